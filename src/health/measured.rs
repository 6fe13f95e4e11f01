//! Checks that a measurement obeys physics.

use super::channel::{MeasuredAlbedo, MeasuredChannel, Negative};
use super::judged::{Exchanged, Judged, Law};
use super::laws::sketch::Sketch;
use super::laws::{exchange, hemisphere};
use super::{Finding, SCHEMA, mismatch};
use crate::geometry::{Directions, HalfDifferenceGrid};
use crate::math::count;
use crate::measurement::{Measurement, coverage};
use serde::Serialize;

/// A value more than this number of standard deviations below 0 is not noise.
pub const NOISE_SIGMAS: f64 = 5.0;
/// Without standard deviations, a value below 0 by more than this share of the mean of abs(f) is not noise.
pub const NOISE_SHARE: f64 = 0.05;
/// Width of the ranges of incidence over which albedos are averaged, degrees.
const RANGE_DEG: f64 = 10.0;
/// Number of ranges of incidence: up to 80 degrees.
const RANGES: u8 = 8;

/// The result of checking a measurement.
#[derive(Clone, Debug, Serialize)]
pub struct MeasurementHealth {
    /// `brdfit.check/1`.
    pub schema: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// "measurement".
    pub subject: &'static str,
    /// The file as it was named.
    pub path: String,
    /// Its format.
    pub format: &'static str,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// Number of samples that were checked.
    pub samples: usize,
    /// Whether every law holds; null if some were not judged and none is broken.
    pub sound: Option<bool>,
    /// What each law says.
    pub laws: Vec<Law>,
    /// Relative root mean square difference of pairs measured both ways, over all channels; null if there are no such pairs.
    pub reciprocity: Option<f64>,
    /// The part of that difference that may come from directions that agree to half a degree only; null if there are no such pairs.
    pub reciprocity_error: Option<f64>,
    /// Number of those pairs.
    pub reciprocity_pairs: usize,
    /// Results per channel.
    pub channels: Vec<MeasuredChannel>,
    /// Violations of physics, and warnings.
    pub findings: Vec<Finding>,
}

/// Checks a measurement.
#[must_use]
pub fn measurement(measurement: &Measurement) -> MeasurementHealth {
    let coverage = coverage(measurement);
    let scattered = || Some(hemisphere::albedos(measurement)).filter(|albedos| !albedos.is_empty());
    let albedos = albedos_of_cells(measurement, 1).or_else(scattered);
    let mut channels = Vec::new();
    for (index, (channel, row)) in measurement.channels.iter().zip(&measurement.values).enumerate() {
        let sigma = measurement.sigma.as_ref().map(|sigma| sigma[index].as_slice());
        channels.push(MeasuredChannel {
            name: channel.name.clone(),
            negative: negative(row, sigma),
            albedo: albedos.as_ref().map(|albedos| albedos[index].clone()),
        });
    }
    let (reciprocity, reciprocity_pairs) = coverage.reciprocity.unzip();
    let reciprocity_error = mismatch::explained(measurement);
    let exchanged = reciprocity.zip(reciprocity_pairs).map(|(difference, pairs)| Exchanged {
        difference,
        explained: reciprocity_error.unwrap_or(0.0),
        pairs,
    });
    let mut judged = Judged::default();
    judged.directions(&measurement.doubts);
    judged.sign(&channels);
    let cosine = Sketch::new(measurement).as_ref().and_then(exchange::cosine);
    judged.reciprocity(measurement.directions.is_grid(), exchanged, cosine);
    judged.energy(&channels);
    MeasurementHealth {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        subject: "measurement",
        path: measurement.source.path.display().to_string(),
        format: measurement.source.format,
        sha256: measurement.source.sha256.clone(),
        samples: measurement.directions.len(),
        sound: judged.sound(),
        reciprocity,
        reciprocity_error,
        reciprocity_pairs: reciprocity_pairs.unwrap_or(0),
        channels,
        laws: judged.laws,
        findings: judged.findings,
    }
}

fn negative(row: &[f64], sigma: Option<&[f64]>) -> Negative {
    // What was not measured is below nothing.
    let (sum, n) =
        row.iter().filter(|f| !f.is_nan()).fold((0.0, 0_usize), |(sum, n), f| (sum + f.abs(), n + 1));
    let mean = sum / count(n.max(1));
    assert!(sigma.is_none_or(|sigma| sigma.len() == row.len()), "one standard deviation per value");
    let noise = |index: usize| match sigma {
        Some(sigma) => NOISE_SIGMAS * sigma[index],
        None => NOISE_SHARE * mean,
    };
    let least = row.iter().copied().fold(f64::INFINITY, f64::min);
    Negative {
        values: row.iter().filter(|f| **f < 0.0).count(),
        beyond_noise: row.iter().enumerate().filter(|(index, f)| **f < -noise(*index)).count(),
        least: if least.is_finite() { least } else { 0.0 },
    }
}

