//! Checks that a measurement obeys physics.

use super::{Finding, SCHEMA};
use crate::geometry::{Directions, HalfDifferenceGrid};
use crate::math::count;
use crate::measurement::{Measurement, coverage};
use serde::Serialize;

/// A value more than this number of standard deviations below 0 is not noise.
pub const NOISE_SIGMAS: f64 = 5.0;
/// Without standard deviations, a value below 0 by more than this share of the mean of abs(f) is not noise.
pub const NOISE_SHARE: f64 = 0.05;
/// Relative rms difference of pairs measured both ways above which a measurement is not reciprocal.
pub const RECIPROCITY_LIMIT: f64 = 0.2;
/// Relative rms difference of pairs measured both ways above which a warning is given.
pub const RECIPROCITY_WARNING: f64 = 0.05;
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
    /// Whether no finding breaks physics.
    pub sound: bool,
    /// Relative root mean square difference of pairs measured both ways, over all channels; null if there are no such pairs.
    pub reciprocity: Option<f64>,
    /// Number of those pairs.
    pub reciprocity_pairs: usize,
    /// Results per channel.
    pub channels: Vec<MeasuredChannel>,
    /// Violations of physics, and warnings.
    pub findings: Vec<Finding>,
}

/// The result of checking one channel.
#[derive(Clone, Debug, Serialize)]
pub struct MeasuredChannel {
    /// Its name.
    pub name: String,
    /// Values below 0.
    pub negative: Negative,
    /// Albedo per range of incidence; null if the solid angles of the samples are unknown.
    pub albedo: Option<Vec<MeasuredAlbedo>>,
}

/// Values below 0.
#[derive(Clone, Debug, Serialize)]
pub struct Negative {
    /// Number of values below 0.
    pub values: usize,
    /// Number of those that are too far below 0 to be noise.
    pub beyond_noise: usize,
    /// The smallest of all values, 1/sr.
    pub least: f64,
}

/// The albedo in a range of incidence.
#[derive(Clone, Debug, Serialize)]
pub struct MeasuredAlbedo {
    /// Smallest and largest angle of incidence, degrees.
    pub theta_i_deg: [f64; 2],
    /// The mean albedo over this range.
    pub value: f64,
    /// Difference between the albedos of two halves of the table: its even and its odd rows.
    pub error: f64,
}

/// Checks a measurement.
#[must_use]
pub fn measurement(measurement: &Measurement) -> MeasurementHealth {
    let coverage = coverage(measurement);
    let albedos = albedos(measurement);
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
    let findings = findings(&channels, reciprocity);
    MeasurementHealth {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        subject: "measurement",
        path: measurement.source.path.display().to_string(),
        format: measurement.source.format,
        sha256: measurement.source.sha256.clone(),
        samples: measurement.directions.len(),
        sound: findings.iter().all(|finding| !finding.breaks),
        reciprocity,
        reciprocity_pairs: reciprocity_pairs.unwrap_or(0),
        channels,
        findings,
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

/// Albedos by channel and range of incidence: pi times the mean of f over outgoing directions, weighted by solid angle
/// and cosine. `None` if the solid angles of the samples are unknown.
fn albedos(measurement: &Measurement) -> Option<Vec<Vec<MeasuredAlbedo>>> {
    let Directions::Grid { grid, cells } = &measurement.directions else { return None };
    /// Sums of weights and of weighted values over the rows of the table with even theta_h index, and over the odd ones.
    type Sums = [(f64, f64); 2];
    let ranges = usize::from(RANGES);
    let mut sums: Vec<Vec<Sums>> = vec![vec![Sums::default(); ranges]; measurement.values.len()];
    let limits: Vec<f64> = (1..=RANGES).map(|k| (RANGE_DEG * f64::from(k)).to_radians().cos()).collect();
    for (index, &cell) in cells.iter().enumerate() {
        let g = grid.geometry(cell);
        let (theta_h, ..) = HalfDifferenceGrid::indices(cell);
        let half = theta_h % 2;
        // A cell represents a pair of directions and the pair with light and viewer exchanged.
        for (light, view) in [(g.cos_i(), g.cos_o()), (g.cos_o(), g.cos_i())] {
            let range = limits.partition_point(|limit| *limit > light);
            if view <= 0.0 || range >= ranges {
                continue;
            }
            let weight = grid.weight(cell) * view;
            for (sums, row) in
                sums.iter_mut().zip(&measurement.values).filter(|(_, row)| !row[index].is_nan())
            {
                let sum = &mut sums[range][half];
                sum.0 += weight;
                sum.1 += weight * row[index];
            }
        }
    }
    let albedo = |(weight, value): (f64, f64)| std::f64::consts::PI * value / weight;
    let of_channel = |sums: Vec<Sums>| {
        let ranges = sums.into_iter().zip(0..RANGES);
        ranges
            .filter(|([even, odd], _)| even.0 > 0.0 && odd.0 > 0.0)
            .map(|([even, odd], k)| MeasuredAlbedo {
                theta_i_deg: [RANGE_DEG * f64::from(k), RANGE_DEG * f64::from(k + 1)],
                value: albedo((even.0 + odd.0, even.1 + odd.1)),
                error: (albedo(even) - albedo(odd)).abs(),
            })
            .collect()
    };
    Some(sums.into_iter().map(of_channel).collect())
}

fn findings(channels: &[MeasuredChannel], reciprocity: Option<f64>) -> Vec<Finding> {
    let mut findings = Vec::new();
    for channel in channels {
        let mut add = |kind, breaks, text| {
            findings.push(Finding { kind, breaks, channel: Some(channel.name.clone()), text });
        };
        let n = &channel.negative;
        if n.beyond_noise > 0 {
            add(
                "negative",
                true,
                format!(
                    "{} values are below 0 by more than the noise, the lowest is {:.4e} 1/sr",
                    n.beyond_noise, n.least
                ),
            );
        } else if n.values > 0 {
            add(
                "negative",
                false,
                format!(
                    "{} values are below 0 within the noise, the lowest is {:.4e} 1/sr",
                    n.values, n.least
                ),
            );
        }
        let most = channel
            .albedo
            .iter()
            .flatten()
            .max_by(|a, b| (a.value - a.error).total_cmp(&(b.value - b.error)));
        if let Some(MeasuredAlbedo { theta_i_deg: [low, high], value, error }) = most {
            let text = format!(
                "the albedo for theta_i from {low} to {high} deg is {value:.4} +/- {error:.1e}, above 1"
            );
            if value - error > 1.0 {
                add("gains-energy", true, text);
            } else if *value > 1.0 {
                add("gains-energy", false, text + " but within the error");
            }
        }
    }
    if let Some(difference) = reciprocity.filter(|difference| *difference > RECIPROCITY_WARNING) {
        findings.push(Finding {
            kind: "not-reciprocal",
            breaks: difference > RECIPROCITY_LIMIT,
            channel: None,
            text: format!("pairs of directions measured both ways differ by {:.1} % rms", 100.0 * difference),
        });
    }
    findings
}
