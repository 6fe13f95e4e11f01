//! Ngan's Cook-Torrance: the model and the constants of a published table of fits.
//!
//! ```text
//! f = kd/pi + ks F D G/(pi ci co)
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | kd | unscaled MERL | 0..2 | albedo of the diffuse base |
//! | ks | unscaled MERL | 0..1000 | scale of the lobe |
//! | f0 | 1 | 0..1 | reflectance at normal incidence, the same in all channels |
//! | m | 1 | 1e-4..1 | roughness: root-mean-square slope |
//!
//! Ngan, Durand and Matusik 2005 (doi:10.2312/EGWR/EGSR05/117-126) fitted 86 MERL materials. A row of their table can be entered
//! as printed: its diffuse colour is kd, `albedo` ks, `eta` f0 and `roughness` m. Their kd and ks are in the unit of the database
//! before the scales of its three channels are applied: the model multiplies kd and ks by 1, 1.15 and 1.66 in channels r, g and b
//! (docs/trust/published.md).
//!
//! D is Beckmann's distribution with its pi, G is that of v-cavities, F is Schlick's. The pi in the denominator of the lobe
//! is in addition to the one in D, a relic of the 1982 paper: ks is pi/4 times the ks of `lambert +
//! cook-torrance(d=beckmann, g=v-cavity, f=schlick)`, with which the model otherwise agrees. Only directions beyond 60
//! degrees separate ks from f0. Reciprocal; energy conserving for ks <= pi/4 and kd = 0 (a mirror reflects 4/pi ks = 1.273
//! ks); finite at grazing; m -> 0 a mirror.

use super::shared::{NGAN, base_and_scale, shared_f0};
use crate::math::Scalar;
use crate::model::parts::distribution::Distribution;
use crate::model::parts::fresnel::Fresnel;
use crate::model::parts::shadowing::Shadowing;
use crate::model::zoo::lambert::Lambert;
use crate::model::{Choices, Model, ParamSpec, Unit, Values, Visitor};
use std::f64::consts::FRAC_1_PI;

/// The model and the constants of a published table of fits.
#[derive(Clone, Copy, Debug)]
pub struct NganCookTorrance;

impl Model for NganCookTorrance {
    type Coefficients<T: Scalar> = [T; 3];

    const NAME: &'static str = "ngan-cook-torrance";
    const SUMMARY: &'static str = "Cook-Torrance with the constants of the fits by Ngan et al. 2005";
    const REFERENCE: &'static str = NGAN;

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let own = base_and_scale(Unit::UnscaledMerl);
        [own, vec![shared_f0()], Distribution::Beckmann.parameters()].concat()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        Lambert::show_as_base(visitor);
        Distribution::Beckmann.show(visitor);
        Shadowing::VCavity.show(Distribution::Beckmann, visitor);
        Fresnel::Schlick.show(Distribution::Beckmann.shapes(), visitor);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 3] {
        let [kd, ks, f0] = amplitudes.take();
        // The shadowing part has 1/4 where the published model has 1/pi.
        let scale = ks.times(4.0 * FRAC_1_PI);
        [kd, scale * f0, scale]
    }

    fn products(&self) -> &'static [(&'static str, &'static str)] {
        &[("ks", "f0")]
    }
}
