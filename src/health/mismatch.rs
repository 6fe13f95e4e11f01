//! How much of the difference between pairs measured both ways their directions explain.
//!
//! Pairs count as exchanged if their angles agree to half a degree. On the flank of a narrow peak f changes much within that, and the
//! difference then says nothing about reciprocity. What the angles explain is estimated from how fast f changes from either sample to
//! its neighbours.

use crate::geometry::{Directions, Pair};
use crate::measurement::{Measurement, invariant_angles, measured_both_ways};

/// Largest number of pairs that are looked at; each is compared with all samples.
const MOST: usize = 500;
/// Directions that differ by less than this, radians, are the same, but for the digits of a file.
const SAME: f64 = 1e-4;
/// Number of neighbours of a sample from which its slope is taken.
const NEIGHBOURS: usize = 4;

/// The relative root mean square difference that directions explain, of the pairs measured both ways; `None` if there are none.
pub(super) fn explained(measurement: &Measurement) -> Option<f64> {
    let Directions::Scattered(pairs) = &measurement.directions else { return None };
    let both = measured_both_ways(pairs);
    let angles: Vec<[f64; 3]> = pairs.iter().map(|Pair { wi, wo }| invariant_angles(*wi, *wo)).collect();
    let (mut explained, mut scale) = (0.0, 0.0);
    for (one, other) in both.iter().step_by(both.len().div_ceil(MOST).max(1)) {
        let [theta_i, theta_o, turn] = angles[*other];
        let apart = distance(angles[*one], [theta_o, theta_i, turn]);
        let near = if apart > SAME {
            [*one, *other].map(|sample| neighbours(&angles, sample))
        } else {
            [vec![], vec![]]
        };
        for row in &measurement.values {
            let (a, b) = (row[*one], row[*other]);
            if a.is_nan() || b.is_nan() {
                continue;
            }
            scale += (a * a + b * b) / 2.0;
            let slopes = [*one, *other].into_iter().zip(&near).map(|(sample, near)| slope(row, sample, near));
            explained += (apart * slopes.fold(0.0, f64::max)).powi(2);
        }
    }
    (scale > 0.0).then(|| (explained / scale).sqrt())
}

/// The angle between two pairs of directions, radians.
fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let around = (a[2] - b[2]) * a[0].sin().min(a[1].sin());
    ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) + around * around).sqrt()
}

/// The samples closest to one, and their distances.
fn neighbours(angles: &[[f64; 3]], sample: usize) -> Vec<(usize, f64)> {
    let distances = angles.iter().map(|other| distance(angles[sample], *other)).enumerate();
    let mut others: Vec<(usize, f64)> = distances.filter(|(_, distance)| *distance > SAME).collect();
    let by_distance = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1);
    if others.len() > NEIGHBOURS {
        others.select_nth_unstable_by(NEIGHBOURS - 1, by_distance);
        others.truncate(NEIGHBOURS);
    }
    others
}

/// The steepest slope of f from a sample to its neighbours, per radian; 0 if none has a value.
fn slope(row: &[f64], sample: usize, neighbours: &[(usize, f64)]) -> f64 {
    let measured = neighbours.iter().filter(|(other, _)| !row[*other].is_nan());
    measured.map(|(other, distance)| (row[*other] - row[sample]).abs() / distance).fold(0.0, f64::max)
}
