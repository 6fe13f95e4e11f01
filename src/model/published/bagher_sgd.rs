//! Bagher's SGD: a shifted gamma distribution with its own shadowing function and Fresnel term, per channel.
//!
//! ```text
//! f  = kd/pi + ks F D G1(wi) G1(wo)/(pi ci co)
//! D  = K exp(-x)/(pi x^p cos^4),   x = alpha + tan^2/alpha,   K from the normalisation
//! F  = f0 + (1 - f0)(1 - mu)^5 - f1 mu
//! G1 = max(0, 1 + lambda (1 - exp(c max(0, theta - theta0)^k)))
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | kd | 1 | 0..2 | albedo of the diffuse base |
//! | ks | 1 | 0..1000 | scale of the lobe |
//! | f0 | 1 | 0..10 | Fresnel term at normal incidence, before f1 |
//! | f1 | 1 | -10..10 | reduction of the Fresnel term at normal incidence |
//! | alpha | 1 | 1e-6..10 | scale of the squared slope |
//! | p | 1 | -1..4 | power of the tail |
//! | lambda | 1 | 1e-9..1e9 | shadowing: weight of the fall; fixed unless freed |
//! | c | 1 | 1e-9..1e120 | shadowing: scale; fixed unless freed |
//! | k | 1 | 0.5..1000 | shadowing: steepness; fixed unless freed |
//! | theta0 | radians | -1..1.5 | shadowing: where the fall begins; fixed unless freed |
//!
//! Bagher, Soler and Holzschuch 2012, Accurate Fitting of Measured Reflectances Using a Shifted Gamma Micro-facet
//! Distribution (doi:10.1111/j.1467-8659.2012.03147.x), whose supplement lists fits of the 100 MERL materials. Every parameter
//! has a value per channel, and a row can be entered as printed: `albedo` is ks, `eta` f0 and f1, `Lambda` lambda
//! (docs/trust/published.md). The printed K follows from alpha and p, and is not a parameter.
//!
//! The authors fit G1 to the shadowing that follows from D, not to the measurement; so lambda, c, k and theta0 are fixed
//! here unless freed, at values in the middle of their table. Data hardly determine them, since shadowing matters only at
//! grazing. `cook-torrance(d=sgd)` has the shadowing that follows from D. F can be outside 0..1, and f can be negative: ks,
//! f0 and f1 are three linear weights of 1 - s, s and mu, which data below 60 degrees hardly separate (the published f0
//! reach 8.5). Reciprocal; not energy conserving in general; f grows as 1/(ci co) at grazing unless G1 has fallen to 0.

use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::parts::distribution::{Distribution, relative_exp_m1};
use crate::model::parts::fresnel::{Constants, FresnelReflectance, Schlick};
use crate::model::zoo::lambert::Lambert;
use crate::model::{Choices, Kernel, Model, ParamSpec, Part, Scale, Values, Visitor};
use std::f64::consts::FRAC_1_PI;

/// A shifted gamma distribution with its own shadowing function and Fresnel term, per channel.
#[derive(Clone, Copy, Debug)]
pub struct BagherSgd;

/// G1(wi) G1(wo)/(ci co)
struct Shadowing;

/// lambda, ln c, k, theta0.
#[derive(Clone, Copy, Debug)]
struct Fall<T>([T; 4]);

impl<T: Scalar> Fall<T> {
    #[inline(always)]
    fn g1(&self, sin2: T::Real, cos: T::Real) -> T {
        /// Exponent from which on G1 is 0: exp(60) lambda is above 1 for every lambda within the bounds.
        const DARK: f64 = 60.0;
        let Self([lambda, ln_c, k, theta0]) = *self;
        let angle: T::Real = sin2.sqrt().atan2(cos);
        let beyond = -(theta0 - angle);
        // At the floor c beyond^k is 0 for every c and k, and its logarithm is still finite.
        let floor = T::from_real(T::Real::TINY);
        let beyond = T::if_less(floor.value(), beyond.value(), beyond, floor);
        let exponent = ln_c + k * beyond.ln();
        let dark = T::Real::literal(DARK.ln());
        let limited = T::if_less(exponent.value(), dark, exponent, T::from_real(dark));
        let fall = limited.exp();
        let g1 = -(lambda * (relative_exp_m1(fall) * fall)).plus(-1.0);
        let zero = T::constant(0.0);
        T::if_less(zero.value(), g1.value(), g1, zero)
    }
}