/// The sums over the cells of one of eight interlaced parts of a table: every other row along each of its three axes.
#[derive(Clone, Copy, Default)]
struct Part {
    /// Of the weights.
    weight: f64,
    /// Of the weighted values.
    value: f64,
}

impl Part {
    /// Pi times the mean value.
    fn albedo(&self) -> f64 {
        std::f64::consts::PI * self.value / self.weight
    }
}

/// Number of those parts.
const PARTS: usize = 8;

/// Where a cell belongs, twice, because it represents a pair of directions and the pair with light and viewer exchanged: the range of
/// incidence, the part, and the weight by solid angles and the cosine of viewing.
fn places(grid: &HalfDifferenceGrid, cell: u32) -> impl Iterator<Item = (usize, usize, f64)> {
    let g = grid.geometry(cell);
    let (theta_h, theta_d, phi_d) = HalfDifferenceGrid::indices(cell);
    let part = 4 * (theta_h % 2) + 2 * (theta_d % 2) + phi_d % 2;
    let weight = grid.weight(cell);
    [(g.cos_i(), g.cos_o()), (g.cos_o(), g.cos_i())].into_iter().filter_map(move |(light, view)| {
        let range = (0..RANGES).position(|k| cos_of_range(k + 1) < light)?;
        (view > 0.0).then_some((range, part, weight * view))
    })
}

/// The cosine of the angle of incidence at which a range begins.
fn cos_of_range(range: u8) -> f64 {
    (RANGE_DEG * f64::from(range)).to_radians().cos()
}

/// Albedos by channel and range of incidence: pi times the mean of f over outgoing directions, weighted by solid angle
/// and cosine, from every so many cells of a table. `None` if the samples are no cells of a table.
pub(crate) fn albedos_of_cells(measurement: &Measurement, step: usize) -> Option<Vec<Vec<MeasuredAlbedo>>> {
    let Directions::Grid { grid, cells } = &measurement.directions else { return None };
    let ranges = usize::from(RANGES);
    let mut sums = vec![vec![[Part::default(); PARTS]; ranges]; measurement.values.len()];
    let looked_at = |cell: &u32| usize::try_from(*cell).is_ok_and(|cell| cell.is_multiple_of(step));
    for (index, cell) in cells.iter().enumerate().filter(|(_, cell)| looked_at(cell)) {
        let cell = *cell;
        for (range, part, weight) in places(grid, cell) {
            let measured = sums.iter_mut().zip(&measurement.values).filter(|(_, row)| !row[index].is_nan());
            for (sums, row) in measured {
                let sum = &mut sums[range][part];
                sum.weight += weight;
                sum.value += weight * row[index];
            }
        }
    }
    // What the weights add up to if every cell has a value, and what they should add up to.
    let mut whole = vec![0.0; ranges];
    for cell in (0..HalfDifferenceGrid::CELLS).step_by(step).filter_map(|cell| u32::try_from(cell).ok()) {
        places(grid, cell).for_each(|(range, _, weight)| whole[range] += weight);
    }
    let exact = |k: u8| {
        let solid_angle = std::f64::consts::TAU * (cos_of_range(k) - cos_of_range(k + 1));
        solid_angle * std::f64::consts::PI / HalfDifferenceGrid::MEASURE
    };
    let of_range = |((parts, whole), k): (([Part; PARTS], &f64), u8)| {
        let known: Vec<Part> = parts.into_iter().filter(|part| part.weight > 0.0).collect();
        let weight: f64 = known.iter().map(|part| part.weight).sum();
        let all = Part { weight, value: known.iter().map(|part| part.value).sum() };
        let value = all.albedo();
        // A sum over cells is not the integral: an eighth of the cells gives another sum, and the cells of a range do not fill it.
        let between = known.iter().map(|part| (part.albedo() - value).abs()).fold(0.0, f64::max);
        let fill = value.abs() * (count(step) * whole / exact(k) - 1.0).abs();
        let (error, unmeasured) = (between + fill, (1.0 - weight / whole).max(0.0));
        (known.len() > 1).then_some(MeasuredAlbedo {
            theta_i_deg: [RANGE_DEG * f64::from(k), RANGE_DEG * f64::from(k + 1)],
            value,
            error,
            // Light that was not measured may be missing, and no more is known about it.
            at_least: value * (1.0 - unmeasured) - error,
            at_most: value + error,
            unmeasured,
        })
    };
    let of_channel =
        |sums: Vec<[Part; PARTS]>| sums.into_iter().zip(&whole).zip(0..RANGES).filter_map(of_range).collect();
    Some(sums.into_iter().map(of_channel).collect())
}
