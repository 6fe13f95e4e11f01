//! Exact unpolarised reflectance of a conductor with complex refractive index eta + i k.
//!
//! With s^2 = 1 - mu^2, t = eta^2 - k^2 - s^2, A = a^2 + b^2 = sqrt(t^2 + 4 eta^2 k^2), 2 a^2 = A + t:
//!
//! ```text
//! Rs = (A - 2 a mu + mu^2)/(A + 2 a mu + mu^2)
//! Rp = Rs (mu^2 A - 2 a mu s^2 + s^4)/(mu^2 A + 2 a mu s^2 + s^4)
//! F  = (Rs + Rp)/2
//! ```
//!
//! Born and Wolf, Principles of Optics, section 14.2. For t < 0 (most metals) A + t cancels;
//! 4 eta^2 k^2/(A - t) is the same number without that.
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | eta | 1 | 0.01..100 | refractive index; 0.2 gold in the red, 30 metals at 5 um |
//! | k | 1 | 0.001..200 | extinction coefficient; 3 to 7 metals in the visible |
//!
//! F depends on k^2 alone, so that k = 0 is a stationary point at which a fit could get stuck; the lower
//! bound differs from it by less than 1e-6 in F. A material without absorption is `dielectric`.

use super::FresnelReflectance;
use crate::math::{Real, Scalar};
use crate::model::{ParamSpec, Scale, Values};

pub(super) struct Conductor;

impl FresnelReflectance for Conductor {
    const SHAPES: usize = 2;

    fn parameters() -> Vec<ParamSpec> {
        vec![
            ParamSpec::shape("eta", "refractive index", (0.01, 100.0), (0.2, 4.0), 1.5, Scale::Log)
                .per_channel(),
            ParamSpec::shape("k", "extinction coefficient", (1e-3, 200.0), (0.3, 7.0), 2.0, Scale::Log)
                .per_channel(),
        ]
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [eta, k] = shapes.take();
        [eta, k]
    }

    #[inline(always)]
    fn factors<T: Scalar>(&[eta, k]: &[T; 2], mu: T::Real) -> [T; 3] {
        let mu2: T::Real = mu * mu;
        let s2 = (-mu2).plus(1.0).greater(T::Real::literal(0.0));
        let s4: T::Real = s2 * s2;
        let t: T = (eta - k) * (eta + k) - s2;
        let product2: T = (eta * k).squared().times(4.0);
        let modulus = (t * t + product2).sqrt();
        let zero = T::Real::literal(0.0);
        let twice_a2 = T::if_less(t.value(), zero, product2 / (modulus - t), modulus + t);
        // Total reflection inside a denser medium without absorption has a = 0, where the root has no slope.
        let floor = T::constant(1e-30);
        let a = T::if_less(twice_a2.value(), floor.value(), floor, twice_a2).times(0.5).sqrt();

        let cross_s = (a * mu).times(2.0);
        let sum_s = modulus + mu2;
        let rs = (sum_s - cross_s) / (sum_s + cross_s);
        let cross_p = cross_s * s2;
        let sum_p = modulus * mu2 + s4;
        let rp = rs * (sum_p - cross_p) / (sum_p + cross_p);
        [(rs + rp).times(0.5), T::constant(0.0), T::constant(0.0)]
    }
}
