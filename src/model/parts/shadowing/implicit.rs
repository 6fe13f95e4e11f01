//! Implicit shadowing: G = ci co, so that V = 1/4 and f = D F/4.
//!
//! This is the shadowing that results from omitting G and the denominator 4 ci co (Hoffman 2013, Background: Physics and Math
//! of Shading, course notes). Too dark everywhere except along the normal.

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
