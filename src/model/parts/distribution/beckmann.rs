//! Beckmann: normally distributed slopes.
//!
//! ```text
//! d=beckmann:             D = exp(-tan^2/m^2) / (pi m^2 cos^4)        of the half vector's polar angle
//! d=beckmann-anisotropic: D = exp(-(hx^2/mx^2 + hy^2/my^2)/hz^2) / (pi mx my hz^4)
//! cos (1 + 2 Lambda) = m sin exp(-x^2)/sqrt(pi) + cos erf(x),   x = cos/(m sin)
//! ```
//!
//! where (m sin)^2 is mx^2 vx^2 + my^2 vy^2 for two roughnesses. Beckmann and Spizzichino 1963; Cook and Torrance 1982
//! (doi:10.1145/357290.357293), with the pi that several texts leave out; Smith 1967 (doi:10.1109/TAP.1967.1138991). m is the
//! root-mean-square slope. D underflows to 0 where tan > 27 m: the surface has no such facets.

use super::{FacetDistribution, Roughness, SmithForm, exp_times};
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::{ParamSpec, Values};
use std::f64::consts::{FRAC_1_PI, FRAC_2_SQRT_PI};
use std::marker::PhantomData;

pub(super) struct Beckmann<R>(PhantomData<R>);

impl<R: Roughness> FacetDistribution for Beckmann<R> {
    const SHAPES: usize = R::SHAPES;
    type Smith = Self;
    type Beckmann = R;
    type Prepared<T: Scalar> = (R::Prepared<T>, T);

    fn parameters() -> Vec<ParamSpec> {
        R::parameters()
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> (R::Prepared<T>, T) {
        let m = R::prepare(&mut shapes);
        (m, R::product(&m).recip().times(FRAC_1_PI))
    }

    #[inline(always)]
    fn density<T: Scalar>((m, peak): &(R::Prepared<T>, T), g: &Geometry<T::Real>) -> T {
        let cos2: T::Real = g.cos_h() * g.cos_h();
        let cos4: T::Real = cos2 * cos2;
        exp_times(-R::squared_slope(m, g), *peak / cos4)
    }

    fn prepare_smith<T: Scalar>(mut shapes: Values<'_, T>) -> R::Prepared<T> {
        R::prepare(&mut shapes)
    }
}

impl<R: Roughness> SmithForm for Beckmann<R> {
    type Prepared<T: Scalar> = R::Prepared<T>;

    #[inline(always)]
    fn smith_cosines<T: Scalar>(m: &R::Prepared<T>, g: &Geometry<T::Real>) -> (T, T) {
        (
            smith_cosine(R::projected_slope2(m, g.wi), g.cos_i()),
            smith_cosine(R::projected_slope2(m, g.wo), g.cos_o()),
        )
    }
}

/// cos (1 + 2 Lambda), from (m sin)^2 and the cosine.
#[inline(always)]
fn smith_cosine<T: Scalar>(slope2: T, cos: T::Real) -> T {
    // At normal incidence the slope of the root would be infinite.
    let floor = T::constant(1e-37);
    let slope = T::if_less(floor.value(), slope2.value(), slope2, floor).sqrt();
    // Beyond x = 26 shadowing is below 1e-290. Towards normal incidence, where x is infinite, the derivatives of x^2 would
    // overflow.
    let steep: T::Real = slope.value().times(26.0);
    let limited = T::if_less(cos, steep, slope, T::from_real(cos.times(1.0 / 26.0)));
    let x = T::from_real(cos) / limited;
    let spread = slope * (-(x * x)).exp().times(0.5 * FRAC_2_SQRT_PI);
    let shadowed = spread - x.erfc() * cos + cos;
    T::if_less(cos, steep, shadowed, T::from_real(cos))
}
