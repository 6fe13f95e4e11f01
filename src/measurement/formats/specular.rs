//! Directions of view counted from the mirror direction, as the tables of Zemax and of SSDD have them.
//!
//! With the light at azimuth phi_i, the mirror direction s is at (theta_i, phi_i + 180 degrees). The radial angle r is the angle to
//! s. The azimuth a turns about s: 0 points from s towards the normal, and 90 degrees along s x (the direction at 0), so that it runs
//! counter-clockwise for whoever looks at the surface along s. Hence
//!
//! ```text
//! wo = cos(r) s + sin(r) (cos(a) u + sin(a) s x u)
//! ```
//!
//! with u the direction at a right angle to s in the plane of incidence, on the side of the normal. In the plane of incidence, azimuth
//! 0 first leads to the normal, then towards the light; azimuth 180 degrees leads to the horizon.

use super::writing::Subject;
use crate::geometry::{Pair, direction};
use crate::measurement::Measurement;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// The least cosine to the normal of a direction above the horizon; less is rounding.
pub(super) const LEAST_COSINE: f64 = 1e-9;
/// Angles in degrees that differ by less are the same.
const SAME_DEG: f64 = 1e-5;
/// The largest number of places of a table over the number of samples that it is made for.
const MOST_EMPTY: usize = 4;

/// The pair of directions at angles of incidence and angles about the mirror direction, degrees.
///
/// `offset` is added to the polar angle of the direction that the last two are counted from.
pub(super) fn pair(incidence: [f64; 2], offset: f64, radial: f64, azimuth: f64) -> Pair {
    let [theta_i, phi_i] = incidence.map(f64::to_radians);
    let frame = Frame::new(theta_i + offset.to_radians(), phi_i);
    Pair { wi: direction(theta_i, phi_i), wo: frame.view(Around::new(radial, azimuth)) }
}

/// Angles about the mirror direction.
#[derive(Clone, Copy)]
pub(super) struct Around {
    radial: Turn,
    azimuth: Turn,
}

/// An angle.
#[derive(Clone, Copy)]
struct Turn {
    sin: f64,
    cos: f64,
}

impl Turn {
    fn new(degrees: f64) -> Self {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Self { sin, cos }
    }
}

impl Around {
    /// Angles in degrees.
    pub(super) fn new(radial: f64, azimuth: f64) -> Self {
        Self { radial: Turn::new(radial), azimuth: Turn::new(azimuth) }
    }

    /// All combinations of two lists of angles in degrees, the radial one faster.
    pub(super) fn all(radials: &[f64], azimuths: &[f64]) -> Vec<Self> {
        let radials: Vec<Turn> = radials.iter().copied().map(Turn::new).collect();
        let azimuths = azimuths.iter().copied().map(Turn::new);
        azimuths
            .flat_map(|azimuth| radials.iter().map(move |radial| Self { radial: *radial, azimuth }))
            .collect()
    }

    /// The direction at these angles about the z axis.
    pub(super) fn direction(self) -> DVec3 {
        let Self { radial, azimuth } = self;
        DVec3::new(radial.sin * azimuth.cos, radial.sin * azimuth.sin, radial.cos)
    }
}

/// The axes about the mirror direction.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    mirror: DVec3,
    up: DVec3,
    across: DVec3,
}

impl Frame {
    /// The direction at these angles.
    pub(super) fn view(&self, Around { radial, azimuth }: Around) -> DVec3 {
        self.mirror * radial.cos + (self.up * azimuth.cos + self.across * azimuth.sin) * radial.sin
    }

    /// The frame for a mirror direction at the polar angle `theta`, with the light at the azimuth `phi_i`, radians.
    pub(super) fn new(theta: f64, phi_i: f64) -> Self {
        let mirror = direction(theta, phi_i + PI);
        // The mirror direction turned by a right angle over the normal: towards the light if that is near the normal.
        let up = direction(theta - PI / 2.0, phi_i + PI);
        Self { mirror, up, across: mirror.cross(up) }
    }
}

/// The angles of a table about the mirror direction, degrees.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SpecularGrid {
    /// Azimuths of the light.
    pub rotations: Vec<f64>,
    /// Angles of incidence.
    pub incidences: Vec<f64>,
    /// Azimuths about the mirror direction.
    pub azimuths: Vec<f64>,
    /// Angles to the mirror direction.
    pub radials: Vec<f64>,
}

