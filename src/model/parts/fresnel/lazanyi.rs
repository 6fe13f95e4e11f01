//! Lazanyi and Szirmay-Kalos: Schlick's approximation minus an error term for metals.
//!
//! ```text
//! F = f0 + (1 - f0)(1 - mu)^5 - a mu (1 - mu)^alpha_f
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | f0 | 1 | 0..1 | reflectance at normal incidence |
//! | a | 1 | 0..20 | depth of the dip before grazing; 0 is Schlick |
//! | alpha_f | 1 | 0.5..20 | its exponent, the same in all channels; without meaning where a is 0 |
//!
//! Lazanyi and Szirmay-Kalos 2005, Fresnel Term Approximations for Metals. They write f0 in terms of the complex index: their
//! ((n - 1)^2 + 4 n (1 - mu)^5 + k^2)/((n + 1)^2 + k^2) is f0 + (1 - f0)(1 - mu)^5 with
//! f0 = ((n - 1)^2 + k^2)/((n + 1)^2 + k^2). Linear in f0 and a. alpha_f has an index in its name because distributions have an
//! alpha.

use super::generalised_schlick::fall_and_rise;
use super::{Constants, FresnelReflectance, Schlick};
use crate::math::Scalar;
use crate::model::{ParamSpec, Scale, Values};

pub(super) struct Lazanyi;

impl FresnelReflectance for Lazanyi {
    const SHAPES: usize = 1;
    const FACTORS: usize = 3;

    fn parameters() -> Vec<ParamSpec> {
        vec![
            ParamSpec::amplitude("f0", "reflectance at normal incidence", 1.0, 0.05),
            ParamSpec::amplitude("a", "depth of the dip before grazing", 20.0, 0.1),
            ParamSpec::shape("alpha_f", "exponent of the dip", (0.5, 20.0), (2.0, 10.0), 6.0, Scale::Linear),
        ]
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Constants<T> {
        let [exponent] = shapes.take();
        [exponent, T::constant(0.0), T::constant(0.0)]
    }

    #[inline(always)]
    fn factors<T: Scalar>(constants: &Constants<T>, mu: T::Real, rest: T::Real) -> [T; 3] {
        let [fallen, risen, _] = Schlick::factors::<T>(constants, mu, rest);
        let [exponent, ..] = *constants;
        let (_, power) = fall_and_rise(exponent, mu, rest);
        [fallen, risen, power * mu]
    }

    fn coefficients<T: Scalar>(amplitudes: &mut Values<'_, T>) -> [T; 3] {
        let [f0, a] = amplitudes.take();
        [f0, T::constant(1.0), -a]
    }
}
