//! USD's Preview Surface, the material that every program which reads Universal Scene Description understands.
//!
//! With s = (1 - wi.h)^5, M = metallic, R = ((1 - ior)/(1 + ior))^2:
//!
//! ```text
//! f  = d/pi (1 - F) + F V(roughness) + clearcoat (R (1 - s) + s) V(clearcoatRoughness),    F = F0 (1 - s) + F90 s
//! V(r) = D G/(4 ci co) of ggx and schlick-smith with m = r^2
//! workflow=metallic
//!   d = (1 - M) diffuseColor,   F90 = 1 - M + M diffuseColor,   F0 = F90 (R (1 - M) + M)
//! workflow=specular
//!   d = diffuseColor,           F90 = 1,                        F0 = specularColor
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | roughness | 1 | 0.01..1 | its square is the m of other models, r = sqrt(m) |
//! | clearcoatRoughness | 1 | 0.01..1 | the same of the coat; fixed at 0.01 unless freed, has no effect without a coat |
//! | diffuseColor | 1 | 0..1 | albedo of the body, and reflectance of the metal |
//! | metallic | 1 | 0..1 | 0 dielectric, 1 metal; shared by the channels; `workflow=metallic` only |
//! | specularColor | 1 | 0..1 | reflectance at normal incidence; `workflow=specular` only |
//! | ior | 1 | 1..3 | refractive index, shared; fixed at 1.5 unless freed. With `workflow=specular` only the coat has it |
//! | clearcoat | 1 | 0..1 | strength of the coat, shared; fixed at 0 unless freed |
//!
//! Pixar, UsdPreviewSurface Specification, version 2.6 (<https://openusd.org/release/spec_usdpreviewsurface.html>). The parameters have the
//! names of its inputs, so that fitted values can be entered into a file. The specification fixes the inputs and Fresnel's form; how
//! shadowing, body and coat combine it leaves to the renderer. The formulas are those of Storm, USD's own renderer
//! (`pxr/usd/plugin/usdShaders/shaders/previewSurface.glslfx`, <https://github.com/PixarAnimationStudios/OpenUSD>). With its epsilon put
//! back, values of that shader agreed with the reference formula to the digits of its single precision.
//!
//! Departures: Storm adds an epsilon of 0.001 to m^2 in the numerator of D and to 4 ci co. That guards its single precision, stands in
//! no other renderer, and is not small: it multiplies a highlight of roughness 0.2 by 1.6 and one of 0.1 by 11. Here it is 0, so a
//! smooth highlight looks brighter in Storm than this f. The lower bound of the roughnesses replaces Storm's floor of 0.001. MaterialX
//! has another reading of the same node, with lobes that give back light of later bounces and a coat that dims what lies below: at normal
//! incidence and mid roughness it differs by a few percent, at grazing by as much as a factor of two.
//!
//! Identifiability: with ior fixed, one channel determines diffuseColor and metallic, or diffuseColor and specularColor. M strictly
//! between 0 and 1 is a mixture of two materials; if M = 0 or M = 1 fits as well, prefer that.
//!
//! Reciprocal, finite at grazing. Not energy conserving: the coat is added without dimming what lies below, and the body is dimmed by
//! 1 - F of the facet that reflects, not by what the surface lets through.

use super::gltf::Squared;
use crate::math::Scalar;
use crate::model::parts::distribution::{Density, Ggx, Isotropic, Shadows};
use crate::model::parts::fresnel::{Reflectance, Schlick};
use crate::model::parts::shadowing::SchlickSmith;
use crate::model::{
    Choices, Model, ModelOption, ParamSpec, Reshaped, Scale, Sharing, Sharper, Strength, Values, Visitor,
};
use std::f64::consts::FRAC_1_PI;

/// USD's Preview Surface.
#[derive(Clone, Copy, Debug)]
pub struct UsdPreviewSurface {
    workflow: Workflow,
}

