//! The registry of all Fresnel reflectances.

use super::{FresnelReflectance, Reflectance};
use super::{conductor, dielectric, f82_tint, generalised_schlick, lazanyi, none, schlick};
use crate::math::Scalar;
use crate::model::parts::parts;
use crate::model::{ParamSpec, Values, Visitor};

macro_rules! fresnels {
    ($($name:literal => $module:ident::$part:ident),* $(,)?) => {
        parts! {
            /// Any Fresnel reflectance.
            Fresnel: $($name => $part),*
        }

        impl Fresnel {
            /// The parameters: shapes and amplitudes.
            #[must_use]
            pub fn parameters(self) -> Vec<ParamSpec> {
                match self { $(Self::$part => $module::$part::parameters()),* }
            }

            /// Passes the reflectance to `visitor` as a part whose shapes begin with the lobe's shape number `first`.
            pub fn show(self, first: usize, visitor: &mut impl Visitor) {
                match self { $(Self::$part => visitor.part::<Reflectance<$module::$part>>(first)),* }
            }

            /// The coefficients of the factors.
            pub fn coefficients<T: Scalar>(self, amplitudes: &mut Values<'_, T>) -> [T; 3] {
                match self { $(Self::$part => $module::$part::coefficients(amplitudes)),* }
            }
        }

        impl Fresnel {
            /// F at cosine `mu` of the difference angle. Shapes and amplitudes are in declared order, in formula units.
            #[must_use]
            pub fn reflectance(self, shapes: &[f64], amplitudes: &[f64], mu: f64) -> f64 {
                let coefficients = self.coefficients(&mut Values::new(amplitudes));
                match self { $(Self::$part => {
                    let constants = $module::$part::prepare(Values::new(shapes));
                    let factors = $module::$part::factors(&constants, mu, 1.0 - mu);
                    let terms = factors.iter().zip(&coefficients).take($module::$part::FACTORS);
                    terms.map(|(factor, coefficient)| factor * coefficient).sum()
                }),* }
            }
        }
    };
}

fresnels! {
    "schlick" => schlick::Schlick,
    "dielectric" => dielectric::Dielectric,
    "conductor" => conductor::Conductor,
    "generalised-schlick" => generalised_schlick::GeneralisedSchlick,
    "f82-tint" => f82_tint::F82Tint,
    "lazanyi" => lazanyi::Lazanyi,
    "none" => none::None,
}
