//! Ngan's Blinn-Phong: a lobe in the half vector over a Lambert base, as in a published table of fits.
//!
//! ```text
//! f = kd/pi + ks (n + 2)/(2 pi) (n.h)^n
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | kd | unscaled MERL | 0..2 | albedo of the diffuse base |
//! | ks | unscaled MERL | 0..1000 | scale of the lobe |
//! | n | 1 | 0.01..1e6 | exponent |
//!
//! Ngan, Durand and Matusik 2005 (doi:10.2312/EGWR/EGSR05/117-126) fitted 86 MERL materials. A row of their table can be entered
//! as printed: its diffuse colour is kd, `albedo` ks and `sharpness` n. Their kd and ks are in the unit of the database before
//! the scales of its three channels are applied: the model multiplies kd and ks by 1, 1.15 and 1.66 in channels r, g and b
//! (docs/trust/published.md).
//!
//! The lobe is that of `blinn-phong`. Reciprocal, finite everywhere; energy conserving only for small ks, since a sharp lobe
//! reflects up to 4 ks. n -> 0: constant.

use super::shared::{NGAN, base_and_scale};
use crate::math::Scalar;
use crate::model::zoo::blinn_phong::BlinnPhong;
use crate::model::zoo::lambert::Lambert;
use crate::model::zoo::phong::exponent;
use crate::model::{Choices, Model, ParamSpec, Unit, Values, Visitor};

/// A lobe in the half vector over a Lambert base, as in a published table of fits.
#[derive(Clone, Copy, Debug)]
pub struct NganBlinnPhong;

impl Model for NganBlinnPhong {
    type Coefficients<T: Scalar> = [T; 2];

    const NAME: &'static str = "ngan-blinn-phong";
    const SUMMARY: &'static str = "Blinn-Phong over Lambert, as fitted by Ngan et al. 2005";
    const REFERENCE: &'static str = NGAN;

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        [base_and_scale(Unit::UnscaledMerl), vec![exponent()]].concat()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        Lambert::show_as_base(visitor);
        visitor.part::<BlinnPhong>(0);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 2] {
        amplitudes.take()
    }
}
