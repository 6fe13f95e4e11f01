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
//! variant=fujii (Fujii's improvement of the qualitative form, with s = wi.wo - ci co)
//!   f  = albedo/pi (1 + r s/t)/(1 + (1/2 - 2/(3 pi)) r),    t = max(ci, co) if s > 0, else 1
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | albedo | 1 | 0..2 | albedo of the facets, not of the surface |
//! | sigma | deg | 0..90 | standard deviation of the facets' angle; 10 smooth plaster, 40 clay or sand |
//! | r | 1 | 0..1 | roughness of `fujii`, instead of sigma; close to sigma in radians if it is small |
//!
//! Departure: some texts print 0.57 instead of 0.33 in the qualitative model, which the paper offers as a partial
//! compensation for the dropped interreflection; here it is 0.33. At sigma = 0 both are Lambert. All variants are
//! reciprocal. f stays finite at grazing, since b in tan b is the *smaller* angle. Close to grazing the full variant can be
//! negative, and can reflect more than it receives: it is a fit to a numerical integral. `fujii` conserves energy and is
//! never negative.

use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::{Choices, Kernel, Model, ModelOption, ParamSpec, Part, Scale, Unit, Values, Visitor};
use std::f64::consts::{FRAC_1_PI, FRAC_2_PI};

/// A rough diffuse surface.
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar {
    variant: Variant,
}

#[derive(Clone, Copy, Debug)]
enum Variant {
    /// The full form, with interreflection and the third coefficient.
    Full,
    /// The qualitative form, without them.
    Qualitative,
    /// Fujii's form.
    Fujii,
}

/// The roughness terms, each divided by pi.
#[derive(Clone, Copy, Debug)]
pub struct Roughness<T> {
    c1: T,
    c2: T,
    c3: T,
    interreflection: T,
}

impl<T: Scalar> Roughness<T> {
    fn new(mut shapes: Values<'_, T>) -> Self {
        let [sigma] = shapes.take();
        let s2: T = sigma * sigma;
        Self {
            c1: (-(s2 / s2.plus(0.33)).times(0.5)).plus(1.0).times(FRAC_1_PI),
            c2: (s2 / s2.plus(0.09)).times(0.45 * FRAC_1_PI),
            c3: (s2 / s2.plus(0.09)).times(0.125 * FRAC_1_PI),
            interreflection: (s2 / s2.plus(0.13)).times(0.17 * FRAC_1_PI),
        }
    }
}

/// The angles that the full and the qualitative form depend on: a is the larger polar angle, b the smaller, p the azimuth
/// between the two directions.
struct Angles<R> {
    sin_a: R,
    cos_a: R,
    sin_b: R,
    cos_b: R,
    cos_p: R,
    /// 1 - |cos p|
    sideways: R,
}

impl<R: Real> Angles<R> {
    #[inline(always)]
    fn new(g: &Geometry<R>) -> Self {
        let zero = R::literal(0.0);
        let (cos_i, cos_o) = (g.cos_i(), g.cos_o());
        let (sin_i, sin_o): (R, R) = (g.sin2_i().sqrt(), g.sin2_o().sqrt());
        // The larger angle has the smaller cosine.
        let swap = |at_a: R, at_b: R| R::if_less(cos_i, cos_o, at_a, at_b);

        // cos p from the projected directions. It is undefined at normal incidence, where it is multiplied by tan b = 0.
        let ([ix, iy, _], [ox, oy, _]) = (g.wi, g.wo);
        let (dot, cross): (R, R) = (ix * ox + iy * oy, ix * oy - iy * ox);
        let lengths: R = sin_i * sin_o;
        let (cos_p, sin_p): (R, R) = (dot / lengths, cross / lengths);
        let cos_p = R::if_less(zero, lengths, cos_p, zero).lesser(R::literal(1.0)).greater(R::literal(-1.0));
        // Computed from the sine, which is exact where tan((a + b)/2) is large and 1 - |cos p| small.
        let sideways: R = sin_p * sin_p / cos_p.greater(-cos_p).plus(1.0);
        let sideways = R::if_less(zero, lengths, sideways, R::literal(1.0));
        Self {
            sin_a: swap(sin_i, sin_o),
            cos_a: swap(cos_i, cos_o),
            sin_b: swap(sin_o, sin_i),
            cos_b: swap(cos_o, cos_i),
            cos_p,
            sideways,
        }
    }
}

/// The full form, with interreflection.
struct Full;

impl Kernel for Full {
    const FUNCTIONS: usize = 2;
    type Prepared<T: Scalar> = Roughness<T>;
    type Output<T: Scalar> = [T; 2];

    #[inline(always)]
    fn at<T: Scalar>(r: &Roughness<T>, g: &Geometry<T::Real>) -> [T; 2] {
        let Angles { sin_a, cos_a, sin_b, cos_b, cos_p, sideways } = Angles::new(g);
        let zero = T::Real::literal(0.0);
        let tan_b: T::Real = sin_b / cos_b;

        // Angles in units of pi/2; b is given by its difference from pi/2.
        let a: T::Real = sin_a.atan2(cos_a).times(FRAC_2_PI);
        let above: T::Real = cos_b.atan2(sin_b).times(FRAC_2_PI);
        let b: T::Real = (-above).plus(1.0);
        let b2: T::Real = b * b;
        // sin a - b^3 as (1 - b^3) - (1 - sin a): close to the horizon tan b multiplies a small difference.
        let less_b3: T::Real = above * (b2 + b).plus(1.0);
        let cos2_a: T::Real = cos_a * cos_a;
        let less_sin_a: T::Real = cos2_a / sin_a.plus(1.0);
        let c2: T::Real = T::Real::if_less(cos_p, zero, less_b3 - less_sin_a, sin_a) * cos_p * tan_b;

        // tan((a + b)/2) = (sin a + sin b)/(cos a + cos b)
        let tan_mean: T::Real = (sin_a + sin_b) / (cos_a + cos_b);
        let ab: T::Real = a * b;
        let c3: T::Real = ab * ab * sideways * tan_mean;

        let bounced: T::Real = (-(cos_p * b2)).plus(1.0);
        [r.c1 + r.c2 * c2 + r.c3 * c3, r.interreflection * bounced]
    }
}

