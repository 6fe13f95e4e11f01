//! Notices values that may mark what was not measured: one number at many samples, far from what the neighbours say.

use super::interpolant::leave_each_out;
use super::{Channel, Doubt, Interpolant, Measurement};
use crate::error::short;
use crate::geometry::{Azimuths, Directions, Pair};
use crate::math::{count, median};

/// Number of samples of a channel that are looked at, evenly over the file.
const LOOKED_AT: usize = 20_000;
/// A value counts as repeated from this many samples on, and from this share of those that are looked at.
const LEAST_REPEATED: usize = 5;
const LEAST_SHARE: f64 = 0.003;
/// A value that most samples have is what the material is.
const LARGEST_SHARE: f64 = 0.9;
/// Number of the most frequent values that are compared with their neighbours.
const CANDIDATES: usize = 2;
/// Number of samples that predict the others, and of those that are predicted.
const PREDICTING: usize = 2_000;
const PREDICTED: usize = 200;
/// A value is far from a prediction beyond this part of the larger of both, and beyond so many times the noise.
const FAR: f64 = 0.5;
const NOISES: f64 = 5.0;
/// The share of the samples with the value that must be far from their predictions.
const MOST: f64 = 0.9;

/// The doubts about values of a measurement that are repeated and do not fit. Tables on a grid mark cells in their own way.
pub(super) fn doubts(measurement: &Measurement) -> Vec<Doubt> {
    let Directions::Scattered(pairs) = &measurement.directions else { return Vec::new() };
    if measurement.continuous.is_some() {
        return Vec::new();
    }
    // What the neighbours say against a value that was looked at; `None` if nothing. One channel speaks for all: a marker is usually the
    // same in all of them, and so is what looks like one.
    let mut verdicts: Vec<(f64, Option<f64>)> = Vec::new();
    let mut doubts: Vec<Doubt> = Vec::new();
    for (channel, row) in measurement.channels.iter().zip(&measurement.values) {
        for marker in candidates(row) {
            let known = verdicts.iter().find(|(value, _)| *value == marker).map(|(_, verdict)| *verdict);
            let is_new = known.is_none();
            let verdict = known.unwrap_or_else(|| far_from_neighbours(measurement, pairs, row, marker));
            if is_new {
                verdicts.push((marker, verdict));
            }
            let Some(predicted) = verdict else { continue };
            let name = short(&channel.name);
            let spoken_of = doubts.iter_mut().find_map(|doubt| match doubt {
                Doubt::RepeatedValue { channels, value, .. } if *value == marker => Some(channels),
                _ => None,
            });
            match spoken_of {
                Some(channels) => channels.push(name),
                None => doubts.push(Doubt::RepeatedValue {
                    channels: vec![name],
                    value: marker,
                    samples: row.iter().filter(|v| **v == marker).count(),
                    predicted,
                }),
            }
        }
    }
    doubts
}

/// At most `most` of the numbers below `of`, evenly spread.
fn evenly(of: usize, most: usize) -> impl Iterator<Item = usize> {
    let step = of.div_ceil(most.max(1)).max(1);
    (0..of).step_by(step)
}

/// The most frequent values of a channel among those that are repeated, except where a detector that saturates explains them.
fn candidates(row: &[f64]) -> Vec<f64> {
    let mut sorted: Vec<f64> =
        evenly(row.len(), LOOKED_AT).filter_map(|k| row.get(k).copied()).filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let many = count(sorted.len());
    let mut runs: Vec<(f64, usize)> = Vec::new();
    for value in &sorted {
        match runs.last_mut() {
            Some((known, times)) if known == value => *times += 1,
            _ => runs.push((*value, 1)),
        }
    }
    // The largest value, if it stands apart. Saturation piles up right above the others.
    let apart = match runs.as_slice() {
        [.., (below, _), (largest, _)] if *below < 0.5 * largest => Some(*largest),
        _ => None,
    };
    let share = |times: usize| count(times) / many;
    runs.retain(|(value, times)| {
        // Whoever marks what was not measured takes what no reflectance is: nothing, less, or far more than all others.
        let is_odd = *value <= 0.0 || Some(*value) == apart;
        is_odd && *times >= LEAST_REPEATED && share(*times) >= LEAST_SHARE && share(*times) <= LARGEST_SHARE
    });
    runs.sort_by_key(|(_, times)| std::cmp::Reverse(*times));
    runs.into_iter().take(CANDIDATES).map(|(value, _)| value).collect()
}

