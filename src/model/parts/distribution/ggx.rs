//! GGX, the Trowbridge-Reitz distribution.
//!
//! ```text
//! D = m^2 / (pi (m^2 cos^2 + sin^2)^2)        of the half vector's polar angle
//! cos (1 + 2 Lambda) = sqrt(cos^2 + m^2 sin^2)
//! ```
//!
//! Trowbridge and Reitz 1975 (doi:10.1364/JOSA.65.000531); Walter et al. 2007, eq. 33 and 34
//! (doi:10.2312/EGWR/EGSR07/195-206). The usual cos^2 (m^2 - 1) + 1 loses all digits of a sharp peak; the
//! sum of squares above does not. m -> 0: a mirror, peak 1/(pi m^2). m = 1: constant 1/pi.

use super::{Constants, FacetDistribution};
use crate::geometry::Geometry;
use crate::math::Scalar;
use std::f64::consts::FRAC_1_PI;

pub(super) struct Ggx;

impl FacetDistribution for Ggx {
    fn prepare<T: Scalar>(m: T) -> Constants<T> {
        let m2: T = m * m;
        [m2, m2.times(FRAC_1_PI), m]
    }

    #[inline(always)]
    fn density<T: Scalar>(&[m2, m2_over_pi, _]: &Constants<T>, g: &Geometry<T::Real>) -> T {
        let cos2: T::Real = g.cos_h() * g.cos_h();
        let denominator: T = m2 * cos2 + g.sin2_h();
        m2_over_pi / (denominator * denominator)
    }

    #[inline(always)]
    fn stretched_cos<T: Scalar>(constants: &Constants<T>, cos: T::Real, sin2: T::Real) -> T {
        stretched_cos2(constants, cos, sin2).sqrt()
    }

    #[inline(always)]
    fn stretched_cosines<T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> (T, T) {
        let of = |cos, sin2| stretched_cos2(constants, cos, sin2);
        T::sqrt_pair(of(g.cos_i(), g.sin2_i()), of(g.cos_o(), g.sin2_o()))
    }
}

/// (cos (1 + 2 Lambda))^2
#[inline(always)]
fn stretched_cos2<T: Scalar>(&[m2, ..]: &Constants<T>, cos: T::Real, sin2: T::Real) -> T {
    let cos2: T::Real = cos * cos;
    m2 * sin2 + cos2
}
