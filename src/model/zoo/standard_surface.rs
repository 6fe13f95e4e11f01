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
//! fuzz=conty-kulla, between the dielectric and its body
//!   ON base_color/pi becomes sheen sheen_color Ds/(4 (ci + co - ci co)) + (1 - sheen S) base_color ON/pi
//!   Ds = (1 + p)/pi (1 - (n.h)^2)^p,  p = 1/(2 sheen_roughness)
//!   S  = s1/s2, between 0 and 1, with s = c0 + c1 x + c2 z + c3 x z + c4 x^2 + c5 z^2,  x = co, z = sheen_roughness
//!   s1  13.673  -68.78018  799.08825   -905.00061   60.28956  1086.96473
//!   s2   1       61.57746  442.78211   2597.49308  121.81241  3045.55075
//! coating=clear, on top
//!   f' = coat Vc Fc comp(Fc) + (1 - coat Xc) f,   Vc, Fc and Xc as V, F and X of the dielectric with m = coat_roughness^2, coat_IOR
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
//! | coat | 1 | 0..1 | with `coating=clear` only: strength of the coat, shared |
//! | coat_roughness | 1 | 0.01..1 | with `coating=clear` only: roughness of the coat |
//! | coat_IOR | 1 | 1..3 | with `coating=clear` only: refractive index of the coat; fixed at 1.5 unless freed |
//! | sheen | 1 | 0..1 | with `fuzz=conty-kulla` only: strength of the sheen, shared |
//! | sheen_color | 1 | 0..1 | with `fuzz=conty-kulla` only: tint of the sheen, which does not dim the body; fixed at 1 unless freed |
//! | sheen_roughness | 1 | 0.01..1 | with `fuzz=conty-kulla` only: small leaves a rim of light towards grazing |
//!
//! Autodesk Standard Surface, version 1.0.1 (Georgiev et al. 2019, <https://autodesk.github.io/standard-surface/>). The document
//! leaves the lobes and their layering open in part; these are those of MaterialX, version 1.39.5
//! (<https://github.com/AcademySoftwareFoundation/MaterialX>, Apache-2.0): `libraries/bxdf/standard_surface.mtlx` with the GLSL of
//! `libraries/pbrlib/genglsl`, in whose `lib/mx_microfacet_specular.glsl` the coefficients of A and B stand. comp gives back the light of
//! later bounces (Turquin 2019, Practical Multiple Scattering Compensation for Microfacet Models). The metal's index is that of
//! Gulbrandsen 2014 (Artist Friendly Metallic Fresnel). The shader that MaterialX writes for the node agreed with the reference formula
//! to the digits of its single precision. The parameters have the names of the node's inputs; `base` is a factor of base_color, and
//! `specular` of a metal one of specular_color: enter 1 for both, and `metalness` 0 or 1. The sheen is after Conty Estevez and Kulla 2017
//! (Production Friendly Microfacet Sheen BRDF), with the denominator of Neubelt and Pettineo 2013 and MaterialX' fit of its albedo; it
//! lies below the dielectric, so `sheen` changes nothing in `base=metal`. The coat is white: enter 1 for `coat_color`, and leave
//! `coat_affect_color` and `coat_affect_roughness` at 0.
//!
//! Departures: the lower bounds of the roughness and of a metal's base_color, which MaterialX clamps at r^2 = 1e-8 and 0. This is the
//! base with its specular parameters, and coat and sheen if chosen, without transmission, subsurface, thin film and emission, and without
//! coat_color, coat_anisotropy and a coat's effect on what is below other than dimming it. Metalness strictly between
//! 0 and 1 is left out: base_color would be an amplitude and a shape at once. As in MaterialX, X leaves out the tint of the
//! highlight, so a tinted surface absorbs the rest. Other generators of MaterialX, and Arnold, evaluate other formulas, which agree in
//! the main.
//!
//! Identifiability: one channel determines base_color and specular_IOR with specular fixed; specular and specular_IOR both scale the
//! highlight and are told apart by its rise towards grazing alone. specular_color of a metal acts only towards grazing. coat and coat_IOR
//! both scale the coat's highlight; the coat shows where its roughness differs from that of the surface below. sheen_color and sheen are
//! told apart only by how sheen dims the body.
//!
//! Not reciprocal: A and B depend on the viewer alone; wo is the viewer. Exchanging the directions changes f by a few percent at
//! mid roughness. Finite at grazing. Seen in light from all around, an isotropic surface and a white body together return what they
//! receive within a few percent, as A and B are fits. Lit from one direction near grazing they return more: the body is not dimmed by what
//! the surface reflects of the light on its way in. Nor does G of the mean roughness belong to D of an anisotropic surface: at grazing a strong
//! anisotropy makes the highlight alone return several times what it receives. A coat lets in what X, a fit at the viewer's side, leaves,
//! with the same consequences. A sheen with a roughness of 0.1 and less returns more than it receives near grazing, where S ends at
//! 1: 1.3 times at 0.1, four times at 0.01.

