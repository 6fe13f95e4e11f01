//! Smith's shadowing, height-correlated: G = 1/(1 + Lambda_i + Lambda_o).
//!
//! Smith 1967 (doi:10.1109/TAP.1967.1138991); Heitz 2014, eq. 99
//! (<https://jcgt.org/published/0003/02/03/>). With C = cos (1 + 2 Lambda), finite at grazing,
//! 4 ci co/G = 2 (co C_i + ci C_o).

use super::Shadows;
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::distribution::FacetDistribution;
use crate::model::{Part, Values, Visitor};
use std::marker::PhantomData;

pub(super) struct Smith;

impl Shadows for Smith {
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
        [(light * g.cos_o() + view * g.cos_i()).recip().times(0.5)]
    }
}
