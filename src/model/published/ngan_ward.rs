//! Ngan's Ward: Ward's isotropic lobe over a Lambert base, as in a published table of fits.
//!
//! ```text
//! f = kd/pi + ks exp(-tan^2/m^2)/(4 pi m^2 sqrt(ci co))
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
//! The lobe is that of `ward`, and tan that of the half vector's polar angle. Reciprocal. At grazing f grows without bound
//! as 1/sqrt(ci co); nevertheless a sharp lobe loses light, while a rough one gains; m -> 0 a mirror.

use super::shared::{NGAN, base_and_scale};
use crate::math::Scalar;
use crate::model::zoo::lambert::Lambert;
use crate::model::zoo::ward::{GeometricMean, Slopes};
use crate::model::{Choices, Model, ParamSpec, Unit, Values, Visitor};

/// Ward's isotropic lobe over a Lambert base, as in a published table of fits.
#[derive(Clone, Copy, Debug)]
pub struct NganWard;

impl Model for NganWard {
    type Coefficients<T: Scalar> = [T; 2];

    const NAME: &'static str = "ngan-ward";
    const SUMMARY: &'static str = "Ward over Lambert, as fitted by Ngan et al. 2005";
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
        visitor.part::<GeometricMean>(0);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 2] {
        amplitudes.take()
    }
}