use super::distribution_based::sum_less_product;
use super::gltf::Squared;
use super::oren_nayar::Qualitative;
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::charlie::CharlieDensity;
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
    /// Whether a clear coat lies on top.
    coated: bool,
    /// Whether fibres stand up from the body of a dielectric.
    sheen: bool,
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
/// Index of the first of the shapes that are roughness and index of the coat: both bases have four of their own.
const COAT_ROUGHNESS: usize = 4;

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
    fn at<T: Scalar>(prepared: &Self::Prepared<T>, g: &Geometry<T::Real>) -> [T; 2] {
        [let_through(prepared, g), T::constant(1.0)]
    }
}

impl Part for Below {
    type Kernel = Self;
    const SHAPES: usize = 3;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        prepare_dielectric(shapes)
    }
}

/// 1 - X of the dielectric.
#[inline(always)]
fn let_through<T: Scalar>((albedo, constants): &(Albedo<T>, Constants<T>), g: &Geometry<T::Real>) -> T {
    let [a, b] = albedo.at(g.cos_o());
    let fresnel = index_reflectance(constants, g.cos_d);
    let [f0, _, _] = *constants;
    let reflected = (f0 * a + b) * compensation(fresnel, a + b);
    (-reflected).plus(1.0)
}

/// The fit and the constants of the coat. Its shapes are roughness and index.
fn prepare_coat<T: Scalar>(mut shapes: Values<'_, T>) -> (Albedo<T>, Constants<T>) {
    let [roughness, eta] = shapes.take();
    (Albedo::new(roughness.squared()), index_constants(eta))
}

/// F comp(F) of the coat.
struct CoatFacets;

impl Part for CoatFacets {
    type Kernel = DielectricFacets;
    const SHAPES: usize = 2;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        prepare_coat(shapes)
    }
}

/// 1 - X of the coat.
struct BelowCoat;

impl Kernel for BelowCoat {
    type Prepared<T: Scalar> = (Albedo<T>, Constants<T>);
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(prepared: &Self::Prepared<T>, g: &Geometry<T::Real>) -> [T; 1] {
        [let_through(prepared, g)]
    }
}

impl Part for BelowCoat {
    type Kernel = Self;
    const SHAPES: usize = 2;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        prepare_coat(shapes)
    }
}

/// 1/(4 (ci + co - ci co))
struct SheenVisibility;

impl Kernel for SheenVisibility {
    type Prepared<T: Scalar> = ();
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>((): &(), g: &Geometry<T::Real>) -> [T; 1] {
        let sum: T::Real = sum_less_product(g);
        [T::from_real(sum.times(4.0).recip())]
    }
}

impl Part for SheenVisibility {
    type Kernel = Self;
    const SHAPES: usize = 0;

