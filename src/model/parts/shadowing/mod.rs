//! Shadowing and masking, as the visibility V = G/(4 ci co). G and 4 ci co both vanish at grazing, so their quotient is
//! written in a form that does not become 0/0.

mod implicit;
mod kelemen;
mod neumann;
mod none;
mod registry;
mod schlick_smith;
mod smith;
mod smith_part;
mod smith_rational;
mod smith_uncorrelated;
mod v_cavity;

pub use registry::Shadowing;
pub(crate) use schlick_smith::SchlickSmith;
pub(crate) use smith::Smith;
pub(crate) use smith_uncorrelated::SmithUncorrelated;

use super::distribution::{FacetDistribution, Shadows};
use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::{Kernel, Part, Values};
use std::marker::PhantomData;

/// Shadowing that depends only on the directions.
pub trait Geometric: 'static {
    /// G/(4 ci co), 1/sr per unit of D F.
    fn visibility<R: Real>(g: &Geometry<R>) -> R;
}

impl<G: Geometric> Shadows for G {
    type Visibility<D: FacetDistribution> = OfDirections<G>;
}

/// Shadowing that depends only on the directions, as a part of a lobe.
pub struct OfDirections<G>(PhantomData<G>);

impl<G: Geometric> Kernel for OfDirections<G> {
    type Prepared<T: Scalar> = ();
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>((): &(), g: &Geometry<T::Real>) -> [T; 1] {
        [T::from_real(G::visibility(g))]
    }
}

impl<G: Geometric> Part for OfDirections<G> {
    type Kernel = Self;
    const SHAPES: usize = 0;

    fn prepare<T: Scalar>(_: Values<'_, T>) {}
}
