//! Mitsuba 3's `principled`: Disney's model of 2012 with an exact dielectric highlight, as that renderer evaluates it.
//!
//! With s = (1 - wi.h)^5, L = (1 - ci)^5, V = (1 - co)^5, r the roughness, M = metallic:
//!
//! ```text
//! f  = (1 - M) (base_color ((1 - flatness) Fd + flatness S)/pi + sheen s)
//!    + Ds Gs ((1 - M) F + M (base_color (1 - s) + s)) + clearcoat/4 Dc Gc (0.04 (1 - s) + s)
//! F  = dielectric with f0 = 0.08 specular, that is eta = 2/(1 - sqrt(0.08 specular)) - 1
//! Fd = (1 + (F90 - 1) L)(1 + (F90 - 1) V),       F90 = 1/2 + 2 r (wi.h)^2
//! S  = 1.25 (Fss (1/(ci + co) - 1/2) + 1/2),      Fss = (1 + (r (wi.h)^2 - 1) L)(1 + (r (wi.h)^2 - 1) V)
//! Ds = ggx-anisotropic, mx = max(r^2/a, 0.001), my = max(r^2 a, 0.001), a = sqrt(1 - 0.9 anisotropic)
//! Gs = smith-uncorrelated of Ds, over 4 ci co
//! Dc = gtr with gamma = 1, m = 0.1 - 0.099 clearcoat_gloss;   Gc = smith-uncorrelated of ggx with m = 0.25, not over 4 ci co
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | roughness | 1 | 0.032..1 | its square is the highlight's m; r of the diffuse lobes, too |
//! | anisotropic | 1 | 0..1 | widens the highlight along x and narrows it along y; fixed at 0 unless freed |
//! | specular | 1 | 0.001..1 | 0.5 is F0 = 0.04; the same for all channels, fixed at 0.5 unless freed |
//! | clearcoat_gloss | 1 | 0..1 | fixed at 0 unless freed; has no effect without a coat |
//! | base_color | 1 | 0..1 | base colour: albedo of the body, f0 of the metal |
//! | metallic | 1 | 0..1 | 0 dielectric over a diffuse base, 1 metal; shared by the channels |
//! | flatness | 1 | 0..1 | share of the flatter diffuse lobe; shared, fixed at 0 unless freed |
//! | sheen | 1 | 0..1 | light of fibres at grazing; shared, fixed at 0 unless freed |
//! | clearcoat | 1 | 0..1 | strength of the coat; shared, fixed at 0 unless freed |
//!
//! Mitsuba 3, version 3.9.1, `src/bsdfs/principled.cpp` and `principledhelpers.h` (<https://github.com/mitsuba-renderer/mitsuba3>), after
//! Burley 2012 and 2015. The parameters have the plugin's names, so that fitted values can be entered into a scene. In three thousand
//! pairs of directions with random parameters the renderer's own values agreed with the reference values of this model to the digits of its
//! single precision.
//!
//! What differs from `disney-2012`: the dielectric's F is exact rather than Schlick's, so `specular` is a shape; the metal takes its full
//! base_color as f0; the coat's G is not divided by 4 ci co, so the coat is up to four times as bright along the normal and vanishes at
//! grazing; the highlight's shadowing is always that of its own facets.
//!
//! Departures: `spec_tint` and `sheen_tint` mix the channels and are left out (0), as is transmission (`spec_trans` = 0). `specular` stays
//! above 0: at exactly 0 the renderer switches off the whole main highlight, also the metal's. Do not write 0 into a scene. The plugin
//! reflects from one side; put it into `twosided` for surfaces that are seen from both.
//!
//! Identifiability: as for `disney-2012`, one channel gives a diffuse strength and a reflectance at normal incidence, which determine
//! base_color and metallic once specular is fixed. A base_color below F0 nearly has a double, as in `gltf`: only what exact and Schlick's
//! F differ by tells the two apart.
//!
//! Reciprocal, finite at grazing. Not energy conserving for rough surfaces at grazing, since its diffuse lobe is not; sheen and coat are
//! added to the rest without dimming it.

use super::disney_2012::{Coat, Sheen, Subsurface};
use super::disney_diffuse::DisneyDiffuse;
use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::parts::distribution::{Anisotropic, Density, Ggx, Gtr, Shadows};
use crate::model::parts::fresnel::{
    Constants, Dielectric, FresnelReflectance, Reflectance, Schlick, index_reflectance,
};
use crate::model::parts::shadowing::SmithUncorrelated;
use crate::model::{
    Choices, Kernel, Model, ParamSpec, Part, PreparedBy, Reshape, Reshaped, Scale, Sharing, Sharper,
    Strength, Values, Visitor,
};