impl SpecularGrid {
    /// The angles at which a subject is written: those that the user gave; or else those of its samples, if they are such a table; or
    /// else angles that are dense near the mirror direction.
    pub(super) fn of(subject: &Subject<'_>) -> Self {
        let own = subject.measurement.and_then(|m| Self::of_samples(m, subject.isotropic));
        let mut grid = own.unwrap_or_else(|| Self::dense(subject.isotropic));
        if let Some(given) = subject.grid {
            let put = |list: &mut Vec<f64>, given: &[f64]| {
                if !given.is_empty() {
                    *list = given.to_vec();
                }
            };
            put(&mut grid.incidences, &given.theta_i_deg);
            put(&mut grid.radials, &given.theta_o_deg);
            put(&mut grid.azimuths, &given.phi_deg);
            if !subject.isotropic {
                put(&mut grid.rotations, &given.phi_i_deg);
            }
        }
        // What a plane mirrors is written once.
        let turned = |azimuth: &f64| {
            let azimuth = azimuth.rem_euclid(360.0);
            if subject.isotropic { azimuth.min(360.0 - azimuth) } else { azimuth }
        };
        let closed = grid.azimuths.last().is_some_and(|last| *last >= 360.0);
        grid.azimuths = sorted(grid.azimuths.iter().map(turned).collect());
        grid.rotations = sorted(grid.rotations.iter().map(|angle| angle.rem_euclid(360.0)).collect());
        grid.incidences = sorted(grid.incidences);
        grid.radials = sorted(grid.radials);
        if !subject.isotropic {
            // A table that goes round is closed, because its readers do not interpolate from the last azimuth to the first.
            close(&mut grid.azimuths, closed);
            close(&mut grid.rotations, false);
        }
        grid
    }

    /// Angles that resolve the lobe of a model.
    fn dense(isotropic: bool) -> Self {
        let steps = |first: u32, step: u32, last: u32| -> Vec<f64> {
            (0..).map(|k| first + k * step).take_while(|angle| *angle <= last).map(f64::from).collect()
        };
        let near = [0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.5];
        Self {
            rotations: if isotropic { vec![0.0] } else { steps(0, 30, 330) },
            incidences: steps(0, 5, 85),
            azimuths: steps(0, 10, if isotropic { 180 } else { 360 }),
            // To the opposite of the mirror direction, so that every direction above the horizon lies between angles.
            radials: [near.to_vec(), steps(15, 5, 180)].concat(),
        }
    }

    /// The angles of samples that form such a table; `None` if they do not.
    pub(super) fn of_samples(measurement: &Measurement, isotropic: bool) -> Option<Self> {
        let [rotations, incidences, azimuths, radials] = lists_of(measurement, |wi, wo| {
            let (theta_i, phi_i) = polar(wi);
            let frame = Frame::new(theta_i, phi_i.unwrap_or_default());
            let (x, y) = (wo.dot(frame.up), wo.dot(frame.across));
            let radial = x.hypot(y).atan2(wo.dot(frame.mirror));
            // The mirror direction has no azimuth.
            let azimuth = (radial.sin() > SAME_DEG.to_radians()).then(|| y.atan2(x));
            let azimuth = azimuth.map(|a| if isotropic { a.abs() } else { a.rem_euclid(TAU) });
            let rotation = phi_i.filter(|_| !isotropic).map(|phi| phi.rem_euclid(TAU));
            [rotation, Some(theta_i), azimuth, Some(radial)]
        })?;
        // A scan in the plane of incidence is no table of the hemisphere.
        (azimuths.len() > 2).then_some(Self { rotations, incidences, azimuths, radials })
    }

    /// The number of places of the table.
    pub(super) fn places(&self) -> usize {
        [&self.rotations, &self.incidences, &self.azimuths, &self.radials].map(Vec::len).iter().product()
    }

    /// The pairs of directions at one azimuth and angle of incidence, and the place of each among all azimuths and radial angles, the
    /// latter faster. Directions below the horizon are left out.
    pub(super) fn above_horizon(&self, rotation: f64, incidence: f64) -> Vec<Option<Pair>> {
        let places = self.azimuths.iter().flat_map(|a| self.radials.iter().map(move |r| (*a, *r)));
        places
            .map(|(azimuth, radial)| {
                let pair = pair([incidence, rotation], 0.0, radial, azimuth);
                (pair.wi.z > LEAST_COSINE && pair.wo.z > LEAST_COSINE).then_some(pair)
            })
            .collect()
    }
}