    fn prepare<T: Scalar>(_: Values<'_, T>) {}
}

/// MaterialX' fit of the albedo of the sheen: the coefficients of 1, x, z, x z, x^2, z^2 in the numerator and in the denominator, x = co,
/// z the roughness.
const SHEEN_FIT: [[f64; 6]; 2] = [
    [13.67300, -68.78018, 799.08825, -905.00061, 60.28956, 1086.96473],
    [1.0, 61.57746, 442.78211, 2597.49308, 121.81241, 3045.55075],
];

/// 1 - S. Its shape is the roughness.
struct BelowSheen;

impl Kernel for BelowSheen {
    /// The coefficients of 1, x and x^2 in both.
    type Prepared<T: Scalar> = [[T; 3]; 2];
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(&[p, q]: &[[T; 3]; 2], g: &Geometry<T::Real>) -> [T; 1] {
        [(-share(p, q, g.cos_o())).plus(1.0)]
    }
}

impl Part for BelowSheen {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [[T; 3]; 2] {
        let [z] = shapes.take();
        SHEEN_FIT.map(|[one, x, by_z, xz, xx, zz]| {
            [z.times(by_z).plus(one) + z.squared().times(zz), z.times(xz).plus(x), T::constant(xx)]
        })
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

/// Number of coefficients: body, body below sheen and sheen below the surface, two each, and the highlight, all below the coat and
/// without; and one of the coat.
const COEFFICIENTS: usize = 2 * (3 * 2 + 1) + 1;

impl StandardSurface {
    /// Whether there is sheen: metals have none.
    fn has_sheen(self) -> bool {
        self.sheen && matches!(self.base, Base::Dielectric)
    }

    /// Index of the shape that is the roughness of the sheen.
    fn sheen_roughness(self) -> usize {
        COAT_ROUGHNESS + if self.coated { 2 } else { 0 }
    }

    /// Passes body, sheen and highlight to `visitor`.
    fn show_base(self, visitor: &mut impl Visitor, below_coat: bool) {
        if let Base::Dielectric = self.base {
            for below_sheen in [false, true].into_iter().filter(|below| self.sheen || !below) {
                visitor.part::<Qualitative>(DIFFUSE_ROUGHNESS);
                visitor.part::<Below>(ROUGHNESS);
                if below_sheen {
                    visitor.part::<BelowSheen>(self.sheen_roughness());
                }
                Self::end_term(visitor, below_coat);
            }
            if self.sheen {
                visitor.part::<CharlieDensity>(self.sheen_roughness());
                visitor.part::<SheenVisibility>(0);
                visitor.part::<Below>(ROUGHNESS);
                Self::end_term(visitor, below_coat);
            }
        }
        visitor.part::<Reshaped<Density<Ggx<Anisotropic>>, Surface>>(ROUGHNESS);
        visitor.part::<Reshaped<<Smith as Shadows>::Visibility<Ggx<Isotropic>>, Mean>>(ROUGHNESS);
        match self.base {
            Base::Dielectric => visitor.part::<DielectricFacets>(ROUGHNESS),
            Base::Metal => visitor.part::<MetalFacets>(ROUGHNESS),
        }
        Self::end_term(visitor, below_coat);
    }

    /// Ends a product, dimmed by the coat or not.
    fn end_term(visitor: &mut impl Visitor, below_coat: bool) {
        if below_coat {
            visitor.part::<BelowCoat>(COAT_ROUGHNESS);
        }
        visitor.next_term();
    }
}

impl Model for StandardSurface {
    type Coefficients<T: Scalar> = [T; COEFFICIENTS];

    const NAME: &'static str = "standard-surface";
    const SUMMARY: &'static str = "Autodesk Standard Surface, opaque, as in MaterialX";
    const REFERENCE: &'static str = "Autodesk Standard Surface 1.0.1, https://autodesk.github.io/standard-surface/, as evaluated by \
        MaterialX 1.39.5, https://github.com/AcademySoftwareFoundation/MaterialX";
    const OPTIONS: &'static [ModelOption] = &[
        ModelOption {
            key: "base",
            summary: "a diffuse body under a dielectric, or a metal",
            values: || vec!["dielectric", "metal"],
            default: "dielectric",
        },
        ModelOption {
            key: "coating",
            summary: "nothing on top, or a clear coat",
            values: || vec!["none", "clear"],
            default: "none",
        },
        ModelOption {
            key: "fuzz",
            summary: "no fibres, or those of cloth, on the body of a dielectric",
            values: || vec!["none", "conty-kulla"],
            default: "none",
        },
    ];
    const RECIPROCAL: bool = false;

