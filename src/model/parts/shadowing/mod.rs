//! Shadowing and masking, as the visibility V = G/(4 ci co): the quotient of two numbers that both vanish
//! at grazing is written so that it does not.

mod none;
mod smith;
mod smith_uncorrelated;
mod v_cavity;

use super::distribution::{Constants, Distribution};
use super::parts;
use crate::geometry::Geometry;
use crate::math::Scalar;

/// Which facets are seen by both the light and the viewer.
pub trait Masking {
    /// G/(4 ci co), 1/sr per unit of D F.
    fn visibility<T: Scalar>(d: Distribution, constants: &Constants<T>, g: &Geometry<T::Real>) -> T;
}

macro_rules! shadowings {
    ($($name:literal => $module:ident::$part:ident),* $(,)?) => {
        parts! {
            /// Any shadowing and masking.
            Shadowing: $($name => $module::$part),*
        }

        impl Shadowing {
            /// G/(4 ci co), 1/sr per unit of D F.
            pub fn visibility<T: Scalar>(
                self,
                d: Distribution,
                constants: &Constants<T>,
                g: &Geometry<T::Real>,
            ) -> T {
                match self { $(Self::$part => $module::$part::visibility(d, constants, g)),* }
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
