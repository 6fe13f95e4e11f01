//! Cook-Torrance as printed in 1982: the model with the paper's own constants.
//!
//! ```text
//! f = kd/pi + s F D' G/(pi ci co),   D' = exp(-tan^2/m^2)/(m^2 cos^4)
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | kd | 1 | 0..2 | albedo of the diffuse base |
//! | s | 1 | 0..1 | share of the specular lobe |
//! | m | 1 | 1e-4..1 | roughness: root-mean-square slope |
//! | f0 | 1 | 0..1 | reflectance at normal incidence |
//!
//! Cook and Torrance 1982 (doi:10.1145/357290.357293), eq. 6 to 12. They write R = d Rd + s Rs with s + d = 1; d Rd, the share of
//! the diffuse base times its bidirectional reflectance, is kd/pi here.
//!
//! D' is Beckmann's distribution as printed in the paper, without pi; G is that of v-cavities; F is the exact reflectance
//! of a dielectric whose index follows from f0, which the paper uses for metals, too. The denominator has pi where the half
//! vector's Jacobian requires 4, and D' lacks its pi: s is a quarter of the ks of `cook-torrance(d=beckmann, g=v-cavity,
//! f=dielectric)`, and a surface with s = 1 reflects up to four times what it receives. If s is free, only the rise towards
//! grazing determines f0. Reciprocal; energy conserving for s <= 1/4 and kd = 0; finite at grazing; m -> 0 a mirror.

use crate::math::Scalar;
use crate::model::parts::distribution::Distribution;
use crate::model::parts::fresnel::Fresnel;
use crate::model::parts::shadowing::Shadowing;
use crate::model::zoo::lambert::Lambert;
use crate::model::{Choices, Model, ParamSpec, Values, Visitor};

/// The model with the paper's own constants.
#[derive(Clone, Copy, Debug)]
pub struct CookTorrance1982;

impl Model for CookTorrance1982 {
    type Coefficients<T: Scalar> = [T; 2];

    const NAME: &'static str = "cook-torrance-1982";
    const SUMMARY: &'static str = "Cook-Torrance with the paper's own constants";
    const REFERENCE: &'static str = "Cook and Torrance 1982, A Reflectance Model for Computer Graphics, \
        doi:10.1145/357290.357293";

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let own = vec![
            ParamSpec::albedo("kd", "albedo of the base", 0.2),
            ParamSpec::amplitude("s", "share of the specular lobe", 1.0, 0.2),
        ];
        // If s is free, only the rise towards grazing determines f0, and a valley separates dielectrics from metals.
        let fresnel = Fresnel::Dielectric.parameters().into_iter();
        let fresnel = fresnel.map(|spec| ParamSpec { typical: (0.01, 0.95), ..spec }).collect();
        [own, Distribution::Beckmann.parameters(), fresnel].concat()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        Lambert::show_as_base(visitor);
        Distribution::Beckmann.show(visitor);
        Shadowing::VCavity.show(Distribution::Beckmann, visitor);
        Fresnel::Dielectric.show(Distribution::Beckmann.shapes(), visitor);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 2] {
        let [kd, s] = amplitudes.take();
        // The model has pi D/(pi ci co), the parts have D/(4 ci co).
        [kd, s.times(4.0)]
    }
}
