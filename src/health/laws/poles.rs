//! About the normal, azimuths make no difference: the directions at one angle to it lie on a ring, which shrinks to a point there.

use super::neighbours::{median, point};
use super::sketch::Sketch;
use crate::math::count;
use std::collections::BTreeMap;

/// The fewest samples of a ring.
const FEWEST: usize = 4;
/// Rings must be at angles that differ by so much to be compared, degrees.
const DIFFERENT_DEG: f64 = 25.0;
/// What is added to how much f varies on a ring, beside the least on any ring, so that noise does not decide.
const NOISE: f64 = 0.03;
/// Angles that differ by less than this, degrees, are one.
const STEP_DEG: f64 = 0.5;

/// How much more f varies with the azimuth on the smallest rings than on the largest, as a logarithm: below 0 where polar angles count from
/// the normal. For the directions of the light, and of the viewer; `None` where there are no rings to compare.
pub(crate) fn variation(sketch: &Sketch) -> [Option<f64>; 2] {
    if !sketch.isotropic {
        return [None; 2];
    }
    let mut rings: BTreeMap<(i32, i32), Vec<f64>> = BTreeMap::new();
    for (pair, value) in sketch.pairs.iter().zip(&sketch.values).filter(|(_, value)| **value > 0.0) {
        let [.., iz, _, _, oz] = point(pair, true);
        rings.entry((step(iz), step(oz))).or_default().push(value.ln());
    }
    // By the other angle: the angle of each ring in steps, and how much f varies on it.
    let mut of_light: BTreeMap<i32, Vec<(i32, f64)>> = BTreeMap::new();
    let mut of_viewer = of_light.clone();
    for ((theta_i, theta_o), values) in rings.into_iter().filter(|(_, values)| values.len() >= FEWEST) {
        let n = count(values.len());
        let mean = values.iter().sum::<f64>() / n;
        let varies = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt();
        of_light.entry(theta_o).or_default().push((theta_i, varies));
        of_viewer.entry(theta_i).or_default().push((theta_o, varies));
    }
    [of_light, of_viewer]
        .map(|rings| median(rings.values().filter_map(|rings| smallest_to_largest(rings)).collect()))
}

/// The logarithm of how much f varies on the smallest of some rings over how much it does on the largest.
fn smallest_to_largest(rings: &[(i32, f64)]) -> Option<f64> {
    let (small, on_small) = rings.iter().min_by_key(|(angle, _)| *angle)?;
    let (large, on_large) = rings.iter().max_by_key(|(angle, _)| *angle)?;
    let noise = NOISE + rings.iter().map(|(_, varies)| *varies).fold(f64::INFINITY, f64::min);
    let different = f64::from(large - small) * STEP_DEG > DIFFERENT_DEG;
    different.then(|| ((on_small + noise) / (on_large + noise)).ln())
}

/// An angle to the normal in steps, from its cosine.
#[expect(clippy::cast_possible_truncation, reason = "at most 360 steps")]
fn step(cosine: f64) -> i32 {
    (cosine.clamp(-1.0, 1.0).acos().to_degrees() / STEP_DEG).round() as i32
}
