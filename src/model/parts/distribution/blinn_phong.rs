//! Blinn-Phong: a power of the half vector's cosine, normalised as a facet distribution.
//!
//! ```text
//! D = (n + 2)/(2 pi) cos^n,   n = 2/m^2 - 2        so that D = 1/(pi m^2) at the normal, as for Beckmann
//! ```
//!
//! Blinn 1977 (doi:10.1145/563858.563893); Walter et al. 2007, eq. 30. Its Smith integral has no closed
//! form; as in Walter et al., the Beckmann one with the same m stands in, close to it because the two
//! distributions agree near the normal. m = 1: n = 0, constant 1/pi.

use super::beckmann::gaussian_slopes;
use super::{Constants, FacetDistribution};
use crate::geometry::Geometry;
use crate::math::Scalar;
use std::f64::consts::FRAC_1_PI;

pub(super) struct BlinnPhong;

impl FacetDistribution for BlinnPhong {
    fn prepare<T: Scalar>(m: T) -> Constants<T> {
        let inverse: T = (m * m).recip();
        [inverse.times(2.0).plus(-2.0), inverse.times(FRAC_1_PI), m]
    }

    #[inline(always)]
    fn density<T: Scalar>(&[n, peak, _]: &Constants<T>, g: &Geometry<T::Real>) -> T {
        (n * g.ln_cos_h()).exp() * peak
    }

    #[inline(always)]
    fn stretched_cos<T: Scalar>(&[.., m]: &Constants<T>, cos: T::Real, sin2: T::Real) -> T {
        gaussian_slopes(m, cos, sin2)
    }
}
