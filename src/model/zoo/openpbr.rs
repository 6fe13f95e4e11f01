//! OpenPBR Surface's base: a rough diffuse body under a rough dielectric surface, a metal, or a mixture of the two.
//!
//! With M the metalness, lobe = D G/(4 ci co) (`ggx`, `smith`), r the roughness and a the anisotropy of the surface:
//!
//! ```text
//! f  = (1 - M) (lobe specular_color F(specular_ior) + f_d (1 - E(ci))(1 - E(co))/(1 - Ea)) + M (lobe F82 + bounces)
//! f_d   eon with albedo = base_color and r = base_diffuse_roughness
//! F     exact dielectric
//! F82   f82-tint with f0 = base_color and tint = specular_color
//! mx = r^2 sqrt(2/(1 + (1 - a)^2)),   my = (1 - a) mx
//! E     directional albedo of lobe F at m = sqrt(mx my); Ea = 2 int E(c) c dc
//! bounces  0 with scattering=single; with scattering=multiple, with E, Ea of lobe (F = 1) and Fa = 2 int F82(c) c dc,
//!          (1 - E(ci))(1 - E(co))/(pi (1 - Ea)) Fa^2 Ea/(1 - Fa (1 - Ea))
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | base_color | 1 | 0..1 | albedo of the diffuse body, f0 of the metal |
//! | base_metalness | 1 | 0..1 | M, shared by the channels; 0 in `base=dielectric`, 1 in `base=metal` |
//! | base_diffuse_roughness | 1 | 0..1 | roughness of the body; 0 is Lambert, from which data cannot distinguish a small value |
//! | specular_roughness | 1 | 0.01..1 | r; r^2 is the m of other models, r = sqrt(m) |
//! | specular_roughness_anisotropy | 1 | 0..0.99 | a; fixed at 0 unless freed |
//! | specular_ior | 1 | 1..3 | refractive index, the same for all channels; in `base=mixed` fixed at 1.5 unless freed |
//! | specular_color | 1 | 0..1 | reflectance of the metal at 82 degrees relative to Schlick's; tint of the dielectric's highlight, which real dielectrics do not have. Fixed at 1 unless freed, but free in `base=metal` |
//!
//! Academy Software Foundation 2024, OpenPBR Surface, version 1.1 (<https://academysoftwarefoundation.github.io/OpenPBR/>). The
//! parameters have the names of the specification, so that fitted values can be entered into a renderer. This is the base with
//! its specular parameters, without coat, fuzz, thin film, transmission, subsurface and emission. Merged: base_weight is a factor
//! of base_color; specular_weight of a dielectric is equivalent to another specular_ior, eta' = (1 + q)/(1 - q),
//! q = sqrt(weight) (eta - 1)/(eta + 1). Left out: specular_weight of a metal (1), and indices below that of the surroundings.
//!
//! Departures: the main form of the specification multiplies f_d only by 1 - E(co) and is not reciprocal. This is the reciprocal
//! alternative that it offers, after Kelemen and Szirmay-Kalos 2001, with 1/(1 - Ea) as its normalisation: the reflectance of a
//! Lambertian body seen from any direction is the same in both, E + base_color (1 - E). E is integrated whenever the shapes
//! change (0.2 ms, with derivatives 0.5 ms) and is accurate to 3e-5 up to 85 degrees, and to 2e-4 up to 89; beyond, to 1e-3 for
//! m = 1e-3. Below an anisotropic surface it is that of the isotropic surface with the same mx my, as in MaterialX' code. EON's albedo
//! enters through b = albedo^2 Ea/(1 - albedo (1 - Ea)), which is not a sum of products of a function of the colour and one of
//! the roughness; interpolation in 1 - Ea at five nodes makes it one, with an error of 3e-8.
//!
//! Identifiability: one channel determines the diffuse strength (1 - M) base_color and one reflectance at normal incidence. So it
//! determines M or specular_ior, but not both: `base=mixed` fits M, as `disney-2012` does, `base=dielectric` the index. Several
//! channels with different colours can determine both (`--free specular_ior`). M strictly between 0 and 1 is a mixture of two
//! materials; if M = 0 or M = 1 fits as well, prefer that.
//!
//! Reciprocal, finite at grazing. A white Lambertian body below an isotropic surface reflects all that it receives, to
//! 2e-5. With base_diffuse_roughness it reflects up to 0.6 % more at normal incidence and 2 % less at 85 degrees. Below an
//! anisotropic surface it is off by up to 7 % at 70 degrees, and at 85 by 6 % for a = 0.5 and 20 % for a = 0.9; it is too
//! bright across the smoother direction.
//!
//! With `scattering=single` metal loses the light that meets a second facet: white metal reflects 0.92, 0.70 and 0.31 of
//! the light from above at roughness 0.5, 0.7 and 1. Renderers give it back; the code of OpenPBR's authors and of MaterialX
//! does. So does `scattering=multiple`, in the reciprocal form of Kulla and Conty 2017 (Revisiting Physically Based Shading
//! at Imageworks), with which isotropic white metal reflects everything; MaterialX scales the lobe by 1 + F (1 -
//! E(co))/E(co) instead (Turquin 2019), which is not reciprocal. The bounces in a dielectric surface are not treated apart:
//! the body receives what the surface does not send back.

