//! Lambert: a perfectly diffuse surface.
//!
//! ```text
//! f = kd / pi
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | kd | 1 | 0..2 | albedo; above 1 only in data with fluorescence or a calibration error |

use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::{Choices, Kernel, Model, ParamSpec, Part, Values, Visitor};
use std::f64::consts::FRAC_1_PI;

/// A perfectly diffuse surface.
#[derive(Clone, Copy, Debug)]
pub struct Lambert;

impl Kernel for Lambert {
    type Prepared<T: Scalar> = ();
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>((): &(), _: &Geometry<T::Real>) -> [T; 1] {
        [T::constant(FRAC_1_PI)]
    }
}

impl Part for Lambert {
    type Kernel = Self;
    const SHAPES: usize = 0;

    fn prepare<T: Scalar>(_: Values<'_, T>) {}
}

impl Lambert {
    /// Passes kd/pi, the base of a complete model, to `visitor` as the first product.
    pub(crate) fn show_as_base(visitor: &mut impl Visitor) {
        visitor.part::<Self>(0);
        visitor.next_term();
    }
}

impl Model for Lambert {
    type Coefficients<T: Scalar> = [T; 1];

    const NAME: &'static str = "lambert";
    const SUMMARY: &'static str = "perfectly diffuse surface";
    const REFERENCE: &'static str = "Lambert 1760, Photometria";

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        vec![ParamSpec::albedo("kd", "albedo", 0.2)]
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        visitor.part::<Self>(0);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 1] {
        amplitudes.take()
    }
}
