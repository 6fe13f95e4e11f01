//! Parts, of whose products the basis functions of a lobe consist, and the kernels that evaluate them.
//!
//! A [`Kernel`] is a formula in the geometry: the function that a loop over a block of samples evaluates. A [`Part`] is what
//! a model shows: how many shapes it takes, and how they prepare its kernel. Many parts run the same kernel. Disney's
//! roughness, squared, prepares the kernel of GGX's density; Smith's shadowing of nine distributions interpolates in a table
//! that each of them fills in its own way. Loops are compiled per kernel, parts only add their preparation.
#![allow(clippy::indexing_slicing, reason = "a kernel: the lengths that it indexes are checked at its head")]

use super::values::Values;
use crate::geometry::Geometry;
use crate::math::Scalar;
use std::marker::PhantomData;

/// A formula in the geometry, with everything that depends on the shapes alone prepared.
///
/// [`Kernel::at`], and whatever it calls, must be `#[inline(always)]` and choose by [`Scalar::if_less`]: a call or a
/// branch would keep the loop over a block from being packed. A closure cannot be told to be inlined, and a long one that is
/// called twice may not be: write a function.
pub trait Kernel: 'static {
    /// How many functions it has: one per basis function of the lobe, or one that multiplies them all.
    const FUNCTIONS: usize = 1;
    /// Whether it depends on the half vector and the difference angle alone: on the samples of a grid, which share
    /// these by the hundred, it is evaluated once for all that do.
    const SHARED_ON_RINGS: bool = false;
    /// Quantities that depend on the shapes alone, computed anew only when these have changed. Quickly cloned: what
    /// is large stands behind an `Arc`.
    type Prepared<T: Scalar>: Clone + Send + Sync + 'static;
    /// A value per function; values beyond [`Kernel::FUNCTIONS`] are ignored.
    type Output<T: Scalar>: AsRef<[T]>;

    /// The functions at one pair of directions, both above the horizon.
    fn at<T: Scalar>(prepared: &Self::Prepared<T>, geometry: &Geometry<T::Real>) -> Self::Output<T>;
}

/// One factor of the basis functions of a lobe: a kernel, and how the lobe's shapes prepare it.
pub trait Part: 'static {
    /// The formula that it runs.
    type Kernel: Kernel;
    /// How many shapes it takes.
    const SHAPES: usize;
    /// Whether preparing takes longer than a block: it is then done once per pass over the samples, for all threads.
    const PREPARES_LONG: bool = false;

    /// Everything that depends on the shapes alone. Shapes come in declared order, in formula units (radians).
    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<Self, T>;
}

/// What a part prepares for its kernel.
pub type PreparedBy<P, T> = <<P as Part>::Kernel as Kernel>::Prepared<T>;

/// Receives the parts of a lobe, one after the other.
pub trait Visitor {
    /// A part whose shapes begin with the lobe's shape number `first`.
    fn part<P: Part>(&mut self, first: usize);

    /// Ends a product: the parts that follow make further basis functions, after those of the parts before.
    fn next_term(&mut self);

    /// Mirrors the light about the normal for the parts that follow, up to the last of the lobe.
    fn mirror_light(&mut self);
}

/// Computes the shapes of a part from those of the model.
pub trait Reshape: 'static {
    /// How many shapes of the model it takes.
    const SHAPES: usize;

    /// The part's shapes; a part that needs one takes the first.
    fn reshape<T: Scalar>(shapes: Values<'_, T>) -> [T; 2];
}

/// Part `P` of a model that has other parameters: Disney's roughness is the root of a distribution's m.
pub struct Reshaped<P, M>(PhantomData<(P, M)>);

impl<P: Part, M: Reshape> Part for Reshaped<P, M> {
    type Kernel = P::Kernel;
    const SHAPES: usize = M::SHAPES;
    const PREPARES_LONG: bool = P::PREPARES_LONG;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<P, T> {
        P::prepare(Values::new(&M::reshape(shapes)))
    }
}

/// Which of a lobe's shapes its basis functions are differentiated by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivatives<'a> {
    /// None.
    None,
    /// All.
    All,
    /// Those that are marked, one mark per shape; others that share a part with them may be, too.
    Of(&'a [bool]),
}

impl Derivatives<'_> {
    /// Whether any of the shapes `first..first + count` is among them.
    pub(super) fn include_any(self, first: usize, count: usize) -> bool {
        match self {
            Self::None => false,
            Self::All => count > 0,
            Self::Of(marks) => marks[first..first + count].contains(&true),
        }
    }
}