/// Mitsuba's principled model.
#[derive(Clone, Copy, Debug)]
pub struct Principled;

/// Index of the first of the shapes that hold the highlight's roughness and anisotropy.
const ROUGHNESS: usize = 0;
/// Index of the shape that sets the dielectric's reflectance.
const SPECULAR: usize = 2;
/// Index of the shape of the coat.
const CLEARCOAT_GLOSS: usize = 3;
/// The least mx and my of the renderer.
const FLOOR: f64 = 0.001;

/// mx and my of the highlight.
struct Highlight;

impl Reshape for Highlight {
    const SHAPES: usize = 2;

    fn reshape<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [roughness, anisotropic] = shapes.take();
        let aspect = (-anisotropic.times(0.9)).plus(1.0).sqrt();
        let m = roughness.squared();
        let floor = T::constant(FLOOR);
        [m / aspect, m * aspect].map(|m| T::if_less(m.value(), floor.value(), floor, m))
    }
}

/// F of the dielectric, and Schlick's 1 - s and s for the metal. Its shape is `specular`.
struct Facets;

impl Kernel for Facets {
    const FUNCTIONS: usize = 3;
    const SHARED_ON_RINGS: bool = true;
    type Prepared<T: Scalar> = Constants<T>;
    type Output<T: Scalar> = [T; 3];

    #[inline(always)]
    fn at<T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> [T; 3] {
        let [fallen, risen, _] = Schlick::factors::<T>(constants, g.cos_d, g.one_less_cos_d);
        [index_reflectance(constants, g.cos_d), fallen, risen]
    }
}

impl Part for Facets {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        let [specular] = shapes.take();
        Dielectric::prepare(Values::new(&[specular.times(0.08)]))
    }
}

/// G of the coat, between 0 and 1.
struct CoatShadowing;

impl Kernel for CoatShadowing {
    type Prepared<T: Scalar> = ();
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>((): &(), g: &Geometry<T::Real>) -> [T; 1] {
        [T::from_real(g1(g.cos_i()) * g1(g.cos_o()))]
    }
}

/// Smith's G1 of ggx with m = 0.25.
#[inline(always)]
fn g1<R: Real>(cos: R) -> R {
    const M2: f64 = 0.25 * 0.25;
    let cos2: R = cos * cos;
    cos.times(2.0) / (cos + cos2.times(1.0 - M2).plus(M2).sqrt())
}

impl Part for CoatShadowing {
    type Kernel = Self;
    const SHAPES: usize = 0;

    fn prepare<T: Scalar>(_: Values<'_, T>) {}
}

impl Model for Principled {
    type Coefficients<T: Scalar> = [T; 8];

    const NAME: &'static str = "principled";
    const SUMMARY: &'static str = "Mitsuba 3's principled material";
    const REFERENCE: &'static str = "Mitsuba 3.9.1, src/bsdfs/principled.cpp; Burley 2012, Physically Based Shading at Disney, \
        SIGGRAPH 2012 course notes";

    fn build(_: &Choices) -> Self {
        Self
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
            shape("specular", "strength of a dielectric's highlight", (1e-3, 1.0), 0.5).fixed(),
            shape("clearcoat_gloss", "gloss of the coat", (0.0, 1.0), 0.0).fixed(),
            ParamSpec::amplitude("base_color", "base colour", 1.0, 0.2),
            shared("metallic", "metal or dielectric", 0.1),
            shared("flatness", "share of the flatter diffuse lobe", 0.0).fixed(),
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
        visitor.part::<Reshaped<<SmithUncorrelated as Shadows>::Visibility<Ggx<Anisotropic>>, Highlight>>(
            ROUGHNESS,
        );
        visitor.part::<Facets>(SPECULAR);
        visitor.next_term();
        visitor.part::<Reshaped<Density<Gtr>, Coat>>(CLEARCOAT_GLOSS);
        visitor.part::<CoatShadowing>(0);
        visitor.part::<Reflectance<Schlick>>(0);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 8] {
        let [base, metallic, flatness, sheen, clearcoat] = amplitudes.take();
        let one = T::constant(1.0);
        let dielectric = one - metallic;
        let diffuse = dielectric * base;
        let coat = clearcoat.times(0.25);
        [
            diffuse * (one - flatness),
            diffuse * flatness,
            dielectric * sheen,
            dielectric,
            metallic * base,
            metallic,
            coat.times(0.04),
            coat,
        ]
    }

    fn strength(&self) -> Strength {
        Strength::Missing
    }
}
