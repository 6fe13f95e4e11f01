//! Code shared by the forms of Smith's shadowing, which combine the same Lambda in different ways.

use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::distribution::{FacetDistribution, SmithForm};
use crate::model::{Kernel, Part, PreparedBy, Values};
use std::marker::PhantomData;

/// A form of Smith's shadowing: how it combines Lambda of the light and of the viewer.
pub trait SmithVisibility: 'static {
    /// G/(4 ci co), 1/sr per unit of D F, from C = cos (1 + 2 Lambda) of the light and of the viewer.
    fn visibility<T: Scalar>(light: T, view: T, g: &Geometry<T::Real>) -> T;
}

/// Smith's shadowing in the form `G` for distribution `D`, as a part of a lobe.
pub struct OfSmith<D, G>(PhantomData<(D, G)>);

impl<D: FacetDistribution, G: SmithVisibility> Part for OfSmith<D, G> {
    type Kernel = OfForm<D::Smith, G>;
    const SHAPES: usize = D::SHAPES;
    const PREPARES_LONG: bool = D::SMITH_TAKES_LONG;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        D::prepare_smith(shapes)
    }
}

/// The kernel of all distributions whose Smith integral has the form `S`.
pub struct OfForm<S, G>(PhantomData<(S, G)>);

impl<S: SmithForm, G: SmithVisibility> Kernel for OfForm<S, G> {
    type Prepared<T: Scalar> = S::Prepared<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(prepared: &S::Prepared<T>, g: &Geometry<T::Real>) -> [T; 1] {
        let (light, view) = S::smith_cosines(prepared, g);
        [G::visibility(light, view, g)]
    }
}
