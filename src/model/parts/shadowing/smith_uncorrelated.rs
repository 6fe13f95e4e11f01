//! Smith's shadowing with light and viewer taken as independent: G = G1(i) G1(o), G1 = 1/(1 + Lambda).
//!
//! Smith 1967; Walter et al. 2007, eq. 23. Darker than the height-correlated form, up to many times at
//! grazing on rough surfaces. With C = cos (1 + 2 Lambda), 2 cos/G1 = cos + C.

use super::{Constants, FacetDistribution, Masking};
use crate::geometry::Geometry;
use crate::math::Scalar;

pub(super) struct SmithUncorrelated;

impl Masking for SmithUncorrelated {
    const ROUGH: bool = true;

    #[inline(always)]
    fn visibility<D: FacetDistribution, T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> T {
        let (light, view) = D::stretched_cosines(constants, g);
        ((light + g.cos_i()) * (view + g.cos_o())).recip()
    }
}
