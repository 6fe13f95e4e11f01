//! Autodesk Standard Surface: a rough diffuse body under a rough dielectric surface, or a metal, as MaterialX evaluates it.
//!
//! With s2 = diffuse_roughness^2, r = specular_roughness, F the reflectance of a facet at wi.h:
//!
//! ```text
//! base=dielectric
//!   f  = specular specular_color V F comp(F) + (1 - specular X) base_color ON/pi
//!   F    dielectric with eta = specular_IOR;   X = (F0 A + B) comp(F),  F0 = ((eta - 1)/(eta + 1))^2
//!   ON   pi times oren-nayar(variant=qualitative) of albedo 1, with sigma = diffuse_roughness in radians
//! base=metal
//!   f  = V F comp(F)
//!   F    conductor with eta = (1 - e) (1 + q)/(1 - q) + e (1 - c)/(1 + c),  k^2 = ((eta + 1)^2 c - (eta - 1)^2)/(1 - c),
//!        c = base_color, e = specular_color, q = sqrt(c)
//! V  = D G/(4 ci co):  D = ggx-anisotropic with mx = min(r^2/a, 1), my = r^2 a, a = sqrt(1 - specular_anisotropy);
//!      G = smith of ggx with m = sqrt(mx my)
//! comp(F) = 1 + F (1 - A - B)/(A + B):  A, B of (co, m), the albedo of V is F0 A + B for Schlick's F
//! A  = p1/p3, B = p2/p4, each between 0 and 1, with p = c0 + c1 x + c2 y + c3 x y + c4 x^2 + c5 y^2 + c6 x^2 y + c7 x y^2 + c8 x^2 y^2,
//!      x = co, y = m
//!   p1   0.1003  -0.6303   9.748   -2.038   29.34   -8.245   -26.44    19.99    -5.448
//!   p2   0.9345  -2.323    2.229   -3.748    1.424  -0.7684    1.436    0.2913   0.6286
//!   p3   1       -1.765    8.263   11.53    28.96   -7.507   -36.11    15.86    33.37
//!   p4   1        0.2281  15.94   -55.83    13.08   41.26     54.9    300.2   -285.1
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | specular_roughness | 1 | 0.01..1 | r; r^2 is the m of other models, r = sqrt(m) |
//! | specular_anisotropy | 1 | 0..0.98 | widens the highlight along x and narrows it along y; fixed at 0 unless freed |
//! | specular_IOR | 1 | 1..3 | refractive index of the dielectric, the same for all channels |
//! | diffuse_roughness | 1 | 0..1 | roughness of the body; 0 is Lambert, from which data cannot distinguish a small value |
//! | base_color | 1 | 0..1 | albedo of the body; in `base=metal` a shape, the reflectance of the metal at normal incidence, 1e-4..0.99 |
//! | specular | 1 | 0..1 | strength of the dielectric's highlight, shared; fixed at 1 unless freed |
//! | specular_color | 1 | 0..1 | tint of the dielectric's highlight, fixed at 1 unless freed; in `base=metal` a shape that sets the colour towards grazing |
//!
//! Autodesk Standard Surface, version 1.0.1 (Georgiev et al. 2019, <https://autodesk.github.io/standard-surface/>). The document
//! leaves the lobes and their layering open in part; these are those of MaterialX, version 1.39.5
//! (<https://github.com/AcademySoftwareFoundation/MaterialX>, Apache-2.0): `libraries/bxdf/standard_surface.mtlx` with the GLSL of
//! `libraries/pbrlib/genglsl`, in whose `lib/mx_microfacet_specular.glsl` the coefficients of A and B stand. comp gives back the light of
//! later bounces (Turquin 2019, Practical Multiple Scattering Compensation for Microfacet Models). The metal's index is that of
//! Gulbrandsen 2014 (Artist Friendly Metallic Fresnel). The shader that MaterialX writes for the node agreed with the reference formula
//! to the digits of its single precision. The parameters have the names of the node's inputs; `base` is a factor of base_color, and
//! `specular` of a metal one of specular_color: enter 1 for both, and `metalness` 0 or 1.
//!
//! Departures: the lower bounds of the roughness and of a metal's base_color, which MaterialX clamps at r^2 = 1e-8 and 0. This is the
//! base with its specular parameters, without coat, sheen, transmission, subsurface, thin film and emission. Metalness strictly between
//! 0 and 1 is left out: base_color would be an amplitude and a shape at once. As in MaterialX, X leaves out the tint of the
//! highlight, so a tinted surface absorbs the rest. Other generators of MaterialX, and Arnold, evaluate other formulas, which agree in
//! the main.
//!
//! Identifiability: one channel determines base_color and specular_IOR with specular fixed; specular and specular_IOR both scale the
//! highlight and are told apart by its rise towards grazing alone. specular_color of a metal acts only towards grazing.
//!
//! Not reciprocal: A and B depend on the viewer alone; wo is the viewer. Exchanging the directions changes f by a few percent at
//! mid roughness. Finite at grazing. Seen in light from all around, an isotropic surface and a white body together return what they
//! receive within a few percent, as A and B are fits. Lit from one direction near grazing they return more: the body is not dimmed by what
//! the surface reflects of the light on its way in. Nor does G of the mean roughness belong to D of an anisotropic surface: at grazing a strong
//! anisotropy makes the highlight alone return several times what it receives.

