//! Beckmann: normally distributed slopes.
//!
//! ```text
//! D = exp(-tan^2/m^2) / (pi m^2 cos^4)        of the half vector's polar angle
//! cos (1 + 2 Lambda) = m sin exp(-x^2)/sqrt(pi) + cos erf(x),   x = cos/(m sin)
//! ```
//!
//! Beckmann and Spizzichino 1963; Cook and Torrance 1982 (doi:10.1145/357290.357293), with the pi that
//! several texts leave out; Smith 1967 (doi:10.1109/TAP.1967.1138991). m is
//! the root-mean-square slope. D underflows to 0 where tan > 27 m: the surface has no such facets.

use super::{Constants, FacetDistribution};
use crate::geometry::Geometry;
use crate::math::Scalar;
use std::f64::consts::{FRAC_1_PI, FRAC_2_SQRT_PI};

pub(super) struct Beckmann;

impl FacetDistribution for Beckmann {
    fn prepare<T: Scalar>(m: T) -> Constants<T> {
        let inverse: T = (m * m).recip();
        [inverse, inverse.times(FRAC_1_PI), m]
    }

    #[inline(always)]
    fn density<T: Scalar>(&[inverse_m2, peak, _]: &Constants<T>, g: &Geometry<T::Real>) -> T {
        let cos2: T::Real = g.cos_h() * g.cos_h();
        let cos4: T::Real = cos2 * cos2;
        (-(inverse_m2 * g.tan2_h())).exp() * peak / cos4
    }

    #[inline(always)]
    fn stretched_cos<T: Scalar>(&[.., m]: &Constants<T>, cos: T::Real, sin2: T::Real) -> T {
        gaussian_slopes(m, cos, sin2)
    }
}

/// cos (1 + 2 Lambda) for normally distributed slopes of root mean square m.
#[inline(always)]
pub(super) fn gaussian_slopes<T: Scalar>(m: T, cos: T::Real, sin2: T::Real) -> T {
    let slope = m * sin2.sqrt();
    // Beyond x = 26 shadowing is below 1e-290, and x^2 would overflow in its derivatives on the way to
    // normal incidence, where x is infinite.
    let steep: T::Real = slope.value().times(26.0);
    let limited = T::if_less(cos, steep, slope, T::from_real(cos.times(1.0 / 26.0)));
    let x = T::from_real(cos) / limited;
    let spread = slope * (-(x * x)).exp().times(0.5 * FRAC_2_SQRT_PI);
    let shadowed = spread - x.erfc() * cos + cos;
    T::if_less(cos, steep, shadowed, T::from_real(cos))
}