    fn build(choices: &Choices) -> Self {
        Self {
            base: match choices.get("base") {
                "metal" => Base::Metal,
                _ => Base::Dielectric,
            },
            coated: choices.get("coating") == "clear",
            sheen: choices.get("fuzz") == "conty-kulla",
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
        let shared = |name, summary, initial| {
            let spec = ParamSpec::amplitude(name, summary, 1.0, initial);
            ParamSpec { sharing: Sharing::Shared, ..spec }
        };
        let has_sheen = self.has_sheen();
        let mut all = match self.base {
            Base::Dielectric => vec![
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
            ],
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
        };
        if self.coated {
            let (roughness, index) = ("roughness of the coat", "refractive index of the coat");
            all.push(shape("coat_roughness", roughness, (0.01, 1.0), (0.05, 1.0), 0.1, Scale::Linear));
            all.push(shape("coat_IOR", index, (1.0, 3.0), (1.1, 2.5), 1.5, Scale::Linear).fixed());
        }
        if has_sheen {
            let roughness = "roughness of the sheen";
            all.push(shape("sheen_roughness", roughness, (0.01, 1.0), (0.1, 1.0), 0.3, Scale::Linear));
        }
        if let Base::Dielectric = self.base {
            all.extend([
                ParamSpec::amplitude("base_color", "albedo of the body", 1.0, 0.2),
                shared("specular", "strength of the highlight", 1.0).fixed(),
                ParamSpec::amplitude("specular_color", "tint of the highlight", 1.0, 1.0).fixed(),
            ]);
        }
        if self.coated {
            all.push(shared("coat", "strength of the coat", 0.5));
        }
        if has_sheen {
            all.push(shared("sheen", "strength of the sheen", 0.3));
            all.push(ParamSpec::amplitude("sheen_color", "tint of the sheen", 1.0, 1.0).fixed());
        }
        all
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        self.show_base(visitor, false);
        if self.coated {
            self.show_base(visitor, true);
            visitor.part::<Reshaped<Density<Ggx<Isotropic>>, Squared>>(COAT_ROUGHNESS);
            visitor.part::<Reshaped<<Smith as Shadows>::Visibility<Ggx<Isotropic>>, Squared>>(COAT_ROUGHNESS);
            visitor.part::<CoatFacets>(COAT_ROUGHNESS);
        }
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; COEFFICIENTS] {
        let (zero, one) = (T::constant(0.0), T::constant(1.0));
        let [base, specular, tint] = match self.base {
            Base::Dielectric => amplitudes.take(),
            Base::Metal => [zero, one, one],
        };
        let [coat] = if self.coated { amplitudes.take() } else { [zero] };
        let [sheen, sheen_color] = if self.has_sheen() { amplitudes.take() } else { [zero, one] };
        let mut below = Vec::with_capacity(COEFFICIENTS);
        if let Base::Dielectric = self.base {
            // 1 - specular X is this times 1 - X, and times 1.
            let through = |amount: T| [amount * specular, amount * (one - specular)];
            if self.sheen {
                below.extend(through(base * (one - sheen)));
                below.extend(through(base * sheen));
                below.extend(through(sheen * sheen_color));
            } else {
                below.extend(through(base));
            }
        }
        below.push(specular * tint);
        // 1 - coat Xc is this times 1, and times 1 - Xc.
        let through_coat = if self.coated { vec![one - coat, coat] } else { vec![one] };
        let dimmed = through_coat.iter().flat_map(|coat| below.iter().map(|amount| *amount * *coat));
        let mut visited = dimmed.chain(std::iter::once(coat));
        std::array::from_fn(|_| visited.next().unwrap_or(zero))
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
