//! A pinhole camera.

use super::frame::Ray;
use glam::DVec3;

#[derive(Clone, Debug)]
pub(super) struct Camera {
    pub position: DVec3,
    forward: DVec3,
    /// Vector from the centre of the image to its right edge, at distance 1.
    right: DVec3,
    /// Vector from the centre of the image to its upper edge, at distance 1.
    up: DVec3,
    pub width: u32,
    pub height: u32,
}

impl Camera {
    /// A camera that looks along the unit vector `forward`, with `up`, which must not be parallel to it, pointing up in the
    /// image. `half` is half of the angle between the upper and lower edge of the image, radians.
    pub fn new(position: DVec3, forward: DVec3, up: DVec3, half: f64, (width, height): (u32, u32)) -> Self {
        let right = forward.cross(up).normalize();
        let tall = half.tan();
        let wide = tall * f64::from(width) / f64::from(height);
        Self { position, forward, right: right * wide, up: right.cross(forward) * tall, width, height }
    }

    /// The ray through the centre of a pixel. Row 0 is at the top.
    pub fn ray(&self, column: u32, row: u32) -> Ray {
        let x = (2.0 * f64::from(column) + 1.0) / f64::from(self.width) - 1.0;
        let y = 1.0 - (2.0 * f64::from(row) + 1.0) / f64::from(self.height);
        let direction = (self.forward + self.right * x + self.up * y).normalize();
        Ray { origin: self.position, direction }
    }
}
