//! Surfaces: where rays meet them, and which light they block from their own points.
//!
//! Each surface is visible only from its outside; from behind it is invisible.

use super::frame::{Frame, Hit, Ray};
use super::mesh::Mesh;
use glam::DVec3;

#[derive(Clone, Debug)]
pub(super) enum Surface {
    Sphere(Sphere),
    Plane(Plane),
    Cylinder(Cylinder),
    Mesh(Mesh),
}

/// A sphere. Its tangents run around the pole.
#[derive(Clone, Debug)]
pub(super) struct Sphere {
    pub center: DVec3,
    pub radius: f64,
    /// Unit vector.
    pub pole: DVec3,
}

/// A rectangle.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    pub center: DVec3,
    pub frame: Frame,
    pub half_width: f64,
    pub half_height: f64,
}

/// The curved side of a solid cylinder. Its tangents run along the axis.
#[derive(Clone, Debug)]
pub(super) struct Cylinder {
    pub center: DVec3,
    /// Unit vector.
    pub axis: DVec3,
    pub radius: f64,
    pub height: f64,
}

impl Surface {
    /// Where a ray first meets the surface. `None` if it misses it or first meets it from behind.
    pub fn hit(&self, ray: &Ray) -> Option<Hit> {
        match self {
            Self::Sphere(sphere) => sphere.hit(ray),
            Self::Plane(plane) => plane.hit(ray),
            Self::Cylinder(cylinder) => cylinder.hit(ray),
            Self::Mesh(mesh) => mesh.hit(ray),
        }
    }

    /// Whether a mesh blocks the line from one of its points to a light at `distance` in a direction above the horizon.
    /// Other surfaces are flat or bound convex bodies, so only their horizon blocks light.
    pub fn hides(&self, hit: &Hit, direction: DVec3, distance: f64) -> bool {
        match self {
            Self::Sphere(_) | Self::Plane(_) | Self::Cylinder(_) => false,
            Self::Mesh(mesh) => mesh.hides(hit, direction, distance),
        }
    }
}

impl Sphere {
    fn hit(&self, ray: &Ray) -> Option<Hit> {
        let from = ray.origin - self.center;
        let along = -from.dot(ray.direction);
        // The square of half the chord, from the distance of the line to the centre; b^2 - c would lose digits for a distant
        // sphere.
        let half_squared = self.radius * self.radius - (from + ray.direction * along).length_squared();
        let t = along - half_squared.max(0.0).sqrt();
        if half_squared <= 0.0 || t <= 0.0 {
            return None;
        }
        let point = ray.at(t);
        let normal = (point - self.center).normalize();
        Some(Hit { point, frame: Frame::around(normal, self.pole), geometric: normal })
    }
}

impl Plane {
    fn hit(&self, ray: &Ray) -> Option<Hit> {
        let normal = self.frame.normal();
        let towards = -ray.direction.dot(normal);
        if towards <= 0.0 {
            return None;
        }
        let t = (ray.origin - self.center).dot(normal) / towards;
        let point = ray.at(t);
        let local = self.frame.local(point - self.center);
        let inside = local.x.abs() <= self.half_width && local.y.abs() <= self.half_height;
        (t > 0.0 && inside).then_some(Hit { point, frame: self.frame, geometric: normal })
    }
}

impl Cylinder {
    fn hit(&self, ray: &Ray) -> Option<Hit> {
        let across = |v: DVec3| v - self.axis * v.dot(self.axis);
        let (from, along) = (across(ray.origin - self.center), across(ray.direction));
        let square = along.length_squared();
        // A ray along the axis does not meet the side.
        if square <= 1e-24 {
            return None;
        }
        let nearest = -from.dot(along) / square;
        let half_squared = (self.radius * self.radius - (from + along * nearest).length_squared()) / square;
        let t = nearest - half_squared.max(0.0).sqrt();
        if half_squared <= 0.0 || t <= 0.0 {
            return None;
        }
        // A ray that enters through an end meets the side beyond the end.
        let point = ray.at(t);
        if (point - self.center).dot(self.axis).abs() > self.height / 2.0 {
            return None;
        }
        let normal = across(point - self.center).normalize();
        Some(Hit { point, frame: Frame::new(normal, self.axis), geometric: normal })
    }
}
