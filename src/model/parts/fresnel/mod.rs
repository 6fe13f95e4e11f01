//! Fresnel reflectance F(mu) of a facet, mu = wi.h.
//!
//! A Fresnel part gives one or two factors and their coefficients, F = sum_k c_k(amplitudes) F_k(mu; shapes),
//! so that an amplitude such as Schlick's f0 stays linear.

mod conductor;
mod dielectric;
mod none;
mod schlick;

use super::parts;
use crate::math::Scalar;
use crate::model::{ParamSpec, Values};

/// Reflectance of a facet.
pub trait FresnelReflectance {
    /// Parameters, shapes and amplitudes.
    fn parameters() -> Vec<ParamSpec>;

    /// How many factors there are, 1 or 2.
    const FACTORS: usize = 1;

    /// What depends on the shapes alone, computed once per block.
    fn prepare<T: Scalar>(shapes: &mut Values<'_, T>) -> [T; 2];

    /// The factors at cosine `mu`; the second is ignored where there is one.
    fn factors<T: Scalar>(constants: &[T; 2], mu: T::Real) -> [T; 2];

    /// The coefficients of the factors.
    fn coefficients<T: Scalar>(_: &mut Values<'_, T>) -> [T; 2] {
        [T::constant(1.0), T::constant(0.0)]
    }
}

macro_rules! fresnels {
    ($($name:literal => $module:ident::$part:ident),* $(,)?) => {
        parts! {
            /// Any Fresnel reflectance.
            Fresnel: $($name => $module::$part),*
        }

        impl Fresnel {
            /// Parameters, shapes and amplitudes.
            #[must_use]
            pub fn parameters(self) -> Vec<ParamSpec> {
                match self { $(Self::$part => $module::$part::parameters()),* }
            }

            /// How many factors there are, 1 or 2.
            #[must_use]
            pub fn factor_count(self) -> usize {
                match self { $(Self::$part => $module::$part::FACTORS),* }
            }

            /// What depends on the shapes alone.
            pub fn prepare<T: Scalar>(self, shapes: &mut Values<'_, T>) -> [T; 2] {
                match self { $(Self::$part => $module::$part::prepare(shapes)),* }
            }

            /// The factors at cosine `mu`.
            pub fn factors<T: Scalar>(self, constants: &[T; 2], mu: T::Real) -> [T; 2] {
                match self { $(Self::$part => $module::$part::factors(constants, mu)),* }
            }

            /// The coefficients of the factors.
            pub fn coefficients<T: Scalar>(self, amplitudes: &mut Values<'_, T>) -> [T; 2] {
                match self { $(Self::$part => $module::$part::coefficients(amplitudes)),* }
            }
        }
    };
}

fresnels! {
    "schlick" => schlick::Schlick,
    "dielectric" => dielectric::Dielectric,
    "conductor" => conductor::Conductor,
    "none" => none::None,
}

#[cfg(test)]
#[expect(clippy::excessive_precision, reason = "golden values stand as computed, to 17 digits")]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn reflectance(name: &str, shapes: &[f64], amplitudes: &[f64], degrees: f64) -> f64 {
        let f = Fresnel::named(name);
        let factors = f.factors(&f.prepare(&mut Values::new(shapes)), degrees.to_radians().cos());
        let coefficients = f.coefficients(&mut Values::new(amplitudes));
        (0..f.factor_count()).map(|k| factors[k] * coefficients[k]).sum()
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
