//! glTF's physically based material: metallic-roughness, with the extensions for index, specular colour, anisotropy and clear coat.
//!
//! With s = (1 - wi.h)^5, M = metallic, r the roughness:
//!
//! ```text
//! f  = (1 - M) (F V + (1 - F) base_color/pi) + M (base_color (1 - s) + s) V
//! F  = f0 (1 - s) + specular s,    f0 = specular min(((ior - 1)/(ior + 1))^2 specular_color, 1)
//! V  = D G/(4 ci co) of ggx-anisotropic and smith:  my = r^2,  mx = r^2 + (1 - r^2) anisotropy_strength^2
//! coat=clearcoat
//!   f' = (1 - clearcoat Fc) f + clearcoat Fc Vc,    Fc = 0.04 (1 - t) + t,  t = (1 - co)^5
//!   Vc = D G/(4 ci co) of ggx and smith:  m = clearcoat_roughness^2
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | roughness | 1 | 0.01..1 | `roughnessFactor`; its square is the m of other models, r = sqrt(m) |
//! | anisotropy_strength | 1 | 0..1 | `anisotropyStrength`: widens the highlight along x, the tangent; fixed at 0 unless freed |
//! | base_color | 1 | 0..1 | `baseColorFactor`: albedo of the body, f0 of the metal |
//! | metallic | 1 | 0..1 | `metallicFactor`: 0 dielectric, 1 metal; shared by the channels |
//! | ior | 1 | 1..3 | refractive index, shared; fixed at 1.5 unless freed. It enters f only through f0 |
//! | specular | 1 | 0..1 | `specularFactor`: scales F of the dielectric, at grazing too; shared, fixed at 1 unless freed |
//! | specular_color | 1 | 0..25 | `specularColorFactor`: scales f0 only; shared, fixed at 1 unless freed. With ior 1.5, 25 is f0 = 1 |
//! | clearcoat | 1 | 0..1 | `clearcoatFactor`, with `coat=clearcoat` only: strength of the coat, shared |
//! | clearcoat_roughness | 1 | 0.01..1 | `clearcoatRoughnessFactor`, with `coat=clearcoat` only |
//!
//! Khronos Group, glTF 2.0 (<https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html>), Appendix B, "BRDF Implementation", with the
//! extensions `KHR_materials_ior`, `KHR_materials_specular`, `KHR_materials_anisotropy` and `KHR_materials_clearcoat`, "Implementation" of
//! each. The appendix is informative: a renderer may use other formulas. Copies of the specification from before December 2025 print
//! the separable form of Smith's G and recommend the height-correlated one, which is in later copies and has always been in Khronos'
//! sample renderer; it is the one here.
//!
//! Departures: the lower bound of the roughness; the specification has none, and roughness 0 is a mirror. The specification weighs the
//! diffuse term by 1 - F of the channel whose F is largest; with `specular_color` shared by the channels, all have the same F. The
//! sample code for anisotropy limits G/(4 ci co) to 1, which darkens grazing directions; that guard is left out. Left out as well:
//! sheen, since its layering needs a table that the specification does not give, emission, transmission, volume, and ior = 0, the
//! switch for older files. The axis along which anisotropy widens the highlight is x; turn it by `anisotropyRotation`.
//!
//! Identifiability: ior and specular_color enter only through f0, so free one of them at most. One channel gives two numbers, the strengths
//! of body and highlight, which determine base_color and metallic. A dielectric darker than its own f0 has a double: base_color b
//! below f0 = 0.04 and metallic M give the same f as base_color (1 - M) f0 and metallic 1 - b/f0. M strictly between 0 and 1 is a
//! mixture of two materials; if M = 0 or M = 1 fits as well, prefer that. The coat shows where its roughness differs from that of the
//! surface below.
//!
//! Reciprocal without the coat. With it f is not, as the extension says, since Fc depends on the viewer alone; wo is the viewer. Finite
//! at grazing. Not energy conserving for dielectrics: the body is dimmed by 1 - F of the facet that reflects rather than by what the
//! surface lets through, as the specification says itself. The highlight alone never gains energy; it loses what meets a second
//! facet.

