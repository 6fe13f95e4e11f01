//! Fresnel reflectance F(mu) of a facet, mu = wi.h.
//!
//! A Fresnel part has one to three factors with coefficients, F = sum_k c_k(amplitudes) F_k(mu; shapes), so that f stays
//! linear in amplitudes such as Schlick's f0.

mod conductor;
mod dielectric;
mod f82_tint;
mod generalised_schlick;
mod lazanyi;
mod none;
mod normal_incidence;
mod registry;
mod schlick;

pub(crate) use conductor::{Conductor, conductor_constants};
pub(crate) use dielectric::{
    Dielectric, DielectricIndex, index_constants, index_reflectance, index_transmittance,
};
pub use normal_incidence::{Known, NAMES, eta_of_f0, f0_of_eta, f0_of_index, known_f0};
pub use registry::Fresnel;
pub(crate) use schlick::Schlick;

use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::{Kernel, ParamSpec, Part, Values};
use std::marker::PhantomData;

/// The constants that a reflectance computes from its shapes.
pub type Constants<T> = [T; 3];

/// Reflectance of a facet.
pub trait FresnelReflectance: 'static {
    /// The parameters: shapes and amplitudes.
    fn parameters() -> Vec<ParamSpec>;

    /// Number of parameters that are shapes.
    const SHAPES: usize = 0;

    /// Number of factors, 1 to 3.
    const FACTORS: usize = 1;

    /// Computes everything that depends only on the shapes, once per block.
    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> Constants<T>;

    /// The factors at cosine `mu`, with `rest` = 1 - `mu`; those beyond `FACTORS` are ignored.
    fn factors<T: Scalar>(constants: &Constants<T>, mu: T::Real, rest: T::Real) -> [T; 3];

    /// The coefficients of the factors.
    fn coefficients<T: Scalar>(_: &mut Values<'_, T>) -> [T; 3] {
        [1.0, 0.0, 0.0].map(T::constant)
    }
}

/// Fresnel reflectance as a part of a lobe.
pub struct Reflectance<F>(PhantomData<F>);

impl<F: FresnelReflectance> Kernel for Reflectance<F> {
    const FUNCTIONS: usize = F::FACTORS;
    const SHARED_ON_RINGS: bool = true;
    type Prepared<T: Scalar> = Constants<T>;
    type Output<T: Scalar> = [T; 3];

    #[inline(always)]
    fn at<T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> [T; 3] {
        F::factors(constants, g.cos_d, g.one_less_cos_d)
    }
}

impl<F: FresnelReflectance> Part for Reflectance<F> {
    type Kernel = Self;
    const SHAPES: usize = F::SHAPES;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> Constants<T> {
        F::prepare(shapes)
    }
}

