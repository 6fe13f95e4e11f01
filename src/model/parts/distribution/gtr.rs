//! GTR, the generalised Trowbridge-Reitz distribution: GGX with a tail of any length.
//!
//! ```text
//! D = 1/(N (cos^2 + sin^2/m^2)^gamma),   N = pi m^2 (1 - m^(2 gamma - 2))/((gamma - 1)(1 - m^2))
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | m | 1 | 1e-4..1 | width of the peak |
//! | gamma | 1 | 0.2..10 | 2 is GGX; smaller values have longer tails, 1 is Disney's clearcoat |
//!
//! Burley 2012, Physically Based Shading at Disney, appendix B, whose first version misprints the normalisation. The printed
//! N is 0/0 at gamma = 1 and at m = 1; with L = -2 ln m and phi(x) = (e^x - 1)/x it is pi m^2 phi(-(gamma - 1) L)/phi(-L),
//! which is smooth at both. Changing m does not merely stretch the distribution. Its Smith integral has no closed form and is
//! tabulated ([`SlopeTable`]); Disney uses that of GGX with a different roughness instead.

use super::roughness::{One, roughness};
use super::slope_table::{ScaledTable, TableOfSlopes};
use super::{FacetDistribution, Isotropic, SlopeTable, exp_times, relative_exp_m1};
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::{ParamSpec, Scale, Sharper, Values};
use std::f64::consts::PI;

pub(crate) struct Gtr;

/// D at the normal, 1/N.
fn peak<T: Scalar>(m: T, gamma: T) -> T {
    let length = m.ln().times(-2.0);
    let excess = gamma.plus(-1.0) * length;
    relative_exp_m1(-length) / (relative_exp_m1(-excess) * m * m).times(PI)
}

impl FacetDistribution for Gtr {
    const SHAPES: usize = 2;
    const SMITH_TAKES_LONG: bool = true;
    type Smith = TableOfSlopes<Isotropic>;
    type Beckmann = Isotropic;
    /// 1/m^2, gamma, and D at the normal.
    type Prepared<T: Scalar> = [T; 3];

    fn parameters() -> Vec<ParamSpec> {
        let gamma =
            ParamSpec::shape("gamma", "decline of the tail", (0.2, 10.0), (0.6, 6.0), 2.0, Scale::Log);
        vec![roughness("m", "width of the peak").sharper_when(Sharper::Smaller), gamma]
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 3] {
        let [m, gamma] = shapes.take();
        [(m * m).recip(), gamma, peak(m, gamma)]
    }

    #[inline(always)]
    fn density<T: Scalar>(&[inverse_m2, gamma, peak]: &[T; 3], g: &Geometry<T::Real>) -> T {
        let cos2: T::Real = g.cos_h() * g.cos_h();
        let base = inverse_m2 * g.sin2_h() + cos2;
        exp_times(-(gamma * base.ln()), peak)
    }

    fn prepare_smith<T: Scalar>(mut shapes: Values<'_, T>) -> ScaledTable<Isotropic, T> {
        let [m, gamma] = shapes.take();
        let (m2, peak): (T, T) = (m * m, peak(m, gamma));
        // cos^2 + sin^2/m^2 = (1 + u^2)/(1 + m^2 u^2) with the slope m u
        let table = SlopeTable::new(&|u2: T| {
            let (near, far): (T, T) = (u2.ln_1p(), (m2 * u2).ln_1p());
            (gamma.plus(-2.0) * far - gamma * near).exp() * peak * m2
        });
        (One::squared(m2), table)
    }
}
