//! F82-tint: Schlick's approximation with the dip that metals have before grazing.
//!
//! ```text
//! F = f0 + (1 - f0)(1 - mu)^5 - b mu (1 - mu)^6
//! b = (f0 + (1 - f0)(1 - m)^5)(1 - tint)/(m (1 - m)^6),   m = 1/7
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | f0 | 1 | 0..1 | reflectance at normal incidence |
//! | tint | 1 | 0..1 | reflectance at mu = 1/7 (82 degrees), relative to Schlick's; 1 is Schlick |
//!
//! Kutz, Hasan and Edmondson 2021, Novel Aspects of the Adobe Standard Material, with Hoffman's term (Hoffman 2019, Fresnel
//! Equations Considered Harmful, doi:10.2312/mam.20191305); used for the metals of OpenPBR. For metals its largest error is a
//! sixth to a twelfth of Schlick's, for gold half of it. It has three factors and is linear in f0 and b. It is not clamped,
//! since even a deep tint on a bright metal stays within 0..1.

use super::{Constants, FresnelReflectance, Schlick};
use crate::math::Scalar;
use crate::model::{ParamSpec, Values};

pub(super) struct F82Tint;

/// (1 - m)^5 at m = 1/7.
const RISE: f64 = 7776.0 / 16807.0;
/// m (1 - m)^6 there.
const DIP: f64 = RISE * 6.0 / 49.0;

impl FresnelReflectance for F82Tint {
    const FACTORS: usize = 3;

    fn parameters() -> Vec<ParamSpec> {
        vec![
            ParamSpec::amplitude("f0", "reflectance at normal incidence", 1.0, 0.05),
            ParamSpec::amplitude("tint", "reflectance at 82 degrees over Schlick's", 1.0, 0.95),
        ]
    }

    fn prepare<T: Scalar>(_: Values<'_, T>) -> Constants<T> {
        [T::constant(0.0); 3]
    }

    #[inline(always)]
    fn factors<T: Scalar>(constants: &Constants<T>, mu: T::Real, rest: T::Real) -> [T; 3] {
        let [fallen, risen, _] = Schlick::factors::<T>(constants, mu, rest);
        [fallen, risen, risen * (mu * rest)]
    }

    fn coefficients<T: Scalar>(amplitudes: &mut Values<'_, T>) -> [T; 3] {
        let [f0, tint] = amplitudes.take();
        let schlick = f0.times(1.0 - RISE).plus(RISE);
        [f0, T::constant(1.0), schlick * tint.plus(-1.0).times(1.0 / DIP)]
    }
}
