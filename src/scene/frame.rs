//! Rays, and the local frames that directions are given in.

use glam::DVec3;

/// A ray: a starting point and a direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
}

impl Ray {
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }
}

/// Where a ray meets the surface from outside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    pub point: DVec3,
    /// The local frame of the shading normal and the tangent.
    pub frame: Frame,
    /// The normal of the actual geometry; for a mesh, that of the facet.
    pub geometric: DVec3,
}

/// A right-handed orthonormal frame: z is the normal, x the tangent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    x: DVec3,
    y: DVec3,
    z: DVec3,
}

impl Frame {
    /// The frame with the unit normal `z` whose tangent is closest to `tangent`.
    ///
    /// If the two are parallel, as at the pole of a sphere, the tangent is instead as close as possible to the coordinate axis
    /// that has the largest angle to the normal.
    pub fn new(z: DVec3, tangent: DVec3) -> Self {
        let across = |v: DVec3| v - z * v.dot(z);
        // Rounding leaves less than 1e-9 of the length of a parallel vector.
        let x = Some(across(tangent)).filter(|x| x.length() > 1e-9 * tangent.length());
        let x = x.unwrap_or_else(|| {
            let least = z.abs();
            let axis = if least.x <= least.y.min(least.z) {
                DVec3::X
            } else if least.y <= least.z {
                DVec3::Y
            } else {
                DVec3::Z
            };
            across(axis)
        });
        let x = x.normalize();
        Self { x, y: z.cross(x), z }
    }

    /// The frame with normal `z` whose tangent runs around `axis`: eastward if `axis` points north.
    pub fn around(z: DVec3, axis: DVec3) -> Self {
        let east = axis.cross(z);
        Self::new(z, if east.length() > 1e-9 { east } else { z })
    }

    pub fn normal(&self) -> DVec3 {
        self.z
    }

    /// Converts a vector from world coordinates to this frame.
    pub fn local(&self, v: DVec3) -> DVec3 {
        DVec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn frames_are_orthonormal_right_handed_and_continuous() {
        let normal = |theta: f64, phi: f64| crate::geometry::direction(theta, phi);
        for i in 0..=40 {
            for j in 0..80 {
                let (theta, phi) = (f64::from(i) * 0.078_539_816, f64::from(j) * 0.078_539_816);
                let frame = Frame::around(normal(theta, phi), DVec3::Z);
                for (a, b, dot) in [
                    (frame.x, frame.x, 1.0),
                    (frame.x, frame.y, 0.0),
                    (frame.y, frame.z, 0.0),
                    (frame.z, frame.x, 0.0),
                    (frame.x.cross(frame.y), frame.z, 1.0),
                ] {
                    assert_relative_eq!(a.dot(b), dot, epsilon = 1e-14);
                }
                // Away from the poles the tangent turns no faster than the azimuth, and is horizontal.
                if i % 40 != 0 {
                    let near = Frame::around(normal(theta + 1e-6, phi + 1e-6), DVec3::Z);
                    assert!((near.x - frame.x).length() < 2e-6);
                    assert_relative_eq!(frame.x.z, 0.0, epsilon = 1e-14);
                    assert!(frame.y.z > 0.0, "y points north");
                }
            }
        }
    }
}
