//! Smith's shadowing, height-correlated: G = 1/(1 + Lambda_i + Lambda_o).
//!
//! Smith 1967 (doi:10.1109/TAP.1967.1138991); Heitz 2014, eq. 99
//! (<https://jcgt.org/published/0003/02/03/>). With C = cos (1 + 2 Lambda), finite at grazing,
//! 4 ci co/G = 2 (co C_i + ci C_o).

use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::distribution::{FacetDistribution, Shadows, SmithForm};
use crate::model::{Kernel, Part, PreparedBy, Values};
use std::marker::PhantomData;

pub(crate) struct Smith;

impl Shadows for Smith {
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
        [(light * g.cos_o() + view * g.cos_i()).recip().times(0.5)]
    }
}
