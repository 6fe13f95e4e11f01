//! Implicit shadowing: G = ci co, so that V = 1/4 and f = D F/4.
//!
//! What leaving the quotient out amounts to (Hoffman 2013, Background: Physics and Math of Shading, course notes). Too
//! dark everywhere but along the normal.

use super::Geometric;
use crate::geometry::Geometry;
use crate::math::Real;

pub(super) struct Implicit;

impl Geometric for Implicit {
    #[inline(always)]
    fn visibility<R: Real>(_: &Geometry<R>) -> R {
        R::literal(0.25)
    }
}
