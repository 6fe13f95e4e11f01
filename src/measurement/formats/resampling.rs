//! How far a file that was written is from what it was written from, found by reading it back.

use super::format::{Format, ReadOptions};
use super::writing::Subject;
use super::{File, read_file};
use crate::error::Error;
use crate::geometry::{Directions, Geometry, Pair};
use crate::measurement::interpolant::Interpolant;
use crate::measurement::{KnownSamples, Measurement};
use crate::synthetic::scattered_directions;
use std::path::Path;

/// Differences of a file from what it was written from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resampling {
    /// Root mean square of the differences of f cos(theta_o), relative to that of f cos(theta_o) itself, all channels together.
    pub relative_rms: f64,
    /// Median of the absolute differences of f, relative to f.
    pub median: f64,
    /// Number of pairs of directions that were compared.
    pub pairs: usize,
}

/// Number of pairs at which a model is compared, and the largest number for a measurement.
const PAIRS: usize = 4000;
/// Largest angle at which a model is compared, and a measurement that has any smaller one, degrees: beyond it f grows without bound.
const STEEPEST_DEG: f64 = 80.0;

/// Reads a file back and compares it with its subject: a measurement at its own samples, a model at random directions. `None` if
/// nothing can be compared, because the channels differ.
///
/// # Errors
/// Those of the reader.
pub fn resampling(bytes: &[u8], format: &Format, subject: &Subject<'_>) -> Result<Option<Resampling>, Error> {
    let file = File::new(Path::new("what was written"), bytes)?;
    let read = read_file(file, Some(format.name), &ReadOptions::new())?;
    let (pairs, wanted) = match subject.measurement {
        Some(measurement) => {
            let least_cos = STEEPEST_DEG.to_radians().cos();
            let near = |(_, g): &(usize, Geometry<f64>)| g.cos_i().min(g.cos_o()) >= least_cos;
            let mut indices: Vec<usize> =
                measurement.directions.iter().enumerate().filter(near).map(|(index, _)| index).collect();
            if indices.is_empty() {
                indices = (0..measurement.directions.len()).collect();
            }
            // Every so many samples, so that all parts of the file are compared.
            let step = indices.len().div_ceil(PAIRS).max(1);
            let indices: Vec<usize> = indices.into_iter().step_by(step).collect();
            let part = measurement.directions.select(&indices);
            let pairs: Vec<Pair> = part.iter().map(|g| Pair { wi: g.wi.into(), wo: g.wo.into() }).collect();
            let values =
                measurement.values.iter().map(|row| crate::geometry::gather(row, &indices)).collect();
            (pairs, values)
        }
        None => {
            let pairs = scattered_directions(PAIRS, STEEPEST_DEG, 0);
            let values = (subject.at)(&pairs);
            (pairs, values)
        }
    };
    let wanted: Vec<Vec<f64>> = wanted;
    // A format that needs three channels repeats the only one.
    if read.values.len() < wanted.len() || (wanted.len() > 1 && read.values.len() > wanted.len()) {
        return Ok(None);
    }
    let found = same_samples(&read.directions, &pairs).then(|| read.values.clone());
    let found = found.unwrap_or_else(|| values_at(&read, &pairs));
    let (mut difference, mut scale) = (0.0, 0.0);
    let mut relative = Vec::new();
    for (found, wanted) in found.iter().zip(&wanted) {
        // What was not measured cannot be compared.
        let both = found.iter().zip(wanted).zip(&pairs).filter(|((a, b), _)| !(a.is_nan() || b.is_nan()));
        for ((a, b), pair) in both {
            difference += ((a - b) * pair.wo.z).powi(2);
            scale += (b * pair.wo.z).powi(2);
            if *b != 0.0 {
                relative.push(((a - b) / b).abs());
            }
        }
    }
    if scale == 0.0 || relative.is_empty() {
        return Ok(None);
    }
    relative.sort_by(f64::total_cmp);
    let median = relative.get(relative.len() / 2).copied().unwrap_or_default();
    Ok(Some(Resampling { relative_rms: (difference / scale).sqrt(), median, pairs: pairs.len() }))
}

/// The values of a measurement: those of its samples at their directions, interpolated between them.
fn values_at(measurement: &Measurement, pairs: &[Pair]) -> Vec<Vec<f64>> {
    let mut values = Interpolant::new(measurement).at(pairs).values;
    KnownSamples::new(measurement).put(measurement, pairs, &mut values);
    values
}

/// Whether the samples of a file are at these pairs, in the same order.
fn same_samples(directions: &Directions, pairs: &[Pair]) -> bool {
    // Angles that were written as text come back with a rounding.
    let close = 1e-9;
    directions.len() == pairs.len()
        && directions
            .iter()
            .zip(pairs)
            .all(|(g, pair)| pair.wi.distance(g.wi.into()) < close && pair.wo.distance(g.wo.into()) < close)
}