/// What the reflectance is computed from.
#[derive(Clone, Copy, Debug)]
enum Workflow {
    /// Metalness and index.
    Metallic,
    /// A colour of its own.
    Specular,
}

/// Index of the shape that is the roughness.
const ROUGHNESS: usize = 0;
/// Index of the shape that is the coat's roughness.
const CLEARCOAT_ROUGHNESS: usize = 1;

/// Passes 1 - s and s of the lobe with the roughness at this index of the shapes to `visitor`.
fn show_lobe(roughness: usize, visitor: &mut impl Visitor) {
    visitor.part::<Reshaped<Density<Ggx<Isotropic>>, Squared>>(roughness);
    visitor.part::<Reshaped<<SchlickSmith as Shadows>::Visibility<Ggx<Isotropic>>, Squared>>(roughness);
    visitor.part::<Reflectance<Schlick>>(0);
}

impl Model for UsdPreviewSurface {
    type Coefficients<T: Scalar> = [T; 6];

    const NAME: &'static str = "usd-preview-surface";
    const SUMMARY: &'static str = "Preview Surface of USD";
    const REFERENCE: &'static str = "Pixar, UsdPreviewSurface Specification 2.6, \
        https://openusd.org/release/spec_usdpreviewsurface.html, as evaluated by Storm";
    const OPTIONS: &'static [ModelOption] = &[ModelOption {
        key: "workflow",
        summary: "reflectance by metalness and index, or a colour of its own",
        values: || vec!["metallic", "specular"],
        default: "metallic",
    }];

    fn build(choices: &Choices) -> Self {
        Self {
            workflow: match choices.get("workflow") {
                "specular" => Workflow::Specular,
                _ => Workflow::Metallic,
            },
        }
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let roughness = |name, summary, initial| {
            ParamSpec::shape(name, summary, (0.01, 1.0), (0.1, 1.0), initial, Scale::Linear)
        };
        let shared = |name, summary, initial| {
            let spec = ParamSpec::amplitude(name, summary, 1.0, initial);
            ParamSpec { sharing: Sharing::Shared, ..spec }
        };
        let ior = shared("ior", "refractive index", 1.5);
        vec![
            roughness("roughness", "roughness", 0.5).sharper_when(Sharper::Smaller),
            roughness("clearcoatRoughness", "roughness of the coat", 0.01).fixed(),
            ParamSpec::amplitude("diffuseColor", "albedo of the body, reflectance of the metal", 1.0, 0.18),
            match self.workflow {
                Workflow::Metallic => shared("metallic", "metal or dielectric", 0.1),
                Workflow::Specular => {
                    ParamSpec::amplitude("specularColor", "reflectance at normal incidence", 1.0, 0.04)
                }
            },
            ParamSpec { bounds: (1.0, 3.0), typical: (1.1, 2.5), ..ior }.fixed(),
            shared("clearcoat", "strength of the coat", 0.0).fixed(),
        ]
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        visitor.part::<Reflectance<Schlick>>(0);
        visitor.next_term();
        show_lobe(ROUGHNESS, visitor);
        visitor.next_term();
        show_lobe(CLEARCOAT_ROUGHNESS, visitor);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 6] {
        let [color, fourth, ior, clearcoat] = amplitudes.take();
        let one = T::constant(1.0);
        let of_index = (ior.plus(-1.0) / ior.plus(1.0)).squared();
        // 1 - F90 is small at grazing, where little else remains of the body.
        let (diffuse, f0, less_f90) = match self.workflow {
            Workflow::Metallic => {
                let (dielectric, less_f90) = (one - fourth, fourth * (one - color));
                (dielectric * color, (one - less_f90) * (of_index * dielectric + fourth), less_f90)
            }
            Workflow::Specular => (color, fourth, T::constant(0.0)),
        };
        let body = diffuse.times(FRAC_1_PI);
        [body * (one - f0), body * less_f90, f0, one - less_f90, clearcoat * of_index, clearcoat]
    }

    fn strength(&self) -> Strength {
        Strength::Missing
    }
}
