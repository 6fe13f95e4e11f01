//! Half/difference coordinates.

use crate::geometry::Pair;
use glam::DVec3;

/// Half/difference coordinates of a pair.
#[derive(Clone, Copy, Debug)]
pub(super) struct HalfDifference {
    /// Polar angle of the half vector.
    pub(super) theta_h: f64,
    /// Cosine and sine of its azimuth; (1, 0) where it has none.
    pub(super) azimuth: (f64, f64),
    /// Difference angle.
    pub(super) theta_d: f64,
    /// (wi - wo)/2: at right angles to the half vector, sin(theta_d) long.
    pub(super) difference: DVec3,
    /// sin(theta_d) cos(phi_d): the difference along the plane of normal and half vector.
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
