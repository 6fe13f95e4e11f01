//! Low's smooth-surface model: scattering by a polished surface, in terms of the projections of the directions onto it.
//!
//! ```text
//! f = kd/pi + a F(mu')/(1 + b |d|^2)^c
//! d = xy(wi) + xy(wo),   mu' = sqrt(1 - |xy(wi) - xy(wo)|^2/4)
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
//! Low, Kronander, Ynnerman and Unger 2012 (doi:10.1145/2077341.2077350), whose supplement lists fits of the 100 MERL materials.
//! A row can be entered as printed: A, B, C and eta are a, b, c and eta (docs/trust/published.md). The fitted indices reach 9.1,
//! far above any dielectric: F is then nearly constant and eta is merely a scale. `--bounds eta=1.0001..10` admits them.
//!
//! xy is the projection onto the surface, and d is the projected deviation from the mirror direction, on which the scattering of
//! smooth surfaces depends in Rayleigh-Rice theory; the power law is the ABC model of optics. F is the exact reflectance of a
//! dielectric at mu', the cosine halfway between the two directions. a is f in the mirror direction divided by F. If b |d|^2 is
//! large in all data, only a b^-c is determined, and not a and b. Reciprocal, finite everywhere.

use super::shared::{LOW, base_and_abc};
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::distribution::abc;
use crate::model::parts::fresnel::{Constants, DielectricIndex, FresnelReflectance, index_reflectance};
use crate::model::zoo::lambert::Lambert;
use crate::model::{Choices, Kernel, Model, ParamSpec, Part, Values, Visitor};

/// Scattering by a polished surface, in terms of the projections of the directions onto it.
#[derive(Clone, Copy, Debug)]
pub struct LowSmooth;

/// (1 + b |d|^2)^-c
struct Deviation;

impl Kernel for Deviation {
    type Prepared<T: Scalar> = [T; 2];
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(&[b, c]: &[T; 2], g: &Geometry<T::Real>) -> [T; 1] {
        let ([xi, yi, _], [xo, yo, _]) = (g.wi, g.wo);
        let (x, y): (T::Real, T::Real) = (xi + xo, yi + yo);
        [abc::unnormalised(b, c, T::from_real(x * x + y * y))]
    }
}

impl Part for Deviation {
    type Kernel = Self;
    const SHAPES: usize = 2;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        shapes.take()
    }
}

/// F(mu')
struct Halfway;

impl Kernel for Halfway {
    type Prepared<T: Scalar> = Constants<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> [T; 1] {
        let ([xi, yi, zi], [xo, yo, zo]) = (g.wi, g.wo);
        let (x, y): (T::Real, T::Real) = (xi + xo, yi + yo);
        // 1 - |xy(wi) - xy(wo)|^2/4 of unit vectors, written as a sum, which keeps its digits if both directions are grazing.
        let (across, upward): (T::Real, T::Real) = (x * x + y * y, zi * zi + zo * zo);
        let square: T::Real = across.times(0.25) + upward.times(0.5);
        [index_reflectance(constants, square.sqrt())]
    }
}

impl Part for Halfway {
    type Kernel = Self;
    const SHAPES: usize = DielectricIndex::SHAPES;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> Constants<T> {
        DielectricIndex::prepare(shapes)
    }
}

impl Model for LowSmooth {
    type Coefficients<T: Scalar> = [T; 2];

    const NAME: &'static str = "low-smooth";
    const SUMMARY: &'static str = "ABC smooth-surface scattering over Lambert, as fitted by Low et al. 2012";
    const REFERENCE: &'static str = LOW;

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        [base_and_abc(), DielectricIndex::parameters()].concat()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        Lambert::show_as_base(visitor);
        visitor.part::<Deviation>(0);
        visitor.part::<Halfway>(2);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 2] {
        amplitudes.take()
    }
}
