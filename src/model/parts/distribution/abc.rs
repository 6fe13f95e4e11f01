//! ABC: the ABC model of optics for scattering by smooth surfaces, used as a facet distribution.
//!
//! ```text
//! D = (1 + b (1 - cos))^-c / N,   N = 2 pi int_0^1 (1 + b (1 - u))^-c u du
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | b | 1 | 1e-2..1e9 | inverse width of the peak, which falls off from theta_h = sqrt(2/b) on |
//! | c | 1 | 0.05..20 | decline of the tail; 1 like GGX in the angle's square root scale, larger values are steeper |
//!
//! Low, Kronander, Ynnerman and Unger 2012, BRDF Models for Accurate and Efficient Rendering of Glossy Surfaces
//! (doi:10.1145/2077341.2077350), eq. 19, where it is not normalised: their A is ks/(4 N) here (`low-microfacet` uses their
//! convention). If b (1 - cos) is large in all data, b and c^-1/b trade off against each other and against the lobe's scale.
//! Smith's integral is tabulated ([`SlopeTable`]).

use super::roughness::One;
use super::slope_table::{ScaledTable, TableOfSlopes};
use super::{FacetDistribution, Isotropic, SlopeTable, exp_times};
use crate::geometry::Geometry;
use crate::math::{GaussLegendre, Real, Scalar};
use crate::model::{ParamSpec, Scale, Sharper, Values};
use std::f64::consts::PI;
use std::sync::LazyLock;

pub(crate) struct Abc;

static RULE: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(96));

/// The normalisation N for given b and c.
pub(crate) fn normaliser<T: Scalar>(b: T, c: T) -> T {
    // With e^v = 1 + b (1 - u) and v = length s: int e^((1 - c) v) (1 - (e^v - 1)/b) dv/b
    let length = b.plus(1.0).ln();
    let one_less_c = -(c.plus(-1.0));
    let integral = RULE.integrate(T::constant(0.0), T::constant(1.0), |s: T| {
        let v: T = length * s;
        let u = -((v.exp().plus(-1.0)) / b).plus(-1.0);
        (one_less_c * v).exp() * u
    });
    (integral * length / b).times(2.0 * PI)
}

/// ln of (1 + b (1 - cos))^-c
#[inline(always)]
fn ln_unnormalised<T: Scalar>(b: T, c: T, one_less_cos: T) -> T {
    -(c * (b * one_less_cos).ln_1p())
}

/// (1 + b (1 - cos))^-c
#[inline(always)]
pub(crate) fn unnormalised<T: Scalar>(b: T, c: T, one_less_cos: T) -> T {
    ln_unnormalised(b, c, one_less_cos).exp()
}

/// 1 - cos of the half vector's polar angle, exact near the normal.
#[inline(always)]
pub(crate) fn one_less_cos<R: Real>(g: &Geometry<R>) -> R {
    g.sin2_h() / g.cos_h().plus(1.0)
}

impl FacetDistribution for Abc {
    const SHAPES: usize = 2;
    const SMITH_TAKES_LONG: bool = true;
    type Smith = TableOfSlopes<Isotropic>;
    type Beckmann = Isotropic;
    const BECKMANN_SHAPES: usize = 2;
    /// b, c, 1/N.
    type Prepared<T: Scalar> = [T; 3];

    fn parameters() -> Vec<ParamSpec> {
        vec![
            ParamSpec::shape("b", "inverse width of the peak", (1e-2, 1e9), (10.0, 1e5), 200.0, Scale::Log)
                .sharper_when(Sharper::Larger),
            ParamSpec::shape("c", "decline of the tail", (0.05, 20.0), (0.5, 5.0), 1.5, Scale::Log),
        ]
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 3] {
        let [b, c] = shapes.take();
        [b, c, normaliser(b, c).recip()]
    }

    #[inline(always)]
    fn density<T: Scalar>(&[b, c, peak]: &[T; 3], g: &Geometry<T::Real>) -> T {
        exp_times(ln_unnormalised(b, c, T::from_real(one_less_cos(g))), peak)
    }

    fn prepare_smith<T: Scalar>(shapes: Values<'_, T>) -> ScaledTable<Isotropic, T> {
        let [b, c, peak] = Self::prepare(shapes);
        // The width of the peak, at most that of the hemisphere.
        let (narrow, wide): (T, T) = (b.recip().times(2.0), T::constant(1.0));
        let scale2 = T::if_less(narrow.value(), wide.value(), narrow, wide);
        let table = SlopeTable::new(&|u2: T| {
            let t2: T = scale2 * u2;
            let cos2 = t2.plus(1.0).recip();
            // 1 - cos = sin^2/(1 + cos)
            let one_less_cos = t2 * cos2 / cos2.sqrt().plus(1.0);
            unnormalised(b, c, one_less_cos) * peak * cos2 * cos2 * scale2
        });
        (One::squared(scale2), table)
    }

    /// m^2 = 2/(b c), that of the Beckmann distribution that it approaches for large c.
    fn prepare_beckmann<T: Scalar>(mut shapes: Values<'_, T>) -> One<T> {
        let [b, c] = shapes.take();
        One::squared((b * c).recip().times(2.0))
    }
}
