//! Ashikhmin-Shirley: an anisotropic Phong lobe over a diffuse base that receives only the light that the lobe transmits.
//!
//! With c = n.h, mu = wi.h, s = (1 - mu)^5:
//!
//! ```text
//! f_s = sqrt((nu + 1)(nv + 1))/(8 pi) c^((nu hx^2 + nv hy^2)/(1 - c^2)) F/(mu max(ci, co)),  F = rs + (1 - rs) s
//! f_d = 28 rd/(23 pi) (1 - rs)(1 - (1 - ci/2)^5)(1 - (1 - co/2)^5)
//! f   = f_s + f_d
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | rd | 1 | 0..1 | diffuse reflectance under the lobe |
//! | rs | 1 | 0..1 | specular reflectance at normal incidence |
//! | nu, nv | 1 | 0.01..1e6 | Phong exponents along x and y; 10 satin, 1000 polished |
//!
//! At h = n the printed exponent is 0/0; written as exp((nu hx^2 + nv hy^2) ln(c)/(1 - c^2)) it is 0, because ln(c)/(1 -
//! c^2) tends to -1/2. At grazing f_s grows without bound, as 1/max(ci, co). Reciprocal. Where its exponents allow more
//! light than arrives, the table below says so.

use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::parts::fresnel::{FresnelReflectance, Schlick};
use crate::model::{Choices, Kernel, Model, ParamSpec, Part, Scale, Sharper, Strength, Values, Visitor};
use std::f64::consts::PI;

/// An anisotropic Phong lobe over a coupled diffuse base.
#[derive(Clone, Copy, Debug)]
pub struct AshikhminShirley;

/// The exponents and the lobe's normalisation.
#[derive(Clone, Copy, Debug)]
pub struct Exponents<T> {
    nu: T,
    nv: T,
    norm: T,
}

impl<T: Scalar> Exponents<T> {
    fn new(nu: T, nv: T) -> Self {
        Self { nu, nv, norm: (nu.plus(1.0) * nv.plus(1.0)).sqrt().times(1.0 / (8.0 * PI)) }
    }

    /// The lobe without its reflectance.
    #[inline(always)]
    fn lobe(&self, g: &Geometry<T::Real>) -> T {
        let [hx, hy, _] = g.h;
        let sin2 = g.sin2_h();
        let exact: T::Real = g.ln_cos_h() / sin2;
        // Below 1e-12 the ratio equals its limit to the last digit.
        let slope = T::Real::if_less(sin2, T::Real::literal(1e-12), T::Real::literal(-0.5), exact);
        let (hx2, hy2): (T::Real, T::Real) = (hx * hx, hy * hy);
        let power = ((self.nu * hx2 + self.nv * hy2) * slope).exp();
        self.norm * power / (g.cos_d * g.cos_i().greater(g.cos_o()))
    }
}

/// The lobe without its reflectance and base, with the same exponent along x and y.
pub(crate) struct IsotropicLobe;

impl Kernel for IsotropicLobe {
    type Prepared<T: Scalar> = Exponents<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(exponents: &Exponents<T>, g: &Geometry<T::Real>) -> [T; 1] {
        [exponents.lobe(g)]
    }
}

impl Part for IsotropicLobe {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Exponents<T> {
        let [n] = shapes.take();
        Exponents::new(n, n)
    }
}

/// The declaration of an exponent as a parameter.
pub(crate) fn exponent(name: &'static str, summary: &'static str) -> ParamSpec {
    ParamSpec::shape(name, summary, (0.01, 1e6), (2.0, 1e5), 30.0, Scale::Log)
}

impl Kernel for AshikhminShirley {
    const FUNCTIONS: usize = 3;
    type Prepared<T: Scalar> = Exponents<T>;
    type Output<T: Scalar> = [T; 3];

    #[inline(always)]
    fn at<T: Scalar>(e: &Exponents<T>, g: &Geometry<T::Real>) -> [T; 3] {
        let lobe = e.lobe(g);
        let nothing = [T::Real::literal(0.0); 3];
        let [fallen, risen, _] = Schlick::factors::<T::Real>(&nothing, g.cos_d, g.one_less_cos_d);
        let diffuse: T::Real = (diffuse_rise(g.cos_i()) * diffuse_rise(g.cos_o())).times(28.0 / (23.0 * PI));
        [T::from_real(diffuse), lobe * fallen, lobe * risen]
    }
}

/// 1 - (1 - cos/2)^5, the factor of f0 in Schlick's reflectance at cos/2.
#[inline(always)]
fn diffuse_rise<R: Real>(cos: R) -> R {
    let half: R = cos.times(0.5);
    let [rise, ..] = Schlick::factors::<R>(&[R::literal(0.0); 3], half, (-half).plus(1.0));
    rise
}

impl Part for AshikhminShirley {
    type Kernel = Self;
    const SHAPES: usize = 2;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Exponents<T> {
        let [nu, nv] = shapes.take();
        Exponents::new(nu, nv)
    }
}

impl Model for AshikhminShirley {
    type Coefficients<T: Scalar> = [T; 3];

    const NAME: &'static str = "ashikhmin-shirley";
    const SUMMARY: &'static str = "anisotropic Phong lobe over a coupled diffuse base";
    const REFERENCE: &'static str =
        "Ashikhmin and Shirley 2000, An Anisotropic Phong BRDF Model, doi:10.1080/10867651.2000.10487522";

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        vec![
            ParamSpec::amplitude("rd", "diffuse reflectance", 1.0, 0.2),
            ParamSpec::amplitude("rs", "specular reflectance at normal incidence", 1.0, 0.05),
            exponent("nu", "Phong exponent along x").sharper_when(Sharper::Larger),
            exponent("nv", "Phong exponent along y").isotropic_as("nu"),
        ]
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        visitor.part::<Self>(0);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 3] {
        let [rd, rs] = amplitudes.take();
        [rd * (-rs).plus(1.0), rs, T::constant(1.0)]
    }

    fn strength(&self) -> Strength {
        Strength::Missing
    }
}
