//! Retro-reflection: a lobe back towards the light, as from glass beads and prism sheets.
//!
//! This is a microfacet lobe of light that has first been mirrored about the normal. With r = (-xi, -yi, zi) and the back
//! vector b = normalise(r + wo) instead of the half vector:
//!
//! ```text
//! f = ks D(b) G/(4 ci co)
//! ```
//!
//! b = n where wo = wi. D and G are those of [`cook_torrance`](super::cook_torrance), evaluated at b; `g=neumann`, the default,
//! is G = min(ci, co), which leaves 1/(4 max(ci, co)).
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | m, ... | 1 | 1e-4..1 | parameters of the distribution: roughness; b turns by half the angle between wi and wo; 0.04 reflective tape |
//! | ks | 1 | 0..1000 | albedo of a sharp lobe at normal incidence |
//!
//! Belcour, Pacanowski, Delahaie, Laville-Geay and Eupherte 2014 (doi:10.1364/JOSAA.31.002561) measure tapes and propose the
//! back vector; Portsmouth, Raab, Belcour and Liu 2026 (<https://arxiv.org/abs/2606.08739>) show that any microfacet lobe
//! evaluated at it stays reciprocal and energy conserving: that is `g=smith`. The default fits the tape measured by the former
//! best (docs/trust/measured.md): a sharp lobe with G near 1 reflects ks at any angle, one with `g=neumann` ks cos(theta), and
//! tapes do get darker at oblique incidence.
//!
//! Departure: there is no Fresnel term. The light does not come back from facets, and a term that rises where wi and wo are
//! opposite would rise where the lobe is absent. Reciprocal. Energy conserving for ks <= 1, except for the pairs of d and g
//! in the table below. At grazing, f with `g=neumann` grows without bound if both directions are grazing, and is finite if
//! only one is; other forms of G behave as in Cook-Torrance. m -> 0: all light returns to where it came from.

use super::cook_torrance::DISTRIBUTION;
use crate::math::Scalar;
use crate::model::parts::distribution::Distribution;
use crate::model::parts::shadowing::Shadowing;
use crate::model::{Choices, Model, ModelOption, ParamSpec, Values, Visitor};

/// A lobe back towards the light.
#[derive(Clone, Copy, Debug)]
pub struct Retro {
    distribution: Distribution,
    shadowing: Shadowing,
}

impl Model for Retro {
    type Coefficients<T: Scalar> = [T; 1];

    const NAME: &'static str = "retro";
    const SUMMARY: &'static str = "lobe back to the light";
    const REFERENCE: &'static str = "Belcour et al. 2014, Bidirectional reflectance distribution function measurements \
        and analysis of retroreflective materials, doi:10.1364/JOSAA.31.002561; Portsmouth et al. 2026, \
        https://arxiv.org/abs/2606.08739";
    const OPTIONS: &'static [ModelOption] = &[
        DISTRIBUTION,
        ModelOption {
            key: "g",
            summary: "shadowing and masking",
            values: Shadowing::names,
            default: "neumann",
        },
    ];

    fn build(choices: &Choices) -> Self {
        Self {
            distribution: Distribution::named(choices.get("d")),
            shadowing: Shadowing::named(choices.get("g")),
        }
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let scale = ParamSpec::amplitude("ks", "albedo of a sharp lobe", 1000.0, 0.2);
        [self.distribution.parameters(), vec![scale]].concat()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        visitor.mirror_light();
        self.distribution.show(visitor);
        self.shadowing.show(self.distribution, visitor);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 1] {
        amplitudes.take()
    }
}
