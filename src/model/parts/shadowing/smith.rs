//! Smith's shadowing, height-correlated: G = 1/(1 + Lambda_i + Lambda_o).
//!
//! Smith 1967 (doi:10.1109/TAP.1967.1138991); Heitz 2014, eq. 99
//! (<https://jcgt.org/published/0003/02/03/>). With C = cos (1 + 2 Lambda), finite at grazing,
//! 4 ci co/G = 2 (co C_i + ci C_o).

use super::{Constants, FacetDistribution, Masking};
use crate::geometry::Geometry;
use crate::math::Scalar;

pub(super) struct Smith;

impl Masking for Smith {
    const ROUGH: bool = true;

    #[inline(always)]
    fn visibility<D: FacetDistribution, T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> T {
        let (cos_i, cos_o) = (g.cos_i(), g.cos_o());
        let (light, view) = D::stretched_cosines(constants, g);
        (light * cos_o + view * cos_i).recip().times(0.5)
    }
}
