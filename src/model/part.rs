//! Parts, whose products are the basis functions of a lobe, and the kernels that evaluate them.
//!
//! A [`Kernel`] is a formula in the geometry: the function that a loop over a block of samples evaluates. A [`Part`] is a
//! factor of a model: it says how many shapes it takes, and how they prepare its kernel. Many parts run the same kernel.
//! Disney's roughness, squared, prepares the kernel of GGX's density; Smith's shadowing of nine distributions interpolates
//! in a table that each of them fills in its own way. Loops are compiled per kernel; parts only add their preparation.
#![allow(clippy::indexing_slicing, reason = "a kernel: the lengths that it indexes are checked at its head")]

use super::values::Values;
use crate::geometry::Geometry;
use crate::math::Scalar;
use std::marker::PhantomData;

/// A formula in the geometry; everything that depends only on the shapes is prepared before.
///
/// [`Kernel::at`], and whatever it calls, must be `#[inline(always)]` and choose by [`Scalar::if_less`]: a call or a branch
/// would keep the loop over a block from being vectorised. Closures cannot be forced to be inlined, and a long one that is
/// called twice may not be, so write a function instead.
pub trait Kernel: 'static {
    /// Number of functions: one per basis function of the lobe, or a single one that multiplies them all.
    const FUNCTIONS: usize = 1;
    /// Whether it depends only on the half vector and the difference angle. Hundreds of samples of a grid share these, and the
    /// kernel is evaluated once for all of them.
    const SHARED_ON_RINGS: bool = false;
    /// Quantities that depend only on the shapes and are computed again only when these change. Cloning must be fast: large
    /// data belongs behind an `Arc`.
    type Prepared<T: Scalar>: Clone + Send + Sync + 'static;
    /// One value per function; values beyond [`Kernel::FUNCTIONS`] are ignored.
    type Output<T: Scalar>: AsRef<[T]>;

    /// Evaluates the functions at one pair of directions, both above the horizon.
    fn at<T: Scalar>(prepared: &Self::Prepared<T>, geometry: &Geometry<T::Real>) -> Self::Output<T>;
}

/// One factor of the basis functions of a lobe: a kernel, and how the lobe's shapes prepare it.
pub trait Part: 'static {
    /// The formula that it runs.
    type Kernel: Kernel;
    /// Number of shapes that it takes.
    const SHAPES: usize;
    /// Whether preparing takes longer than evaluating a block. It is then done once per pass over the samples, for all threads.
    const PREPARES_LONG: bool = false;

    /// Computes everything that depends only on the shapes, which are in declared order and in formula units (radians).
    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<Self, T>;
}

/// The quantities that a part prepares for its kernel.
pub type PreparedBy<P, T> = <<P as Part>::Kernel as Kernel>::Prepared<T>;

/// Receives the parts of a lobe, one after another.
pub trait Visitor {
    /// Receives a part whose shapes begin with the lobe's shape number `first`.
    fn part<P: Part>(&mut self, first: usize);

    /// Ends a product: the parts that follow make further basis functions, numbered after those of the parts before.
    fn next_term(&mut self);

    /// Mirrors the light about the normal for all following parts of the lobe.
    fn mirror_light(&mut self);
}

/// Computes the shapes of a part from those of the model.
pub trait Reshape: 'static {
    /// Number of shapes of the model that it takes.
    const SHAPES: usize;

    /// Returns the part's shapes; a part with one shape takes the first.
    fn reshape<T: Scalar>(shapes: Values<'_, T>) -> [T; 2];
}

/// Part `P` in a model with different parameters: Disney's roughness, for example, is the square root of a distribution's m.
pub struct Reshaped<P, M>(PhantomData<(P, M)>);

impl<P: Part, M: Reshape> Part for Reshaped<P, M> {
    type Kernel = P::Kernel;
    const SHAPES: usize = M::SHAPES;
    const PREPARES_LONG: bool = P::PREPARES_LONG;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<P, T> {
        P::prepare(Values::new(&M::reshape(shapes)))
    }
}

/// The shapes of a lobe with respect to which its basis functions are differentiated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivatives<'a> {
    /// None.
    None,
    /// All.
    All,
    /// Those that are marked, with one mark per shape. Derivatives with respect to other shapes of the same parts may be
    /// computed, too.
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
