//! EON: energy-preserving Oren-Nayar, a rough diffuse surface that includes the light that bounces between its facets.
//!
//! With the single bounce f_1 of `oren-nayar(variant=fujii)` at albedo 1 and its directional albedo E:
//!
//! ```text
//! f   = albedo f_1 + b/pi (1 - E(ci))(1 - E(co))/(1 - Ea)
//! b   = albedo^2 Ea/(1 - albedo (1 - Ea))                     light of the second and later bounces
//! E   = A (1 + r G(c)/pi),  Ea = A (1 + k2 r),  A = 1/(1 + k1 r)
//! G   = s (acos c - s c) + (2/3) ((s/c)(1 - s^3) - s),  s = sqrt(1 - c^2)
//! k1  = 1/2 - 2/(3 pi),  k2 = 2/3 - 28/(15 pi)
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | albedo | 1 | 0..1 | albedo of the facets; 1 reflects everything |
//! | r | 1 | 0..1 | roughness; 0 is Lambert, from which data cannot distinguish a small value |
//!
//! Portsmouth, Kutz and Hill 2025, EON: A Practical Energy-Preserving Rough Diffuse BRDF, JCGT 14(1)
//! (<https://arxiv.org/abs/2410.18026>); with the exact G, not its polynomial. 1 - E = A r (k1 - G/pi) and
//! 1 - Ea = A r (k1 - k2) avoid 0/0 at r = 0, and (s/c)(1 - s^3) = s c (1 + s + s^2)/(1 + s) avoids it at grazing.
//!
//! albedo enters together with r, through b; therefore it is a shape here, with a value per channel. Reciprocal; energy
//! conserving, without loss at albedo 1; finite at grazing. There is no such surface with an albedo above 1.

use super::oren_nayar::{FUJII, SingleBounce, roughness};
use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::{Choices, Kernel, Model, ParamSpec, Part, Scale, Strength, Values, Visitor};
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2};

/// A rough diffuse surface that preserves energy.
#[derive(Clone, Copy, Debug)]
pub struct Eon;

/// k1 - k2, which is the mean of k1 - G/pi.
pub(crate) const MISSING: f64 = FUJII - (2.0 / 3.0 - 28.0 / 15.0 * FRAC_1_PI);

/// Mean albedo of the single bounce, Ea.
pub(crate) fn mean_albedo<T: Scalar>(r: T) -> T {
    let a = r.times(FUJII).plus(1.0).recip();
    (-(a * r).times(MISSING)).plus(1.0)
}

/// The single bounce and the pattern of the later ones, for an albedo of 1.
pub(crate) struct Bounces;

#[derive(Clone, Copy, Debug)]
pub struct BouncesOf<T> {
    single: SingleBounce<T>,
    /// A r/(pi (k1 - k2))
    later: T,
}

/// k1 - G/pi
#[inline(always)]
fn missing<R: Real>(cos: R, sin2: R) -> R {
    // In terms of the angle above the horizon, a = pi/2 - theta, both terms vanish towards grazing:
    // k1 pi - G = (pi/2 - 2/3)(1 - s) + s a + s^2 c - (2/3) s c (1 + s + s^2)/(1 + s)
    let sin: R = sin2.sqrt();
    let above = cos.atan2(sin);
    let inverse: R = sin.plus(1.0).recip();
    let tail: R = sin * (sin2 + sin).plus(1.0);
    let flat: R = cos.times(FRAC_PI_2 - 2.0 / 3.0) - tail.times(2.0 / 3.0);
    let missing: R = flat * inverse * cos + sin * (above + sin * cos);
    missing.times(FRAC_1_PI)
}

impl Kernel for Bounces {
    const FUNCTIONS: usize = 2;
    type Prepared<T: Scalar> = BouncesOf<T>;
    type Output<T: Scalar> = [T; 2];

    #[inline(always)]
    fn at<T: Scalar>(bounces: &BouncesOf<T>, g: &Geometry<T::Real>) -> [T; 2] {
        let light = missing(g.cos_i(), g.sin2_i());
        let view = missing(g.cos_o(), g.sin2_o());
        let both: T::Real = light * view;
        [bounces.single.at(g), bounces.later * both]
    }
}

impl Part for Bounces {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> BouncesOf<T> {
        let [r] = shapes.take();
        let single = SingleBounce::new(r);
        BouncesOf { single, later: (single.scale * r).times(1.0 / MISSING) }
    }
}

/// The factors of the single and the later bounces, which depend on the facets' albedo.
struct Absorption;

impl Kernel for Absorption {
    const FUNCTIONS: usize = 2;
    const SHARED_ON_RINGS: bool = true;
    type Prepared<T: Scalar> = [T; 2];
    type Output<T: Scalar> = [T; 2];

    #[inline(always)]
    fn at<T: Scalar>(factors: &[T; 2], _: &Geometry<T::Real>) -> [T; 2] {
        *factors
    }
}

impl Part for Absorption {
    type Kernel = Self;
    const SHAPES: usize = 2;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [r, albedo] = shapes.take();
        let mean = mean_albedo(r);
        let lost = albedo * (-mean).plus(1.0);
        [albedo, albedo * albedo * mean / (-lost).plus(1.0)]
    }
}

impl Model for Eon {
    type Coefficients<T: Scalar> = [T; 2];

    const NAME: &'static str = "eon";
    const SUMMARY: &'static str = "rough diffuse surface that preserves energy";
    const REFERENCE: &'static str = "Portsmouth, Kutz and Hill 2025, EON: A Practical Energy-Preserving Rough Diffuse \
        BRDF, JCGT 14(1), https://arxiv.org/abs/2410.18026";

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let albedo =
            ParamSpec::shape("albedo", "albedo of the facets", (0.0, 1.0), (0.0, 1.0), 0.2, Scale::Linear);
        vec![roughness(), albedo.per_channel()]
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        visitor.part::<Bounces>(0);
        visitor.part::<Absorption>(0);
    }

    fn coefficients<T: Scalar>(&self, _: Values<'_, T>) -> [T; 2] {
        [T::constant(1.0); 2]
    }

    fn strength(&self) -> Strength {
        Strength::Shape("albedo")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// E(mu = 0.5) of the single bounce at r = 0.7, to 30 digits with mpmath from the paper's closed form. The form used here must
    /// agree with it, and both with the integral (tests/physics.rs).
    #[test]
    fn single_bounce_albedo() {
        let r = 0.7;
        let a = 1.0 / (1.0 + FUJII * r);
        let albedo = 1.0 - a * r * missing(0.5_f64, 0.75);
        assert_relative_eq!(albedo, 0.898_948_874_807_447_8, max_relative = 1e-15);
    }

    /// Ea = 2 int E(mu) mu dmu.
    #[test]
    fn mean_albedo_is_the_mean() {
        let rule = crate::math::GaussLegendre::new(64);
        let r = 0.7;
        let a = 1.0 / (1.0 + FUJII * r);
        // mu = cos(theta) makes the integrand smooth at both ends.
        let mean = rule.integrate(0.0, std::f64::consts::FRAC_PI_2, |theta: f64| {
            let (sin, cos) = theta.sin_cos();
            2.0 * (1.0 - a * r * missing(cos, sin * sin)) * cos * sin
        });
        assert_relative_eq!(mean_albedo(r), mean, max_relative = 1e-13);
    }
}
