//! The interface of a rough surface.

use glam::{DVec2, DVec3};

/// A surface that can reflect rays.
pub(super) trait RoughSurface {
    /// Follows light from `wi`. `place`, in the unit square, determines where it meets the surface.
    fn reflect(&self, place: DVec2, wi: DVec3) -> Fate;
}

/// The fate of a ray.
pub(super) enum Fate {
    /// It escaped, reflected about a half vector of this slope (hx/hz, hy/hz).
    Escaped(DVec2),
    /// It met the surface again.
    Shadowed,
    /// It never met the surface. This cannot happen, since the surface has a bottom; if it does, the balance does not add up.
    Lost,
}
