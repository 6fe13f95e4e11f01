//! Distribution-based BRDF: a density of half vectors divided by an expression that replaces all shadowing.
//!
//! ```text
//! f = ks p(h) F/(4 (ci + co - ci co)),   p(h) = D(h) (n.h),   int p(h) dh = 1
//! ```
//!
//! `d` chooses D and `f` the Fresnel part. The parameters are those of the two, and ks.
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | m, ... | 1 | 1e-4..1 | parameters of the distribution: roughness |
//! | f0, ... | 1 | | parameters of the Fresnel part |
//! | ks | 1 | 0..1000 | scale; fixed at 1 unless freed or F is none |
//!
//! Ashikhmin and Premoze 2007, Distribution-based BRDFs (technical report, University of Utah). Their p absorbs all constants;
//! here it is a density and the 4 is the half vector's Jacobian, so that along the normal the lobe is that of `cook-torrance`.
//! Measured towards the light, f gives p directly, as p F(0)/(4 (2 c - c^2)). The denominator rises from 0 at grazing to 1 along
//! the normal; it does not depend on the roughness.
//!
//! Reciprocal. f is finite if one direction is grazing, and grows without bound if both are, as 1/(ci + co). Nearly energy
//! conserving for ks <= 1. A sharp distribution makes a mirror that reflects F cos/(2 - cos), which is dark at grazing except for
//! the rise of F.

use super::cook_torrance::{CookTorrance, DISTRIBUTION, FRESNEL};
use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::parts::distribution::Distribution;
use crate::model::parts::fresnel::Fresnel;
use crate::model::parts::shadowing::Shadowing;
use crate::model::{Choices, Kernel, Model, ModelOption, ParamSpec, Part, Strength, Values, Visitor};

/// A density of half vectors divided by an expression that replaces all shadowing.
#[derive(Clone, Copy, Debug)]
pub struct DistributionBased(CookTorrance);

/// ci + co - ci co, without a difference of nearly equal numbers.
#[inline(always)]
pub(super) fn sum_less_product<R: Real>(g: &Geometry<R>) -> R {
    let (ci, co) = (g.cos_i(), g.cos_o());
    ci + co * (-ci).plus(1.0)
}

/// (n.h)/(4 (ci + co - ci co))
struct Denominator;

impl Kernel for Denominator {
    type Prepared<T: Scalar> = ();
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>((): &(), g: &Geometry<T::Real>) -> [T; 1] {
        let sum: T::Real = sum_less_product(g);
        let factor: T::Real = g.cos_h() / sum.times(4.0);
        [T::from_real(factor)]
    }
}

impl Part for Denominator {
    type Kernel = Self;
    const SHAPES: usize = 0;

    fn prepare<T: Scalar>(_: Values<'_, T>) {}
}

impl Model for DistributionBased {
    type Coefficients<T: Scalar> = [T; 3];

    const NAME: &'static str = "distribution-based";
    const SUMMARY: &'static str = "any density of half vectors over ci + co - ci co";
    const REFERENCE: &'static str =
        "Ashikhmin and Premoze 2007, Distribution-based BRDFs, University of Utah";
    const OPTIONS: &'static [ModelOption] = &[DISTRIBUTION, FRESNEL];

    fn build(choices: &Choices) -> Self {
        Self(CookTorrance {
            distribution: Distribution::named(choices.get("d")),
            shadowing: Shadowing::None,
            fresnel: Fresnel::named(choices.get("f")),
        })
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        self.0.parameters()
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        self.0.distribution.show(visitor);
        visitor.part::<Denominator>(0);
        self.0.fresnel.show(self.0.distribution.shapes(), visitor);
    }

    fn coefficients<T: Scalar>(&self, amplitudes: Values<'_, T>) -> [T; 3] {
        self.0.coefficients(amplitudes)
    }

    fn products(&self) -> &'static [(&'static str, &'static str)] {
        self.0.products()
    }

    fn strength(&self) -> Strength {
        self.0.strength()
    }
}
