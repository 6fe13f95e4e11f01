//! No shadowing: G = 1, V = 1/(4 ci co). Grows without bound at grazing.

use super::Geometric;
use crate::geometry::Geometry;
use crate::math::Real;

pub(super) struct None;

impl Geometric for None {
    #[inline(always)]
    fn visibility<R: Real>(g: &Geometry<R>) -> R {
        let product: R = g.cos_i() * g.cos_o();
        product.recip().times(0.25)
    }
}
