//! Exact unpolarised reflectance of a dielectric, given by its reflectance at normal incidence f0.
//!
//! ```text
//! eta = (1 + sqrt f0)/(1 - sqrt f0),   g^2 = eta^2 + mu^2 - 1
//! F = 1/2 ((g - mu)/(g + mu))^2 [1 + ((mu (g + mu) - 1)/(mu (g - mu) + 1))^2]
//! ```
//!
//! Cook and Torrance 1982, eq. 12; note the sign in g^2, wrong in several slides. Here every length is
//! multiplied by 1 - sqrt f0, which removes both the division by zero at f0 = 1 (F = 1) and the
//! cancellation in g - mu at f0 = 0 (F = 0): with r = sqrt f0, G = (1 - r) g, M = (1 - r) mu,
//! (1 - r)^2 (eta^2 - 1) = 4 r, so G - M = 4 r/(G + M).
//!
//! [`DielectricIndex`] is the same reflectance with eta itself as its parameter, for the published tables that print
//! it: r = (eta - 1)/(eta + 1). Below eta = 1 there would be total reflection; it is left out.

use super::FresnelReflectance;
use crate::math::Scalar;
use crate::model::{ParamSpec, Role, Scale, Values};

pub(super) struct Dielectric;

/// What [`index_reflectance`] needs to know of a refractive index of at least 1: sqrt f0 = (eta - 1)/(eta + 1).
#[inline(always)]
pub(crate) fn index_constants<T: Scalar>(eta: T) -> [T; 2] {
    let r: T = eta.plus(-1.0) / eta.plus(1.0);
    [r, (-r).plus(1.0)]
}

/// F at cosine `mu`, more than 0.
#[inline(always)]
pub(crate) fn index_reflectance<T: Scalar>(constants: &[T; 2], mu: T::Real) -> T {
    let [reflectance, ..] = Dielectric::factors(constants, mu);
    reflectance
}

impl FresnelReflectance for Dielectric {
    const SHAPES: usize = 1;

    fn parameters() -> Vec<ParamSpec> {
        let f0 = ParamSpec::amplitude("f0", "reflectance at normal incidence", 1.0, 0.05);
        vec![ParamSpec { role: Role::Shape, typical: (0.01, 0.3), scale: Scale::Linear, ..f0 }]
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [f0] = shapes.take();
        // The root's slope is infinite at zero; the floor keeps inf * 0 out of the derivative.
        let floor = T::constant(1e-30);
        let r = T::if_less(f0.value(), floor.value(), floor + (f0 - f0.value()), f0).sqrt();
        [r, (-r).plus(1.0)]
    }

    #[inline(always)]
    fn factors<T: Scalar>(&[r, scale]: &[T; 2], mu: T::Real) -> [T; 3] {
        let m = scale * mu;
        let g = (m * m + r.times(4.0)).sqrt();
        let sum = g + m;
        let difference = r.times(4.0) / sum;
        let s_polarised = difference / sum;
        let p_ratio = (sum * mu - scale) / (difference * mu + scale);
        [s_polarised.squared() * (p_ratio.squared()).plus(1.0).times(0.5), T::constant(0.0), T::constant(0.0)]
    }
}

/// The same, given by the refractive index.
pub(crate) struct DielectricIndex;

impl FresnelReflectance for DielectricIndex {
    const SHAPES: usize = 1;

    fn parameters() -> Vec<ParamSpec> {
        vec![ParamSpec::shape("eta", "refractive index", (1.0001, 3.0), (1.05, 2.8), 1.5, Scale::Linear)]
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [eta] = shapes.take();
        index_constants(eta)
    }

    #[inline(always)]
    fn factors<T: Scalar>(constants: &[T; 2], mu: T::Real) -> [T; 3] {
        Dielectric::factors(constants, mu)
    }
}
