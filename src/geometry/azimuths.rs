//! What directions tell about the azimuth of the half vector, and so about the anisotropy of a material.

use super::{Directions, Pair};
use glam::DVec3;

/// What the directions of a measurement tell about the azimuth of the half vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Azimuths {
    /// Nothing: the samples lie on a half/difference grid, which does not contain it.
    Lost,
    /// Little: all light lies in one plane through the normal, or by reciprocity all viewing does. The sample was not turned, so an
    /// anisotropic material differs from an isotropic one only in ways that another isotropic lobe has as well.
    OnePlane,
    /// Enough to tell an anisotropic material from an isotropic one.
    Several,
}

/// Azimuths that differ by less than this belong to one plane, degrees: the errors of goniometers are smaller.
const SAME_PLANE_DEG: f64 = 0.5;
/// Directions closer to the normal than this have no azimuth, degrees.
const OFF_NORMAL_DEG: f64 = 1.0;

impl Directions {
    /// What these directions tell about the azimuth of the half vector.
    #[must_use]
    pub fn azimuths(&self) -> Azimuths {
        let pairs = match self {
            Self::Grid { .. } => return Azimuths::Lost,
            Self::Scattered(pairs) => pairs,
        };
        let planes = |of: fn(&Pair) -> DVec3| planes(pairs.iter().map(of));
        match (planes(|pair| pair.wi), planes(|pair| pair.wo)) {
            // Light along the normal falls on a turned sample in the same way, and viewing along it sees the same.
            (Planes::One, _) | (_, Planes::One) | (Planes::None, Planes::None) => Azimuths::OnePlane,
            _ => Azimuths::Several,
        }
    }
}

/// The planes through the normal that contain directions.
#[derive(Clone, Copy, PartialEq)]
enum Planes {
    /// All directions are along the normal.
    None,
    One,
    Several,
}

fn planes(directions: impl Iterator<Item = DVec3>) -> Planes {
    let (least, most) = (OFF_NORMAL_DEG.to_radians().sin(), SAME_PLANE_DEG.to_radians().sin());
    let mut horizontal = directions.map(|v| v.truncate()).filter(|v| v.length() > least);
    let Some(first) = horizontal.next().map(|v| v / v.length()) else { return Planes::None };
    if horizontal.all(|v| first.perp_dot(v).abs() <= most * v.length()) {
        Planes::One
    } else {
        Planes::Several
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::HalfDifferenceGrid;
    use std::sync::Arc;

    fn of(angles: &[[f64; 4]]) -> Azimuths {
        Directions::from_degrees(angles.iter().copied()).unwrap().azimuths()
    }

    #[test]
    fn planes_are_told_apart() {
        // In-plane scans, on both sides of the normal, with azimuths that are half a turn apart or slightly wrong.
        assert_eq!(of(&[[30.0, 20.0, 40.0, 200.0], [-30.0, 20.0, 10.0, 20.0]]), Azimuths::OnePlane);
        assert_eq!(of(&[[30.0, 0.0, 40.0, 180.2], [50.0, 180.3, 0.5, 77.0]]), Azimuths::OnePlane);
        // Light from one azimuth, viewed from all around, and the same exchanged.
        assert_eq!(of(&[[30.0, 0.0, 40.0, 90.0], [60.0, 0.0, 40.0, 135.0]]), Azimuths::OnePlane);
        assert_eq!(of(&[[40.0, 90.0, 30.0, 0.0], [40.0, 135.0, 60.0, 0.0]]), Azimuths::OnePlane);
        // Light along the normal, viewed from all around, shows the anisotropy itself.
        assert_eq!(of(&[[0.0, 0.0, 40.0, 90.0], [0.0, 0.0, 40.0, 135.0]]), Azimuths::Several);
        assert_eq!(of(&[[0.0, 0.0, 40.0, 90.0], [0.0, 0.0, 30.0, 270.0]]), Azimuths::OnePlane);
        // Two in-plane scans, of which one is across.
        assert_eq!(of(&[[30.0, 0.0, 40.0, 180.0], [30.0, 90.0, 40.0, 270.0]]), Azimuths::Several);
        let grid = Arc::new(HalfDifferenceGrid::merl(0.5));
        assert_eq!(Directions::Grid { grid, cells: vec![1] }.azimuths(), Azimuths::Lost);
    }
}
