//! The registry of all forms of shadowing and masking.

use super::{
    implicit, kelemen, neumann, none, schlick_smith, smith, smith_rational, smith_uncorrelated, v_cavity,
};
use crate::model::Visitor;
use crate::model::parts::distribution::Distribution;
use crate::model::parts::parts;

macro_rules! shadowings {
    ($($name:literal => $module:ident::$part:ident),* $(,)?) => {
        parts! {
            /// Any form of shadowing and masking.
            Shadowing: $($name => $part),*
        }

        impl Shadowing {
            /// Passes the visibility of `distribution` to `visitor` as a part whose shapes are the first ones of the lobe.
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
