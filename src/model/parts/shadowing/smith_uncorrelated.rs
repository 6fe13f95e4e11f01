//! Smith's shadowing with light and viewer taken as independent: G = G1(i) G1(o), G1 = 1/(1 + Lambda).
//!
//! Smith 1967; Walter et al. 2007, eq. 23. Darker than the height-correlated form, up to many times at
//! grazing on rough surfaces. With C = cos (1 + 2 Lambda), 2 cos/G1 = cos + C.

use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::distribution::{FacetDistribution, Shadows, SmithForm};
use crate::model::{Kernel, Part, PreparedBy, Values};
use std::marker::PhantomData;

pub(crate) struct SmithUncorrelated;

impl Shadows for SmithUncorrelated {
    type Visibility<D: FacetDistribution> = Visibility<D>;
}

/// The visibility of a distribution.
pub(crate) struct Visibility<D>(PhantomData<D>);

impl<D: FacetDistribution> Part for Visibility<D> {
    type Kernel = OfForm<D::Smith>;
    const SHAPES: usize = D::SHAPES;
    const PREPARES_LONG: bool = D::SMITH_TAKES_LONG;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        D::prepare_smith(shapes)
    }
}

/// The visibility of all distributions whose Smith integral has the same form.
pub(crate) struct OfForm<S>(PhantomData<S>);

impl<S: SmithForm> Kernel for OfForm<S> {
    type Prepared<T: Scalar> = S::Prepared<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(prepared: &S::Prepared<T>, g: &Geometry<T::Real>) -> [T; 1] {
        let (light, view) = S::smith_cosines(prepared, g);
        [((light + g.cos_i()) * (view + g.cos_o())).recip()]
    }
}
