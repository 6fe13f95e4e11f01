//! Lafortune: a cosine power about a direction that is a linear map of wi.
//!
//! ```text
//! q = (cx xi xo + cy yi yo + cz zi zo)/N,   N = max(|cx|, |cy|, |cz|)
//! f = ks (n + 2)/(2 pi) max(0, q)^n
//! ```
//!
//! shape=isotropic has cx = cy, called cxy.
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | ks | 1 | 0..1000 | scale of the lobe; the albedo at normal incidence if abs(cz) = N |
//! | cxy; cx | 1 | -1..1 | fixed at -1 unless freed: forward; 1 is backward, towards the light |
//! | cy | 1 | -10..10 | shape=anisotropic; equal to cx where the data show no anisotropy |
//! | cz | 1 | -10..10 | 1 mirror-like, below 1 bent towards grazing, above 1 towards the normal |
//! | n | 1 | 1..1e6 | exponent |
//!
//! Lafortune, Foo, Torrance and Greenberg 1997, eq. 7 and 8 (doi:10.1145/258734.258801), with the normalisation of Ngan et al.
//! 2005 (doi:10.2312/EGWR/EGSR05/117-126): ks here is their published albedo, and their Cxy, Cz and n can be entered as printed,
//! although each C is about 0.577. Division by N keeps the cosine below 1; separate n-th powers of cosine and N would underflow.
//!
//! Identifiability: doubling cx, cy and cz changes nothing; only their ratios matter. One of them, the forward one, is therefore
//! fixed at -1. To bend a lobe more than |cz| <= 10 allows, or to fit a retro-reflective one, set it with --fix cxy=1, or fix cz
//! and free cxy. With all three free there are no standard errors. A lobe that is bent and sharp, with n |1 - |cz/cxy|| above
//! about 20, peaks only where directions are not measured, and is not identifiable either. Where abs(cz) passes N, the
//! derivative of f with respect to cz jumps by a multiple of f, which ks compensates, so the fit can pass this point. n below 1
//! is excluded because f would have infinite slopes where q reaches 0; for a lobe as wide as that use Lambert.
//!
//! Reciprocal; finite at grazing; energy conserving for ks <= 1 and abs(cz) = N. It has no Fresnel rise, although a lobe bent
//! towards grazing can imitate one.

use super::phong::{Exponent, ln_of_both};
use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::{Choices, Kernel, Model, ModelOption, ParamSpec, Part, Scale, Sharper, Values, Visitor};

/// A cosine power about a direction that is a linear map of wi.
#[derive(Clone, Copy, Debug)]
pub struct Lafortune {
    anisotropic: bool,
}

/// Weights of the three products, divided by N, and the exponent.
#[derive(Clone, Copy, Debug)]
pub struct Lobe<T: Scalar> {
    weights: [T; 3],
    /// For each weight: its sign, its size, and 1 minus its size.
    sizes: [[T::Real; 3]; 3],
    exponent: Exponent<T>,
}

impl<T: Scalar> Lobe<T> {
    fn new(weights: [T; 3], n: T) -> Self {
        let zero = T::Real::literal(0.0);
        let size = |c: T| T::if_less(c.value(), zero, -c, c);
        let greatest = |a: T, b: T| T::if_less(a.value(), b.value(), b, a);
        // If all weights are 0 there is no lobe, and any N will do.
        let largest = weights.map(size).into_iter().fold(T::constant(f64::MIN_POSITIVE), greatest);
        let sizes = weights.map(|c| {
            let sign = T::Real::if_less(c.value(), zero, T::Real::literal(-1.0), T::Real::literal(1.0));
            // For the largest weight this is exactly 0.
            let rest: T = (largest - size(c)) / largest;
            let relative: T = size(c) / largest;
            [sign, relative.value(), rest.value()]
        });
        Self { weights: weights.map(|c| c / largest), sizes, exponent: Exponent::new(n) }
    }