use super::oren_nayar::Qualitative;
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::distribution::{Anisotropic, Density, Ggx, Isotropic, Shadows};
use crate::model::parts::fresnel::{
    Conductor, Constants, FresnelReflectance, conductor_constants, index_constants, index_reflectance,
};
use crate::model::parts::shadowing::Smith;
use crate::model::{
    Choices, Kernel, Model, ModelOption, ParamSpec, Part, PreparedBy, Reshape, Reshaped, Scale, Sharing,
    Sharper, Strength, Values, Visitor,
};

/// Autodesk Standard Surface.
#[derive(Clone, Copy, Debug)]
pub struct StandardSurface {
    base: Base,
}

#[derive(Clone, Copy, Debug)]
enum Base {
    /// Metalness 0.
    Dielectric,
    /// Metalness 1.
    Metal,
}

/// Index of the first of the shapes that hold the surface's roughness and anisotropy.
const ROUGHNESS: usize = 0;
/// Index of the shape that is the body's roughness.
const DIFFUSE_ROUGHNESS: usize = 3;

/// mx and my of the surface.
struct Surface;

impl Reshape for Surface {
    const SHAPES: usize = 2;

    fn reshape<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [roughness, anisotropy] = shapes.take();
        let aspect = (-anisotropy).plus(1.0).sqrt();
        let m = roughness.squared();
        let (mx, one) = (m / aspect, T::constant(1.0));
        [T::if_less(mx.value(), one.value(), mx, one), m * aspect]
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

/// MaterialX' fit of the albedo of ggx with smith: the coefficients of 1, x, y, x y, x^2, y^2, x^2 y, x y^2, x^2 y^2 in the numerators
/// of A and B and in their denominators, x = co, y = m.
const FIT: [[f64; 9]; 4] = [
    [0.1003, -0.6303, 9.748, -2.038, 29.34, -8.245, -26.44, 19.99, -5.448],
    [0.9345, -2.323, 2.229, -3.748, 1.424, -0.7684, 1.436, 0.2913, 0.6286],
    [1.0, -1.765, 8.263, 11.53, 28.96, -7.507, -36.11, 15.86, 33.37],
    [1.0, 0.2281, 15.94, -55.83, 13.08, 41.26, 54.9, 300.2, -285.1],
];

/// The fit at one roughness: the coefficients of 1, x and x^2 in each polynomial.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Albedo<T>([[T; 3]; 4]);

impl<T: Scalar> Albedo<T> {
    fn new(m: T) -> Self {
        let m2 = m.squared();
        let of = |one: f64, first: f64, second: f64| m.times(first).plus(one) + m2.times(second);
        Self(FIT.map(|[one, x, y, xy, xx, yy, xxy, xyy, xxyy]| {
            [of(one, y, yy), of(x, xy, xyy), of(xx, xxy, xxyy)]
        }))
    }

