//! Oren-Nayar: a rough diffuse surface of Lambertian V-grooves with normally distributed slopes.
//!
//! With a = max(theta_i, theta_o), b = min(theta_i, theta_o), p = phi_i - phi_o, s2 = sigma^2:
//!
//! ```text
//! variant=full (direct and interreflected light, paper eq. 30 and 31)
//!   C1 = 1 - s2 / (2 (s2 + 0.33))
//!   C2 = 0.45 s2/(s2 + 0.09) (sin a - [cos p < 0] (2 b/pi)^3)
//!   C3 = 0.125 s2/(s2 + 0.09) (4 a b/pi^2)^2
//!   f  = albedo/pi   (C1 + C2 cos p tan b + C3 (1 - |cos p|) tan((a + b)/2))
//!      + albedo^2/pi 0.17 s2/(s2 + 0.13) (1 - cos p (2 b/pi)^2)
//! variant=qualitative (paper section 4.4)
//!   f  = albedo/pi (C1 + 0.45 s2/(s2 + 0.09) max(0, cos p) sin a tan b)
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | albedo | 1 | 0..2 | of the facets, not of the surface |
//! | sigma | deg | 0..90 | standard deviation of the facets' angle; 10 smooth plaster, 40 clay or sand |
//!
//! Departure: some texts print 0.57 for 0.33 in the qualitative model, a partial compensation for the
//! dropped interreflection that the paper offers; 0.33 it is here. At sigma = 0 both are Lambert.
//! Grazing: f stays finite, since tan b multiplies the *smaller* angle. The full variant can fall below
//! zero, and reflect more than it receives, close to grazing: it is a fit to a numerical integral.

use super::{Choices, Model, ModelOption, ParamSpec, Scale, Unit, Values};
use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use std::f64::consts::{FRAC_1_PI, FRAC_2_PI};

/// A rough diffuse surface.
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar {
    /// Whether to keep the interreflection and the third coefficient.
    full: bool,
}

/// The roughness terms, each divided by pi.
#[derive(Clone, Copy, Debug)]
pub struct Roughness<T> {
    c1: T,
    c2: T,
    c3: T,
    interreflection: T,
}

impl Model for OrenNayar {
    type Prepared<T: Scalar> = Roughness<T>;
    type Basis<T: Scalar> = [T; 2];

    const NAME: &'static str = "oren-nayar";
    const SUMMARY: &'static str = "rough diffuse surface";
    const REFERENCE: &'static str =
        "Oren and Nayar 1994, Generalization of Lambert's Reflectance Model, doi:10.1145/192161.192213";
    const OPTIONS: &'static [ModelOption] = &[ModelOption {
        key: "variant",
        summary: "full with interreflection, or the qualitative model",
        values: || vec!["full", "qualitative"],
        default: "full",
    }];

    fn build(choices: &Choices) -> Self {
        Self { full: choices.get("variant") == "full" }
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let sigma = ParamSpec::shape(
            "sigma",
            "standard deviation of the facet angle",
            (0.0, 90.0),
            (5.0, 60.0),
            20.0,
            Scale::Square,
        );
        vec![ParamSpec::amplitude("albedo", "albedo of the facets", 2.0, 0.2), sigma.unit(Unit::Degrees)]
    }

    fn basis_len(&self) -> usize {
        if self.full { 2 } else { 1 }
    }

    fn prepare<T: Scalar>(&self, mut shapes: Values<'_, T>) -> Roughness<T> {
        let [sigma] = shapes.take();
        let s2: T = sigma * sigma;
        Roughness {
            c1: (-(s2 / s2.plus(0.33)).times(0.5)).plus(1.0).times(FRAC_1_PI),
            c2: (s2 / s2.plus(0.09)).times(0.45 * FRAC_1_PI),
            c3: (s2 / s2.plus(0.09)).times(0.125 * FRAC_1_PI),
            interreflection: (s2 / s2.plus(0.13)).times(0.17 * FRAC_1_PI),
        }
    }

    fn basis<T: Scalar>(&self, r: &Roughness<T>, g: &Geometry<T::Real>) -> [T; 2] {
        let zero = T::Real::literal(0.0);
        let (cos_i, cos_o) = (g.cos_i(), g.cos_o());
        let (sin_i, sin_o): (T::Real, T::Real) = (g.sin2_i().sqrt(), g.sin2_o().sqrt());
        // The larger angle a has the smaller cosine.
        let swap = |at_a: T::Real, at_b: T::Real| T::Real::if_less(cos_i, cos_o, at_a, at_b);
        let (sin_a, sin_b) = (swap(sin_i, sin_o), swap(sin_o, sin_i));
        let (cos_a, cos_b) = (swap(cos_i, cos_o), swap(cos_o, cos_i));
        let tan_b: T::Real = sin_b / cos_b;

        // cos p from the projected directions; undefined at normal incidence, where tan b = 0 hides it.
        let ([ix, iy, _], [ox, oy, _]) = (g.wi, g.wo);
        let (dot, lengths): (T::Real, T::Real) = (ix * ox + iy * oy, sin_i * sin_o);
        let ratio: T::Real = dot / lengths;
        let cos_p = T::Real::if_less(zero, lengths, ratio, zero)
            .lesser(T::Real::literal(1.0))
            .greater(T::Real::literal(-1.0));

        if !self.full {
            let forward: T::Real = cos_p.greater(zero) * sin_a * tan_b;
            return [r.c1 + r.c2 * forward, T::constant(0.0)];
        }

        // Angles in units of pi/2.
        let a: T::Real = sin_a.atan2(cos_a).times(FRAC_2_PI);
        let b: T::Real = sin_b.atan2(cos_b).times(FRAC_2_PI);
        let b2: T::Real = b * b;
        let b3: T::Real = b2 * b;
        let backward = T::Real::if_less(cos_p, zero, b3, zero);
        let c2: T::Real = (sin_a - backward) * cos_p * tan_b;

        // tan((a + b)/2) = (sin a + sin b)/(cos a + cos b)
        let tan_mean: T::Real = (sin_a + sin_b) / (cos_a + cos_b);
        let sideways: T::Real = (-cos_p.greater(-cos_p)).plus(1.0);
        let ab: T::Real = a * b;
        let c3: T::Real = ab * ab * sideways * tan_mean;

        let bounced: T::Real = (-(cos_p * b2)).plus(1.0);
        [r.c1 + r.c2 * c2 + r.c3 * c3, r.interreflection * bounced]
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 2] {
        let [albedo] = amplitudes.take();
        [albedo, albedo * albedo]
    }
}
