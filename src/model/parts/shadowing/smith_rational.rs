//! Smith's shadowing with a rational approximation to Beckmann's Lambda, which avoids the exponential and the error function.
//!
//! ```text
//! G = 1/(1 + Lambda_i + Lambda_o),   a = 1/(m tan)
//! Lambda = (1 - 1.259 a + 0.396 a^2)/(3.535 a + 2.181 a^2) for a < 1.548133, else 0
//! ```
//!
//! Walter et al. 2007, eq. 27 (doi:10.2312/EGWR/EGSR07/195-206), who print G1 = 1/(1 + Lambda) and its error, less than 0.35 %.
//! G1 differs from the exact one by at most 0.31 % and G by 0.62 %. Lambda is off by 4.6 % for a < 1; for larger a its relative
//! error increases as Lambda itself decreases, up to 100 % of 0.0023 at the end. With s = m sin or, for two roughnesses,
//! s^2 = mx^2 vx^2 + my^2 vy^2,
//!
//! ```text
//! 4 ci co/G = 4 (ci co + co L_i + ci L_o)
//! L = cos Lambda = (s^2 - 1.259 s cos + 0.396 cos^2)/(3.535 s + 2.181 cos)
//! ```
//!
//! which is finite at grazing, and along the normal, where a is infinite.
//!
//! Departure: the paper's Lambda is 0 from a = 1.6 on. Between 1.548133, where the numerator first vanishes, and 1.6 it is
//! negative, down to -6e-5; that part is replaced by 0 here. So G never exceeds 1 and has no jump. It has a kink, where the
//! derivative of Lambda with respect to a changes from -0.003 to 0.
//!
//! Distributions other than Beckmann's use their own m, or mx and my. For SGD m^2 is alpha, and for ABC it is 2/(b c), with
//! which they equal Beckmann's for p = 0, and for large c. This is not their own shadowing: if they have longer tails it is
//! too weak, and the lobe gains light towards grazing. With d=ggx, m = 0.2 its albedo is 1.02 at 75 degrees, 1.29 at 85 and
//! 1.753 at 89.9.

use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::distribution::{FacetDistribution, Roughness, Shadows};
use crate::model::{Kernel, Part, PreparedBy, Values};
use std::marker::PhantomData;

/// The a from which on nothing is hidden: the smaller zero of 1 - 1.259 a + 0.396 a^2.
const END: f64 = 1.548_133_125_700_066_7;

pub(crate) struct SmithRational;

impl Shadows for SmithRational {
    type Visibility<D: FacetDistribution> = Visibility<D>;
}

/// The visibility of a distribution.
pub(crate) struct Visibility<D>(PhantomData<D>);

impl<D: FacetDistribution> Part for Visibility<D> {
    type Kernel = OfRoughness<D::Beckmann>;
    const SHAPES: usize = D::BECKMANN_SHAPES;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        D::prepare_beckmann(shapes)
    }
}

/// The visibility of all distributions with one roughness, or with two.
pub(crate) struct OfRoughness<R>(PhantomData<R>);

impl<R: Roughness> Kernel for OfRoughness<R> {
    type Prepared<T: Scalar> = R::Prepared<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(m: &R::Prepared<T>, g: &Geometry<T::Real>) -> [T; 1] {
        let (cos_i, cos_o) = (g.cos_i(), g.cos_o());
        let light = cos_lambda(R::projected_slope2(m, g.wi), cos_i);
        let view = cos_lambda(R::projected_slope2(m, g.wo), cos_o);
        let product: T::Real = cos_i * cos_o;
        [(light * cos_o + view * cos_i + product).recip().times(0.25)]
    }
}

/// cos Lambda, from (m sin)^2 and the cosine.
#[inline(always)]
fn cos_lambda<T: Scalar>(slope2: T, cos: T::Real) -> T {
    let slope = slope2.sqrt();
    let numerator = slope2 - (slope.times(1.259) - cos.times(0.396)) * cos;
    let hidden = numerator / (slope.times(3.535) + cos.times(2.181));
    // Along the normal the slope of the root is infinite; it is discarded together with the value.
    let end: T::Real = slope.value().times(END);
    T::if_less(cos, end, hidden, T::constant(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Lambda at a = 1/(m tan): the approximation, and the exact value.
    fn lambdas(a: f64) -> (f64, f64) {
        // m = 1
        let cos = a / a.hypot(1.0);
        let exact = (-a * a).exp() / (2.0 * a * PI.sqrt()) - 0.5 * libm::erfc(a);
        (cos_lambda(1.0 - cos * cos, cos) / cos, exact)
    }

    /// The bound is that of Walter et al.; the smaller figures are those in the head of this file.
    #[test]
    fn is_as_close_as_published() {
        let steps: Vec<(f64, f64, f64)> = (0..=1000)
            .map(|k| {
                let a = 1e-3 * 1e4_f64.powf(f64::from(k) / 1000.0);
                let (found, exact) = lambdas(a);
                (a, found, exact)
            })
            .collect();
        let off = |found: f64, exact: f64| ((1.0 + exact) / (1.0 + found) - 1.0).abs();
        let most = |errors: &mut dyn Iterator<Item = f64>| errors.fold(0.0, f64::max);
        let of_g1 = most(&mut steps.iter().map(|(_, found, exact)| off(*found, *exact)));
        assert!(of_g1 < 0.0035 && (of_g1 - 0.0031).abs() < 5e-5, "{of_g1}");
        let pairs = steps.iter().flat_map(|i| steps.iter().map(move |o| (i.1 + o.1, i.2 + o.2)));
        let of_g = most(&mut pairs.map(|(found, exact)| off(found, exact)));
        assert!((of_g - 0.0062).abs() < 5e-5, "{of_g}");
        let below_1 = steps.iter().filter(|(a, ..)| *a < 1.000_001);
        let of_lambda = most(&mut below_1.map(|(_, found, exact)| (found / exact - 1.0).abs()));
        assert!((of_lambda - 0.046).abs() < 5e-4, "{of_lambda}");
        let beyond = most(&mut steps.iter().filter(|(a, ..)| *a > END).map(|(.., exact)| *exact));
        assert!(beyond < 0.0023, "{beyond}");
    }

    /// It equals the paper's form where that is positive, and is never negative and never jumps.
    #[test]
    fn ends_where_the_numerator_does() {
        for k in 1..=2000 {
            let a = f64::from(k) / 1000.0;
            let numerator = 1.0 - 1.259 * a + 0.396 * a * a;
            let printed = if a < 1.6 { numerator / (3.535 * a + 2.181 * a * a) } else { 0.0 };
            let (found, _) = lambdas(a);
            assert!(
                (found - printed.max(0.0)).abs() < 1e-13 * (1.0 + printed),
                "{a}: {found}, not {printed}"
            );
        }
        let (before, _) = lambdas(END * (1.0 - 1e-9));
        assert!(before > 0.0 && before < 1e-11, "{before}");
        assert!(lambdas(END * (1.0 + 1e-9)).0 == 0.0);
    }
}