use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::parts::distribution::{Anisotropic, Density, Ggx, Isotropic, Shadows};
use crate::model::parts::fresnel::{FresnelReflectance, Reflectance, Schlick};
use crate::model::parts::shadowing::Smith;
use crate::model::{
    Choices, Kernel, Model, ModelOption, ParamSpec, Part, Reshape, Reshaped, Scale, Sharing, Sharper,
    Strength, Values, Visitor,
};
use std::f64::consts::FRAC_1_PI;

/// glTF's material.
#[derive(Clone, Copy, Debug)]
pub struct Gltf {
    /// Whether a clear coat lies on top.
    coated: bool,
}

/// Index of the first of the shapes that hold the surface's roughness and anisotropy.
const ROUGHNESS: usize = 0;
/// Index of the shape that is the coat's roughness.
const CLEARCOAT_ROUGHNESS: usize = 2;
/// f0 of the coat, whose index is 1.5.
const COAT_F0: f64 = 0.04;

/// mx and my of the surface.
struct Surface;

impl Reshape for Surface {
    const SHAPES: usize = 2;

    fn reshape<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [roughness, strength] = shapes.take();
        let m = roughness.squared();
        let share = strength.squared();
        // m + (1 - m) share, as a sum of positive terms.
        [(-share).plus(1.0) * m + share, m]
    }
}

/// m of the coat.
pub(super) struct Squared;

impl Reshape for Squared {
    const SHAPES: usize = 1;

    fn reshape<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [roughness] = shapes.take();
        [roughness.squared(), T::constant(0.0)]
    }
}

/// 1 - t and t, with t = (1 - co)^5.
#[inline(always)]
fn towards_viewer<T: Scalar>(g: &Geometry<T::Real>) -> [T; 2] {
    let cos: T::Real = g.cos_o();
    // 1 - cos without cancellation near the normal.
    let rest: T::Real = g.sin2_o() / cos.plus(1.0);
    let [fallen, risen, _] = Schlick::factors::<T>(&[T::constant(0.0); 3], cos, rest);
    [fallen, risen]
}

/// What a surface below the coat shows: 1 - s and s times 1 - t, and both times t.
struct BelowCoat;

impl Kernel for BelowCoat {
    const FUNCTIONS: usize = 4;
    type Prepared<T: Scalar> = ();
    type Output<T: Scalar> = [T; 4];

    #[inline(always)]
    fn at<T: Scalar>((): &(), g: &Geometry<T::Real>) -> [T; 4] {
        let constants = [T::Real::literal(0.0); 3];
        let [fallen, risen, _] = Schlick::factors::<T::Real>(&constants, g.cos_d, g.one_less_cos_d);
        let [towards, grazing] = towards_viewer::<T>(g);
        [towards * fallen, towards * risen, grazing * fallen, grazing * risen]
    }
}

impl Part for BelowCoat {
    type Kernel = Self;
    const SHAPES: usize = 0;

    fn prepare<T: Scalar>(_: Values<'_, T>) {}
}

/// Fc
struct CoatReflectance;

impl Kernel for CoatReflectance {
    type Prepared<T: Scalar> = ();
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>((): &(), g: &Geometry<T::Real>) -> [T; 1] {
        let [towards, grazing] = towards_viewer::<T>(g);
        [towards.times(COAT_F0) + grazing]
    }
}

impl Part for CoatReflectance {
    type Kernel = Self;
    const SHAPES: usize = 0;

    fn prepare<T: Scalar>(_: Values<'_, T>) {}
}

/// Passes V to `visitor`.
fn show_surface(visitor: &mut impl Visitor) {
    visitor.part::<Reshaped<Density<Ggx<Anisotropic>>, Surface>>(ROUGHNESS);
    visitor.part::<Reshaped<<Smith as Shadows>::Visibility<Ggx<Anisotropic>>, Surface>>(ROUGHNESS);
}

impl Model for Gltf {
    type Coefficients<T: Scalar> = [T; 9];

