//! STD: facet slopes with Student's t-distribution, which includes GGX and Beckmann and extends beyond GGX.
//!
//! ```text
//! D = 1/(pi m^2 cos^4 (1 + tan^2/(m^2 (gamma - 1)))^gamma)
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | m | 1 | 1e-4..1 | roughness |
//! | gamma | 1 | 1.6..1000 | 2 is GGX, infinity Beckmann; smaller values have longer tails |
//!
//! Ribardiere, Bringier, Meneveaux and Simonot 2017, STD: Student's t-Distribution of Slopes for Microfacet Based BSDFs
//! (doi:10.1111/cgf.13137). The mean slope, and so the shadowing, is finite for gamma > 3/2. Smith's integral is tabulated for
//! each gamma ([`SlopeTable`]); the paper's rational fit has errors of up to 0.007 in G1.

use super::roughness::{One, roughness};
use super::slope_table::{ScaledTable, TableOfSlopes};
use super::{FacetDistribution, Isotropic, SlopeTable, exp_times};
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::{ParamSpec, Scale, Sharper, Values};
use std::f64::consts::FRAC_1_PI;

pub(super) struct StudentT;

impl FacetDistribution for StudentT {
    const SHAPES: usize = 2;
    const SMITH_TAKES_LONG: bool = true;
    type Smith = TableOfSlopes<Isotropic>;
    type Beckmann = Isotropic;
    /// 1/(m^2 (gamma - 1)), gamma, and D at the normal.
    type Prepared<T: Scalar> = [T; 3];

    fn parameters() -> Vec<ParamSpec> {
        let gamma =
            ParamSpec::shape("gamma", "decline of the tail", (1.6, 1000.0), (1.7, 20.0), 2.0, Scale::Log);
        vec![roughness("m", "roughness").sharper_when(Sharper::Smaller), gamma]
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 3] {
        let [m, gamma] = shapes.take();
        let m2: T = m * m;
        [(m2 * gamma.plus(-1.0)).recip(), gamma, m2.recip().times(FRAC_1_PI)]
    }

    #[inline(always)]
    fn density<T: Scalar>(&[scale, gamma, peak]: &[T; 3], g: &Geometry<T::Real>) -> T {
        let cos2: T::Real = g.cos_h() * g.cos_h();
        let cos4: T::Real = cos2 * cos2;
        exp_times(-(gamma * (scale * g.tan2_h()).ln_1p()), peak / cos4)
    }

    fn prepare_smith<T: Scalar>(mut shapes: Values<'_, T>) -> ScaledTable<Isotropic, T> {
        let [m, gamma] = shapes.take();
        let scale = gamma.plus(-1.0).recip();
        let table = SlopeTable::new(&|u2: T| (-(gamma * (scale * u2).ln_1p())).exp().times(FRAC_1_PI));
        (One::squared(m * m), table)
    }
}