use super::eon::{Bounces, BouncesOf, MISSING, mean_albedo};
use super::oren_nayar::FUJII;
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::directional_albedo::{
    BOUNCES, Bounced, Through, bounce_nodes, chebyshev, lagrange, later_bounces,
};
use crate::model::parts::distribution::{Anisotropic, Density, Ggx, Shadows};
use crate::model::parts::fresnel::{DielectricIndex, Fresnel, Reflectance};
use crate::model::parts::shadowing::Smith;
use crate::model::{
    Choices, Kernel, Model, ModelOption, ParamSpec, Part, PreparedBy, Reshape, Reshaped, Scale, Sharing,
    Sharper, Strength, Values, Visitor,
};

/// OpenPBR Surface's base.
#[derive(Clone, Copy, Debug)]
pub struct Openpbr {
    base: Base,
    /// Whether the facets of the metal reflect to one another.
    bounces: bool,
}

#[derive(Clone, Copy, Debug)]
enum Base {
    /// Any metalness.
    Mixed,
    /// Metalness 0.
    Dielectric,
    /// Metalness 1.
    Metal,
}

/// Index of the first of the shapes that hold the surface's roughness and anisotropy.
const ROUGHNESS: usize = 0;
/// Index of the shape that is the surface's index of refraction.
const IOR: usize = 2;
/// Index of the shape that is the body's roughness.
const DIFFUSE_ROUGHNESS: usize = 3;

/// mx and my of the surface.
struct Surface;

impl Reshape for Surface {
    const SHAPES: usize = 2;

    fn reshape<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [roughness, anisotropy] = shapes.take();
        let aspect = (-anisotropy).plus(1.0);
        let mx = roughness.squared() * (aspect.squared().plus(1.0).recip().times(2.0)).sqrt();
        [mx, mx * aspect]
    }
}

/// Passes D G/(4 ci co) of the surface to `visitor`.
fn show_surface(visitor: &mut impl Visitor) {
    visitor.part::<Reshaped<Density<Ggx<Anisotropic>>, Surface>>(ROUGHNESS);
    visitor.part::<Reshaped<<Smith as Shadows>::Visibility<Ggx<Anisotropic>>, Surface>>(ROUGHNESS);
}

/// m and eta of the surface, as used for the transmission to the body below.
struct FromBelow;

impl Reshape for FromBelow {
    const SHAPES: usize = 3;

    fn reshape<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [mx, my] = Surface::reshape(shapes.clone());
        let [_, _, eta] = shapes.take();
        [(mx * my).sqrt(), eta]
    }
}

