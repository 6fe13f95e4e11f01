//! Phong: a lobe about the mirror direction.
//!
//! With r the mirror image of wi about the normal:
//!
//! ```text
//! f = ks (n + 2)/(2 pi) max(0, r.wo)^n,   r.wo = zi zo - xi xo - yi yo
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | ks | 1 | 0..1000 | albedo at normal incidence |
//! | n | 1 | 0.01..1e6 | exponent; 5 nearly diffuse, 50 satin, 1000 polished |
//!
//! Phong 1975 (doi:10.1145/360825.360839) in the "modified" form of Lafortune and Willems 1994: a normalised BRDF, and not a
//! shading formula for f cos. Reciprocal. Energy conserving for ks <= 1: the albedo is ks at normal incidence and falls towards
//! grazing, where half of the lobe lies below the surface. Finite everywhere. n -> 0: Lambert, except for the step where wo
//! leaves the hemisphere of the lobe. It lacks the peak at grazing incidence that real surfaces have; for that, see the
//! microfacet models.

use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::{Choices, Kernel, Model, ParamSpec, Part, Scale, Sharper, Values, Visitor};
use std::f64::consts::PI;

/// A lobe about the mirror direction.
#[derive(Clone, Copy, Debug)]
pub struct Phong;

/// An exponent and the normalisation of its lobe.
#[derive(Clone, Copy, Debug)]
pub struct Exponent<T> {
    n: T,
    norm: T,
}

impl<T: Scalar> Exponent<T> {
    /// Makes it for an exponent n, with the normalisation (n + 2)/(2 pi).
    pub(crate) fn new(n: T) -> Self {
        Self { n, norm: n.plus(2.0).times(0.5 / PI) }
    }

    /// (n + 2)/(2 pi) cos^n from the logarithm of the cosine.
    #[inline(always)]
    pub(crate) fn lobe(&self, ln_cos: T::Real) -> T {
        (self.n * ln_cos).exp() * self.norm
    }

    /// Like [`Self::lobe`], for a logarithm that also depends on shapes.
    #[inline(always)]
    pub(crate) fn power(&self, ln_cos: T) -> T {
        (self.n * ln_cos).exp() * self.norm
    }
}

/// ln of a cosine. It is computed from the cosine itself if that is small, otherwise from `away`, its difference from 1, which
/// has digits that the rounded cosine lacks.
#[inline(always)]
pub(crate) fn ln_of_both<R: Real>(cos: R, away: R) -> R {
    let lost: R = (-cos).plus(1.0) - away;
    let lost = R::if_less(R::literal(0.5), cos, lost, R::literal(0.0));
    // Below the horizon of the lobe, TINY keeps the logarithm finite.
    cos.greater(R::TINY).ln_of_sum(lost)
}

/// The parameter `n`.
pub(crate) fn exponent() -> ParamSpec {
    ParamSpec::shape("n", "exponent", (0.01, 1e6), (1.0, 1e5), 30.0, Scale::Log).sharper_when(Sharper::Larger)
}

impl Kernel for Phong {
    type Prepared<T: Scalar> = Exponent<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(exponent: &Exponent<T>, g: &Geometry<T::Real>) -> [T; 1] {
        let ([xi, yi, zi], [xo, yo, zo]) = (g.wi, g.wo);
        // 1 - r.wo = |r - wo|^2/2, which keeps its digits where the lobe is sharp.
        let [x, y, z]: [T::Real; 3] = [xi + xo, yi + yo, zi - zo];
        let away: T::Real = (x * x + y * y + z * z).times(0.5);
        let cos: T::Real = zi * zo - xi * xo - yi * yo;
        let zero = T::Real::literal(0.0);
        [T::if_less(zero, cos, exponent.lobe(ln_of_both(cos, away)), T::from_real(zero))]
    }
}

impl Part for Phong {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Exponent<T> {
        let [n] = shapes.take();
        Exponent::new(n)
    }
}

impl Model for Phong {
    type Coefficients<T: Scalar> = [T; 1];

    const NAME: &'static str = "phong";
    const SUMMARY: &'static str = "cosine power about the mirror direction";
    const REFERENCE: &'static str = "Phong 1975, Illumination for Computer Generated Pictures, \
        doi:10.1145/360825.360839; Lafortune and Willems 1994, Using the Modified Phong Reflectance Model for \
        Physically Based Rendering, KU Leuven CW 197";

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        vec![ParamSpec::amplitude("ks", "albedo at normal incidence", 1000.0, 0.2), exponent()]
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        visitor.part::<Self>(0);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 1] {
        amplitudes.take()
    }
}