#[cfg(test)]
#[expect(clippy::excessive_precision, reason = "golden values are given as computed, to 17 digits")]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn reflectance(name: &str, shapes: &[f64], amplitudes: &[f64], degrees: f64) -> f64 {
        Fresnel::named(name).reflectance(shapes, amplitudes, degrees.to_radians().cos())
    }

    #[test]
    fn golden_values() {
        let f0 = |eta: f64| ((eta - 1.0) / (eta + 1.0)).powi(2);
        for (eta, degrees, golden) in [
            (1.5, 0.0, 0.04),
            (1.5, 60.0, 0.089_186_712_802_212_783),
            (1.5, 80.0, 0.387_704_354_691_472_68),
            (1.5, 89.0, 0.904_184_949_780_189_13),
            (1.33, 0.0, 0.020_059_312_199_524_766),
            (1.33, 60.0, 0.059_125_599_247_392_293),
            (1.33, 80.0, 0.346_916_096_262_253_65),
            (1.33, 89.0, 0.896_046_505_214_435_53),
        ] {
            let f = reflectance("dielectric", &[f0(eta)], &[], degrees);
            assert_relative_eq!(f, golden, max_relative = 1e-12);
        }
        for (degrees, golden) in [
            (0.0, 0.923_371_647_509_578_54),
            (60.0, 0.918_411_084_659_369_1),
            (80.0, 0.938_558_369_711_149_86),
        ] {
            assert_relative_eq!(
                reflectance("conductor", &[0.2, 3.0], &[], degrees),
                golden,
                max_relative = 1e-12
            );
        }
        assert_relative_eq!(reflectance("schlick", &[], &[0.04], 60.0), 0.07, max_relative = 1e-12);
    }

    #[test]
    fn metals_dip_before_grazing() {
        let golden = Fresnel::F82Tint.reflectance(&[], &[0.9, 0.8], 0.3);
        assert_relative_eq!(golden, 0.798_902_140_658_564_81, max_relative = 1e-14);
        for degrees in [0.0, 40.0, 82.0, 90.0] {
            let schlick = reflectance("schlick", &[], &[0.6], degrees);
            for (name, shapes, amplitudes) in [
                ("generalised-schlick", &[5.0][..], &[0.6, 1.0]),
                ("f82-tint", &[], &[0.6, 1.0]),
                ("lazanyi", &[6.0], &[0.6, 0.0]),
            ] {
                assert_relative_eq!(
                    reflectance(name, shapes, amplitudes, degrees),
                    schlick,
                    max_relative = 1e-14
                );
            }
        }
        // By definition, tint is the reflectance at mu = 1/7 divided by Schlick's.
        let at_82 = |tint: f64| Fresnel::F82Tint.reflectance(&[], &[0.6, tint], 1.0 / 7.0);
        assert_relative_eq!(at_82(0.7), 0.7 * at_82(1.0), max_relative = 1e-14);
        // With a = b and the exponent 6 Lazanyi's is the same function.
        let b = (0.9 + 0.1 * (6.0_f64 / 7.0).powi(5)) * 0.2 * 7.0 / (6.0_f64 / 7.0).powi(6);
        assert_relative_eq!(
            Fresnel::Lazanyi.reflectance(&[6.0], &[0.9, b], 0.3),
            golden,
            max_relative = 1e-13
        );
    }

    /// Metals by their complex index near 589 nm (Johnson and Christy 1972, Rakic 1998): aluminium, chromium, iron, tungsten.
    /// Schlick's largest errors, published as 0.125, 0.19, 0.17 and 0.21, are reduced to a fraction by the term of Lazanyi and
    /// Szirmay-Kalos, whose a and alpha are searched on a grid here, and by F82-tint.
    #[test]
    fn approximations_of_metals() {
        let cosines: Vec<f64> = (0..=90).map(|i| f64::from(i).to_radians().cos()).collect();
        for (name, eta, k, most) in [
            ("aluminium", 1.18, 7.05, 0.125),
            ("chromium", 3.17, 3.33, 0.19),
            ("iron", 2.87, 3.12, 0.17),
            ("tungsten", 3.54, 2.78, 0.21),
        ] {
            let exact = |mu: f64| Fresnel::Conductor.reflectance(&[eta, k], &[], mu);
            let f0 = f0_of_index(eta, k);
            assert_relative_eq!(exact(1.0), f0, max_relative = 1e-13);
            let worst = |approximate: &dyn Fn(f64) -> f64| {
                cosines.iter().map(|mu| (approximate(*mu) - exact(*mu)).abs()).fold(0.0, f64::max)
            };
            let schlick = worst(&|mu| Fresnel::Schlick.reflectance(&[], &[f0], mu));
            assert!((schlick / most - 1.0).abs() < 0.35, "{name}: {schlick}");
            let tint = exact(1.0 / 7.0) / Fresnel::Schlick.reflectance(&[], &[f0], 1.0 / 7.0);
            let f82 = worst(&|mu| Fresnel::F82Tint.reflectance(&[], &[f0, tint], mu));
            let mut lazanyi = f64::INFINITY;
            for alpha in (10..100).map(|i| 0.1 * f64::from(i)) {
                for a in (0..100).map(|i| 0.05 * f64::from(i)) {
                    lazanyi = lazanyi.min(worst(&|mu| Fresnel::Lazanyi.reflectance(&[alpha], &[f0, a], mu)));
                }
            }
            assert!(f82 < schlick / 5.0 && lazanyi < schlick / 5.0, "{name}: {schlick} {f82} {lazanyi}");
        }
    }

    #[test]
    fn dielectric_is_a_conductor_without_absorption() {
        for degrees in [0.0, 30.0, 75.0, 89.9] {
            let f0: f64 = 0.04;
            let eta = (1.0 + f0.sqrt()) / (1.0 - f0.sqrt());
            let dielectric = reflectance("dielectric", &[f0], &[], degrees);
            let conductor = reflectance("conductor", &[eta, 0.0], &[], degrees);
            assert_relative_eq!(dielectric, conductor, max_relative = 1e-12);
        }
    }

    #[test]
    fn dielectric_limits() {
        for degrees in [0.0, 45.0, 85.0] {
            // The floor under the root leaves 1e-30 for 0.
            assert!(reflectance("dielectric", &[0.0], &[], degrees).abs() < 1e-24);
            assert_relative_eq!(reflectance("dielectric", &[1.0], &[], degrees), 1.0, max_relative = 1e-12);
        }
    }
}
