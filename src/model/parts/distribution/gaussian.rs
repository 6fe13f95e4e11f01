//! Gaussian of the facet *angle*, the distribution of Torrance and Sparrow.
//!
//! ```text
//! D = exp(-(alpha/m)^2) / N(m),   alpha the half vector's polar angle
//! N(m) = 2 pi int_0^{pi/2} exp(-(a/m)^2) cos a sin a da
//! ```
//!
//! Torrance and Sparrow 1967 (doi:10.1364/JOSA.57.001105); Blinn 1977. In print it is not normalised: N is
//! computed here by quadrature, which close to m = 0 is pi m^2 (0.7 % above N at m = 0.1, 6 % at 0.3).
//! Its Smith integral has no closed form; the Beckmann one with the same m stands in, which it tends to
//! for small m, where angle and slope are alike.

use super::beckmann::gaussian_slopes;
use super::{Constants, FacetDistribution};
use crate::geometry::Geometry;
use crate::math::{GaussLegendre, Real, Scalar};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;

pub(super) struct Gaussian;

/// Sixty-four nodes carry the integral to the last digit over the whole range of m.
static RULE: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(64));

/// Beyond seven standard widths the integrand is below 1e-21 of its peak.
const WIDTHS: f64 = 7.0;

/// N(m). In units u = a/m the integrand is the same bell for every m.
fn normalisation<T: Scalar>(m: T) -> T {
    let horizon = m.recip().times(FRAC_PI_2);
    let far = T::constant(WIDTHS);
    let upper = T::if_less(horizon.value(), far.value(), horizon, far);
    // 2 cos a sin a = sin 2a
    RULE.integrate(T::constant(0.0), upper, |u: T| (-(u * u)).exp() * (u * m).times(2.0).sin()) * m.times(PI)
}

impl FacetDistribution for Gaussian {
    fn prepare<T: Scalar>(m: T) -> Constants<T> {
        [(m * m).recip(), normalisation(m).recip(), m]
    }

    #[inline(always)]
    fn density<T: Scalar>(&[inverse_m2, peak, _]: &Constants<T>, g: &Geometry<T::Real>) -> T {
        let alpha = g.sin2_h().sqrt().atan2(g.cos_h());
        let alpha2: T::Real = alpha * alpha;
        (-(inverse_m2 * alpha2)).exp() * peak
    }

    #[inline(always)]
    fn stretched_cos<T: Scalar>(&[.., m]: &Constants<T>, cos: T::Real, sin2: T::Real) -> T {
        gaussian_slopes(m, cos, sin2)
    }
}
