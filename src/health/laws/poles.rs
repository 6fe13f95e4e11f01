//! About the normal, azimuths make no difference: the directions at one angle to it lie on a ring, which shrinks to a point there.

use super::sketch::Sketch;
use crate::geometry::Pair;
use crate::math::{count, median};
use std::collections::BTreeMap;

/// Rings must be at angles that differ by so much to be compared, degrees.
const DIFFERENT_DEG: f64 = 25.0;
/// What is added to how much f varies on a ring, beside the least on any ring, so that noise does not decide.
const NOISE: f64 = 0.03;

/// What is taken for a ring.
#[derive(Clone, Copy)]
struct Rings {
    /// Angles that differ by less than this, degrees, are on one ring.
    step_deg: f64,
    /// The fewest samples of a ring.
    fewest: usize,
    /// The fewest pairs of rings that are compared.
    compared: usize,
    /// The angle of the other direction must differ from that of the smallest ring by so much, degrees, lest a lobe lie on a part of the ring.
    apart_deg: f64,
}

/// The rings of a goniometer.
const SET: Rings = Rings { step_deg: 0.5, fewest: 4, compared: 1, apart_deg: 0.0 };
/// Those of directions at random, which are far wider.
const RANDOM: Rings = Rings { step_deg: 12.0, fewest: 8, compared: 3, apart_deg: 25.0 };

/// How much more f varies with the azimuth on the smallest rings than on the largest, as a logarithm: below 0 where polar angles count from
/// the normal. For the directions of the light, and of the viewer, if `pairs` were those of the samples; `None` where there are no rings to
/// compare.
pub(crate) fn variation(sketch: &Sketch, pairs: &[Pair]) -> [Option<f64>; 2] {
    if !sketch.isotropic {
        return [None; 2];
    }
    let set = on(SET, pairs, &sketch.values);
    if set.iter().any(Option::is_some) { set } else { on(RANDOM, pairs, &sketch.values) }
}

/// [`variation`] on rings of one kind.
fn on(kind: Rings, pairs: &[Pair], values: &[f64]) -> [Option<f64>; 2] {
    let step = |cosine: f64| step(cosine, kind.step_deg);
    let mut rings: BTreeMap<(i32, i32), Vec<f64>> = BTreeMap::new();
    for (pair, value) in pairs.iter().zip(values).filter(|(_, value)| **value > 0.0) {
        rings.entry((step(pair.wi.z), step(pair.wo.z))).or_default().push(value.ln());
    }
    // By the other angle: the angle of each ring in steps, and how much f varies on it.
    let mut of_light: BTreeMap<i32, Vec<(i32, f64)>> = BTreeMap::new();
    let mut of_viewer = of_light.clone();
    for ((theta_i, theta_o), values) in rings.into_iter().filter(|(_, values)| values.len() >= kind.fewest) {
        let n = count(values.len());
        let mean = values.iter().sum::<f64>() / n;
        let varies = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt();
        of_light.entry(theta_o).or_default().push((theta_i, varies));
        of_viewer.entry(theta_i).or_default().push((theta_o, varies));
    }
    [of_light, of_viewer].map(|rings| {
        let compared: Vec<f64> =
            rings.iter().filter_map(|(other, rings)| kind.compare(*other, rings)).collect();
        if compared.len() < kind.compared { None } else { median(compared) }
    })
}

impl Rings {
    /// The logarithm of how much f varies on the smallest of some rings over how much it does on the largest, for one angle of the other direction.
    fn compare(self, other: i32, rings: &[(i32, f64)]) -> Option<f64> {
        let (small, on_small) = rings.iter().min_by_key(|(angle, _)| *angle)?;
        let (large, on_large) = rings.iter().max_by_key(|(angle, _)| *angle)?;
        let noise = NOISE + rings.iter().map(|(_, varies)| *varies).fold(f64::INFINITY, f64::min);
        let degrees = |steps: i32| f64::from(steps) * self.step_deg;
        let different =
            degrees(large - small) > DIFFERENT_DEG && degrees((other - small).abs()) >= self.apart_deg;
        different.then(|| ((on_small + noise) / (on_large + noise)).ln())
    }
}

/// An angle to the normal in steps, from its cosine.
#[expect(clippy::cast_possible_truncation, reason = "at most 360 steps")]
fn step(cosine: f64, step_deg: f64) -> i32 {
    (cosine.clamp(-1.0, 1.0).acos().to_degrees() / step_deg).round() as i32
}
