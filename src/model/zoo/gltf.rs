//! glTF's physically based material: metallic-roughness, with the extensions for index, specular colour, anisotropy, sheen and clear coat.
//!
//! With s = (1 - wi.h)^5, M = metallic, r the roughness:
//!
//! ```text
//! f  = (1 - M) (F V + (1 - F) base_color/pi) + M (base_color (1 - s) + s) V
//! F  = f0 (1 - s) + specular s,    f0 = specular min(((ior - 1)/(ior + 1))^2 specular_color, 1)
//! V  = D G/(4 ci co) of ggx-anisotropic and smith:  my = r^2,  mx = r^2 + (1 - r^2) anisotropy_strength^2
//! fuzz=charlie
//!   f' = sheen sheen_color Ds Vs + (1 - sheen max(E(ci), E(co))) f,    E(ci) = int Ds Vs co dwo, at most 1
//!   Ds = (1 + p)/pi (1 - (n.h)^2)^p,    p = 1/(2 a),  a = sheen_roughness^2
//!   Vs = 1/((1 + Lambda(ci) + Lambda(co)) 4 ci co),    Lambda of the extension's text, no cosine less than 2^-12
//! coating=clearcoat, on top of the sheen
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
//! | clearcoat | 1 | 0..1 | `clearcoatFactor`, with `coating=clearcoat` only: strength of the coat, shared |
//! | clearcoat_roughness | 1 | 0.01..1 | `clearcoatRoughnessFactor`, with `coating=clearcoat` only |
//! | sheen | 1 | 0..1 | with `fuzz=charlie` only: the largest of the three of `sheenColorFactor`, shared |
//! | sheen_color | 1 | 0..1 | with `fuzz=charlie` only: `sheenColorFactor` divided by `sheen`; fixed at 1 unless freed |
//! | sheen_roughness | 1 | 0.1..1 | `sheenRoughnessFactor`, with `fuzz=charlie` only; a small one leaves a rim of light towards grazing |
//!
//! Khronos Group, glTF 2.0 (<https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html>), Appendix B, "BRDF Implementation", with the
//! extensions `KHR_materials_ior`, `KHR_materials_specular`, `KHR_materials_anisotropy` and `KHR_materials_clearcoat`, "Implementation" of
//! each, and `KHR_materials_sheen`, "Implementation Notes", with the visibility "Charlie", after Conty Estevez and Kulla 2017, Production
//! Friendly Microfacet Sheen BRDF. The appendix is informative: a renderer may use other formulas. Copies of the specification from before December 2025 print
//! the separable form of Smith's G and recommend the height-correlated one, which is in later copies and has always been in Khronos'
//! sample renderer; it is the one here.
//!
//! Departures: the lower bound of the roughness; the specification has none, and roughness 0 is a mirror. The specification weighs the
//! diffuse term by 1 - F of the channel whose F is largest; with `specular_color` shared by the channels, all have the same F. The
//! sample code for anisotropy limits G/(4 ci co) to 1, which darkens grazing directions; that guard is left out. Left out as well:
//! emission, transmission, volume, and ior = 0, the switch for older files. The axis along which anisotropy widens the highlight is x; turn it by `anisotropyRotation`.
//!
//! Sheen: the extension dims what is below by the brightest channel. Channels are fitted one by one, so `sheen` holds that brightness, and
//! `sheen_color` the colour relative to it: free it together with `--fix` of its brightest channel at 1, since only such a material has a
//! form in glTF. The extension refers to a table of E elsewhere and gives no numbers; E is integrated here whenever sheen_roughness changes,
//! to 2e-4 (`src/model/parts/charlie.rs`). Khronos' sample renderer reads E from a picture of 8 bits per channel and limits Vs to 1, which
//! darkens sheen within ten degrees of the horizon; other viewers take the simpler visibility that the extension allows. The cosines in
//! Vs are cut off 0.014 degrees above the horizon, where the printed form grows without bound. Below a sheen_roughness of 0.1, which
//! the specification allows, sheen is a line at the horizon that sends back several times what it receives.
//!
//! Identifiability: ior and specular_color enter only through f0, so free one of them at most. One channel gives two numbers, the strengths
//! of body and highlight, which determine base_color and metallic. A dielectric darker than its own f0 has a double: base_color b
//! below f0 = 0.04 and metallic M give the same f as base_color (1 - M) f0 and metallic 1 - b/f0. M strictly between 0 and 1 is a
//! mixture of two materials; if M = 0 or M = 1 fits as well, prefer that. The coat shows where its roughness differs from that of the
//! surface below.
//!
//! With sheen, the rim towards grazing tells sheen_roughness, its brightness `sheen`; without samples beyond 60 degrees a small
//! sheen_roughness shows nothing.
//!
//! Reciprocal without the coat, with sheen too. With the coat f is not, as the extension says, since Fc depends on the viewer alone; wo is the viewer. Finite
//! at grazing. Not energy conserving for dielectrics: the body is dimmed by 1 - F of the facet that reflects rather than by what the
//! surface lets through, as the specification says itself. The highlight alone never gains energy; it loses what meets a second
//! facet. Sheen with a sheen_roughness of 0.2 and less returns more than it receives within three degrees
//! of grazing, up to twice as much at 0.1.

