//! Parts of models whose parameters are not those of the parts: Disney's roughness is the root of a distribution's m.

use super::{Part, Values, Visitor};
use crate::geometry::Geometry;
use crate::math::Scalar;
use std::marker::PhantomData;

/// Computes the shapes of a part from those of the model.
pub(super) trait Reshape: 'static {
    /// How many shapes it takes.
    const SHAPES: usize;

    /// The part's shapes; a part that needs one takes the first.
    fn reshape<T: Scalar>(shapes: Values<'_, T>) -> [T; 2];
}

/// A part that knows the model's shapes in another form.
pub(super) struct Of<P, M>(PhantomData<(P, M)>);

impl<P: Part, M: Reshape> Part for Of<P, M> {
    const SHAPES: usize = M::SHAPES;
    const FUNCTIONS: usize = P::FUNCTIONS;
    const SHARED_ON_RINGS: bool = P::SHARED_ON_RINGS;
    const PREPARES_LONG: bool = P::PREPARES_LONG;
    type Prepared<T: Scalar> = P::Prepared<T>;
    type Output<T: Scalar> = P::Output<T>;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> P::Prepared<T> {
        P::prepare(Values::new(&M::reshape(shapes)))
    }

    #[inline(always)]
    fn at<T: Scalar>(prepared: &P::Prepared<T>, g: &Geometry<T::Real>) -> P::Output<T> {
        P::at(prepared, g)
    }
}

/// Shows parts as such, with shapes from number `first` on.
pub(super) struct Reshaped<'a, V, M> {
    visitor: &'a mut V,
    first: usize,
    shapes: PhantomData<M>,
}

impl<V: Visitor, M: Reshape> Visitor for Reshaped<'_, V, M> {
    fn part<P: Part>(&mut self, _: usize) {
        self.visitor.part::<Of<P, M>>(self.first);
    }

    fn next_term(&mut self) {
        self.visitor.next_term();
    }
}

/// The parts that are shown take what `M` makes of the lobe's shapes from number `first` on.
pub(super) fn reshaped<M: Reshape, V: Visitor>(visitor: &mut V, first: usize) -> Reshaped<'_, V, M> {
    Reshaped { visitor, first, shapes: PhantomData }
}