impl Part for Full {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> Roughness<T> {
        Roughness::new(shapes)
    }
}

/// The qualitative form, without interreflection.
pub(super) struct Qualitative;

impl Kernel for Qualitative {
    type Prepared<T: Scalar> = Roughness<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(r: &Roughness<T>, g: &Geometry<T::Real>) -> [T; 1] {
        let Angles { sin_a, sin_b, cos_b, cos_p, .. } = Angles::new(g);
        let tan_b: T::Real = sin_b / cos_b;
        let forward: T::Real = cos_p.greater(T::Real::literal(0.0)) * sin_a * tan_b;
        [r.c1 + r.c2 * forward]
    }
}

impl Part for Qualitative {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> Roughness<T> {
        Roughness::new(shapes)
    }
}

/// FON for an albedo of 1 and roughness `r`, with the factors that it shares with later bounces.
#[derive(Clone, Copy, Debug)]
pub struct SingleBounce<T> {
    r: T,
    /// 1 - r
    rest: T,
    /// A/pi, A = 1/(1 + (1/2 - 2/(3 pi)) r)
    pub(crate) scale: T,
}

/// 1/2 - 2/(3 pi)
pub(crate) const FUJII: f64 = 0.5 - 2.0 / 3.0 * FRAC_1_PI;

impl<T: Scalar> SingleBounce<T> {
    pub(crate) fn new(r: T) -> Self {
        Self { r, rest: (-r).plus(1.0), scale: r.times(FUJII).plus(1.0).recip().times(FRAC_1_PI) }
    }

    /// f for an albedo of 1.
    #[inline(always)]
    pub(crate) fn at(&self, g: &Geometry<T::Real>) -> T {
        let ([xi, yi, zi], [xo, yo, zo]) = (g.wi, g.wo);
        let s: T::Real = xi * xo + yi * yo;
        let ratio: T::Real = s / zi.greater(zo);
        // Where s is negative, 1 + r s is computed as (1 - r) + r (1 + s). For opposite directions at the horizon 1 + s is 0;
        // for unit vectors it is a sum of squares, and computed as that.
        let (x, y): (T::Real, T::Real) = (xi + xo, yi + yo);
        let (across, upward): (T::Real, T::Real) = (x * x + y * y, zi * zi + zo * zo);
        let opposed: T::Real = (across + upward).times(0.5);
        let zero = T::Real::literal(0.0);
        let start = T::if_less(zero, s, T::constant(1.0), self.rest);
        (start + self.r * T::Real::if_less(zero, s, ratio, opposed)) * self.scale
    }
}

/// Fujii's form.
struct Fujii;

impl Kernel for Fujii {
    type Prepared<T: Scalar> = SingleBounce<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(bounce: &SingleBounce<T>, g: &Geometry<T::Real>) -> [T; 1] {
        [bounce.at(g)]
    }
}

impl Part for Fujii {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> SingleBounce<T> {
        let [r] = shapes.take();
        SingleBounce::new(r)
    }
}

/// The parameter `r`.
pub(crate) fn roughness() -> ParamSpec {
    ParamSpec::shape("r", "roughness", (0.0, 1.0), (0.0, 1.0), 0.5, Scale::Linear)
}

impl Model for OrenNayar {
    type Coefficients<T: Scalar> = [T; 2];

    const NAME: &'static str = "oren-nayar";
    const SUMMARY: &'static str = "rough diffuse surface";
    const REFERENCE: &'static str =
        "Oren and Nayar 1994, Generalization of Lambert's Reflectance Model, doi:10.1145/192161.192213";
    const OPTIONS: &'static [ModelOption] = &[ModelOption {
        key: "variant",
        summary: "full with interreflection, or the qualitative model, or Fujii's improved form of it",
        values: || vec!["full", "qualitative", "fujii"],
        default: "full",
    }];

    fn build(choices: &Choices) -> Self {
        let variant = match choices.get("variant") {
            "qualitative" => Variant::Qualitative,
            "fujii" => Variant::Fujii,
            _ => Variant::Full,
        };
        Self { variant }
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
        let shape = match self.variant {
            Variant::Full | Variant::Qualitative => sigma.unit(Unit::Degrees),
            Variant::Fujii => roughness(),
        };
        vec![ParamSpec::albedo("albedo", "albedo of the facets", 0.2), shape]
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        match self.variant {
            Variant::Full => visitor.part::<Full>(0),
            Variant::Qualitative => visitor.part::<Qualitative>(0),
            Variant::Fujii => visitor.part::<Fujii>(0),
        }
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 2] {
        let [albedo] = amplitudes.take();
        [albedo, albedo * albedo]
    }
}
