//! V-cavities: long symmetric grooves, in which one facet of each pair shades the other.
//!
//! ```text
//! G = min(1, 2 (n.h) ci/(wi.h), 2 (n.h) co/(wi.h))
//! V = G/(4 ci co) = min(1/(4 ci co), (n.h)/(2 (wi.h) co), (n.h)/(2 (wi.h) ci))
//! ```
//!
//! Torrance and Sparrow 1967; Cook and Torrance 1982, eq. 9. Does not depend on the roughness; has kinks.

use super::Geometric;
use crate::geometry::Geometry;
use crate::math::Real;

pub(super) struct VCavity;

impl Geometric for VCavity {
    #[inline(always)]
    fn visibility<R: Real>(g: &Geometry<R>) -> R {
        let (cos_i, cos_o) = (g.cos_i(), g.cos_o());
        // The smaller of the two shaded cases has the larger cosine in the denominator.
        let product: R = cos_i * cos_o;
        let shaded: R = (g.cos_h() / (g.cos_d * cos_i.greater(cos_o))).times(0.5);
        shaded.lesser(product.recip().times(0.25))
    }
}
