//! Shadowing and masking, as the visibility V = G/(4 ci co): the quotient of two numbers that both vanish
//! at grazing is written so that it does not.

mod implicit;
mod kelemen;
mod neumann;
mod none;
mod schlick_smith;
mod smith;
mod smith_rational;
mod smith_uncorrelated;
mod v_cavity;

use super::distribution::{Distribution, FacetDistribution};
use super::parts;
use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::{Part, Values, Visitor};
use std::marker::PhantomData;

/// Which facets are seen by both the light and the viewer.
pub trait Shadows: 'static {
    /// Shows the visibility of distribution `D` as a part whose shapes are a lobe's first.
    fn show<D: FacetDistribution>(visitor: &mut impl Visitor);
}

/// Shadowing that knows the directions alone.
pub trait Geometric: 'static {
    /// G/(4 ci co), 1/sr per unit of D F.
    fn visibility<R: Real>(g: &Geometry<R>) -> R;
}

impl<G: Geometric> Shadows for G {
    fn show<D: FacetDistribution>(visitor: &mut impl Visitor) {
        visitor.part::<OfDirections<G>>(0);
    }
}

/// Such a shadowing as a part of a lobe.
pub struct OfDirections<G>(PhantomData<G>);

impl<G: Geometric> Part for OfDirections<G> {
    const SHAPES: usize = 0;
    type Prepared<T: Scalar> = ();
    type Output<T: Scalar> = [T; 1];

    fn prepare<T: Scalar>(_: Values<'_, T>) {}

    #[inline(always)]
    fn at<T: Scalar>((): &(), g: &Geometry<T::Real>) -> [T; 1] {
        [T::from_real(G::visibility(g))]
    }
}

macro_rules! shadowings {
    ($($name:literal => $module:ident::$part:ident),* $(,)?) => {
        parts! {
            /// Any shadowing and masking.
            Shadowing: $($name => $part),*
        }

        impl Shadowing {
            /// Shows the visibility of `distribution` as a part whose shapes are a lobe's first.
            pub fn show(self, distribution: Distribution, visitor: &mut impl Visitor) {
                match self { $(Self::$part => distribution.show_visibility::<$module::$part>(visitor)),* }
            }
        }
    };
}

shadowings! {
    "smith" => smith::Smith,
    "smith-uncorrelated" => smith_uncorrelated::SmithUncorrelated,
    "smith-rational" => smith_rational::SmithRational,
    "schlick-smith" => schlick_smith::SchlickSmith,
    "v-cavity" => v_cavity::VCavity,
    "kelemen" => kelemen::Kelemen,
    "neumann" => neumann::Neumann,
    "implicit" => implicit::Implicit,
    "none" => none::None,
}
