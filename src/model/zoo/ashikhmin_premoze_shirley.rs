//! Ashikhmin-Premoze-Shirley: a microfacet lobe with any density of half vectors, and the shadowing that follows from it.
//!
//! ```text
//! f = ks p(h) <n.h> F/(4 g(wi) g(wo)),   g(k) = int max(0, h.k) p(h) dh,   <n.h> = g(n),   int p(h) dh = 1
//! ```
//!
//! With D = p/<n.h>, the facets per area of the surface, g(k)/<n.h> is cos(theta_k) divided by Smith's G1(k): the model is
//! `cook-torrance(g=smith-uncorrelated)` with that D, and is evaluated in that way. The options `d` and `f` and the parameters
//! are the same as there: those of the distribution and of the Fresnel part, and ks.
//!
//! Ashikhmin, Premoze and Shirley 2000, A Microfacet-Based BRDF Generator (doi:10.1145/344779.344814). The paper's
//! anisotropic densities are `d=...-anisotropic`, its arbitrary ones `d=tabulated`. Reciprocal; energy conserving with F <=
//! 1 and ks <= 1, unless the table below says otherwise; finite at grazing; a sharp distribution makes a mirror.

use super::cook_torrance::{CookTorrance, DISTRIBUTION, FRESNEL};
use crate::math::Scalar;
use crate::model::parts::distribution::Distribution;
use crate::model::parts::fresnel::Fresnel;
use crate::model::parts::shadowing::Shadowing;
use crate::model::{Choices, Model, ModelOption, ParamSpec, Strength, Values, Visitor};

/// Any density of half vectors, with the shadowing that follows from it.
#[derive(Clone, Copy, Debug)]
pub struct AshikhminPremozeShirley(CookTorrance);

impl Model for AshikhminPremozeShirley {
    type Coefficients<T: Scalar> = [T; 3];

    const NAME: &'static str = "ashikhmin-premoze-shirley";
    const SUMMARY: &'static str = "microfacet lobe of any density, with the shadowing that follows from it";
    const REFERENCE: &'static str =
        "Ashikhmin, Premoze and Shirley 2000, A Microfacet-Based BRDF Generator, doi:10.1145/344779.344814";
    const OPTIONS: &'static [ModelOption] = &[DISTRIBUTION, FRESNEL];

    fn build(choices: &Choices) -> Self {
        Self(CookTorrance {
            distribution: Distribution::named(choices.get("d")),
            shadowing: Shadowing::SmithUncorrelated,
            fresnel: Fresnel::named(choices.get("f")),
        })
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        self.0.parameters()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        self.0.visit(visitor);
    }

    fn coefficients<T: Scalar>(&self, amplitudes: Values<'_, T>) -> [T; 3] {
        self.0.coefficients(amplitudes)
    }

    fn products(&self) -> &'static [(&'static str, &'static str)] {
        self.0.products()
    }

    fn strength(&self) -> Strength {
        self.0.strength()
    }
}
