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
        let side = |cos: T::Real, sin2: T::Real| D::stretched_cos(constants, cos, sin2) + cos;
        let light: T = side(g.cos_i(), g.sin2_i());
        let view: T = side(g.cos_o(), g.sin2_o());
        (light * view).recip()
    }
}
