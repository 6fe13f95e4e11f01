//! Blinn-Phong: a lobe in the half vector, without Fresnel reflectance or shadowing.
//!
//! ```text
//! f = ks (n + 2)/(2 pi) (n.h)^n
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | ks | 1 | 0..1000 | scale of the lobe |
//! | n | 1 | 0.01..1e6 | exponent; 10 nearly diffuse, 100 satin, 10 000 polished |
//!
//! Blinn 1977 (doi:10.1145/965141.563893); normalised as a distribution of facets: the integral of (n + 2)/(2 pi) c^(n + 1) dwh
//! is 1. This is the convention of the fits that Ngan et al. 2005 (doi:10.2312/EGWR/EGSR05/117-126) published as "Blinn-Phong".
//! A microfacet model with the same facets is `cook-torrance(d=blinn-phong)`, where n = 2/m^2 - 2.
//!
//! ks is not an albedo: without the 1/4 of the half vector's Jacobian a sharp lobe reflects 4 ks cos^2(theta), and any lobe
//! 4 ks (n + 2^(-n/2))/(n + 4) at normal incidence. Reciprocal; energy conserving for ks up to about 1/4. Finite everywhere,
//! without a rise at grazing. n -> 0: constant.

use super::phong::{Exponent, exponent};
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::{Choices, Kernel, Model, ParamSpec, Part, Values, Visitor};

/// A lobe in the half vector.
#[derive(Clone, Copy, Debug)]
pub struct BlinnPhong;

impl Kernel for BlinnPhong {
    const SHARED_ON_RINGS: bool = true;
    type Prepared<T: Scalar> = Exponent<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(exponent: &Exponent<T>, g: &Geometry<T::Real>) -> [T; 1] {
        [exponent.lobe(g.ln_cos_h())]
    }
}

impl Part for BlinnPhong {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Exponent<T> {
        let [n] = shapes.take();
        Exponent::new(n)
    }
}

impl Model for BlinnPhong {
    type Coefficients<T: Scalar> = [T; 1];

    const NAME: &'static str = "blinn-phong";
    const SUMMARY: &'static str = "cosine power in the half vector";
    const REFERENCE: &'static str = "Blinn 1977, Models of Light Reflection for Computer Synthesized Pictures, \
        doi:10.1145/965141.563893; Ngan et al. 2005, doi:10.2312/EGWR/EGSR05/117-126";

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        vec![ParamSpec::amplitude("ks", "scale of the lobe", 1000.0, 0.2), exponent()]
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        visitor.part::<Self>(0);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 1] {
        amplitudes.take()
    }
}
