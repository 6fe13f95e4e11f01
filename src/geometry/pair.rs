//! A pair of directions.

use super::Geometry;
use glam::DVec3;

/// A pair of unit directions: one to the light and one to the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Direction to the light.
    pub wi: DVec3,
    /// Direction to the viewer.
    pub wo: DVec3,
}

impl Pair {
    /// The geometry of the pair, as a model uses it.
    pub(crate) fn geometry(&self) -> Geometry<f64> {
        Geometry::new(self.wi.to_array(), self.wo.to_array())
    }
}
