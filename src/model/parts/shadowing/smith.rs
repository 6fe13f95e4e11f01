//! Smith's shadowing, height-correlated: G = 1/(1 + Lambda_i + Lambda_o).
//!
//! Smith 1967 (doi:10.1109/TAP.1967.1138991); Heitz 2014, eq. 99
//! (<https://jcgt.org/published/0003/02/03/>). With C = cos (1 + 2 Lambda), finite at grazing,
//! 4 ci co/G = 2 (co C_i + ci C_o).

use super::smith_part::{OfSmith, SmithVisibility};
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::distribution::{FacetDistribution, Shadows};

pub(crate) struct Smith;

impl Shadows for Smith {
    type Visibility<D: FacetDistribution> = OfSmith<D, Self>;
}

impl SmithVisibility for Smith {
    #[inline(always)]
    fn visibility<T: Scalar>(light: T, view: T, g: &Geometry<T::Real>) -> T {
        (light * g.cos_o() + view * g.cos_i()).recip().times(0.5)
    }
}
