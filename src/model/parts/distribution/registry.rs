//! The registry of all facet distributions.

#[cfg(test)]
use super::SmithForm;
use super::{Anisotropic, Density, FacetDistribution, Isotropic, Shadows};
use super::{abc, beckmann, blinn_phong, exponential_power, gaussian, ggx, gtr, sgd, student_t, tabulated};
#[cfg(test)]
use crate::geometry::Geometry;
#[cfg(test)]
use crate::model::Values;
use crate::model::parts::parts;
use crate::model::{ParamSpec, Visitor};

macro_rules! distributions {
    ($($name:literal => $part:ident: $type:ty),* $(,)?) => {
        parts! {
            /// Any facet distribution.
            Distribution: $($name => $part),*
        }

        impl Distribution {
            /// Number of shapes.
            #[must_use]
            pub const fn shapes(self) -> usize {
                match self { $(Self::$part => <$type>::SHAPES),* }
            }

            /// The parameters, all of which are shapes.
            #[must_use]
            pub fn parameters(self) -> Vec<ParamSpec> {
                match self { $(Self::$part => <$type>::parameters()),* }
            }

            /// Passes the density to `visitor` as a part whose shapes are the first ones of the lobe.
            pub fn show(self, visitor: &mut impl Visitor) {
                match self { $(Self::$part => visitor.part::<Density<$type>>(0)),* }
            }

            /// Passes the visibility of the distribution under `S` to `visitor` as a part whose shapes are the first ones of the lobe.
            pub(crate) fn show_visibility<S: Shadows>(self, visitor: &mut impl Visitor) {
                match self { $(Self::$part => visitor.part::<S::Visibility<$type>>(0)),* }
            }
        }

        #[cfg(test)]
        impl Distribution {
            /// D with these shapes, 1/sr.
            pub(super) fn density(self, shapes: &[f64]) -> Box<dyn Fn(&Geometry<f64>) -> f64> {
                match self { $(Self::$part => {
                    let prepared = <$type>::prepare(Values::new(shapes));
                    Box::new(move |g| <$type>::density(&prepared, g))
                }),* }
            }

            /// cos(theta) Lambda(theta) of the light's direction with these shapes.
            pub(super) fn cos_lambda(self, shapes: &[f64]) -> Box<dyn Fn(&Geometry<f64>) -> f64> {
                match self { $(Self::$part => {
                    let prepared = <$type>::prepare_smith(Values::new(shapes));
                    Box::new(move |g| 0.5 * (<<$type as FacetDistribution>::Smith as SmithForm>::smith_cosines(&prepared, g).0 - g.cos_i()))
                }),* }
            }
        }
    };
}

distributions! {
    "ggx" => Ggx: ggx::Ggx<Isotropic>,
    "ggx-anisotropic" => GgxAnisotropic: ggx::Ggx<Anisotropic>,
    "beckmann" => Beckmann: beckmann::Beckmann<Isotropic>,
    "beckmann-anisotropic" => BeckmannAnisotropic: beckmann::Beckmann<Anisotropic>,
    "blinn-phong" => BlinnPhong: blinn_phong::BlinnPhong<Isotropic>,
    "blinn-phong-anisotropic" => BlinnPhongAnisotropic: blinn_phong::BlinnPhong<Anisotropic>,
    "gaussian" => Gaussian: gaussian::Gaussian,
    "gtr" => Gtr: gtr::Gtr,
    "student-t" => StudentT: student_t::StudentT,
    "exponential-power" => ExponentialPower: exponential_power::ExponentialPower,
    "sgd" => Sgd: sgd::Sgd,
    "abc" => Abc: abc::Abc,
    "tabulated" => Tabulated: tabulated::Tabulated,
}
