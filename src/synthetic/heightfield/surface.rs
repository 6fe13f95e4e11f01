//! What is asked of a rough surface.

use glam::{DVec2, DVec3};

/// A surface that rays can be sent to.
pub(super) trait RoughSurface {
    /// What becomes of light from `wi`. `place`, in the unit square, says where on the surface.
    fn reflect(&self, place: DVec2, wi: DVec3) -> Fate;
}

/// What becomes of a ray.
pub(super) enum Fate {
    /// It got away, reflected about a half vector of this slope (hx/hz, hy/hz).
    Escaped(DVec2),
    /// It met the surface again.
    Shadowed,
    /// It never met the surface, which the bottom of the surface rules out; then the balance does not add up.
    Lost,
}
