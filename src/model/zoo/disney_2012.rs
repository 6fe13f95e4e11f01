//! Disney's "principled" model of 2012: diffuse and subsurface light, sheen, an anisotropic highlight and a clear coat.
//!
//! With s = (1 - wi.h)^5, L = (1 - ci)^5, V = (1 - co)^5, r the roughness:
//!
//! ```text
//! f  = (1 - metallic) (base/pi ((1 - subsurface) Fd + subsurface S) + sheen s)
//!    + Ds Gs (F0 (1 - s) + s) + clearcoat/4 Dc Gc (0.04 (1 - s) + s)
//! Fd = (1 + (F90 - 1) L)(1 + (F90 - 1) V),       F90 = 1/2 + 2 r (wi.h)^2
//! S  = 1.25 (Fss (1/(ci + co) - 1/2) + 1/2),      Fss = (1 + (r (wi.h)^2 - 1) L)(1 + (r (wi.h)^2 - 1) V)
//! F0 = 0.08 specular (1 - metallic) + base metallic
//! Ds = ggx-anisotropic, mx = r^2/a, my = r^2 a, a = sqrt(1 - 0.9 anisotropic)
//! Gs = smith-uncorrelated over 4 ci co: of Ds with g=revised, of ggx with m = (1/2 + r/2)^2 with g=original
//! Dc = gtr with gamma = 1, m = 0.1 - 0.099 clearcoat_gloss;   Gc = smith-uncorrelated of ggx with m = 0.25, over 4 ci co
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | base | 1 | 0..1 | base colour |
//! | metallic | 1 | 0..1 | 0 dielectric over a diffuse base, 1 metal; shared by the channels |
//! | specular | 1 | 0..1 | 0.5 is F0 = 0.04; fixed at 0.5 unless freed |
//! | subsurface, sheen, clearcoat | 1 | 0..1 | shared; fixed at 0 unless freed |
//! | roughness | 1 | 0.032..1 | its square is the highlight's m |
//! | anisotropic | 1 | 0..1 | fixed at 0 unless freed |
//! | clearcoat_gloss | 1 | 0..1 | fixed at 1 unless freed; has no effect without a coat |
//!
//! Burley 2012, Physically Based Shading at Disney, SIGGRAPH 2012 course notes, and the code of Disney's BRDF Explorer where
//! the notes are incomplete: there G is divided by 4 ci co for both lobes, and the 1/4 of the coat is an additional factor. The notes
//! widen the roughness for Gs, `g=original`, which darkened the highlight at grazing. Their author withdrew this (addendum to the
//! notes; the Explorer's code since 2017, src/brdfs/disney.brdf): the highlight is shadowed as its own facets are, `g=revised`. At roughness 0.2 the two differ by a quarter.
//!
//! Departures: the tints of specular and sheen mix the channels and are left out (0). The lower bound of roughness replaces
//! the code's floor of 0.001 under mx and my. A single channel does not determine base, metallic and specular together:
//! with specular fixed, the diffuse strength and F0 determine the other two. Reciprocal. Not energy conserving for rough
//! surfaces at grazing, since its diffuse lobe is not, and since coat and sheen are simply added.

use super::disney_diffuse::DisneyDiffuse;
use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::parts::distribution::{Anisotropic, Density, Ggx, Gtr, Isotropic, Shadows};
use crate::model::parts::fresnel::{FresnelReflectance, Reflectance, Schlick};
use crate::model::parts::shadowing::SmithUncorrelated;
use crate::model::{
    Choices, Kernel, Model, ModelOption, ParamSpec, Part, Reshape, Reshaped, Scale, Sharing, Sharper,
    Strength, Values, Visitor,
};
use std::f64::consts::FRAC_1_PI;

/// Disney's principled model.
#[derive(Clone, Copy, Debug)]
pub struct Disney2012 {
    shadowing: HighlightShadowing,
}

/// The shadowing of the highlight.
#[derive(Clone, Copy, Debug)]
enum HighlightShadowing {
    /// That of its own facets.
    Revised,
    /// That of rougher ones.
    Original,
}

/// Index of the first of the shapes that hold the highlight's roughness and anisotropy.
const ROUGHNESS: usize = 0;
/// Index of the shape of the coat.
const CLEARCOAT_GLOSS: usize = 2;

/// mx and my of the highlight.
struct Highlight;

impl Reshape for Highlight {
    const SHAPES: usize = 2;

    fn reshape<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [roughness, anisotropic] = shapes.take();
        let aspect = (-anisotropic.times(0.9)).plus(1.0).sqrt();
        let m = roughness.squared();
        [m / aspect, m * aspect]
    }
}

/// m of the highlight's shadowing in the notes of 2012.
struct Widened;

impl Reshape for Widened {
    const SHAPES: usize = 1;

    fn reshape<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [roughness] = shapes.take();
        [roughness.times(0.5).plus(0.5).squared(), T::constant(0.0)]
    }
}

/// m and gamma of the coat.
pub(super) struct Coat;

impl Reshape for Coat {
    const SHAPES: usize = 1;

    fn reshape<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [gloss] = shapes.take();
        [(-gloss.times(0.099)).plus(0.1), T::constant(1.0)]
    }
}

/// m of the coat's shadowing.
struct CoatShadowing;

impl Reshape for CoatShadowing {
    const SHAPES: usize = 0;

    fn reshape<T: Scalar>(_: Values<'_, T>) -> [T; 2] {
        [T::constant(0.25), T::constant(0.0)]
    }
}

