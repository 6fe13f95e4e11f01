//! Low's Cook-Torrance: the model and the constants of a published table of fits.
//!
//! ```text
//! f = kd/pi + ks F D' G/(pi ci co),   D' = exp(-tan^2/m^2)/(m^2 cos^4)
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | kd | 1 | 0..2 | albedo of the diffuse base |
//! | ks | 1 | 0..1000 | scale of the lobe |
//! | m | 1 | 1e-4..1 | roughness: root-mean-square slope |
//! | eta | 1 | 1.0001..3 | refractive index, the same in all channels; 1.5 glass and plastic |
//!
//! Low, Kronander, Ynnerman and Unger 2012 (doi:10.1145/2077341.2077350), whose supplement lists fits of the 100 MERL materials.
//! A row can be entered as printed: `albedo` is ks, `roughness` m (docs/trust/published.md). The fitted indices reach 9.8, far
//! above any dielectric: F is then nearly constant and eta is merely a scale. `--bounds eta=1.0001..10` admits them.
//!
//! D' is Beckmann's distribution without its pi, G is that of v-cavities, and F is the exact reflectance of a dielectric:
//! ks is a quarter of the ks of `lambert + cook-torrance(d=beckmann, g=v-cavity, f=dielectric)`. Reciprocal; energy
//! conserving for ks <= 1/4 and kd = 0; finite at grazing; m -> 0 a mirror.

use super::shared::{LOW, base_and_scale};
use crate::math::Scalar;
use crate::model::parts::distribution::Distribution;
use crate::model::parts::fresnel::{DielectricIndex, FresnelReflectance, Reflectance};
use crate::model::parts::shadowing::Shadowing;
use crate::model::zoo::lambert::Lambert;
use crate::model::{Choices, Model, ParamSpec, Unit, Values, Visitor};

/// The model and the constants of a published table of fits.
#[derive(Clone, Copy, Debug)]
pub struct LowCookTorrance;

impl Model for LowCookTorrance {
    type Coefficients<T: Scalar> = [T; 2];

    const NAME: &'static str = "low-cook-torrance";
    const SUMMARY: &'static str = "Cook-Torrance with the constants of the fits by Low et al. 2012";
    const REFERENCE: &'static str = LOW;

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        [base_and_scale(Unit::One), Distribution::Beckmann.parameters(), DielectricIndex::parameters()]
            .concat()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        Lambert::show_as_base(visitor);
        Distribution::Beckmann.show(visitor);
        Shadowing::VCavity.show(Distribution::Beckmann, visitor);
        visitor.part::<Reflectance<DielectricIndex>>(Distribution::Beckmann.shapes());
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 2] {
        let [kd, ks] = amplitudes.take();
        // The model has pi D/(pi ci co), the parts have D/(4 ci co).
        [kd, ks.times(4.0)]
    }
}
