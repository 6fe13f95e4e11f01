//! Neumann and Neumann: G = min(ci, co), so that V = 1/(4 max(ci, co)).
//!
//! Neumann, Neumann and Szirmay-Kalos 1999, Compact Metallic Reflectance Models (doi:10.1111/1467-8659.00337). Does not depend
//! on the roughness; grows without bound only where both directions are grazing.

use super::Geometric;
use crate::geometry::Geometry;
use crate::math::Real;

pub(super) struct Neumann;

impl Geometric for Neumann {
    #[inline(always)]
    fn visibility<R: Real>(g: &Geometry<R>) -> R {
        g.cos_i().greater(g.cos_o()).recip().times(0.25)
    }
}
