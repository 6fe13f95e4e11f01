//! No shadowing: G = 1, V = 1/(4 ci co). Grows without bound at grazing.

use super::{Constants, FacetDistribution, Masking};
use crate::geometry::Geometry;
use crate::math::Scalar;

pub(super) struct None;

impl Masking for None {
    const ROUGH: bool = false;

    #[inline(always)]
    fn visibility<D: FacetDistribution, T: Scalar>(_: &Constants<T>, g: &Geometry<T::Real>) -> T {
        let product: T::Real = g.cos_i() * g.cos_o();
        T::from_real(product.recip().times(0.25))
    }
}