    /// A and B.
    #[inline(always)]
    fn at(&self, cos: T::Real) -> [T; 2] {
        let [p1, p2, p3, p4] = self.0;
        [share(p1, p3, cos), share(p2, p4, cos)]
    }
}

/// The quotient of two polynomials, between 0 and 1.
#[inline(always)]
fn share<T: Scalar>(p: [T; 3], q: [T; 3], x: T::Real) -> T {
    let (zero, one) = (T::constant(0.0), T::constant(1.0));
    let value = polynomial(p, x) / polynomial(q, x);
    let value = T::if_less(value.value(), one.value(), value, one);
    T::if_less(zero.value(), value.value(), value, zero)
}

#[inline(always)]
fn polynomial<T: Scalar>([a, b, c]: [T; 3], x: T::Real) -> T {
    (c * x + b) * x + a
}

/// comp(F), given A + B.
#[inline(always)]
fn compensation<T: Scalar>(fresnel: T, albedo: T) -> T {
    fresnel * ((-albedo).plus(1.0) / albedo) + T::constant(1.0)
}

/// F comp(F) of the dielectric. Its shapes are roughness, anisotropy and index.
struct DielectricFacets;

/// 1 - X, and 1. Its shapes are the same.
struct Below;

/// The fit and the dielectric's constants.
fn prepare_dielectric<T: Scalar>(mut shapes: Values<'_, T>) -> (Albedo<T>, Constants<T>) {
    let [m, _] = Mean::reshape(shapes.clone());
    let [_, _, eta] = shapes.take();
    (Albedo::new(m), index_constants(eta))
}

impl Kernel for DielectricFacets {
    type Prepared<T: Scalar> = (Albedo<T>, Constants<T>);
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>((albedo, constants): &Self::Prepared<T>, g: &Geometry<T::Real>) -> [T; 1] {
        let [a, b] = albedo.at(g.cos_o());
        let fresnel = index_reflectance(constants, g.cos_d);
        [fresnel * compensation(fresnel, a + b)]
    }
}

impl Part for DielectricFacets {
    type Kernel = Self;
    const SHAPES: usize = 3;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        prepare_dielectric(shapes)
    }
}

impl Kernel for Below {
    const FUNCTIONS: usize = 2;
    type Prepared<T: Scalar> = (Albedo<T>, Constants<T>);
    type Output<T: Scalar> = [T; 2];

    #[inline(always)]
    fn at<T: Scalar>((albedo, constants): &Self::Prepared<T>, g: &Geometry<T::Real>) -> [T; 2] {
        let [a, b] = albedo.at(g.cos_o());
        let fresnel = index_reflectance(constants, g.cos_d);
        let [f0, _, _] = *constants;
        let reflected = (f0 * a + b) * compensation(fresnel, a + b);
        [(-reflected).plus(1.0), T::constant(1.0)]
    }
}

impl Part for Below {
    type Kernel = Self;
    const SHAPES: usize = 3;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        prepare_dielectric(shapes)
    }
}

/// F comp(F) of the metal. Its shapes are roughness, anisotropy, reflectance and edge colour.
struct MetalFacets;

impl Kernel for MetalFacets {
    type Prepared<T: Scalar> = (Albedo<T>, Constants<T>);
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>((albedo, constants): &Self::Prepared<T>, g: &Geometry<T::Real>) -> [T; 1] {
        let [a, b] = albedo.at(g.cos_o());
        let [fresnel, _, _] = Conductor::factors(constants, g.cos_d, g.one_less_cos_d);
        [fresnel * compensation(fresnel, a + b)]
    }
}

impl Part for MetalFacets {
    type Kernel = Self;
    const SHAPES: usize = 4;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        let [m, _] = Mean::reshape(shapes.clone());
        let [_, _, reflectance, edge] = shapes.take();
        let (excess, k2) = artistic_index(reflectance, edge);
        (Albedo::new(m), conductor_constants(excess, k2))
    }
}

/// eta - 1 and k^2 of the metal with this reflectance and edge colour.
///
/// The printed k^2 cancels where the edge colour is small. With q the root of the reflectance c, largest eta n = (1 + q)/(1 - q) and
/// smallest l = (1 - c)/(1 + c), it is (n - eta)(eta - 1/n), and n - eta = e (n - l); both factors are written as sums of positive terms.
fn artistic_index<T: Scalar>(c: T, e: T) -> (T, T) {
    let q = c.sqrt();
    let (less, more) = ((-q).plus(1.0), q.plus(1.0));
    let sum = c.plus(1.0);
    let rest = (-e).plus(1.0);
    let twice = q.times(2.0);
    // (1 - e)(n - 1) + e (l - 1)
    let excess = rest * twice / less - e * c.times(2.0) / sum;
    let below = e * twice * more / (less * sum);
    // (1 - e)(n - 1/n) + e (l - 1/n)
    let above = rest * twice.times(2.0) / (less * more) + e * twice * less / (sum * more);
    (excess, below * above)
}

impl Model for StandardSurface {
    type Coefficients<T: Scalar> = [T; 3];

