//! Kelemen and Szirmay-Kalos: G = ci co/(wi.h)^2, so that V = 1/(4 (wi.h)^2) = 1/(2 (1 + wi.wo)).
//!
//! Kelemen and Szirmay-Kalos 2001, A Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling
//! (doi:10.2312/egs.20011034), an approximation to v-cavities that does not depend on the roughness. A common mistake makes it
//! four times as large. Finite except where light and viewer are opposite each other at grazing, wi.h -> 0.

use super::Geometric;
use crate::geometry::Geometry;
use crate::math::Real;

pub(super) struct Kelemen;

impl Geometric for Kelemen {
    #[inline(always)]
    fn visibility<R: Real>(g: &Geometry<R>) -> R {
        let mu2: R = g.cos_d * g.cos_d;
        mu2.recip().times(0.25)
    }
}