impl Kernel for Shadowing {
    type Prepared<T: Scalar> = Fall<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(fall: &Fall<T>, g: &Geometry<T::Real>) -> [T; 1] {
        let product: T::Real = g.cos_i() * g.cos_o();
        [fall.g1(g.sin2_i(), g.cos_i()) * fall.g1(g.sin2_o(), g.cos_o()) / product]
    }
}

impl Part for Shadowing {
    type Kernel = Self;
    const SHAPES: usize = 4;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Fall<T> {
        let [lambda, c, k, theta0] = shapes.take();
        Fall([lambda, c.ln(), k, theta0])
    }
}

/// 1 - s, s and mu.
struct Fresnel;

impl Kernel for Fresnel {
    const FUNCTIONS: usize = 3;
    const SHARED_ON_RINGS: bool = true;
    type Prepared<T: Scalar> = Constants<T>;
    type Output<T: Scalar> = [T; 3];

    #[inline(always)]
    fn at<T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> [T; 3] {
        let [fallen, risen, _] = Schlick::factors::<T>(constants, g.cos_d, g.one_less_cos_d);
        [fallen, risen, T::from_real(g.cos_d)]
    }
}

impl Part for Fresnel {
    type Kernel = Self;
    const SHAPES: usize = 0;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> Constants<T> {
        Schlick::prepare(shapes)
    }
}

impl Model for BagherSgd {
    type Coefficients<T: Scalar> = [T; 4];

    const NAME: &'static str = "bagher-sgd";
    const SUMMARY: &'static str = "shifted gamma distribution, its shadowing and Fresnel terms per channel";
    const REFERENCE: &'static str = "Bagher, Soler and Holzschuch 2012, Accurate Fitting of Measured Reflectances Using a Shifted Gamma \
        Micro-facet Distribution, doi:10.1111/j.1467-8659.2012.03147.x";

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let own = [
            ParamSpec::albedo("kd", "albedo of the base", 0.2),
            ParamSpec::amplitude("ks", "scale of the lobe", 1000.0, 0.2),
            ParamSpec::amplitude("f0", "Fresnel term at normal incidence, before f1", 10.0, 0.05),
            ParamSpec {
                bounds: (-10.0, 10.0),
                ..ParamSpec::amplitude("f1", "what is taken off at normal incidence", 10.0, 0.0)
            },
        ];
        let shadowing = [
            ParamSpec::shape("lambda", "weight of the fall of G1", (1e-9, 1e9), (0.5, 10.0), 3.0, Scale::Log),
            ParamSpec::shape("c", "scale of the fall of G1", (1e-9, 1e120), (0.01, 1.0), 0.1, Scale::Log),
            ParamSpec::shape(
                "k",
                "steepness of the fall of G1",
                (0.5, 1000.0),
                (5.0, 50.0),
                15.0,
                Scale::Log,
            ),
            ParamSpec::shape(
                "theta0",
                "angle in radians where G1 begins to fall",
                (-1.0, 1.5),
                (-0.2, 0.4),
                0.1,
                Scale::Linear,
            ),
        ];
        let facets = Distribution::Sgd.parameters().into_iter().map(ParamSpec::per_channel);
        let shadowing = shadowing.map(|spec| spec.per_channel().fixed());
        own.into_iter().chain(facets).chain(shadowing).collect()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        Lambert::show_as_base(visitor);
        Distribution::Sgd.show(visitor);
        visitor.part::<Shadowing>(2);
        visitor.part::<Fresnel>(6);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 4] {
        let [kd, ks, f0, f1] = amplitudes.take();
        let scale = ks.times(FRAC_1_PI);
        [kd, scale * f0, scale, -(scale * f1)]
    }

    fn products(&self) -> &'static [(&'static str, &'static str)] {
        &[("ks", "f0")]
    }
}