/// The shadowing of facets that are the same in all directions.
type Visibility = <SmithUncorrelated as Shadows>::Visibility<Ggx<Isotropic>>;
/// The shadowing of facets that are not.
type AnisotropicVisibility = <SmithUncorrelated as Shadows>::Visibility<Ggx<Anisotropic>>;

/// S/pi.
pub(super) struct Subsurface;

impl Kernel for Subsurface {
    type Prepared<T: Scalar> = T;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(r: &T, g: &Geometry<T::Real>) -> [T; 1] {
        let cos2: T::Real = g.cos_d * g.cos_d;
        let x: T = *r * cos2;
        let fss: T = towards_grazing(x, g.cos_i()) * towards_grazing(x, g.cos_o());
        let spread: T::Real = (g.cos_i() + g.cos_o()).recip().plus(-0.5);
        [(fss * spread).plus(0.5).times(1.25 * FRAC_1_PI)]
    }
}

/// 1 + (x - 1) L with L = (1 - cos)^5, computed as x L + (1 - L), since L is close to 1 towards grazing.
#[inline(always)]
fn towards_grazing<T: Scalar>(x: T, cos: T::Real) -> T {
    let [fallen, risen, _] = Schlick::factors::<T::Real>(&[T::Real::literal(0.0); 3], cos, (-cos).plus(1.0));
    x * risen + fallen
}

impl Part for Subsurface {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> T {
        let [r] = shapes.take();
        r
    }
}

/// (1 - wi.h)^5
pub(super) struct Sheen;

impl Kernel for Sheen {
    const SHARED_ON_RINGS: bool = true;
    type Prepared<T: Scalar> = ();
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>((): &(), g: &Geometry<T::Real>) -> [T; 1] {
        [T::from_real(g.one_less_cos_d.fifth_power())]
    }
}

impl Part for Sheen {
    type Kernel = Self;
    const SHAPES: usize = 0;

    fn prepare<T: Scalar>(_: Values<'_, T>) {}
}

impl Model for Disney2012 {
    type Coefficients<T: Scalar> = [T; 7];

    const NAME: &'static str = "disney-2012";
    const SUMMARY: &'static str = "Disney's principled model of 2012";
    const REFERENCE: &'static str =
        "Burley 2012, Physically Based Shading at Disney, SIGGRAPH 2012 course notes, with its addendum";
    const OPTIONS: &'static [ModelOption] = &[ModelOption {
        key: "g",
        summary: "shadowing of the highlight, as revised, or as first published",
        values: || vec!["revised", "original"],
        default: "revised",
    }];

    fn build(choices: &Choices) -> Self {
        Self {
            shadowing: match choices.get("g") {
                "original" => HighlightShadowing::Original,
                _ => HighlightShadowing::Revised,
            },
        }
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let shape = |name, summary, bounds, initial| {
            ParamSpec::shape(name, summary, bounds, (0.1, 1.0), initial, Scale::Linear)
        };
        let shared = |name, summary, initial| {
            let spec = ParamSpec::amplitude(name, summary, 1.0, initial);
            ParamSpec { sharing: Sharing::Shared, ..spec }
        };
        vec![
            shape("roughness", "roughness", (0.032, 1.0), 0.4).sharper_when(Sharper::Smaller),
            shape("anisotropic", "anisotropy of the highlight", (0.0, 1.0), 0.0).isotropic_at(0.0).fixed(),
            shape("clearcoat_gloss", "gloss of the coat", (0.0, 1.0), 1.0).fixed(),
            ParamSpec::amplitude("base", "base colour", 1.0, 0.2),
            shared("metallic", "metal or dielectric", 0.1),
            shared("specular", "strength of a dielectric's highlight", 0.5).fixed(),
            shared("subsurface", "share of the flatter diffuse lobe", 0.0).fixed(),
            shared("sheen", "light of fibres at grazing", 0.0).fixed(),
            shared("clearcoat", "strength of the coat", 0.0).fixed(),
        ]
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        visitor.part::<DisneyDiffuse>(ROUGHNESS);
        visitor.next_term();
        visitor.part::<Subsurface>(ROUGHNESS);
        visitor.next_term();
        visitor.part::<Sheen>(0);
        visitor.next_term();
        visitor.part::<Reshaped<Density<Ggx<Anisotropic>>, Highlight>>(ROUGHNESS);
        match self.shadowing {
            HighlightShadowing::Revised => {
                visitor.part::<Reshaped<AnisotropicVisibility, Highlight>>(ROUGHNESS);
            }
            HighlightShadowing::Original => visitor.part::<Reshaped<Visibility, Widened>>(ROUGHNESS),
        }
        visitor.part::<Reflectance<Schlick>>(0);
        visitor.next_term();
        visitor.part::<Reshaped<Density<Gtr>, Coat>>(CLEARCOAT_GLOSS);
        visitor.part::<Reshaped<Visibility, CoatShadowing>>(0);
        visitor.part::<Reflectance<Schlick>>(0);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 7] {
        let [base, metallic, specular, subsurface, sheen, clearcoat] = amplitudes.take();
        let one = T::constant(1.0);
        let dielectric = one - metallic;
        let diffuse = dielectric * base;
        // The shadowing of both lobes includes the 1/4 of the half vector; the coat has another 1/4.
        let coat = clearcoat.times(0.25);
        [
            diffuse * (one - subsurface),
            diffuse * subsurface,
            dielectric * sheen,
            (dielectric * specular).times(0.08) + metallic * base,
            one,
            coat.times(0.04),
            coat,
        ]
    }

    fn strength(&self) -> Strength {
        Strength::Missing
    }
}