/// The m of an isotropic surface of the same mx my.
struct Mean;

impl Reshape for Mean {
    const SHAPES: usize = 2;

    fn reshape<T: Scalar>(shapes: Values<'_, T>) -> [T; 2] {
        let [mx, my] = Surface::reshape(shapes);
        [(mx * my).sqrt(), T::constant(0.0)]
    }
}

/// Number of nodes of the interpolation in 1 - Ea.
const NODES: usize = 5;

/// The nodes: from 0 to the value of 1 - Ea at roughness 1.
fn nodes() -> [f64; NODES] {
    chebyshev(MISSING / (1.0 + FUJII))
}

/// Number of coefficients: the body's, one of the highlight, and three and more of the metal.
const COEFFICIENTS: usize = 1 + NODES + 1 + 3 + BOUNCES;

/// Number of basis functions of the body.
pub(super) const BODY: usize = 1 + NODES;

/// EON's single bounce at albedo 1, and its later bounces times each of the Lagrange polynomials in 1 - Ea.
pub(super) struct Body;

impl Kernel for Body {
    const FUNCTIONS: usize = BODY;
    type Prepared<T: Scalar> = (BouncesOf<T>, [T; NODES]);
    type Output<T: Scalar> = [T; BODY];

    #[inline(always)]
    fn at<T: Scalar>((bounces, lagrange): &Self::Prepared<T>, g: &Geometry<T::Real>) -> [T; BODY] {
        let [single, later] = Bounces::at(bounces, g);
        let [a, b, c, d, e] = lagrange.map(|polynomial| polynomial * later);
        [single, a, b, c, d, e]
    }
}

impl Part for Body {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        let [r] = shapes.take();
        let missing = (-mean_albedo(r)).plus(1.0);
        (Bounces::prepare(Values::new(&[r])), lagrange(nodes(), missing))
    }
}

/// EON's albedo, and the corresponding factor of the later bounces at each node.
pub(super) fn body_coefficients<T: Scalar>(albedo: T) -> [T; BODY] {
    let [a, b, c, d, e] = later_bounces(nodes(), albedo);
    [albedo, a, b, c, d, e]
}

impl Model for Openpbr {
    type Coefficients<T: Scalar> = [T; COEFFICIENTS];

