//! SGD, the shifted gamma distribution.
//!
//! ```text
//! D = K exp(-x) / (pi x^p cos^4),   x = alpha + tan^2/alpha,   1/K = alpha Gamma(1 - p, alpha)
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | alpha | 1 | 1e-6..10 | scale: like a squared roughness where it is small |
//! | p | 1 | -1..4 | 0 is a Beckmann peak; larger values have longer tails inside tan^2 = alpha |
//!
//! Bagher, Soler and Holzschuch 2012, Accurate Fitting of Measured Reflectances Using a Shifted Gamma Micro-facet
//! Distribution (doi:10.1111/j.1467-8659.2012.03147.x). K follows from the normalisation and is not a parameter here; the
//! incomplete gamma function is computed by quadrature, since its argument 1 - p can be negative. Smith's integral is
//! tabulated ([`SlopeTable`]) instead of using the paper's fitted one, which `bagher-sgd` has.

use super::roughness::One;
use super::slope_table::{ScaledTable, TableOfSlopes};
use super::{FacetDistribution, Isotropic, SlopeTable, exp_times};
use crate::geometry::Geometry;
use crate::math::{GaussLegendre, Scalar};
use crate::model::{ParamSpec, Scale, Sharper, Values};
use std::f64::consts::FRAC_1_PI;
use std::sync::LazyLock;

pub(crate) struct Sgd;

static RULE: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(24));

/// The x beyond which exp(-x) is below 1e-300 and negligible.
const END: f64 = 690.0;
/// Number of panels of the quadrature up to `END`.
const PANELS: u8 = 24;

/// The normalisation K for given alpha and p.
pub(crate) fn normaliser<T: Scalar>(alpha: T, p: T) -> T {
    // Gamma(1 - p, alpha) = int_alpha^inf e^-x x^-p dx, with x = alpha e^v in panels of equal length in v.
    let length = (T::constant(END) / alpha).plus(1.0).ln().times(1.0 / f64::from(PANELS));
    let one_less_p = -(p.plus(-1.0));
    let integrand = |v: T| (v * one_less_p - alpha * v.exp()).exp();
    let panel = |i: u8| {
        let lower = length.times(f64::from(i));
        RULE.integrate(lower, lower + length, integrand)
    };
    let sum = (0..PANELS).map(panel).fold(T::constant(0.0), |sum, term| sum + term);
    // alpha alpha^(1 - p) sum
    (-((one_less_p.plus(1.0)) * alpha.ln())).exp() / sum
}

impl FacetDistribution for Sgd {
    const SHAPES: usize = 2;
    const DENSITY_TAKES_LONG: bool = true;
    const SMITH_TAKES_LONG: bool = true;
    type Smith = TableOfSlopes<Isotropic>;
    type Beckmann = Isotropic;
    /// alpha, 1/alpha, p, K/pi.
    type Prepared<T: Scalar> = [T; 4];

    fn parameters() -> Vec<ParamSpec> {
        vec![
            ParamSpec::shape(
                "alpha",
                "scale of the squared slope",
                (1e-6, 10.0),
                (1e-4, 0.5),
                0.05,
                Scale::Log,
            )
            .sharper_when(Sharper::Smaller),
            ParamSpec::shape("p", "power of the tail", (-1.0, 4.0), (0.2, 1.6), 0.5, Scale::Linear),
        ]
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 4] {
        let [alpha, p] = shapes.take();
        [alpha, alpha.recip(), p, normaliser(alpha, p).times(FRAC_1_PI)]
    }

    #[inline(always)]
    fn density<T: Scalar>(prepared: &[T; 4], g: &Geometry<T::Real>) -> T {
        let cos2: T::Real = g.cos_h() * g.cos_h();
        let cos4: T::Real = cos2 * cos2;
        let [.., k_over_pi] = *prepared;
        exp_times(ln_fall(prepared, T::from_real(g.tan2_h())), k_over_pi / cos4)
    }

    fn prepare_smith<T: Scalar>(shapes: Values<'_, T>) -> ScaledTable<Isotropic, T> {
        let prepared = Self::prepare(shapes);
        let [alpha, _, _, k_over_pi] = prepared;
        let table = SlopeTable::new(&|u2: T| ln_fall(&prepared, alpha * u2).exp() * k_over_pi * alpha);
        (One::squared(alpha), table)
    }

    /// m^2 = alpha, that of the Beckmann distribution that it is for p = 0.
    fn prepare_beckmann<T: Scalar>(mut shapes: Values<'_, T>) -> One<T> {
        let [alpha] = shapes.take();
        One::squared(alpha)
    }
}

/// ln of e^-x x^-p at a squared slope.
#[inline(always)]
fn ln_fall<T: Scalar>(&[alpha, inverse_alpha, p, _]: &[T; 4], t2: T) -> T {
    let x = alpha + inverse_alpha * t2;
    -(x + p * x.ln())
}
