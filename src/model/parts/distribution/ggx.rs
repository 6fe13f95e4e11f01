//! GGX, the Trowbridge-Reitz distribution.
//!
//! ```text
//! d=ggx:             D = m^2 / (pi (m^2 cos^2 + sin^2)^2)        of the half vector's polar angle
//!                    cos (1 + 2 Lambda) = sqrt(cos^2 + m^2 sin^2)
//! d=ggx-anisotropic: D = 1 / (pi mx my (hx^2/mx^2 + hy^2/my^2 + hz^2)^2)
//!                    cos (1 + 2 Lambda) = sqrt(vz^2 + mx^2 vx^2 + my^2 vy^2)
//! ```
//!
//! Trowbridge and Reitz 1975 (doi:10.1364/JOSA.65.000531); Walter et al. 2007, eq. 33 and 34
//! (doi:10.2312/EGWR/EGSR07/195-206); two roughnesses: Burley 2012, Heitz 2014. The usual form cos^2 (m^2 - 1) + 1 loses all
//! digits in a sharp peak; the sum of squares above does not. m -> 0: a mirror, peak 1/(pi m^2). m = 1: constant 1/pi.

use super::{FacetDistribution, Roughness, SmithForm};
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::{ParamSpec, Values};
use std::f64::consts::FRAC_1_PI;
use std::marker::PhantomData;

pub(crate) struct Ggx<R>(PhantomData<R>);

impl<R: Roughness> FacetDistribution for Ggx<R> {
    const SHAPES: usize = R::SHAPES;
    type Smith = Self;
    type Beckmann = R;
    type Prepared<T: Scalar> = (R::Prepared<T>, T);

    fn parameters() -> Vec<ParamSpec> {
        R::parameters()
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> (R::Prepared<T>, T) {
        let m = R::prepare(&mut shapes);
        (m, R::product(&m).times(FRAC_1_PI))
    }

    #[inline(always)]
    fn density<T: Scalar>((m, m2_over_pi): &(R::Prepared<T>, T), g: &Geometry<T::Real>) -> T {
        let denominator = R::stretched(m, g);
        *m2_over_pi / (denominator * denominator)
    }

    fn prepare_smith<T: Scalar>(mut shapes: Values<'_, T>) -> R::Prepared<T> {
        R::prepare(&mut shapes)
    }
}

impl<R: Roughness> SmithForm for Ggx<R> {
    type Prepared<T: Scalar> = R::Prepared<T>;

    #[inline(always)]
    fn smith_cosines<T: Scalar>(m: &R::Prepared<T>, g: &Geometry<T::Real>) -> (T, T) {
        let (cos2_i, cos2_o): (T::Real, T::Real) = (g.cos_i() * g.cos_i(), g.cos_o() * g.cos_o());
        T::sqrt_pair(R::projected_slope2(m, g.wi) + cos2_i, R::projected_slope2(m, g.wo) + cos2_o)
    }
}
