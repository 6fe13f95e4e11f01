//! Schlick's rational approximation to Smith's shadowing: G1 = cos/(cos (1 - k) + k), k = m/2.
//!
//! Schlick 1994 (doi:10.1111/1467-8659.1330233), with the k that approximates GGX (Karis 2013); exact at m = 1, off by up to
//! 0.12 in G1 at m = 0.2 and 0.15 at 0.05. For other distributions m is that of the GGX with the same peak, 1/sqrt(pi D(n)).
//! V = 1/(4 (ci (1 - k) + k)(co (1 - k) + k)), finite at grazing.

use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::parts::distribution::{FacetDistribution, Shadows};
use crate::model::{Kernel, Part, Values};
use std::f64::consts::PI;
use std::marker::PhantomData;

pub(crate) struct SchlickSmith;

impl Shadows for SchlickSmith {
    type Visibility<D: FacetDistribution> = Visibility<D>;
}

/// The visibility of a distribution.
pub(crate) struct Visibility<D>(PhantomData<D>);

impl<D: FacetDistribution> Part for Visibility<D> {
    type Kernel = Rational;
    const SHAPES: usize = D::SHAPES;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> T {
        let normal = [0.0, 0.0, 1.0].map(T::Real::literal);
        let peak = D::density(&D::prepare(shapes), &Geometry::new(normal, normal));
        peak.times(PI).sqrt().recip().times(0.5)
    }
}

/// The visibility of all distributions, which depends only on k.
pub(crate) struct Rational;

impl Kernel for Rational {
    /// The constant k.
    type Prepared<T: Scalar> = T;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(k: &T, g: &Geometry<T::Real>) -> [T; 1] {
        let of = |cos: T::Real| *k - *k * cos + cos;
        [(of(g.cos_i()) * of(g.cos_o())).recip().times(0.25)]
    }
}
