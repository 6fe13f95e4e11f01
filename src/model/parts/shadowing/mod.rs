//! Shadowing and masking, as the visibility V = G/(4 ci co): the quotient of two numbers that both vanish
//! at grazing is written so that it does not.

mod none;
mod smith;
mod smith_uncorrelated;
mod v_cavity;

use super::distribution::{Constants, Distribution, FacetDistribution};
use super::parts;
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::{Part, Values, Visitor};
use std::marker::PhantomData;

/// Which facets are seen by both the light and the viewer.
pub trait Masking: 'static {
    /// Whether it knows the roughness.
    const ROUGH: bool;

    /// G/(4 ci co), 1/sr per unit of D F.
    fn visibility<D: FacetDistribution, T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> T;
}

/// Shadowing and masking of a distribution as a part of a lobe.
pub struct Visibility<G, D>(PhantomData<(G, D)>);

impl<G: Masking, D: FacetDistribution> Part for Visibility<G, D> {
    const SHAPES: usize = if G::ROUGH { 1 } else { 0 };
    type Prepared<T: Scalar> = Constants<T>;
    type Output<T: Scalar> = [T; 1];

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Constants<T> {
        if G::ROUGH {
            let [m] = shapes.take();
            D::prepare(m)
        } else {
            [T::constant(0.0); 3]
        }
    }

    #[inline(always)]
    fn at<T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> [T; 1] {
        [G::visibility::<D, T>(constants, g)]
    }
}

macro_rules! shadowings {
    ($($name:literal => $module:ident::$part:ident),* $(,)?) => {
        parts! {
            /// Any shadowing and masking.
            Shadowing: $($name => $module::$part),*
        }

        impl Shadowing {
            /// Shows the visibility of `distribution` as a part whose shapes are a lobe's first.
            pub(crate) fn show(self, distribution: Distribution, visitor: &mut impl Visitor) {
                match self { $(Self::$part => distribution.show_visibility::<$module::$part>(visitor)),* }
            }
        }
    };
}

shadowings! {
    "smith" => smith::Smith,
    "smith-uncorrelated" => smith_uncorrelated::SmithUncorrelated,
    "v-cavity" => v_cavity::VCavity,
    "none" => none::None,
}
