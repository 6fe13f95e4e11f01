//! Low's ABC microfacet model: a lobe with a long tail, with the constants of a published table of fits.
//!
//! ```text
//! f = kd/pi + a F S G/(pi ci co),   S = (1 + b (1 - n.h))^-c
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | kd | 1 | 0..2 | albedo of the diffuse base |
//! | a | 1 | 0..1e5 | strength of the lobe |
//! | b | 1 | 0.01..1e9 | inverse width of the peak |
//! | c | 1 | 0.01..20 | decline of the tail |
//! | eta | 1 | 1.0001..3 | refractive index, the same in all channels; 1.5 glass and plastic |
//!
//! Low, Kronander, Ynnerman and Unger 2012 (doi:10.1145/2077341.2077350), eq. 19, whose supplement lists fits of the 100 MERL
//! materials. A row can be entered as printed: A, B, C and eta are a, b, c and eta (docs/trust/published.md). The fitted indices
//! reach 100, far above any dielectric: F is then nearly constant and eta is merely a scale. `--bounds eta=1.0001..100` admits
//! them.
//!
//! G is that of v-cavities, F the exact reflectance of a dielectric. The paper prints no pi in the denominator of the lobe, but
//! the fits in its supplement include it, and so does this model. S is not normalised: a is pi/(4 N) times the ks of
//! `lambert + cook-torrance(d=abc, g=v-cavity, f=dielectric)`, with the N of that distribution. If b (1 - n.h) is large in all
//! data, only a b^-c is determined, and not a and b. Reciprocal, finite at grazing.

use super::shared::{LOW, base_and_abc};
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::distribution::{Distribution, abc};
use crate::model::parts::fresnel::{DielectricIndex, FresnelReflectance, Reflectance};
use crate::model::parts::shadowing::Shadowing;
use crate::model::zoo::lambert::Lambert;
use crate::model::{Choices, Kernel, Model, ParamSpec, Part, Values, Visitor};
use std::f64::consts::FRAC_1_PI;

/// A lobe with a long tail, with the constants of a published table of fits.
#[derive(Clone, Copy, Debug)]
pub struct LowMicrofacet;

/// S for given b and c.
struct Facets;

impl Kernel for Facets {
    const SHARED_ON_RINGS: bool = true;
    type Prepared<T: Scalar> = [T; 2];
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(&[b, c]: &[T; 2], g: &Geometry<T::Real>) -> [T; 1] {
        [abc::unnormalised(b, c, T::from_real(abc::one_less_cos(g)))]
    }
}

impl Part for Facets {
    type Kernel = Self;
    const SHAPES: usize = 2;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        shapes.take()
    }
}

impl Model for LowMicrofacet {
    type Coefficients<T: Scalar> = [T; 2];

    const NAME: &'static str = "low-microfacet";
    const SUMMARY: &'static str =
        "ABC microfacet lobe over Lambert, with the constants of the fits by Low et al. 2012";
    const REFERENCE: &'static str = LOW;

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        [base_and_abc(), DielectricIndex::parameters()].concat()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        Lambert::show_as_base(visitor);
        visitor.part::<Facets>(0);
        Shadowing::VCavity.show(Distribution::Abc, visitor);
        visitor.part::<Reflectance<DielectricIndex>>(2);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 2] {
        let [kd, a] = amplitudes.take();
        [kd, a.times(4.0 * FRAC_1_PI)]
    }
}
