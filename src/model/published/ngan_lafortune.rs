//! Ngan's Lafortune: one isotropic lobe over a Lambert base, as in a published table of fits.
//!
//! ```text
//! f = kd/pi + ks (n + 2)/(2 pi) max(0, q)^n,   q = (cxy (xi xo + yi yo) + cz zi zo)/max(|cxy|, |cz|)
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | kd | unscaled MERL | 0..2 | albedo of the diffuse base |
//! | ks | unscaled MERL | 0..1000 | scale of the lobe |
//! | cxy | 1 | -1..1 | fixed at -1 unless freed: only the ratio to cz matters |
//! | cz | 1 | -10..10 | 1 mirror-like, below 1 bent towards grazing |
//! | n | 1 | 1..1e6 | exponent |
//!
//! Ngan, Durand and Matusik 2005 (doi:10.2312/EGWR/EGSR05/117-126) fitted 86 MERL materials. A row of their table can be entered
//! as printed: its diffuse colour is kd, `albedo` ks, `sharpness` n, and `Cxy` and `Cz` are cxy and cz. Their kd and ks are in the
//! unit of the database before the scales of its three channels are applied: the model multiplies kd and ks by 1, 1.15 and 1.66
//! in channels r, g and b (docs/trust/published.md).
//!
//! The lobe is that of `lafortune`, whose manual says which parameters are identifiable. Reciprocal, finite everywhere.

use super::shared::{NGAN, base_and_scale};
use crate::math::Scalar;
use crate::model::zoo::lafortune::{Isotropic, shapes};
use crate::model::zoo::lambert::Lambert;
use crate::model::{Choices, Model, ParamSpec, Unit, Values, Visitor};

/// One isotropic lobe over a Lambert base, as in a published table of fits.
#[derive(Clone, Copy, Debug)]
pub struct NganLafortune;

impl Model for NganLafortune {
    type Coefficients<T: Scalar> = [T; 2];

    const NAME: &'static str = "ngan-lafortune";
    const SUMMARY: &'static str = "Lafortune lobe over Lambert, as fitted by Ngan et al. 2005";
    const REFERENCE: &'static str = NGAN;

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        [base_and_scale(Unit::UnscaledMerl), shapes()].concat()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        Lambert::show_as_base(visitor);
        visitor.part::<Isotropic>(0);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 2] {
        amplitudes.take()
    }
}
