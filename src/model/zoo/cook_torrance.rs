//! Cook-Torrance: a rough surface of small mirrors, composed of exchangeable parts.
//!
//! ```text
//! f = ks F D G/(4 ci co)
//! ```
//!
//! with a normalised distribution D of facet normals, shadowing and masking G, and the facets' Fresnel
//! reflectance F.
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | m | 1 | 1e-4..1 | roughness: rms slope (Beckmann), alpha (GGX); 0.01 polished, 0.3 satin, 0.7 nearly diffuse |
//! | ks | 1 | 0..1000 | scale of the lobe; 1 in the physical model, and fixed there unless freed or F is none |
//! | f0, ...; eta, k | 1 | | parameters of the Fresnel part |
//!
//! Departure: Cook and Torrance 1982 print 1/(pi ci co) with D = exp(-tan^2/m^2)/(m^2 cos^4). Here the 4 is the Jacobian of
//! the half vector, and D is normalised. A `ks` published in their convention is smaller than this one by a factor of 4/pi
//! (D with its pi) or 4 (D without). Finite at grazing with every G except `none`. m -> 0: a mirror, D = 1/(pi m^2) at its
//! peak. Reciprocal. Energy conserving with ks = 1 and F <= 1 for most pairs of d and g. Some gain energy: those with
//! g=none, where f grows as 1/(ci co), and those whose shadowing does not follow from d and is too weak for it; the table
//! below lists them.

use crate::math::Scalar;
use crate::model::parts::distribution::Distribution;
use crate::model::parts::fresnel::Fresnel;
use crate::model::parts::shadowing::Shadowing;
use crate::model::{Choices, Model, ModelOption, ParamSpec, Strength, Values, Visitor};

/// A microfacet lobe.
#[derive(Clone, Copy, Debug)]
pub struct CookTorrance {
    pub(crate) distribution: Distribution,
    pub(crate) shadowing: Shadowing,
    pub(crate) fresnel: Fresnel,
}

/// The option that chooses a distribution, for all models that have one.
pub(crate) const DISTRIBUTION: ModelOption =
    ModelOption { key: "d", summary: "facet distribution", values: Distribution::names, default: "ggx" };
/// The option that chooses a Fresnel term, for all models that have one.
pub(crate) const FRESNEL: ModelOption =
    ModelOption { key: "f", summary: "Fresnel reflectance", values: Fresnel::names, default: "schlick" };

impl Model for CookTorrance {
    type Coefficients<T: Scalar> = [T; 3];

    const NAME: &'static str = "cook-torrance";
    const SUMMARY: &'static str = "microfacet lobe F D G/(4 ci co)";
    const REFERENCE: &'static str = "Cook and Torrance 1982, A Reflectance Model for Computer Graphics, \
        doi:10.1145/357290.357293; Walter et al. 2007, doi:10.2312/EGWR/EGSR07/195-206";
    const OPTIONS: &'static [ModelOption] = &[
        DISTRIBUTION,
        ModelOption {
            key: "g",
            summary: "shadowing and masking",
            values: Shadowing::names,
            default: "smith",
        },
        FRESNEL,
    ];

    fn build(choices: &Choices) -> Self {
        Self {
            distribution: Distribution::named(choices.get("d")),
            shadowing: Shadowing::named(choices.get("g")),
            fresnel: Fresnel::named(choices.get("f")),
        }
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let fresnel = self.fresnel.parameters();
        let scale = ParamSpec::amplitude("ks", "scale of the lobe", 1000.0, 1.0);
        // Without a Fresnel term only ks determines the strength of the lobe.
        let scale = if fresnel.is_empty() { scale } else { scale.fixed() };
        [self.distribution.parameters(), fresnel, vec![scale]].concat()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        self.distribution.show(visitor);
        self.shadowing.show(self.distribution, visitor);
        self.fresnel.show(self.distribution.shapes(), visitor);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 3] {
        let fresnel = self.fresnel.coefficients(&mut amplitudes);
        let [ks] = amplitudes.take();
        fresnel.map(|coefficient| ks * coefficient)
    }

    fn products(&self) -> &'static [(&'static str, &'static str)] {
        match self.fresnel {
            Fresnel::Conductor | Fresnel::None => &[],
            _ => &[("ks", "f0")],
        }
    }

    fn strength(&self) -> Strength {
        match self.fresnel {
            Fresnel::None => Strength::Amplitudes,
            _ => Strength::Scale("ks"),
        }
    }
}
