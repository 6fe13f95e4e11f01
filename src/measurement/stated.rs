//! How a reader understood the angles of a file, so that one can ask what else they could mean.

use super::reading::{Angle, AngleUnit, AzimuthOrigin, LightDirection};

/// How a reader understood the angles that a file states.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stated {
    /// The angles that have a column, and the unit of its numbers.
    pub units: Vec<(Angle, AngleUnit)>,
    /// Where the azimuth of the viewer begins; `None` if both azimuths count from one axis.
    pub origin: Option<AzimuthOrigin>,
    /// Which way the light's direction points.
    pub light: LightDirection,
    /// The smallest azimuth of the light and of the viewer, radians. Directions do not say how often an azimuth went round.
    pub least_azimuths: [f64; 2],
}