/// The lists of angles in degrees of samples that form a table, given the four angles of a sample in radians, `None` where a sample has
/// any; `None` if they do not form a table.
pub(super) fn lists_of(
    measurement: &Measurement,
    angles: impl Fn(DVec3, DVec3) -> [Option<f64>; 4],
) -> Option<[Vec<f64>; 4]> {
    /// The largest number of angles of one kind that a table has.
    const MOST: usize = 4000;
    let mut lists = [const { Vec::new() }; 4];
    for geometry in measurement.directions.iter() {
        let found = angles(geometry.wi.into(), geometry.wo.into());
        for (list, angle) in lists.iter_mut().zip(found) {
            list.extend(angle.map(f64::to_degrees));
            if list.len() > 2 * MOST {
                *list = sorted(std::mem::take(list));
            }
            if list.len() > 2 * MOST - 1 {
                return None;
            }
        }
    }
    let lists = lists.map(|list| if list.is_empty() { vec![0.0] } else { sorted(list) });
    let places = lists.iter().try_fold(1_usize, |product, list| product.checked_mul(list.len()))?;
    (places <= MOST_EMPTY.checked_mul(measurement.directions.len())?).then_some(lists)
}

/// The polar angle of a direction, and its azimuth unless it is at the normal; radians.
pub(super) fn polar(direction: DVec3) -> (f64, Option<f64>) {
    let sin = direction.x.hypot(direction.y);
    (sin.atan2(direction.z), (sin > 1e-9).then(|| direction.y.atan2(direction.x)))
}

/// Adds 360 degrees to angles that go round from 0.
pub(super) fn close(angles: &mut Vec<f64>, was_closed: bool) {
    if let [first, _, .., last] = angles.as_slice()
        && *first == 0.0
        && (was_closed || *last > 180.0)
    {
        angles.push(360.0);
    }
}

/// Angles in ascending order, each once, without the noise of rounding.
pub(super) fn sorted(mut angles: Vec<f64>) -> Vec<f64> {
    angles.sort_by(f64::total_cmp);
    angles.dedup_by(|b, a| *b - *a < SAME_DEG);
    // An angle just below a whole turn is 0.
    if let [first, .., last] = angles.as_slice()
        && *first < SAME_DEG
        && 360.0 - *last < SAME_DEG
    {
        angles.pop();
    }
    angles.iter().map(|angle| (angle * 1e6).round() / 1e6 + 0.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    fn close_to(found: DVec3, expected: DVec3) {
        assert_abs_diff_eq!(found.x, expected.x, epsilon = 1e-14);
        assert_abs_diff_eq!(found.y, expected.y, epsilon = 1e-14);
        assert_abs_diff_eq!(found.z, expected.z, epsilon = 1e-14);
    }

    /// Places that need no arithmetic.
    #[test]
    fn azimuth_0_leads_to_the_normal_and_180_to_the_horizon() {
        for phi in [0.0, 70.0] {
            let at = |radial, azimuth| pair([30.0, phi], 0.0, radial, azimuth);
            let turn = f64::to_radians(phi);
            close_to(at(0.0, 50.0).wo, direction(30_f64.to_radians(), turn + PI));
            close_to(at(30.0, 0.0).wo, DVec3::Z);
            // Twice the angle of incidence leads back to the light.
            close_to(at(60.0, 0.0).wo, at(0.0, 0.0).wi);
            close_to(at(60.0, 180.0).wo, direction(PI / 2.0, turn + PI));
            close_to(at(90.0, 0.0).wo, direction(60_f64.to_radians(), turn));
            // Out of plane at 90 degrees: level, and to the left of whoever comes from the light and looks ahead.
            close_to(at(90.0, 90.0).wo, direction(PI / 2.0, turn + PI / 2.0));
            close_to(at(90.0, 270.0).wo, direction(PI / 2.0, turn - PI / 2.0));
        }
        // Azimuths about the normal turn as those of the surface do.
        close_to(pair([0.0, 0.0], 0.0, 20.0, 40.0).wo, direction(20_f64.to_radians(), 40_f64.to_radians()));
        // An offset moves the direction that is counted from.
        close_to(
            pair([30.0, 0.0], -30.0, 20.0, 40.0).wo,
            direction(20_f64.to_radians(), 40_f64.to_radians()),
        );
    }

    #[test]
    fn angles_of_samples_are_found_again() {
        // At normal incidence a rotation turns the azimuths, here into each other.
        let grid = SpecularGrid {
            rotations: vec![0.0, 90.0, 180.0],
            incidences: vec![0.0, 20.0, 75.0],
            azimuths: vec![0.0, 90.0, 180.0, 270.0],
            radials: vec![0.0, 1.0, 10.0, 30.0],
        };
        let mut pairs = Vec::new();
        for rotation in &grid.rotations {
            for incidence in &grid.incidences {
                pairs.extend(grid.above_horizon(*rotation, *incidence).into_iter().flatten());
            }
        }
        let values = vec![vec![1.0; pairs.len()]];
        let m = Measurement::of(vec![], crate::geometry::Directions::Scattered(pairs), values);
        assert_eq!(SpecularGrid::of_samples(&m, false), Some(grid));
    }
}
