//! The samples that are looked at.

use super::smoothness::{ranks, roughness};
use crate::geometry::{Directions, Pair};
use crate::math::{GOLDEN, count};
use crate::measurement::{Doubt, Measurement};

/// The most samples that are looked at.
const MOST: usize = 3000;
/// With fewer samples nothing is said.
const FEWEST: usize = 12;
/// Azimuths of the light that differ by less than this, radians, are one.
const ONE_AZIMUTH: f64 = 1e-3;

/// A surface is isotropic if turning its samples to one azimuth of the light makes them no rougher than this.
const ISOTROPIC: f64 = 1.1;

/// Some samples of a measurement, each with the mean value of its channels.
#[derive(Clone, Debug)]
pub(crate) struct Sketch {
    /// The directions of each sample.
    pub pairs: Vec<Pair>,
    /// The mean of the values of its channels, 1/sr.
    pub values: Vec<f64>,
    /// Their ranks, from 0 to 1.
    ranks: Vec<f64>,
    /// Whether f stays the same when light and viewer are turned about the normal together.
    pub isotropic: bool,
}

impl Sketch {
    /// A sketch of a measurement; `None` if it has too few samples, or none that state their directions.
    pub fn new(measurement: &Measurement) -> Option<Self> {
        let Directions::Scattered(pairs) = &measurement.directions else { return None };
        let every = thinned(pairs.len());
        let mut sketch = Self { pairs: Vec::new(), values: Vec::new(), ranks: Vec::new(), isotropic: true };
        for (index, pair) in pairs.iter().enumerate().filter(|(index, _)| every(*index)) {
            if let Some(mean) = mean(measurement, index) {
                sketch.pairs.push(*pair);
                sketch.values.push(mean);
            }
        }
        if sketch.values.len() < FEWEST {
            return None;
        }
        sketch.ranks = ranks(&sketch.values);
        let azimuths =
            sketch.pairs.iter().filter(|pair| pair.wi.z < 0.9999).map(|pair| pair.wi.y.atan2(pair.wi.x));
        let range = azimuths
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), phi| (low.min(phi), high.max(phi)));
        if range.1 - range.0 > ONE_AZIMUTH {
            let [turned, not] = [true, false].map(|isotropic| {
                sketch.isotropic = isotropic;
                sketch.roughness(&sketch.pairs).unwrap_or(f64::INFINITY)
            });
            sketch.isotropic = turned < ISOTROPIC * not;
        }
        Some(sketch)
    }

    /// The [`roughness`] of the values if these were their directions.
    pub fn roughness(&self, pairs: &[Pair]) -> Option<f64> {
        roughness(pairs, &self.ranks, self.isotropic)
    }
}

/// Whether a sample is among those that are looked at. They are spread evenly without following any pattern in the file's rows.
fn thinned(samples: usize) -> impl Fn(usize) -> bool {
    let share = count(MOST) / count(samples.max(1));
    move |index| (count(index) * GOLDEN).fract() < share
}

/// The mean of the values that a sample has, without those that seem to mark what was not measured.
fn mean(measurement: &Measurement, index: usize) -> Option<f64> {
    let marks = |value: f64| {
        measurement
            .doubts
            .iter()
            .any(|doubt| matches!(doubt, Doubt::RepeatedValue { value: mark, .. } if *mark == value))
    };
    let values = measurement.values.iter().filter_map(|row| row.get(index));
    let measured = values.filter(|value| !value.is_nan() && !marks(**value));
    let (sum, n) = measured.fold((0.0, 0_usize), |(sum, n), value| (sum + value, n + 1));
    (n > 0).then(|| sum / count(n))
}
