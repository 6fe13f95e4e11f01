//! Exact unpolarised reflectance of a conductor with complex refractive index eta + i k.
//!
//! With s^2 = 1 - mu^2, t = eta^2 - k^2 - s^2, 2 a^2 = sqrt(t^2 + 4 eta^2 k^2) + t, 2 b^2 = 2 a^2 - 2 t:
//!
//! ```text
//! Rs = ((a - mu)^2 + b^2)/((a + mu)^2 + b^2)
//! Rp = Rs ((a mu - s^2)^2 + b^2 mu^2)/((a mu + s^2)^2 + b^2 mu^2)
//! F  = (Rs + Rp)/2
//! ```
//!
//! Born and Wolf, Principles of Optics, section 14.2. One of 2 a^2 and 2 b^2 suffers from cancellation (for most metals the
//! first); 4 eta^2 k^2 divided by the other gives the same number without it. a - mu = (eta^2 - 1 - k^2 + b^2)/(a + mu) keeps
//! its digits if the index is close to 1.
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | eta | 1 | 0.01..100 | refractive index; 0.2 gold in the red, 30 metals at 5 um |
//! | k | 1 | 0.001..200 | extinction coefficient; 3 to 7 metals in the visible |
//!
//! F depends only on k^2, so k = 0 is a stationary point at which a fit could get stuck; the lower bound differs from it by
//! less than 1e-6 in F. For a material without absorption use `dielectric`.

use super::{Constants, FresnelReflectance};
use crate::math::{Real, Scalar};
use crate::model::{ParamSpec, Scale, Values};

pub(crate) struct Conductor;

/// `part`/`whole`, computed as 1 - `rest`/`whole` if the two are close, since their derivatives would cancel.
#[inline(always)]
fn quotient<T: Scalar>(part: T, whole: T, rest: T) -> T {
    let inverse = whole.recip();
    let half: T::Real = whole.value().times(0.5);
    T::if_less(half, part.value(), (-(rest * inverse)).plus(1.0), part * inverse)
}

/// The constants of the reflectance from eta - 1 and k^2, which may be 0.
pub(crate) fn conductor_constants<T: Scalar>(eta_less_1: T, k2: T) -> Constants<T> {
    let eta = eta_less_1.plus(1.0);
    let eta2: T = eta * eta;
    [(eta2 * k2).times(4.0), eta_less_1 * eta.plus(1.0) - k2, eta2 - k2]
}

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

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Constants<T> {
        let [eta, k] = shapes.take();
        let k2: T = k * k;
        let excess: T = eta.plus(-1.0) * eta.plus(1.0) - k2;
        [(eta * k).squared().times(4.0), excess, eta * eta - k2]
    }

    #[inline(always)]
    fn factors<T: Scalar>(
        &[product2, excess, difference]: &Constants<T>,
        mu: T::Real,
        rest: T::Real,
    ) -> [T; 3] {
        let mu2: T::Real = mu * mu;
        let s2: T::Real = rest * mu.plus(1.0);
        // t is computed from the smaller of cosine and sine: with a small index the other one leaves few digits.
        let t = T::if_less(s2, mu2, difference - s2, excess + mu2);
        let modulus = (t * t + product2).sqrt();
        // 2 a^2 and 2 b^2: the larger is a sum, the smaller is the product divided by it.
        let zero = T::Real::literal(0.0);
        let larger = modulus + T::if_less(t.value(), zero, -t, t);
        let smaller = product2 / larger;
        let twice_a2 = T::if_less(t.value(), zero, smaller, larger);
        let b2 = T::if_less(t.value(), zero, larger, smaller).times(0.5);
        // For total reflection inside a denser medium without absorption a is 0, where the root has no slope.
        let floor = T::constant(1e-30);
        let a = T::if_less(twice_a2.value(), floor.value(), floor, twice_a2).times(0.5).sqrt();

        let sum_s = a + mu;
        let difference_s = (excess + b2) / sum_s;
        let (along, b2_mu2): (T, T) = (a * mu, b2 * mu2);
        // The differences of denominator and numerator: 4 a mu, and 4 a mu s^2.
        let cross = along.times(4.0);
        let rs = quotient(difference_s.squared() + b2, sum_s.squared() + b2, cross);
        let rp = rs * quotient((along - s2).squared() + b2_mu2, (along + s2).squared() + b2_mu2, cross * s2);
        [(rs + rp).times(0.5), T::constant(0.0), T::constant(0.0)]
    }
}
