//! A Gaussian of the facet *angle*, the distribution of Torrance and Sparrow.
//!
//! ```text
//! D = exp(-(alpha/m)^2) / N(m),   alpha the half vector's polar angle
//! N(m) = 2 pi int_0^{pi/2} exp(-(a/m)^2) cos a sin a da
//! ```
//!
//! Torrance and Sparrow 1967 (doi:10.1364/JOSA.57.001105); Blinn 1977. In print it is not normalised. Here N is computed by
//! quadrature; for m close to 0 it is pi m^2 (which is 0.7 % above N at m = 0.1, 6 % at 0.3). Its Smith integral has no closed
//! form and is tabulated ([`SlopeTable`]); for small m, where angle and slope are nearly equal, it tends to Beckmann's.

use super::roughness::One;
use super::slope_table::{ScaledTable, TableOfSlopes};
use super::{FacetDistribution, Isotropic, Roughness, SlopeTable, exp_times};
use crate::geometry::Geometry;
use crate::math::{GaussLegendre, Real, Scalar};
use crate::model::{ParamSpec, Values};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;

pub(super) struct Gaussian;

/// Sixty-four nodes give the integral to the last digit for the whole range of m.
static RULE: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(64));

/// Beyond seven standard widths the integrand is below 1e-21 of its peak.
const WIDTHS: f64 = 7.0;

/// N(m). In units of u = a/m the integrand is nearly the same bell curve for every m.
fn normalisation<T: Scalar>(m: T) -> T {
    let horizon = m.recip().times(FRAC_PI_2);
    let far = T::constant(WIDTHS);
    let upper = T::if_less(horizon.value(), far.value(), horizon, far);
    // 2 cos a sin a = sin 2a
    RULE.integrate(T::constant(0.0), upper, |u: T| (-(u * u)).exp() * (u * m).times(2.0).sin()) * m.times(PI)
}

/// The angle of a slope. The derivative, 1/(1 + t^2), is attached by adding a difference whose value is 0.
fn arc_tangent<T: Scalar>(t: T) -> T {
    let at: T::Real = t.value();
    let slope: T::Real = (at * at).plus(1.0).recip();
    (t - at) * slope + at.atan2(T::Real::literal(1.0))
}

impl FacetDistribution for Gaussian {
    const SHAPES: usize = 1;
    const SMITH_TAKES_LONG: bool = true;
    type Smith = TableOfSlopes<Isotropic>;
    type Beckmann = Isotropic;
    /// 1/m^2 and D at the normal.
    type Prepared<T: Scalar> = [T; 2];

    fn parameters() -> Vec<ParamSpec> {
        Isotropic::parameters()
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [m] = shapes.take();
        [(m * m).recip(), normalisation(m).recip()]
    }

    #[inline(always)]
    fn density<T: Scalar>(&[inverse_m2, peak]: &[T; 2], g: &Geometry<T::Real>) -> T {
        let alpha = g.sin2_h().sqrt().atan2(g.cos_h());
        let alpha2: T::Real = alpha * alpha;
        exp_times(-(inverse_m2 * alpha2), peak)
    }

    fn prepare_smith<T: Scalar>(mut shapes: Values<'_, T>) -> ScaledTable<Isotropic, T> {
        let [m] = shapes.take();
        let (inverse_m2, peak): (T, T) = ((m * m).recip(), normalisation(m).recip());
        let scale2: T = m * m;
        let table = SlopeTable::new(&|u2: T| {
            // The smallest slopes underflow in single precision, and at 0 the root has no derivative.
            let (t2, floor): (T, T) = (scale2 * u2, T::from_real(T::Real::TINY));
            let t2 = T::if_less(floor.value(), t2.value(), t2, floor);
            let cos2 = t2.plus(1.0).recip();
            let alpha = arc_tangent(t2.sqrt());
            (-(inverse_m2 * alpha * alpha)).exp() * peak * cos2 * cos2 * scale2
        });
        (One::squared(scale2), table)
    }
}
