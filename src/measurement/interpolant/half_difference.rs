//! Half/difference coordinates.

use crate::geometry::Pair;
use glam::DVec3;

/// Half/difference coordinates of a pair of directions.
#[derive(Clone, Copy, Debug)]
pub(super) struct HalfDifference {
    /// Polar angle of the half vector, radians.
    pub(super) theta_h: f64,
    /// Cosine and sine of its azimuth; (1, 0) if that is undefined.
    pub(super) azimuth: (f64, f64),
    /// Difference angle.
    pub(super) theta_d: f64,
    /// (wi - wo)/2, which is perpendicular to the half vector and has length sin(theta_d).
    pub(super) difference: DVec3,
    /// sin(theta_d) cos(phi_d), the component of the difference in the plane of the normal and the half vector.
    pub(super) along: f64,
    /// sin(theta_d) sin(phi_d).
    pub(super) across: f64,
}

impl HalfDifference {
    pub(super) fn of(pair: &Pair) -> Self {
        let (sum, difference) = (0.5 * (pair.wi + pair.wo), 0.5 * (pair.wi - pair.wo));
        // Only opposite directions, both in the horizon, have no half vector.
        let h = sum.normalize_or(DVec3::Z);
        let sin_h = h.x.hypot(h.y);
        let azimuth = if sin_h > 0.0 { (h.x / sin_h, h.y / sin_h) } else { (1.0, 0.0) };
        let (cos_phi, sin_phi) = azimuth;
        Self {
            theta_h: sin_h.atan2(h.z),
            azimuth,
            theta_d: difference.length().atan2(sum.length()),
            difference,
            along: (difference.x * cos_phi + difference.y * sin_phi) * h.z - difference.z * sin_h,
            across: difference.y * cos_phi - difference.x * sin_phi,
        }
    }
}