    const NAME: &'static str = "openpbr";
    const SUMMARY: &'static str = "base and specular of OpenPBR Surface";
    const REFERENCE: &'static str = "Academy Software Foundation 2024, OpenPBR Surface 1.1, \
        https://academysoftwarefoundation.github.io/OpenPBR/";
    const OPTIONS: &'static [ModelOption] = &[
        ModelOption {
            key: "base",
            summary: "a mixture by metalness, or one of its ends",
            values: || vec!["mixed", "dielectric", "metal"],
            default: "mixed",
        },
        ModelOption {
            key: "scattering",
            summary: "light that meets the facets of the metal once, or also later",
            values: || vec!["single", "multiple"],
            default: "single",
        },
    ];

    fn build(choices: &Choices) -> Self {
        let base = match choices.get("base") {
            "dielectric" => Base::Dielectric,
            "metal" => Base::Metal,
            _ => Base::Mixed,
        };
        Self { base, bounces: choices.get("scattering") == "multiple" }
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let shape = |name, summary, bounds, typical, initial| {
            ParamSpec::shape(name, summary, bounds, typical, initial, Scale::Linear)
        };
        let roughness =
            shape("specular_roughness", "roughness of the surface", (0.01, 1.0), (0.05, 1.0), 0.3)
                .sharper_when(Sharper::Smaller);
        let anisotropy =
            shape("specular_roughness_anisotropy", "anisotropy of the surface", (0.0, 0.99), (0.1, 0.9), 0.0)
                .isotropic_at(0.0)
                .fixed();
        let ior = shape("specular_ior", "refractive index", (1.0, 3.0), (1.1, 2.5), 1.5);
        let body = shape("base_diffuse_roughness", "roughness of the body", (0.0, 1.0), (0.0, 1.0), 0.5);
        let color = ParamSpec::amplitude("base_color", "albedo of the body, f0 of the metal", 1.0, 0.2);
        let metalness = ParamSpec::amplitude("base_metalness", "metal or dielectric", 1.0, 0.1);
        let metalness = ParamSpec { sharing: Sharing::Shared, ..metalness };
        let tint = ParamSpec::amplitude("specular_color", "tint of the surface", 1.0, 1.0);
        match self.base {
            Base::Mixed => vec![roughness, anisotropy, ior.fixed(), body, color, metalness, tint.fixed()],
            Base::Dielectric => vec![roughness, anisotropy, ior, body, color, tint.fixed()],
            Base::Metal => vec![roughness, anisotropy, color, ParamSpec { initial: 0.95, ..tint }],
        }
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        if let Base::Mixed | Base::Dielectric = self.base {
            visitor.part::<Body>(DIFFUSE_ROUGHNESS);
            visitor.part::<Reshaped<Through, FromBelow>>(ROUGHNESS);
            visitor.next_term();
            show_surface(visitor);
            visitor.part::<Reflectance<DielectricIndex>>(IOR);
            visitor.next_term();
        }
        if let Base::Mixed | Base::Metal = self.base {
            show_surface(visitor);
            Fresnel::F82Tint.show(0, visitor);
            if self.bounces {
                visitor.next_term();
                visitor.part::<Reshaped<Bounced, Mean>>(ROUGHNESS);
            }
        }
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; COEFFICIENTS] {
        let (zero, one) = (T::constant(0.0), T::constant(1.0));
        let [color] = amplitudes.take();
        let [metalness] = match self.base {
            Base::Mixed => amplitudes.take(),
            Base::Dielectric => [zero],
            Base::Metal => [one],
        };
        let [tint] = amplitudes.take();
        let dielectric = one - metalness;
        let body = body_coefficients(color).map(|coefficient| dielectric * coefficient);
        let of_facets = Fresnel::F82Tint.coefficients(&mut Values::new(&[color, tint]));
        let [fallen, risen, dip] = of_facets;
        // The means of 1 - (1 - mu)^5, (1 - mu)^5 and mu (1 - mu)^6 over 2 mu dmu.
        let mean = fallen.times(20.0 / 21.0) + risen.times(1.0 / 21.0) + dip.times(1.0 / 126.0);
        let metal = of_facets.into_iter().chain(later_bounces(bounce_nodes(), mean));
        let metal = metal.map(|coefficient| metalness * coefficient);
        // In the order in which they are visited.
        let all = body.into_iter().chain(std::iter::once(dielectric * tint)).chain(metal);
        let absent = if let Base::Metal = self.base { body.len() + 1 } else { 0 };
        let mut visited = all.skip(absent);
        std::array::from_fn(|_| visited.next().unwrap_or(zero))
    }

    fn strength(&self) -> Strength {
        Strength::Missing
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The interpolated b of EON agrees with its formula, for all albedos and roughnesses.
    #[test]
    fn later_bounces_are_those_of_eon() {
        let mut worst = 0.0_f64;
        for albedo in (0..=20).map(|i| 0.05 * f64::from(i)) {
            for r in (0..=40).map(|i| 0.025 * f64::from(i)) {
                let mean: f64 = mean_albedo(r);
                let exact = albedo * albedo * mean / (1.0 - albedo * (1.0 - mean));
                let [_, later @ ..] = body_coefficients(albedo);
                let (_, lagrange) = Body::prepare(Values::new(&[r]));
                let found: f64 = later.iter().zip(lagrange).map(|(a, b)| a * b).sum();
                worst = worst.max((found - exact).abs());
            }
        }
        // The error is largest near albedo 1, where b is 1.
        assert!(worst < 3e-8, "{worst:e}");
    }
}
