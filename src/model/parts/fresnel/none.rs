//! No Fresnel effect: F = 1, the same at every angle.

use super::{Constants, FresnelReflectance};
use crate::math::Scalar;
use crate::model::{ParamSpec, Values};

pub(super) struct None;

impl FresnelReflectance for None {
    fn parameters() -> Vec<ParamSpec> {
        Vec::new()
    }

    fn prepare<T: Scalar>(_: Values<'_, T>) -> Constants<T> {
        [T::constant(0.0); 3]
    }

    #[inline(always)]
    fn factors<T: Scalar>(_: &Constants<T>, _: T::Real, _: T::Real) -> [T; 3] {
        [1.0, 0.0, 0.0].map(T::constant)
    }
}