    const NAME: &'static str = "standard-surface";
    const SUMMARY: &'static str = "base and specular of Autodesk Standard Surface, as in MaterialX";
    const REFERENCE: &'static str = "Autodesk Standard Surface 1.0.1, https://autodesk.github.io/standard-surface/, as evaluated by \
        MaterialX 1.39.5, https://github.com/AcademySoftwareFoundation/MaterialX";
    const OPTIONS: &'static [ModelOption] = &[ModelOption {
        key: "base",
        summary: "a diffuse body under a dielectric, or a metal",
        values: || vec!["dielectric", "metal"],
        default: "dielectric",
    }];
    const RECIPROCAL: bool = false;

    fn build(choices: &Choices) -> Self {
        Self {
            base: match choices.get("base") {
                "metal" => Base::Metal,
                _ => Base::Dielectric,
            },
        }
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let shape = |name, summary, bounds, typical, initial, scale| {
            ParamSpec::shape(name, summary, bounds, typical, initial, scale)
        };
        let roughness = ("specular_roughness", "roughness of the surface");
        let roughness = shape(roughness.0, roughness.1, (0.01, 1.0), (0.05, 1.0), 0.3, Scale::Linear)
            .sharper_when(Sharper::Smaller);
        let anisotropy = ("specular_anisotropy", "anisotropy of the surface");
        let anisotropy = shape(anisotropy.0, anisotropy.1, (0.0, 0.98), (0.1, 0.9), 0.0, Scale::Linear)
            .isotropic_at(0.0)
            .fixed();
        match self.base {
            Base::Dielectric => {
                let specular = ParamSpec::amplitude("specular", "strength of the highlight", 1.0, 1.0);
                vec![
                    roughness,
                    anisotropy,
                    shape("specular_IOR", "refractive index", (1.0, 3.0), (1.1, 2.5), 1.5, Scale::Linear),
                    // It enters as its square.
                    shape(
                        "diffuse_roughness",
                        "roughness of the body",
                        (0.0, 1.0),
                        (0.1, 1.0),
                        0.3,
                        Scale::Square,
                    ),
                    ParamSpec::amplitude("base_color", "albedo of the body", 1.0, 0.2),
                    ParamSpec { sharing: Sharing::Shared, ..specular }.fixed(),
                    ParamSpec::amplitude("specular_color", "tint of the highlight", 1.0, 1.0).fixed(),
                ]
            }
            Base::Metal => {
                let color = ("base_color", "reflectance at normal incidence");
                let edge = ("specular_color", "colour towards grazing");
                vec![
                    roughness,
                    anisotropy,
                    shape(color.0, color.1, (1e-4, 0.99), (0.2, 0.95), 0.7, Scale::Linear).per_channel(),
                    shape(edge.0, edge.1, (0.0, 1.0), (0.1, 0.9), 0.5, Scale::Linear).per_channel(),
                ]
            }
        }
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        if let Base::Dielectric = self.base {
            visitor.part::<Qualitative>(DIFFUSE_ROUGHNESS);
            visitor.part::<Below>(ROUGHNESS);
            visitor.next_term();
        }
        visitor.part::<Reshaped<Density<Ggx<Anisotropic>>, Surface>>(ROUGHNESS);
        visitor.part::<Reshaped<<Smith as Shadows>::Visibility<Ggx<Isotropic>>, Mean>>(ROUGHNESS);
        match self.base {
            Base::Dielectric => visitor.part::<DielectricFacets>(ROUGHNESS),
            Base::Metal => visitor.part::<MetalFacets>(ROUGHNESS),
        }
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 3] {
        let (zero, one) = (T::constant(0.0), T::constant(1.0));
        match self.base {
            Base::Dielectric => {
                let [base, specular, tint] = amplitudes.take();
                [base * specular, base * (one - specular), specular * tint]
            }
            Base::Metal => [one, zero, zero],
        }
    }

    fn strength(&self) -> Strength {
        Strength::Missing
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Gulbrandsen's printed formula, where it keeps its digits.
    #[test]
    fn artistic_index_is_as_printed() {
        for (c, e) in [(0.9_f64, 0.5), (0.5, 0.9), (0.1, 0.3), (0.99, 1.0), (0.04, 0.7)] {
            let (excess, k2) = artistic_index(c, e);
            let eta = (1.0 - e) * (1.0 + c.sqrt()) / (1.0 - c.sqrt()) + e * (1.0 - c) / (1.0 + c);
            assert_relative_eq!(excess + 1.0, eta, max_relative = 1e-13);
            let printed = ((eta + 1.0).powi(2) * c - (eta - 1.0).powi(2)) / (1.0 - c);
            assert_relative_eq!(k2, printed, max_relative = 1e-10);
        }
    }
}
