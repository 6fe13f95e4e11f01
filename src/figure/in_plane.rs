//! The samples of a measurement near the plane of incidence.

use crate::geometry::{Directions, Geometry};
use crate::math::{Real as _, count};

/// Directions closer to the plane of incidence than this count as in it, degrees.
pub(super) const PLANE_DEG: f64 = 2.0;
/// Light closer to the normal than this has no plane of incidence of its own; x and z span it then. Degrees.
const NORMAL_DEG: f64 = 0.05;
/// The angles of incidence to show, if they are measured, degrees.
const USUAL_DEG: [f64; 4] = [15.0, 35.0, 55.0, 75.0];
/// Width of the ranges in which angles of incidence are counted, degrees.
const RANGE_DEG: f64 = 0.5;
/// Angles of incidence closer than this to the wanted one count as it, degrees.
const SAME_DEG: f64 = 0.6;

/// A sample in the plane of incidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct InPlane {
    /// The angle of incidence, degrees.
    pub(super) theta_i: f64,
    /// The azimuth of the light, degrees.
    pub(super) phi_i: f64,
    /// The angle of viewing, degrees: positive on the side of the mirror direction.
    pub(super) theta_o: f64,
    /// How far the direction is from the plane, degrees.
    pub(super) apart: f64,
    /// The index of the sample.
    pub(super) sample: usize,
}

/// The samples near the plane of incidence. A cell of a half/difference grid counts once for either of its directions as the light.
pub(super) fn in_plane(directions: &Directions) -> Vec<InPlane> {
    let of = |g: &Geometry<f64>| [place(g.wi, g.wo), place(g.wo, g.wi)];
    let both = directions.is_grid();
    let mut found = Vec::new();
    for (sample, [given, exchanged]) in directions.each(of).into_iter().enumerate() {
        found.extend(given.map(|place| InPlane { sample, ..place }));
        found.extend(exchanged.filter(|_| both).map(|place| InPlane { sample, ..place }));
    }
    found
}

/// The angles of a pair of directions in the plane of incidence; `None` if it is not in it.
fn place(wi: [f64; 3], wo: [f64; 3]) -> Option<InPlane> {
    let [ix, iy, iz] = wi;
    let [ox, oy, oz] = wo;
    let sin_i = ix.hypot(iy);
    let near_normal = sin_i < NORMAL_DEG.to_radians().sin() && iz > 0.0;
    // The direction of the light along the surface.
    let (x, y) = if near_normal { (-1.0, 0.0) } else { (ix / sin_i, iy / sin_i) };
    // Most directions of a full table are far from the plane: angles are for the others.
    let sin_apart = (ox * y - oy * x).abs();
    if sin_apart > PLANE_DEG.to_radians().sin() || iz <= 0.0 || oz <= 0.0 {
        return None;
    }
    Some(InPlane {
        theta_i: sin_i.atan2(iz).to_degrees(),
        phi_i: if near_normal { 0.0 } else { iy.atan2(ix).to_degrees() },
        theta_o: -(ox * x + oy * y).atan2(oz).to_degrees(),
        apart: sin_apart.asin().to_degrees(),
        sample: 0,
    })
}

/// The angles of incidence to show, in degrees, ascending: those that the user wants, or the measured ones nearest to the usual four;
/// the usual four if nothing is measured in the plane.
pub(super) fn angles_of_incidence(samples: &[InPlane], wanted: &[f64]) -> Vec<f64> {
    let mut angles: Vec<f64> = if !wanted.is_empty() {
        wanted.to_vec()
    } else if samples.is_empty() {
        USUAL_DEG.to_vec()
    } else {
        measured_angles(samples)
    };
    angles.sort_by(f64::total_cmp);
    angles.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    angles
}