use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::parts::charlie::{BelowCharlie, CharlieDensity, CharlieVisibility};
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
    /// Whether fibres stand up from the surface.
    sheen: bool,
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

/// 1 - t and t: what fibres below the coat show.
struct TowardsViewer;

impl Kernel for TowardsViewer {
    const FUNCTIONS: usize = 2;
    type Prepared<T: Scalar> = ();
    type Output<T: Scalar> = [T; 2];

    #[inline(always)]
    fn at<T: Scalar>((): &(), g: &Geometry<T::Real>) -> [T; 2] {
        towards_viewer::<T>(g)
    }
}

impl Part for TowardsViewer {
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

/// Number of coefficients: those of body and highlight below coat and sheen and below the coat alone, two of the sheen and one of the coat.
const COEFFICIENTS: usize = 2 * 8 + 2 + 1;

impl Gltf {
    /// Index of the shape that is the roughness of the sheen.
    fn sheen_roughness(self) -> usize {
        CLEARCOAT_ROUGHNESS + usize::from(self.coated)
    }

    /// Passes body and highlight, dimmed by what lies above, to `visitor`.
    fn show_base(self, visitor: &mut impl Visitor, below_sheen: bool) {
        for is_highlight in [false, true] {
            if is_highlight {
                show_surface(visitor);
            }
            if self.coated {
                visitor.part::<BelowCoat>(0);
            } else {
                visitor.part::<Reflectance<Schlick>>(0);
            }
            if below_sheen {
                visitor.part::<Reshaped<BelowCharlie, Squared>>(self.sheen_roughness());
            }
            visitor.next_term();
        }
    }
}

impl Model for Gltf {
    type Coefficients<T: Scalar> = [T; COEFFICIENTS];

    const NAME: &'static str = "gltf";
    const SUMMARY: &'static str = "glTF's metallic-roughness material";
    const REFERENCE: &'static str = "Khronos Group, glTF 2.0 Specification, Appendix B, and KHR_materials_ior, _specular, \
        _anisotropy, _clearcoat, _sheen, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html";
    const OPTIONS: &'static [ModelOption] = &[
        ModelOption {
            key: "coating",
            summary: "nothing on top, or a clear coat, which makes f depend on who looks",
            values: || vec!["none", "clearcoat"],
            default: "none",
        },
        ModelOption {
            key: "fuzz",
            summary: "no fibres, or those of cloth, below the coat",
            values: || vec!["none", "charlie"],
            default: "none",
        },
    ];
    // Not with the coat.
    const RECIPROCAL: bool = false;

