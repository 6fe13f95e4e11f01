//! Smith's shadowing with light and viewer taken as independent: G = G1(i) G1(o), G1 = 1/(1 + Lambda).
//!
//! Smith 1967; Walter et al. 2007, eq. 23. Darker than the height-correlated form, up to many times at
//! grazing on rough surfaces. With C = cos (1 + 2 Lambda), 2 cos/G1 = cos + C.

use super::Shadows;
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::distribution::FacetDistribution;
use crate::model::{Part, Values, Visitor};
use std::marker::PhantomData;

pub(super) struct SmithUncorrelated;

impl Shadows for SmithUncorrelated {
    fn show<D: FacetDistribution>(visitor: &mut impl Visitor) {
        visitor.part::<Visibility<D>>(0);
    }
}

struct Visibility<D>(PhantomData<D>);

impl<D: FacetDistribution> Part for Visibility<D> {
    const SHAPES: usize = D::SHAPES;
    const PREPARES_LONG: bool = D::SLOPES_TAKE_LONG;
    type Prepared<T: Scalar> = D::Slopes<T>;
    type Output<T: Scalar> = [T; 1];

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> D::Slopes<T> {
        D::prepare_slopes(shapes)
    }

    #[inline(always)]
    fn at<T: Scalar>(slopes: &D::Slopes<T>, g: &Geometry<T::Real>) -> [T; 1] {
        let (light, view) = D::stretched_cosines(slopes, g);
        [((light + g.cos_i()) * (view + g.cos_o())).recip()]
    }
}
