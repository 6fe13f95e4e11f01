//! Schlick's approximation: F = f0 (1 - s) + s, s = (1 - mu)^5.
//!
//! Schlick 1994, eq. 15 (doi:10.1111/1467-8659.1330233). Linear in f0. Its largest error is 0.036 for
//! eta = 1.5 (at 85 degrees) and 0.1 to 0.2 for metals.

use super::{Constants, FresnelReflectance};
use crate::math::Scalar;
use crate::model::{ParamSpec, Values};

pub(crate) struct Schlick;

impl FresnelReflectance for Schlick {
    const FACTORS: usize = 2;

    fn parameters() -> Vec<ParamSpec> {
        vec![ParamSpec::amplitude("f0", "reflectance at normal incidence", 1.0, 0.05)]
    }

    fn prepare<T: Scalar>(_: Values<'_, T>) -> Constants<T> {
        [T::constant(0.0); 3]
    }

    #[inline(always)]
    fn factors<T: Scalar>(_: &Constants<T>, mu: T::Real, rest: T::Real) -> [T; 3] {
        let rest2: T::Real = rest * rest;
        let rest4: T::Real = rest2 * rest2;
        // 1 - s = (1 - rest)(1 + rest + ... + rest^4), which avoids a difference of two nearly equal numbers at grazing.
        let sum: T::Real = rest.plus(1.0) * rest2.plus(1.0) + rest4;
        [T::from_real(mu * sum), T::from_real(rest4 * rest), T::constant(0.0)]
    }

    fn coefficients<T: Scalar>(amplitudes: &mut Values<'_, T>) -> [T; 3] {
        let [f0] = amplitudes.take();
        [f0, T::constant(1.0), T::constant(0.0)]
    }
}