/// The median of what the neighbours predict where a channel has this value, if the value is far from it. `None` if it is not.
fn far_from_neighbours(measurement: &Measurement, pairs: &[Pair], row: &[f64], value: f64) -> Option<f64> {
    let (with, without): (Vec<usize>, Vec<usize>) = (0..row.len())
        .filter(|k| row.get(*k).is_some_and(|v| v.is_finite()))
        .partition(|k| row.get(*k) == Some(&value));
    let pick = |from: &[usize], most: usize| -> (Vec<Pair>, Vec<f64>) {
        let chosen = evenly(from.len(), most).filter_map(|place| from.get(place));
        chosen.filter_map(|k| Some((*pairs.get(*k)?, *row.get(*k)?))).unzip()
    };
    let (known, values) = pick(&without, PREDICTING);
    let (asked, _) = pick(&with, PREDICTED);
    let isotropic = measurement.directions.azimuths() != Azimuths::Several;
    let left_out = leave_each_out(&known, std::slice::from_ref(&values), isotropic);
    let left_out = left_out.first()?;
    let others =
        Measurement::of(vec![Channel::named("f")], Directions::Scattered(known), vec![values.clone()]);
    let predicted = Interpolant::new(&others).at(&asked).values.into_iter().next()?;
    let is_far = |p: &&f64| (value - **p).abs() > FAR * value.abs().max(p.abs());
    let number_far = predicted.iter().filter(is_far).count();
    if count(number_far) < MOST * count(predicted.len()) {
        return None;
    }
    let level = median(predicted)?;
    // The noise of samples of about that level: where light is scarce, readings of 0 lie among others as small.
    let distance = |(f, p): (&f64, &f64)| (f - p).abs();
    let alike = values.iter().zip(left_out).filter(|(_, p)| **p > level / 3.0 && **p < level * 3.0);
    let mut distances: Vec<f64> = alike.map(distance).collect();
    if distances.len() < LEAST_REPEATED {
        distances = values.iter().zip(left_out).map(distance).collect();
    }
    ((value - level).abs() > NOISES * median(distances)?).then_some(level)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// Samples of a matte paint with a lobe, over half the hemisphere.
    fn measured(change: impl Fn(usize, [f64; 4], f64) -> f64) -> Vec<Doubt> {
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        let mut angles = Vec::new();
        for theta_i in [10.0, 30.0, 50.0] {
            for step in 0..15 {
                for turn in 0..13 {
                    angles.push([theta_i, 0.0, f64::from(step) * 5.0, f64::from(turn) * 15.0]);
                }
            }
        }
        let directions = Directions::from_degrees(angles.iter().copied()).unwrap();
        let f = |h: f64| 0.1 + 2.0 * (-(1.0 - h * h) / (0.1 * h * h)).exp();
        let values: Vec<f64> = directions
            .iter()
            .map(|g| f(g.h[2]) * (1.0 + 0.02 * (rng.random::<f64>() - 0.5)))
            .zip(&angles)
            .enumerate()
            .map(|(k, (f, angles))| change(k, *angles, f))
            .collect();
        doubts(&Measurement::new(directions, [("f", values)]).unwrap())
    }

    #[test]
    fn markers_are_noticed() {
        for marker in [-999.0, 0.0, 9999.0, -1.0, 1e30] {
            let found = measured(
                |_, [.., theta_o, phi_o], f| if theta_o < 25.0 && phi_o < 45.0 { marker } else { f },
            );
            assert!(
                matches!(found[..], [Doubt::RepeatedValue { value, .. }] if value == marker),
                "{marker}: {found:?}"
            );
        }
    }

    #[test]
    fn what_belongs_there_is_not() {
        assert_eq!(measured(|_, _, f| f), []);
        // Few digits, a detector that saturates, one value only.
        assert_eq!(measured(|_, _, f| (f * 20.0).round() / 20.0), []);
        assert_eq!(measured(|_, _, f| f.min(1.0)), []);
        assert_eq!(measured(|_, _, _| 0.25), []);
        // Noise about 0 that is cut off there.
        let noise = |k: usize| (12.9898 * count(k)).sin() * 0.5;
        assert_eq!(measured(|k, _, _| noise(k).max(0.0)), []);
    }
}
