//! Exact unpolarised reflectance of a dielectric, given by its reflectance at normal incidence f0.
//!
//! ```text
//! eta = (1 + sqrt f0)/(1 - sqrt f0),   g^2 = eta^2 + mu^2 - 1
//! F = 1/2 ((g - mu)/(g + mu))^2 [1 + ((mu (g + mu) - 1)/(mu (g - mu) + 1))^2]
//! ```
//!
//! Cook and Torrance 1982, eq. 12; note the sign in g^2, which is wrong in several sets of slides. Here everything is
//! multiplied by 1 - sqrt f0, which removes both the division by zero at f0 = 1 (F = 1) and the cancellation in g - mu at
//! f0 = 0 (F = 0): with r = sqrt f0, G = (1 - r) g, M = (1 - r) mu, (1 - r)^2 (eta^2 - 1) = 4 r, so G - M = 4 r/(G + M).
//!
//! [`DielectricIndex`] is the same reflectance with eta itself as its parameter, for published tables that print it:
//! r = (eta - 1)/(eta + 1). Total reflection, which would occur for eta below 1, is not modelled.

use super::{Constants, FresnelReflectance};
use crate::math::{Real, Scalar};
use crate::model::{ParamSpec, Role, Scale, Values};

pub(crate) struct Dielectric;

/// The constants that [`index_reflectance`] needs for a refractive index of at least 1: sqrt f0 = (eta - 1)/(eta + 1).
#[inline(always)]
pub(crate) fn index_constants<T: Scalar>(eta: T) -> Constants<T> {
    let sum = eta.plus(1.0);
    let r: T = eta.plus(-1.0) / sum;
    [r * r, r, sum.recip().times(2.0)]
}

/// F at cosine `mu`, which must be above 0.
#[inline(always)]
pub(crate) fn index_reflectance<T: Scalar>(&[f0, r, scale]: &Constants<T>, mu: T::Real) -> T {
    let m = scale * mu;
    let g = (m * m + r.times(4.0)).sqrt();
    let sum = g + m;
    let inverse = sum.recip();
    let difference = r.times(4.0) * inverse;
    let p_ratio = (sum * mu - scale) / (difference * mu + scale);
    // (G - M)^2/(G + M)^2 = 16 f0/(G + M)^4: with the factor f0, F has a finite slope at f0 = 0.
    let s_polarised = f0 * inverse.squared().squared();
    s_polarised * (p_ratio.squared()).plus(1.0).times(8.0)
}

/// 1 - F at cosine `mu`, which must be above 0, with all its digits at grazing, where F is close to 1. For an index close to
/// 1, where F is close to 0, it is computed from F.
///
/// 1 - Rs = 4 G M/(G + M)^2; for p the same with (1 - r) G instead of G and (1 + r)^2 mu instead of M.
#[inline(always)]
pub(crate) fn index_transmittance<T: Scalar>(constants: &Constants<T>, mu: T::Real) -> T {
    let reflected = index_reflectance(constants, mu);
    let [_, r, scale] = *constants;
    let m = scale * mu;
    let g = (m * m + r.times(4.0)).sqrt();
    let one_and_r2 = r.plus(1.0).squared();
    let (p_m, p_g) = (one_and_r2 * mu, scale * g);
    let s_polarised = g * m / (g + m).squared();
    let p_polarised = p_m * p_g / (p_m + p_g).squared();
    let half = T::Real::literal(0.5);
    T::if_less(reflected.value(), half, (-reflected).plus(1.0), (s_polarised + p_polarised).times(2.0))
}

impl FresnelReflectance for Dielectric {
    const SHAPES: usize = 1;

    fn parameters() -> Vec<ParamSpec> {
        let f0 = ParamSpec::amplitude("f0", "reflectance at normal incidence", 1.0, 0.05);
        vec![ParamSpec { role: Role::Shape, typical: (0.01, 0.3), scale: Scale::Linear, ..f0 }]
    }

    /// f0, r and 1 - r.
    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Constants<T> {
        let [f0] = shapes.take();
        // The slope of the root is infinite at 0; the floor, a constant, keeps inf * 0 out of the derivative.
        let floor = T::from_real(T::Real::TINY);
        let r = T::if_less(f0.value(), floor.value(), floor, f0).sqrt();
        [f0, r, (-f0).plus(1.0) / r.plus(1.0)]
    }

    #[inline(always)]
    fn factors<T: Scalar>(constants: &Constants<T>, mu: T::Real, _: T::Real) -> [T; 3] {
        [index_reflectance(constants, mu), T::constant(0.0), T::constant(0.0)]
    }
}

/// The same reflectance, given by the refractive index.
pub(crate) struct DielectricIndex;

impl FresnelReflectance for DielectricIndex {
    const SHAPES: usize = 1;

    fn parameters() -> Vec<ParamSpec> {
        vec![ParamSpec::shape("eta", "refractive index", (1.0001, 3.0), (1.05, 2.8), 1.5, Scale::Linear)]
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Constants<T> {
        let [eta] = shapes.take();
        index_constants(eta)
    }

    #[inline(always)]
    fn factors<T: Scalar>(constants: &Constants<T>, mu: T::Real, rest: T::Real) -> [T; 3] {
        Dielectric::factors(constants, mu, rest)
    }
}
