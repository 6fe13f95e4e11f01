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
//! Ngan, Durand and Matusik 2005 (doi:10.2312/EGWR/EGSR05/117-126) fitted 86 MERL materials; a row of their table is
//! typed in as printed: its diffuse colour is kd, `albedo` ks, `eta` f0 and `roughness` m. Their kd and ks are in the unit of the database before the
//! scale of its three channels is applied: what is evaluated is kd and ks times 1, 1.15 and 1.66 in channels r, g and
//! b (docs/trust/published.md).
//!
//! D is Beckmann's distribution with its pi, G that of v-cavities, F Schlick's. The pi under the lobe stands beside the one
//! in D, a relic of the 1982 paper: ks is pi/4 of the ks of
//! `lambert + cook-torrance(d=beckmann, g=v-cavity, f=schlick)`, with which the model otherwise agrees.
//! ks and f0 are told apart only by directions beyond 60 degrees. Reciprocal; energy conserving for ks <= pi/4 and kd = 0 (a mirror's
//! albedo is 4/pi ks = 1.273 ks, the largest found);
//! at grazing finite, m -> 0 a mirror.

use super::shared::{NGAN, base_and_scale, shared_f0};
use crate::math::Scalar;
use crate::model::parts::distribution::Distribution;
use crate::model::parts::fresnel::Fresnel;
use crate::model::parts::shadowing::Shadowing;
use crate::model::zoo::lambert::Lambert;
use crate::model::{Choices, Energy, Model, ParamSpec, Unit, Values, Visitor};
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
        // The shadowing part has 1/4 where the table has 1/pi.
        let scale = ks.times(4.0 * FRAC_1_PI);
        [kd, scale * f0, scale]
    }

    fn products(&self) -> &'static [(&'static str, &'static str)] {
        &[("ks", "f0")]
    }

    fn energy(&self) -> Energy {
        Energy::MayGain { largest_albedo: 1.273 }
    }
}
