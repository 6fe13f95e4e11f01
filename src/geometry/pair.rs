//! A pair of directions.

use super::Geometry;
use glam::DVec3;

/// A pair of unit directions: to the light, to the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// To the light.
    pub wi: DVec3,
    /// To the viewer.
    pub wo: DVec3,
}

impl Pair {
    /// Everything that a model may know of the pair.
    pub(crate) fn geometry(&self) -> Geometry<f64> {
        Geometry::new(self.wi.to_array(), self.wo.to_array())
    }
}
