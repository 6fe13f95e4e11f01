//! Directions, half/difference grids, and the blocks of geometry that models are evaluated on.
//!
//! In the local frame the normal is +z. `wi` points to the light and `wo` to the viewer; both are unit vectors that
//! point away from the surface (docs/use/conventions.md).

#![allow(
    clippy::indexing_slicing,
    reason = "lengths are checked where they come in; an index beyond the end is a mistake in the program"
)]

mod azimuths;
mod block;
mod directions;
mod half_difference;
mod pair;

pub use azimuths::Azimuths;
#[doc(hidden)]
pub use block::{BLOCK, Block, Row};
pub(crate) use directions::gather;
pub use directions::{Directions, direction, spherical_degrees};
pub use half_difference::HalfDifferenceGrid;
pub use pair::Pair;

use crate::math::Real;

/// The geometry of one pair of directions, as a model uses it. All vectors are unit vectors in the local frame.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<R> {
    /// Direction to the light.
    pub wi: [R; 3],
    /// Direction to the viewer.
    pub wo: [R; 3],
    /// Half vector, normalise(wi + wo).
    pub h: [R; 3],
    /// Cosine of the difference angle, wi.h = wo.h.
    pub cos_d: R,
    /// 1 - wi.h, accurate even if the directions are close to each other.
    pub one_less_cos_d: R,
}

impl<R: Real> Geometry<R> {
    /// The geometry of a pair of unit directions.
    #[must_use]
    #[inline(always)]
    pub fn new(wi: [R; 3], wo: [R; 3]) -> Self {
        let [ix, iy, iz] = wi;
        let [ox, oy, oz] = wo;
        // The half vector before normalisation. Its x and y keep their digits if it is close to the normal, where 1 -
        // cos^2(theta_h) would lose them.
        let [x, y, z]: [R; 3] = [ix + ox, iy + oy, iz + oz];
        let length: R = (x * x + y * y + z * z).sqrt();
        // |wi + wo| = 2 cos(theta_d) for unit vectors, and |wi - wo| = 2 sin(theta_d): 1 - cos = sin^2/(1 + cos).
        let cos_d: R = length.times(0.5);
        let [dx, dy, dz]: [R; 3] = [ix - ox, iy - oy, iz - oz];
        let one_less_cos_d: R = (dx * dx + dy * dy + dz * dz) / cos_d.plus(1.0).times(4.0);
        Self { wi, wo, h: [x / length, y / length, z / length], cos_d, one_less_cos_d }
    }

    /// The same directions with the light mirrored about the normal.
    #[must_use]
    #[inline(always)]
    pub fn with_light_mirrored(&self) -> Self {
        let [x, y, z] = self.wi;
        Self::new([-x, -y, z], self.wo)
    }

    /// Cosine of the angle of incidence, n.wi.
    #[inline(always)]
    #[must_use]
    pub fn cos_i(&self) -> R {
        self.wi[2]
    }

    /// Cosine of the viewing angle, n.wo.
    #[inline(always)]
    #[must_use]
    pub fn cos_o(&self) -> R {
        self.wo[2]
    }

    /// Squared sine of the angle of incidence.
    #[inline(always)]
    #[must_use]
    pub fn sin2_i(&self) -> R {
        sin2(self.wi)
    }

    /// Squared sine of the viewing angle.
    #[inline(always)]
    #[must_use]
    pub fn sin2_o(&self) -> R {
        sin2(self.wo)
    }

    /// Cosine of the half vector's polar angle, n.h.
    #[inline(always)]
    #[must_use]
    pub fn cos_h(&self) -> R {
        self.h[2]
    }

    /// Squared sine of the half vector's polar angle, |n x h|^2, without cancellation near the normal.
    #[inline(always)]
    #[must_use]
    pub fn sin2_h(&self) -> R {
        sin2(self.h)
    }

    /// Squared tangent of the half vector's polar angle.
    #[inline(always)]
    #[must_use]
    pub fn tan2_h(&self) -> R {
        let cos: R = self.cos_h();
        self.sin2_h() / (cos * cos)
    }

    /// ln(n.h), accurate both if the half vector is close to the normal and if it is close to the horizon.
    #[inline(always)]
    #[must_use]
    pub fn ln_cos_h(&self) -> R {
        // With h in the horizon the logarithm stays finite; otherwise a power that underflows would have the
        // derivative 0 times infinity.
        let cos2 = (self.cos_h() * self.cos_h()).greater(R::TINY);
        // The part that rounding has removed from cos^2 near the normal, where 1 - cos^2 is exact. Towards the horizon
        // sin^2 has fewer digits than cos^2.
        let sin2 = self.sin2_h();
        let rest: R = (-cos2).plus(1.0) - sin2;
        let rest = R::if_less(sin2, R::literal(0.5), rest, R::literal(0.0));
        cos2.ln_of_sum(rest).times(0.5)
    }
}

impl Geometry<f64> {
    /// The angle of incidence in degrees, accurate near the normal.
    #[must_use]
    pub(crate) fn theta_i_deg(&self) -> f64 {
        self.sin2_i().sqrt().atan2(self.cos_i()).to_degrees()
    }

    /// The half vector's polar angle in degrees, accurate near the normal.
    #[must_use]
    pub(crate) fn theta_h_deg(&self) -> f64 {
        self.sin2_h().sqrt().atan2(self.cos_h()).to_degrees()
    }
}

#[inline(always)]
fn sin2<R: Real>(v: [R; 3]) -> R {
    let [x, y, _] = v;
    let x2: R = x * x;
    x2 + y * y
}