    #[inline(always)]
    fn at(&self, g: &Geometry<T::Real>) -> T {
        let ([xi, yi, zi], [xo, yo, zo]) = (g.wi, g.wo);
        let [x, y, z]: [T::Real; 3] = [xi * xo, yi * yo, zi * zo];
        let [cx, cy, cz] = self.weights;
        let q = cx * x + cy * y + cz * z;
        // 1 - q as a sum, which keeps its digits where the lobe is sharp: with unit vectors and |c| <= 1
        // 1 - c i o = (1 - |c|)(i^2 + o^2)/2 + |c| (i - sign(c) o)^2/2, summed over x, y and z.
        let [of_x, of_y, of_z] = self.sizes;
        let away: T::Real = (apart(of_x, xi, xo) + apart(of_y, yi, yo) + apart(of_z, zi, zo)).times(0.5);
        // Below this f has no digits left even for n = 1, and 1/q would overflow.
        let least = T::Real::literal(1e-30);
        let positive = T::if_less(least, q.value(), q, T::from_real(least));
        let at: T::Real = positive.value();
        // The derivative is attached by adding a difference whose value is 0.
        let ln_q = (positive - at) * at.recip() + ln_of_both(at, away);
        T::if_less(least, q.value(), self.exponent.power(ln_q), T::constant(0.0))
    }
}

/// One term of 1 - q, from the sign of a weight, its size, and 1 minus its size.
#[inline(always)]
fn apart<R: Real>([sign, size, rest]: [R; 3], i: R, o: R) -> R {
    let difference: R = i - sign * o;
    let both: R = i * i + o * o;
    size * (difference * difference) + rest * both
}

/// The lobe with one weight for x and y.
pub(crate) struct Isotropic;

impl Kernel for Isotropic {
    type Prepared<T: Scalar> = Lobe<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(lobe: &Lobe<T>, g: &Geometry<T::Real>) -> [T; 1] {
        [lobe.at(g)]
    }
}

impl Part for Isotropic {
    type Kernel = Self;
    const SHAPES: usize = 3;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Lobe<T> {
        let [cxy, cz, n] = shapes.take();
        Lobe::new([cxy, cxy, cz], n)
    }
}

/// The lobe with a weight each for x and y.
struct Anisotropic;

impl Kernel for Anisotropic {
    type Prepared<T: Scalar> = Lobe<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(lobe: &Lobe<T>, g: &Geometry<T::Real>) -> [T; 1] {
        [lobe.at(g)]
    }
}

impl Part for Anisotropic {
    type Kernel = Self;
    const SHAPES: usize = 4;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Lobe<T> {
        let [cx, cy, cz, n] = shapes.take();
        Lobe::new([cx, cy, cz], n)
    }
}

fn forward(name: &'static str, summary: &'static str) -> ParamSpec {
    ParamSpec::shape(name, summary, (-1.0, 1.0), (-1.0, -0.3), -1.0, Scale::Linear).fixed()
}

fn upward() -> ParamSpec {
    ParamSpec::shape("cz", "weight of zi zo", (-10.0, 10.0), (0.1, 1.5), 1.0, Scale::Linear)
}

fn exponent() -> ParamSpec {
    ParamSpec::shape("n", "exponent", (1.0, 1e6), (1.5, 1e5), 30.0, Scale::Log).sharper_when(Sharper::Larger)
}

/// The shapes of the isotropic lobe.
pub(crate) fn shapes() -> Vec<ParamSpec> {
    vec![forward("cxy", "weight of xi xo + yi yo"), upward(), exponent()]
}

impl Model for Lafortune {
    type Coefficients<T: Scalar> = [T; 1];

    const NAME: &'static str = "lafortune";
    const SUMMARY: &'static str = "cosine power about a direction of choice";
    const REFERENCE: &'static str = "Lafortune et al. 1997, Non-Linear Approximation of Reflectance Functions, \
        doi:10.1145/258734.258801; Ngan et al. 2005, doi:10.2312/EGWR/EGSR05/117-126";
    const OPTIONS: &'static [ModelOption] = &[ModelOption {
        key: "shape",
        summary: "one weight for x and y, or two",
        values: || vec!["isotropic", "anisotropic"],
        default: "isotropic",
    }];

    fn build(choices: &Choices) -> Self {
        Self { anisotropic: choices.get("shape") == "anisotropic" }
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let ks = ParamSpec::amplitude("ks", "scale of the lobe", 1000.0, 0.2);
        if self.anisotropic {
            let cy =
                ParamSpec::shape("cy", "weight of yi yo", (-10.0, 10.0), (-1.5, -0.3), -1.0, Scale::Linear)
                    .isotropic_as("cx");
            vec![ks, forward("cx", "weight of xi xo"), cy, upward(), exponent()]
        } else {
            [vec![ks], shapes()].concat()
        }
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        if self.anisotropic {
            visitor.part::<Anisotropic>(0);
        } else {
            visitor.part::<Isotropic>(0);
        }
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 1] {
        amplitudes.take()
    }
}
