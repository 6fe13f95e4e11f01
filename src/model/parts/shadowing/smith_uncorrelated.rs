//! Smith's shadowing with light and viewer assumed to be independent: G = G1(i) G1(o), G1 = 1/(1 + Lambda).
//!
//! Smith 1967; Walter et al. 2007, eq. 23. Darker than the height-correlated form, by a large factor at grazing on rough
//! surfaces. With C = cos (1 + 2 Lambda), 2 cos/G1 = cos + C.

use super::smith_part::{OfSmith, SmithVisibility};
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::distribution::{FacetDistribution, Shadows};

pub(crate) struct SmithUncorrelated;

impl Shadows for SmithUncorrelated {
    type Visibility<D: FacetDistribution> = OfSmith<D, Self>;
}

impl SmithVisibility for SmithUncorrelated {
    #[inline(always)]
    fn visibility<T: Scalar>(light: T, view: T, g: &Geometry<T::Real>) -> T {
        ((light + g.cos_i()) * (view + g.cos_o())).recip()
    }
}
