//! Smith's shadowing, height-correlated: G = 1/(1 + Lambda_i + Lambda_o).
//!
//! Smith 1967 (doi:10.1109/TAP.1967.1138991); Heitz 2014, eq. 99
//! (<https://jcgt.org/published/0003/02/03/>). With L = cos Lambda, finite at grazing,
//! ci co/G = ci co + co L_i + ci L_o.

use super::{Constants, Distribution, Masking};
use crate::geometry::Geometry;
use crate::math::Scalar;

pub(super) struct Smith;

impl Masking for Smith {
    fn visibility<T: Scalar>(d: Distribution, constants: &Constants<T>, g: &Geometry<T::Real>) -> T {
        let (cos_i, cos_o) = (g.cos_i(), g.cos_o());
        let light = d.cos_lambda(constants, cos_i, g.sin2_i());
        let view = d.cos_lambda(constants, cos_o, g.sin2_o());
        let product: T::Real = cos_i * cos_o;
        (light * cos_o + view * cos_i + product).recip().times(0.25)
    }
}
