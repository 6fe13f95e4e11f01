//! Ngan's Ashikhmin-Shirley: the isotropic lobe over a Lambert base, as in a published table of fits.
//!
//! ```text
//! f = kd/pi + ks (n + 1)/(8 pi) (n.h)^n F/(mu max(ci, co)),   F = f0 + (1 - f0)(1 - mu)^5,   mu = wi.h
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | kd | unscaled MERL | 0..2 | albedo of the diffuse base |
//! | ks | unscaled MERL | 0..1000 | scale of the lobe |
//! | f0 | 1 | 0..1 | reflectance at normal incidence, the same in all channels |
//! | n | 1 | 0.01..1e6 | exponent; 10 satin, 1000 polished |
//!
//! Ngan, Durand and Matusik 2005 (doi:10.2312/EGWR/EGSR05/117-126) fitted 86 MERL materials. A row of their table can be entered
//! as printed: its diffuse colour is kd, `albedo` ks, `fresnelReflectance` f0 and `sharpness` n. Their kd and ks are in the unit
//! of the database before the scales of its three channels are applied: the model multiplies kd and ks by 1, 1.15 and 1.66 in
//! channels r, g and b (docs/trust/published.md).
//!
//! The lobe is that of `ashikhmin-shirley` with nu = nv = n; its base is Lambert, not the coupled one of the paper of 2000. Only
//! directions beyond 60 degrees separate ks from f0. Reciprocal; not energy conserving at grazing, where f grows without bound
//! as 1/max(ci, co); n -> 0 nearly constant.

use super::shared::{NGAN, base_and_scale, shared_f0};
use crate::math::Scalar;
use crate::model::parts::fresnel::Fresnel;
use crate::model::zoo::ashikhmin_shirley::{IsotropicLobe, exponent};
use crate::model::zoo::lambert::Lambert;
use crate::model::{Choices, Model, ParamSpec, Sharper, Unit, Values, Visitor};

/// The isotropic lobe over a Lambert base, as in a published table of fits.
#[derive(Clone, Copy, Debug)]
pub struct NganAshikhminShirley;

impl Model for NganAshikhminShirley {
    type Coefficients<T: Scalar> = [T; 3];

    const NAME: &'static str = "ngan-ashikhmin-shirley";
    const SUMMARY: &'static str =
        "isotropic Ashikhmin-Shirley lobe over Lambert, as fitted by Ngan et al. 2005";
    const REFERENCE: &'static str = NGAN;

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let lobe = vec![shared_f0(), exponent("n", "exponent").sharper_when(Sharper::Larger)];
        [base_and_scale(Unit::UnscaledMerl), lobe].concat()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        Lambert::show_as_base(visitor);
        visitor.part::<IsotropicLobe>(0);
        Fresnel::Schlick.show(1, visitor);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 3] {
        let [kd, ks, f0] = amplitudes.take();
        [kd, ks * f0, ks]
    }

    fn products(&self) -> &'static [(&'static str, &'static str)] {
        &[("ks", "f0")]
    }
}