    fn build(choices: &Choices) -> Self {
        Self { coated: choices.get("coating") == "clearcoat", sheen: choices.get("fuzz") == "charlie" }
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let shape = |name, summary, least, typical, initial| {
            ParamSpec::shape(name, summary, (least, 1.0), typical, initial, Scale::Linear)
        };
        let roughness = |name, summary, initial| shape(name, summary, 0.01, (0.1, 1.0), initial);
        let strength = shape("anisotropy_strength", "anisotropy of the highlight", 0.0, (0.1, 1.0), 0.0);
        let shared = |name, summary, upper, initial| {
            let spec = ParamSpec::amplitude(name, summary, upper, initial);
            ParamSpec { sharing: Sharing::Shared, ..spec }
        };
        let ior = shared("ior", "refractive index", 3.0, 1.5);
        let mut all = vec![
            roughness("roughness", "roughness", 0.4).sharper_when(Sharper::Smaller),
            strength.isotropic_at(0.0).fixed(),
        ];
        if self.coated {
            all.push(roughness("clearcoat_roughness", "roughness of the coat", 0.1));
        }
        if self.sheen {
            all.push(shape("sheen_roughness", "roughness of the sheen", 0.1, (0.2, 1.0), 0.5));
        }
        all.extend([
            ParamSpec::amplitude("base_color", "albedo of the body, f0 of the metal", 1.0, 0.2),
            shared("metallic", "metal or dielectric", 1.0, 0.1),
            ParamSpec { bounds: (1.0, 3.0), typical: (1.1, 2.5), ..ior }.fixed(),
            shared("specular", "strength of a dielectric's highlight", 1.0, 1.0).fixed(),
            shared("specular_color", "scale of a dielectric's f0", 25.0, 1.0).fixed(),
        ]);
        if self.coated {
            all.push(shared("clearcoat", "strength of the coat", 1.0, 0.5));
        }
        if self.sheen {
            all.push(shared("sheen", "strength of the sheen", 1.0, 0.3));
            all.push(ParamSpec::amplitude("sheen_color", "relative colour of the sheen", 1.0, 1.0).fixed());
        }
        all
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        self.show_base(visitor, false);
        if self.sheen {
            self.show_base(visitor, true);
            let roughness = self.sheen_roughness();
            visitor.part::<Reshaped<CharlieDensity, Squared>>(roughness);
            visitor.part::<Reshaped<CharlieVisibility, Squared>>(roughness);
            if self.coated {
                visitor.part::<TowardsViewer>(0);
            }
            visitor.next_term();
        }
        if self.coated {
            visitor.part::<Reshaped<Density<Ggx<Isotropic>>, Squared>>(CLEARCOAT_ROUGHNESS);
            visitor.part::<Reshaped<<Smith as Shadows>::Visibility<Ggx<Isotropic>>, Squared>>(
                CLEARCOAT_ROUGHNESS,
            );
            visitor.part::<CoatReflectance>(0);
        }
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; COEFFICIENTS] {
        let [base, metallic, ior, specular, specular_color] = amplitudes.take();
        let (zero, one) = (T::constant(0.0), T::constant(1.0));
        let f0 = (ior.plus(-1.0) / ior.plus(1.0)).squared() * specular_color;
        let f0 = specular * T::if_less(f0.value(), one.value(), f0, one);
        let dielectric = one - metallic;
        let body = (dielectric * base).times(FRAC_1_PI);
        // Of 1 - s and s: the body's, and the highlight's.
        let of_body = [body * (one - f0), body * (one - specular)];
        let of_highlight = [dielectric * f0 + metallic * base, dielectric * specular + metallic];
        let [clearcoat] = if self.coated { amplitudes.take() } else { [zero] };
        let [sheen, sheen_color] = if self.sheen { amplitudes.take() } else { [zero, one] };
        // 1 - clearcoat Fc is this times 1 - t, and times t.
        let through_coat = [(-clearcoat.times(COAT_F0)).plus(1.0), one - clearcoat];
        let through_coat = if self.coated { through_coat.to_vec() } else { vec![one] };
        // 1 - sheen max(E) is this times 1, and times 1 - max(E).
        let through_sheen = if self.sheen { vec![one - sheen, sheen] } else { vec![one] };
        let mut all = Vec::with_capacity(COEFFICIENTS);
        for through in through_sheen {
            for pair in [of_body, of_highlight] {
                for coat in &through_coat {
                    all.extend(pair.map(|coefficient| *coat * coefficient * through));
                }
            }
        }
        if self.sheen {
            all.extend(through_coat.iter().map(|coat| *coat * sheen * sheen_color));
        }
        if self.coated {
            all.push(clearcoat);
        }
        let mut visited = all.into_iter();
        std::array::from_fn(|_| visited.next().unwrap_or(zero))
    }

    fn strength(&self) -> Strength {
        Strength::Missing
    }
}
