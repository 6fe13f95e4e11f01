//! Disney diffuse: the diffuse lobe of the "principled" model, darker or brighter at grazing with roughness.
//!
//! ```text
//! f   = kd/pi (1 + (F - 1)(1 - ci)^5)(1 + (F - 1)(1 - co)^5),   F = 1/2 + 2 r (wi.h)^2
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | kd | 1 | 0..2 | base colour; the albedo at normal incidence of a surface with r = 0.5 is close to it |
//! | r | 1 | 0..1 | roughness; 0 halves f at grazing, 1 multiplies it by up to 5/2 towards the light |
//!
//! Burley 2012, Physically Based Shading at Disney, section 5.3 (course notes of SIGGRAPH 2012,
//! <https://media.disneyanimation.com/uploads/production/publication_asset/48/asset/s2012_pbs_disney_brdf_notes_v3.pdf>),
//! derived from the MERL materials: smooth ones get darker at grazing, since light that enters is refracted twice; rough ones
//! get brighter in the direction of the light. r is the parameter "roughness" of the principled model; its microfacet lobe has
//! m = r^2.
//!
//! Reciprocal, finite at grazing. Not energy conserving for rough surfaces: with r = 1 and kd = 1 it reflects more than it
//! receives, and where both directions graze f is 6.25 times Lambert's.

use super::oren_nayar::roughness;
use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::{Choices, Kernel, Model, ParamSpec, Part, Values, Visitor};
use std::f64::consts::FRAC_1_PI;

/// Disney's diffuse lobe.
#[derive(Clone, Copy, Debug)]
pub struct DisneyDiffuse;

impl Kernel for DisneyDiffuse {
    type Prepared<T: Scalar> = T;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(twice_r: &T, g: &Geometry<T::Real>) -> [T; 1] {
        let cos2: T::Real = g.cos_d * g.cos_d;
        [towards_grazing((*twice_r * cos2).plus(-0.5), g).times(FRAC_1_PI)]
    }
}

impl Part for DisneyDiffuse {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> T {
        let [r] = shapes.take();
        r.times(2.0)
    }
}

/// (1 + rise (1 - ci)^5)(1 + rise (1 - co)^5)
#[inline(always)]
fn towards_grazing<T: Scalar>(rise: T, g: &Geometry<T::Real>) -> T {
    rise_at(rise, g.cos_i()) * rise_at(rise, g.cos_o())
}

/// 1 + rise (1 - cos)^5
#[inline(always)]
fn rise_at<T: Scalar>(rise: T, cos: T::Real) -> T {
    (rise * (-cos).plus(1.0).fifth_power()).plus(1.0)
}

impl Model for DisneyDiffuse {
    type Coefficients<T: Scalar> = [T; 1];

    const NAME: &'static str = "disney-diffuse";
    const SUMMARY: &'static str = "diffuse lobe of Disney's principled model";
    const REFERENCE: &'static str =
        "Burley 2012, Physically Based Shading at Disney, SIGGRAPH 2012 course notes";

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        vec![ParamSpec::albedo("kd", "base colour", 0.2), roughness()]
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        visitor.part::<Self>(0);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 1] {
        amplitudes.take()
    }
}
