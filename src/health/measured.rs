//! Checks that a measurement obeys physics.

use super::{ALBEDO_SLACK, Finding, SCHEMA, mismatch};
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
    /// The part of that difference that may come from directions that agree to half a degree only; null if there are no such pairs.
    pub reciprocity_error: Option<f64>,
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
    /// Error of integrating over the table's cells, which may be too coarse for a narrow peak: the largest difference that taking every
    /// other row along the three axes makes, and by how much the cells of the range miss or exceed its solid angle.
    pub error: f64,
    /// Share of the directions, by solid angle and cosine, that have no value. The albedo takes them to be like the others.
    pub unmeasured: f64,
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
    let reciprocity_error = mismatch::explained(measurement);
    let findings = findings(&channels, reciprocity, reciprocity_error.unwrap_or(0.0));
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
        reciprocity_error,
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
/// and cosine. `None` if the solid angles of the samples are unknown.
fn albedos(measurement: &Measurement) -> Option<Vec<Vec<MeasuredAlbedo>>> {
    let Directions::Grid { grid, cells } = &measurement.directions else { return None };
    let ranges = usize::from(RANGES);
    let mut sums = vec![vec![[Part::default(); PARTS]; ranges]; measurement.values.len()];
    for (index, &cell) in cells.iter().enumerate() {
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
    for cell in (0..HalfDifferenceGrid::CELLS).filter_map(|cell| u32::try_from(cell).ok()) {
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
        let fill = value.abs() * (whole / exact(k) - 1.0).abs();
        (known.len() > 1).then_some(MeasuredAlbedo {
            theta_i_deg: [RANGE_DEG * f64::from(k), RANGE_DEG * f64::from(k + 1)],
            value,
            error: between + fill,
            unmeasured: (1.0 - weight / whole).max(0.0),
        })
    };
    let of_channel =
        |sums: Vec<[Part; PARTS]>| sums.into_iter().zip(&whole).zip(0..RANGES).filter_map(of_range).collect();
    Some(sums.into_iter().map(of_channel).collect())
}

fn findings(channels: &[MeasuredChannel], reciprocity: Option<f64>, explained: f64) -> Vec<Finding> {
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
        add_energy(channel.albedo.as_deref().unwrap_or_default(), add);
    }
    if let Some(difference) = reciprocity.filter(|difference| *difference > RECIPROCITY_WARNING) {
        let [percent, may_be] = [difference, explained].map(|share| 100.0 * share);
        let differ = format!("pairs of directions measured both ways differ by {percent:.1} % rms");
        // Only what the directions do not explain is the measurement's.
        let own = difference - explained;
        let (kind, breaks, text) = if own > RECIPROCITY_WARNING {
            let but = if own > RECIPROCITY_LIMIT || difference <= RECIPROCITY_LIMIT || explained == 0.0 {
                String::new()
            } else {
                format!(
                    ", of which up to {may_be:.1} % may come from directions that agree to half a degree only"
                )
            };
            ("not-reciprocal", own > RECIPROCITY_LIMIT, differ + &but)
        } else {
            let text = format!(
                "cannot tell whether light and viewer may be exchanged: {differ}, but their directions agree to half a degree only, \
                 within which f changes by {may_be:.1} %"
            );
            ("unresolved", false, text)
        };
        findings.push(Finding { kind, breaks, channel: None, text });
    }
    findings
}

/// Adds what the albedos of a channel say about energy.
fn add_energy(albedos: &[MeasuredAlbedo], mut add: impl FnMut(&'static str, bool, String)) {
    // Light that was not measured may be missing, and no more is known about it.
    let at_least = |a: &MeasuredAlbedo| a.value * (1.0 - a.unmeasured) - a.error;
    let perhaps = |a: &MeasuredAlbedo| a.value + a.error;
    let most = |key: &dyn Fn(&MeasuredAlbedo) -> f64| {
        let largest = albedos.iter().max_by(|a, b| key(a).total_cmp(&key(b)));
        largest.filter(|largest| key(largest) > 1.0 + ALBEDO_SLACK)
    };
    let in_words = |a: &MeasuredAlbedo| {
        let MeasuredAlbedo { theta_i_deg: [low, high], value, error, unmeasured } = a;
        let range = format!("the albedo for theta_i from {low} to {high} deg");
        let gaps = if *unmeasured > NOTEWORTHY_GAP {
            format!(", and {:.1} % of the directions have no value", 100.0 * unmeasured)
        } else {
            String::new()
        };
        (range, format!("{value:.4} +/- {error:.1e}"), gaps)
    };
    if let Some(most) = most(&at_least) {
        let (range, value, gaps) = in_words(most);
        add("gains-energy", true, format!("{range} is {value}, above 1{gaps}"));
    } else if let Some(most) = most(&perhaps) {
        let (range, value, gaps) = in_words(most);
        let text = format!(
            "cannot tell whether {range} is above 1: the sum over the table's cells is {value}, where the error is that of the sum{gaps}"
        );
        add("unresolved", false, text);
    }
}

/// Share of directions without values from which on they are mentioned.
const NOTEWORTHY_GAP: f64 = 1e-3;
