//! Low's Ashikhmin-Shirley: the isotropic lobe over a Lambert base, as in a published table of fits.
//!
//! ```text
//! f = kd/pi + ks (n + 1)/(8 pi) (n.h)^n F/(mu max(ci, co)),   mu = wi.h
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | kd | 1 | 0..2 | albedo of the diffuse base |
//! | ks | 1 | 0..1000 | scale of the lobe |
//! | n | 1 | 0.001..1e6 | exponent; 10 satin, 1000 polished |
//! | eta | 1 | 1.0001..3 | refractive index, the same in all channels; 1.5 glass and plastic |
//!
//! Low, Kronander, Ynnerman and Unger 2012 (doi:10.1145/2077341.2077350), whose supplement lists fits of the 100 MERL materials.
//! A row can be entered as printed: `albedo` is ks, `sharpness` n and `fresnelReflectance` eta (docs/trust/published.md). The
//! fitted indices reach 10.1, far above any dielectric: F is then nearly constant and eta is merely a scale.
//! `--bounds eta=1.0001..11` admits them.
//!
//! The lobe is that of `ashikhmin-shirley` with nu = nv = n, F is the exact reflectance of a dielectric, and the base is Lambert,
//! not the coupled one of the paper of 2000. Reciprocal; not energy conserving at grazing, where f grows without bound as
//! 1/max(ci, co); n -> 0 nearly constant.

use super::shared::{LOW, base_and_scale};
use crate::math::Scalar;
use crate::model::parts::fresnel::{DielectricIndex, FresnelReflectance, Reflectance};
use crate::model::zoo::ashikhmin_shirley::{IsotropicLobe, exponent};
use crate::model::zoo::lambert::Lambert;
use crate::model::{Choices, Model, ParamSpec, Sharper, Unit, Values, Visitor};

/// The isotropic lobe over a Lambert base, as in a published table of fits.
#[derive(Clone, Copy, Debug)]
pub struct LowAshikhminShirley;

impl Model for LowAshikhminShirley {
    type Coefficients<T: Scalar> = [T; 2];

    const NAME: &'static str = "low-ashikhmin-shirley";
    const SUMMARY: &'static str =
        "isotropic Ashikhmin-Shirley lobe over Lambert, as fitted by Low et al. 2012";
    const REFERENCE: &'static str = LOW;

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let n = ParamSpec { bounds: (0.001, 1e6), ..exponent("n", "exponent") };
        let n = n.sharper_when(Sharper::Larger);
        [base_and_scale(Unit::One), vec![n], DielectricIndex::parameters()].concat()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        Lambert::show_as_base(visitor);
        visitor.part::<IsotropicLobe>(0);
        visitor.part::<Reflectance<DielectricIndex>>(1);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 2] {
        amplitudes.take()
    }
}
