//! The registry of all forms of shadowing and masking.

use super::{
    implicit, kelemen, neumann, none, schlick_smith, smith, smith_rational, smith_uncorrelated, v_cavity,
};
use crate::model::parts::distribution::Distribution;
use crate::model::parts::parts;
use crate::model::{Energy, Visitor};

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

impl Shadowing {
    /// What becomes of the light that meets perfect facets under this form of shadowing.
    #[must_use]
    pub fn energy(self) -> Energy {
        match self {
            // Nothing makes up for 1/(4 ci co), which has no bound towards grazing.
            Self::None => Energy::MayGain { largest_albedo: 286.0 },
            // It is Beckmann's, whatever the distribution: too little for those with longer tails.
            Self::SmithRational => Energy::MayGain { largest_albedo: 1.753 },
            _ => Energy::Conserved,
        }
    }
}
