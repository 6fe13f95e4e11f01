//! Blinn-Phong: a power of the half vector's cosine, normalised as a facet distribution.
//!
//! ```text
//! d=blinn-phong:             D = (n + 2)/(2 pi) cos^n,   n = 2/m^2 - 2     so that D = 1/(pi m^2) at the normal, as
//!                            for Beckmann
//! d=blinn-phong-anisotropic: D = sqrt((nx + 2)(ny + 2))/(2 pi) cos^((nx hx^2 + ny hy^2)/(hx^2 + hy^2))
//! ```
//!
//! Blinn 1977 (doi:10.1145/563858.563893); Walter et al. 2007, eq. 30; two exponents: Ashikhmin and Shirley 2000
//! (doi:10.1080/10867651.2000.10487522). Its Smith integral has no closed form and is tabulated ([`SlopeTable`]). Two
//! roughnesses do more than stretch the distribution, because the power of the cosine depends on the azimuth: for them the
//! table depends on the direction too ([`DirectionalSlopeTable`](super::directional_slope_table::DirectionalSlopeTable)).
//! m = 1: n = 0, constant 1/pi.

use super::directional_slope_table::{DirectionalSlopeTable, TableOfDirections};
use super::slope_table::{ScaledTable, TableOfSlopes};
use super::{Anisotropic, FacetDistribution, Isotropic, Roughness, SlopeTable, SmithForm, exp_times};
use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::{ParamSpec, Values};
use std::f64::consts::FRAC_1_PI;
use std::marker::PhantomData;

pub(super) struct BlinnPhong<R>(PhantomData<R>);

impl<R: Shadowed> FacetDistribution for BlinnPhong<R> {
    const SHAPES: usize = R::SHAPES;
    const SMITH_TAKES_LONG: bool = true;
    type Smith = R::Smith;
    type Beckmann = R;
    type Prepared<T: Scalar> = (R::Prepared<T>, T);

    fn parameters() -> Vec<ParamSpec> {
        R::parameters()
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Self::Prepared<T> {
        let m = R::prepare(&mut shapes);
        (m, R::product(&m).recip().times(FRAC_1_PI))
    }

    #[inline(always)]
    fn density<T: Scalar>((m, peak): &Self::Prepared<T>, g: &Geometry<T::Real>) -> T {
        // n ln cos = 2 (tan^2/m^2 - tan^2) ln(cos)/tan^2, and likewise with the squared slope in units of two roughnesses. At
        // the normal ln(cos)/tan^2 is -1/2, to which it is equal in all digits below 1e-12.
        let tan2 = g.tan2_h();
        let exact: T::Real = g.ln_cos_h() / tan2;
        let ratio = T::Real::if_less(tan2, T::Real::literal(1e-12), T::Real::literal(-0.5), exact).times(2.0);
        exp_times((R::squared_slope(m, g) - tan2) * ratio, *peak)
    }

    fn prepare_smith<T: Scalar>(shapes: Values<'_, T>) -> <R::Smith as SmithForm>::Prepared<T> {
        R::prepare_smith(shapes)
    }
}

/// A roughness, with the form of Smith's shadowing of a Blinn-Phong distribution that has it.
pub(super) trait Shadowed: Roughness {
    type Smith: SmithForm;

    fn prepare_smith<T: Scalar>(shapes: Values<'_, T>) -> <Self::Smith as SmithForm>::Prepared<T>;
}

impl Shadowed for Isotropic {
    type Smith = TableOfSlopes<Self>;

    fn prepare_smith<T: Scalar>(mut shapes: Values<'_, T>) -> ScaledTable<Self, T> {
        let m = Self::prepare(&mut shapes);
        let m2 = Self::product(&m);
        // D cos^4 = 1/(pi m^2) (1 + t^2)^-(n + 4)/2, in units t = m u.
        let power = -(m2.recip().plus(1.0));
        let table = SlopeTable::new(&|u2: T| ((m2 * u2).ln_1p() * power).exp().times(FRAC_1_PI));
        (m, table)
    }
}

impl Shadowed for Anisotropic {
    type Smith = TableOfDirections;

    fn prepare_smith<T: Scalar>(mut shapes: Values<'_, T>) -> DirectionalSlopeTable<T> {
        let [mx, my]: [T; 2] = shapes.take();
        let (mx2, my2): (T, T) = (mx * mx, my * my);
        // In units of mx and my, slopes at one angle are those of one roughness m: with u the slope in these units, t = m u and
        // D cos^4 = 1/(pi mx my) (1 + t^2)^-(1/m^2 + 1), of which (1 + t^2)^-(1/m^2) is beyond u.
        DirectionalSlopeTable::new([mx2, my2], |[cos2, sin2]: [f64; 2]| {
            let m2 = mx2.times(cos2) + my2.times(sin2);
            let power = -m2.recip();
            move |u2: f64| (m2.times(u2).ln_1p() * power).exp()
        })
    }
}
