//! Schlick's approximation: F = f0 (1 - s) + s, s = (1 - mu)^5.
//!
//! Schlick 1994, eq. 15 (doi:10.1111/1467-8659.1330233). Linear in f0. Its largest error is 0.036 for
//! eta = 1.5 (at 85 degrees) and 0.1 to 0.2 for metals.

use super::FresnelReflectance;
use crate::math::{Real, Scalar};
use crate::model::{ParamSpec, Values};

pub(crate) struct Schlick;

impl FresnelReflectance for Schlick {
    const FACTORS: usize = 2;

    fn parameters() -> Vec<ParamSpec> {
        vec![ParamSpec::amplitude("f0", "reflectance at normal incidence", 1.0, 0.05)]
    }

    fn prepare<T: Scalar>(_: Values<'_, T>) -> [T; 2] {
        [T::constant(0.0); 2]
    }

    #[inline(always)]
    fn factors<T: Scalar>(_: &[T; 2], mu: T::Real) -> [T; 3] {
        // wi.h can exceed 1 by an ulp.
        let s = (-mu).plus(1.0).greater(T::Real::literal(0.0)).fifth_power();
        [T::from_real((-s).plus(1.0)), T::from_real(s), T::constant(0.0)]
    }

    fn coefficients<T: Scalar>(amplitudes: &mut Values<'_, T>) -> [T; 3] {
        let [f0] = amplitudes.take();
        [f0, T::constant(1.0), T::constant(0.0)]
    }
}