    const NAME: &'static str = "gltf";
    const SUMMARY: &'static str = "glTF's metallic-roughness material";
    const REFERENCE: &'static str = "Khronos Group, glTF 2.0 Specification, Appendix B, and KHR_materials_ior, _specular, \
        _anisotropy, _clearcoat, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html";
    const OPTIONS: &'static [ModelOption] = &[ModelOption {
        key: "coat",
        summary: "nothing on top, or a clear coat, which makes f depend on who looks",
        values: || vec!["none", "clearcoat"],
        default: "none",
    }];
    // Not with the coat.
    const RECIPROCAL: bool = false;

    fn build(choices: &Choices) -> Self {
        Self { coated: choices.get("coat") == "clearcoat" }
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let roughness = |name, summary, initial| {
            ParamSpec::shape(name, summary, (0.01, 1.0), (0.1, 1.0), initial, Scale::Linear)
        };
        let strength = ("anisotropy_strength", "anisotropy of the highlight");
        let strength = ParamSpec::shape(strength.0, strength.1, (0.0, 1.0), (0.1, 1.0), 0.0, Scale::Linear);
        let shared = |name, summary, upper, initial| {
            let spec = ParamSpec::amplitude(name, summary, upper, initial);
            ParamSpec { sharing: Sharing::Shared, ..spec }
        };
        let ior = shared("ior", "refractive index", 3.0, 1.5);
        let mut all = vec![
            roughness("roughness", "roughness", 0.4).sharper_when(Sharper::Smaller),
            strength.isotropic_at(0.0).fixed(),
            ParamSpec::amplitude("base_color", "albedo of the body, f0 of the metal", 1.0, 0.2),
            shared("metallic", "metal or dielectric", 1.0, 0.1),
            ParamSpec { bounds: (1.0, 3.0), typical: (1.1, 2.5), ..ior }.fixed(),
            shared("specular", "strength of a dielectric's highlight", 1.0, 1.0).fixed(),
            shared("specular_color", "scale of a dielectric's f0", 25.0, 1.0).fixed(),
        ];
        if self.coated {
            all.insert(CLEARCOAT_ROUGHNESS, roughness("clearcoat_roughness", "roughness of the coat", 0.1));
            all.push(shared("clearcoat", "strength of the coat", 1.0, 0.5));
        }
        all
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        if self.coated {
            visitor.part::<BelowCoat>(0);
            visitor.next_term();
            show_surface(visitor);
            visitor.part::<BelowCoat>(0);
            visitor.next_term();
            visitor.part::<Reshaped<Density<Ggx<Isotropic>>, Squared>>(CLEARCOAT_ROUGHNESS);
            visitor.part::<Reshaped<<Smith as Shadows>::Visibility<Ggx<Isotropic>>, Squared>>(
                CLEARCOAT_ROUGHNESS,
            );
            visitor.part::<CoatReflectance>(0);
        } else {
            visitor.part::<Reflectance<Schlick>>(0);
            visitor.next_term();
            show_surface(visitor);
            visitor.part::<Reflectance<Schlick>>(0);
        }
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 9] {
        let [base, metallic, ior, specular, specular_color] = amplitudes.take();
        let (zero, one) = (T::constant(0.0), T::constant(1.0));
        let f0 = (ior.plus(-1.0) / ior.plus(1.0)).squared() * specular_color;
        let f0 = specular * T::if_less(f0.value(), one.value(), f0, one);
        let dielectric = one - metallic;
        let body = (dielectric * base).times(FRAC_1_PI);
        // Of 1 - s and s: the body's, and the highlight's.
        let of_body = [body * (one - f0), body * (one - specular)];
        let of_highlight = [dielectric * f0 + metallic * base, dielectric * specular + metallic];
        let ([a, b], [c, d]) = (of_body, of_highlight);
        if !self.coated {
            return [a, b, c, d, zero, zero, zero, zero, zero];
        }
        let [clearcoat] = amplitudes.take();
        // 1 - clearcoat Fc is this times 1 - t, and times t.
        let (towards, grazing) = ((-clearcoat.times(COAT_F0)).plus(1.0), one - clearcoat);
        let below = |[x, y]: [T; 2]| [towards * x, towards * y, grazing * x, grazing * y];
        let ([a, b, c, d], [e, f, g, h]) = (below(of_body), below(of_highlight));
        [a, b, c, d, e, f, g, h, clearcoat]
    }

    fn strength(&self) -> Strength {
        Strength::Missing
    }
}