/// The measured angles of incidence nearest to the usual ones.
fn measured_angles(samples: &[InPlane]) -> Vec<f64> {
    // The number of samples, and the smallest and largest angle, of each narrow range.
    let mut ranges: Vec<(usize, [f64; 2])> = Vec::new();
    for sample in samples {
        let range = (sample.theta_i / RANGE_DEG + 0.5).whole();
        if ranges.len() <= range {
            ranges.resize(range + 1, (0, [f64::INFINITY, f64::NEG_INFINITY]));
        }
        if let Some((number, [low, high])) = ranges.get_mut(range) {
            (*number, *low, *high) = (*number + 1, low.min(sample.theta_i), high.max(sample.theta_i));
        }
    }
    // Angles with a handful of samples are set only to look at a detail.
    let most = ranges.iter().map(|(number, _)| *number).max().unwrap_or(0);
    let full = |number: usize| number > 0 && 5 * number >= most;
    let angle = |range: usize, [low, high]: [f64; 2]| {
        let middle = 0.5 * (low + high);
        // In a range that is filled the angle is as round as can be.
        if high - low > 0.1 { count(range) * RANGE_DEG } else { (middle * 100.0).round() / 100.0 }
    };
    let angles: Vec<f64> = ranges
        .iter()
        .enumerate()
        .filter(|(_, (n, _))| full(*n))
        .map(|(k, (_, ends))| angle(k, *ends))
        .collect();
    let nearest = |target: &f64| {
        let distance = |angle: &f64| (angle - target).abs();
        angles.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    USUAL_DEG.iter().filter_map(nearest).collect()
}

/// The samples at an angle of incidence, sorted by `theta_o`: of every two degrees of `theta_o`, and of each half near the mirror
/// direction, the one that is closest to the wanted angle and to the plane.
pub(super) fn at_angle(samples: &[InPlane], theta_i: f64) -> Vec<InPlane> {
    /// Within this of the mirror direction, degrees, samples are kept four times as densely.
    const NEAR_MIRROR_DEG: f64 = 6.0;
    let off = |sample: &InPlane| (sample.theta_i - theta_i).abs() + sample.apart;
    let key = |sample: &InPlane| {
        let near = (sample.theta_o - theta_i).abs() < NEAR_MIRROR_DEG;
        let width = if near { 0.5 } else { 2.0 };
        (near, ((sample.theta_o + 90.0) / width).whole())
    };
    let mut close: Vec<InPlane> =
        samples.iter().filter(|sample| (sample.theta_i - theta_i).abs() < SAME_DEG).copied().collect();
    close.sort_by(|a, b| key(a).cmp(&key(b)).then(off(a).total_cmp(&off(b))));
    close.dedup_by_key(|sample| key(sample));
    close.sort_by(|a, b| a.theta_o.total_cmp(&b.theta_o));
    close
}

/// The azimuth of the light, in degrees, that most samples have, to 5 degrees; 0 without samples.
pub(super) fn usual_azimuth(samples: &[InPlane]) -> f64 {
    const WIDTH: f64 = 5.0;
    let mut numbers = vec![0_usize; 73];
    for sample in samples {
        if let Some(number) = numbers.get_mut(((sample.phi_i.rem_euclid(360.0)) / WIDTH + 0.5).whole() % 72) {
            *number += 1;
        }
    }
    // Of several the first, so that the choice does not depend on the order of the samples.
    let most = numbers.iter().copied().max().unwrap_or(0);
    numbers.iter().position(|number| *number == most && most > 0).map_or(0.0, |k| count(k) * WIDTH)
}

/// Whether a sample's light has this azimuth, to 2.5 degrees, or has none.
pub(super) fn has_azimuth(sample: &InPlane, phi_i: f64) -> bool {
    let difference = (sample.phi_i - phi_i + 180.0).rem_euclid(360.0) - 180.0;
    difference.abs() <= 2.5 || sample.theta_i < NORMAL_DEG
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(angles: [f64; 4]) -> Vec<InPlane> {
        in_plane(&Directions::from_degrees([angles]).unwrap())
    }

    #[test]
    fn the_mirror_side_is_positive() {
        let mirror = of([30.0, 40.0, 50.0, 220.0])[0];
        assert!((mirror.theta_o - 50.0).abs() < 1e-9 && (mirror.theta_i - 30.0).abs() < 1e-9);
        assert!((mirror.phi_i - 40.0).abs() < 1e-9 && mirror.apart < 1e-9);
        let back = of([30.0, 40.0, 50.0, 40.0])[0];
        assert!((back.theta_o + 50.0).abs() < 1e-9);
        assert!(of([30.0, 0.0, 50.0, 90.0]).is_empty());
        // At normal incidence x and z span the plane.
        assert!((of([0.0, 0.0, 20.0, 0.0])[0].theta_o - 20.0).abs() < 1e-9);
        assert!((of([0.0, 0.0, 20.0, 180.0])[0].theta_o + 20.0).abs() < 1e-9);
    }

    #[test]
    fn angles_are_those_that_were_measured() {
        let scan = |theta_i: f64| (-8..=8).map(move |o| [theta_i, 0.0, 10.0 * f64::from(o), 0.0]);
        let angles = |all: &[f64]| {
            let directions = Directions::from_degrees(all.iter().flat_map(|t| scan(*t))).unwrap();
            angles_of_incidence(&in_plane(&directions), &[])
        };
        assert_eq!(angles(&[45.0]), [45.0]);
        assert_eq!(angles(&[0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0]), [10.0, 30.0, 50.0, 70.0]);
        assert_eq!(angles_of_incidence(&[], &[]), USUAL_DEG);
        assert_eq!(angles_of_incidence(&[], &[60.0, 5.0, 60.0]), [5.0, 60.0]);
    }
}
