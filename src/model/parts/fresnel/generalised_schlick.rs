//! Schlick's approximation with a free reflectance at grazing and a free exponent.
//!
//! ```text
//! F = f0 + (f90 - f0)(1 - mu)^p_f
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | f0 | 1 | 0..1 | reflectance at normal incidence |
//! | f90 | 1 | 0..1 | reflectance at grazing; fixed at 1 unless freed |
//! | p_f | 1 | 0.5..20 | exponent; fixed at 5 unless freed |
//!
//! Schlick 1994 (doi:10.1111/1467-8659.1330233) has f90 = 1 and the exponent 5, for which this is `schlick`. Linear in f0 and
//! f90. Directions up to 80 degrees hardly separate f90 from p_f, so both are fixed by default. The exponent has an index in
//! its name because distributions have a p.

use super::{Constants, FresnelReflectance};
use crate::math::{Real, Scalar};
use crate::model::parts::distribution::relative_exp_m1;
use crate::model::{ParamSpec, Scale, Values};

pub(super) struct GeneralisedSchlick;

/// 1 - (1 - mu)^exponent and (1 - mu)^exponent, where `rest` is 1 - mu. At mu = 1 they are 1 and 0, with derivatives 0.
#[inline(always)]
pub(super) fn fall_and_rise<T: Scalar>(exponent: T, mu: T::Real, rest: T::Real) -> (T, T) {
    let (zero, one) = (T::constant(0.0), T::constant(1.0));
    let nothing: T::Real = zero.value();
    // The rounding error of 1 - mu, which matters towards grazing; elsewhere `rest` has more digits than mu.
    let lost: T::Real = (-rest).plus(1.0) - mu;
    let lost = T::Real::if_less(T::Real::literal(0.5), rest, lost, nothing);
    let power = exponent * rest.greater(T::Real::TINY).ln_of_sum(lost);
    // Written as a difference from 1, it keeps its digits at grazing, where the power tends to 1.
    let fallen = -(relative_exp_m1(power) * power);
    (T::if_less(nothing, rest, fallen, one), T::if_less(nothing, rest, power.exp(), zero))
}

impl FresnelReflectance for GeneralisedSchlick {
    const SHAPES: usize = 1;
    const FACTORS: usize = 2;

    fn parameters() -> Vec<ParamSpec> {
        vec![
            ParamSpec::amplitude("f0", "reflectance at normal incidence", 1.0, 0.05),
            ParamSpec::amplitude("f90", "reflectance at grazing", 1.0, 1.0).fixed(),
            ParamSpec::shape("p_f", "exponent of the rise", (0.5, 20.0), (2.0, 8.0), 5.0, Scale::Linear)
                .fixed(),
        ]
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Constants<T> {
        let [exponent] = shapes.take();
        [exponent, T::constant(0.0), T::constant(0.0)]
    }

    #[inline(always)]
    fn factors<T: Scalar>(&[exponent, ..]: &Constants<T>, mu: T::Real, rest: T::Real) -> [T; 3] {
        let (fallen, risen) = fall_and_rise(exponent, mu, rest);
        [fallen, risen, T::constant(0.0)]
    }

    fn coefficients<T: Scalar>(amplitudes: &mut Values<'_, T>) -> [T; 3] {
        let [f0, f90] = amplitudes.take();
        [f0, f90, T::constant(0.0)]
    }
}
