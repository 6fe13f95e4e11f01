//! Ngan's Ward-Duer: Duer's form of Ward's lobe over a Lambert base, as in a published table of fits.
//!
//! ```text
//! f = kd/pi + ks exp(-tan^2/m^2)/(4 pi m^2 ci co)
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | kd | unscaled MERL | 0..2 | albedo of the diffuse base |
//! | ks | unscaled MERL | 0..1000 | scale of the lobe |
//! | m | 1 | 1e-4..1 | roughness |
//!
//! Ngan, Durand and Matusik 2005 (doi:10.2312/EGWR/EGSR05/117-126) fitted 86 MERL materials. A row of their table can be entered
//! as printed: its diffuse colour is kd, `albedo` ks and `roughness` m. Their kd and ks are in the unit of the database before
//! the scales of its three channels are applied: the model multiplies kd and ks by 1, 1.15 and 1.66 in channels r, g and b
//! (docs/trust/published.md).
//!
//! The lobe is that of `ward-duer`, and tan that of the half vector's polar angle. Reciprocal; not energy conserving at
//! grazing, where f grows without bound as 1/(ci co); m -> 0 a mirror.

use super::shared::{NGAN, base_and_scale};
use crate::math::Scalar;
use crate::model::zoo::lambert::Lambert;
use crate::model::zoo::ward::Slopes;
use crate::model::zoo::ward_duer::Product;
use crate::model::{Choices, Model, ParamSpec, Unit, Values, Visitor};

/// Duer's form of Ward's lobe over a Lambert base, as in a published table of fits.
#[derive(Clone, Copy, Debug)]
pub struct NganWardDuer;

impl Model for NganWardDuer {
    type Coefficients<T: Scalar> = [T; 2];

    const NAME: &'static str = "ngan-ward-duer";
    const SUMMARY: &'static str = "Ward-Duer over Lambert, as fitted by Ngan et al. 2005";
    const REFERENCE: &'static str = NGAN;

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        [base_and_scale(Unit::UnscaledMerl), Slopes::Isotropic.roughness()].concat()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        Lambert::show_as_base(visitor);
        Slopes::Isotropic.show(visitor);
        visitor.part::<Product>(0);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 2] {
        amplitudes.take()
    }
}
