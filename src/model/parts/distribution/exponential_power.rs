//! EPD, the exponential power distribution: Beckmann with another power of the slope.
//!
//! ```text
//! D = p exp(-(tan^2/m^2)^p) / (pi m^2 Gamma(1/p) cos^4)
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | m | 1 | 1e-4..1 | scale of the slopes |
//! | p | 1 | 0.2..5 | 1 is Beckmann; smaller values have a sharper peak and longer tails |
//!
//! Holzschuch and Pacanowski 2017, A Two-Scale Microfacet Reflectance Model Combining Reflection and Diffraction
//! (doi:10.1145/3072959.3073621), whose distributions include it; p = 1/2 is exponential in the slope. For p < 1 it has a cusp
//! at the normal; for p < 1/2 a fit can make the cusp as sharp as the data are dense. Smith's integral is tabulated
//! ([`SlopeTable`]).

use super::roughness::{One, roughness};
use super::slope_table::{ScaledTable, TableOfSlopes};
use super::{FacetDistribution, Isotropic, SlopeTable, exp_times};
use crate::geometry::Geometry;
use crate::math::{Real, Scalar, ln_gamma};
use crate::model::{ParamSpec, Scale, Sharper, Values};
use std::f64::consts::PI;

pub(super) struct ExponentialPower;

/// D at the normal times m^2.
fn unit_peak<T: Scalar>(p: T) -> T {
    p * (-ln_gamma(p.recip())).exp().times(1.0 / PI)
}

/// -(u^2)^p
#[inline(always)]
fn ln_fall<T: Scalar>(p: T, u2: T) -> T {
    // At the normal u^2 = 0, whose logarithm is not finite; the power of the floor is negligible for every p.
    let floor = T::from_real(T::Real::TINY);
    let u2 = T::if_less(floor.value(), u2.value(), u2, floor);
    // At large slopes the power overflows, and the derivative would be 0 times infinity; e^-2000 and its root are 0.
    let (power, end) = ((p * u2.ln()).exp(), T::constant(2000.0));
    -T::if_less(power.value(), end.value(), power, end)
}

impl FacetDistribution for ExponentialPower {
    const SHAPES: usize = 2;
    const SMITH_TAKES_LONG: bool = true;
    type Smith = TableOfSlopes<Isotropic>;
    type Beckmann = Isotropic;
    /// 1/m^2, p, and D at the normal.
    type Prepared<T: Scalar> = [T; 3];

    fn parameters() -> Vec<ParamSpec> {
        let p = ParamSpec::shape("p", "power of the squared slope", (0.2, 5.0), (0.3, 2.0), 1.0, Scale::Log);
        vec![roughness("m", "scale of the slopes").sharper_when(Sharper::Smaller), p]
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 3] {
        let [m, p] = shapes.take();
        let inverse_m2: T = (m * m).recip();
        [inverse_m2, p, unit_peak(p) * inverse_m2]
    }

    #[inline(always)]
    fn density<T: Scalar>(&[inverse_m2, p, peak]: &[T; 3], g: &Geometry<T::Real>) -> T {
        let cos2: T::Real = g.cos_h() * g.cos_h();
        let cos4: T::Real = cos2 * cos2;
        exp_times(ln_fall(p, inverse_m2 * g.tan2_h()), peak / cos4)
    }

    fn prepare_smith<T: Scalar>(mut shapes: Values<'_, T>) -> ScaledTable<Isotropic, T> {
        let [m, p] = shapes.take();
        let peak = unit_peak(p);
        (One::squared(m * m), SlopeTable::new(&|u2: T| ln_fall(p, u2).exp() * peak))
    }
}
