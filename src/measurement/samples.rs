//! The samples that a fit uses, and their weights.

use super::missing::missing_in;
use super::{Measurement, Predicted, dead_channels};
use crate::error::{Error, OptionName, short};
use crate::geometry::{Directions, Geometry};
use crate::math::count;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// How samples are weighted relative to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Weighting {
    /// By the solid angle that a grid cell stands for.
    SolidAngle,
    /// All the same.
    Uniform,
    /// By the standard deviation that the file gives for each value.
    Sigma,
}

impl Weighting {
    /// Name on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::SolidAngle => "solid-angle",
            Self::Uniform => "uniform",
            Self::Sigma => "sigma",
        }
    }
}

/// Which samples are fitted, and with what weights. The defaults are those of the command line; each `with_` method
/// changes one of them.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Filters {
    /// Largest angle of incidence and viewing, in degrees, inclusive.
    pub max_theta_deg: f64,
    /// How samples are weighted; `None` for solid-angle on grids and uniform otherwise.
    pub weighting: Option<Weighting>,
    /// Number of samples to use, drawn evenly over the measure; `None` for all.
    pub samples: Option<usize>,
    /// Seed of the draw.
    pub seed: u64,
}

impl Filters {
    /// Leaves out directions whose angle of incidence or viewing is larger than this: more than 0 and at most 90
    /// degrees. The default is 80; most instruments are unreliable beyond it.
    #[must_use]
    pub fn with_max_theta_deg(self, max_theta_deg: f64) -> Self {
        Self { max_theta_deg, ..self }
    }

    /// Sets how samples are weighted; by default by solid angle on a half/difference grid and uniformly otherwise.
    #[must_use]
    pub fn with_weighting(self, weighting: Weighting) -> Self {
        Self { weighting: Some(weighting), ..self }
    }

    /// Uses at most this many samples, drawn evenly; by default all.
    #[must_use]
    pub fn with_samples(self, samples: usize) -> Self {
        Self { samples: Some(samples), ..self }
    }

    /// Sets the seed of the draw, 0 by default.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }
}

impl Default for Filters {
    fn default() -> Self {
        Self { max_theta_deg: 80.0, weighting: None, samples: None, seed: 0 }
    }
}

/// Checks that the largest angle of incidence and viewing is above 0 and at most 90 degrees.
///
/// # Errors
/// [`Error::Invalid`] if it is not.
pub fn checked_max_theta(degrees: f64) -> Result<f64, Error> {
    if degrees > 0.0 && degrees <= 90.0 {
        return Ok(degrees);
    }
    let expected = "more than 0 and at most 90 degrees";
    Err(Error::invalid(OptionName::MaxTheta, expected, degrees.to_string()))
}

/// The samples of a measurement that passed the filters.
#[derive(Clone, Debug)]
pub struct Samples {
    /// The directions of each sample.
    pub directions: Directions,
    /// f in 1/sr, by channel and sample; NaN where it was not measured.
    pub values: Vec<Vec<f64>>,
    /// The number of values that were not measured, by channel.
    pub missing: Vec<usize>,
    /// Standard deviation of f, by channel and sample; `None` unless weights are by sigma. That of a value that was not measured says
    /// nothing.
    pub sigma: Option<Vec<Vec<f64>>>,
    /// The weight of each sample, apart from those that `sigma` gives; 1 on average.
    pub weights: Vec<f64>,
    /// How the weights were chosen.
    pub weighting: Weighting,
    /// What the neighbours of each sample predict for it.
    pub predicted: Predicted,
    /// Whether each channel is dead: constant while others vary. Dead channels do not count.
    pub dead: Vec<bool>,
    /// Number of samples left out, in reading or here, by reason.
    pub dropped: BTreeMap<&'static str, usize>,
}

/// Tolerance in degrees for angles that files give in radians or with few digits.
const ANGLE_TOLERANCE_DEG: f64 = 1e-9;

impl Samples {
    /// Selects the samples of `measurement` that pass `filters`.
    ///
    /// # Errors
    /// [`Error::NoSamples`] if none does, or none that has a value in one of the channels; [`Error::Unmet`] for weights that the data cannot give; [`Error::Invalid`]
    /// for a measurement in which a channel does not have one value per pair of directions.
    pub fn select(measurement: &Measurement, filters: &Filters) -> Result<Self, Error> {
        Ok(Self::select_without_predictions(measurement, filters)?.with_predictions())
    }

    /// Predicts every sample from the others.
    #[must_use]
    pub(crate) fn with_predictions(self) -> Self {
        let predicted = Predicted::new(&self.directions, &self.values, self.sigma.as_ref());
        Self { predicted, ..self }
    }

    /// The samples without predictions, for a metric that makes no use of them, or to choose some of them first.
    pub(crate) fn select_without_predictions(
        measurement: &Measurement,
        filters: &Filters,
    ) -> Result<Self, Error> {
        measurement.check_lengths()?;
        let grid = measurement.directions.is_grid();
        let weighting =
            filters.weighting.unwrap_or(if grid { Weighting::SolidAngle } else { Weighting::Uniform });
        let mut dropped = measurement.dropped.clone();
        let cos_limit = (filters.max_theta_deg + ANGLE_TOLERANCE_DEG).to_radians().cos();
        let within = |cos: f64, sin2: f64| {
            // The cosine decides for all directions except those at the limit, where acos has no digits to spare.
            let slack = 1e-6;
            (cos > cos_limit + slack)
                || (cos > cos_limit - slack
                    && sin2.sqrt().atan2(cos).to_degrees() <= filters.max_theta_deg + ANGLE_TOLERANCE_DEG)
        };
        let inside = |g: &Geometry<f64>| within(g.cos_i(), g.sin2_i()) && within(g.cos_o(), g.sin2_o());
        let mut keep: Vec<bool> = measurement.directions.each(inside);
        let mut left = keep.iter().filter(|keep| **keep).count();
        if left < keep.len() {
            *dropped.entry("beyond-max-theta").or_default() += keep.len() - left;
        }
        if let Some(wanted) = filters.samples.filter(|wanted| *wanted < left) {
            *dropped.entry("not-sampled").or_default() += left - wanted;
            stratify(&mut keep, left, wanted, filters.seed);
            left = wanted;
        }
        if left == 0 {
            return Err(Error::no_samples(&measurement.source.path, &dropped));
        }
        let sigma = match weighting {
            Weighting::Sigma => Some(usable_sigma(measurement)?),
            Weighting::SolidAngle | Weighting::Uniform => None,
        };
        if weighting == Weighting::SolidAngle && !grid {
            return Err(Error::Unmet {
                path: measurement.source.path.clone(),
                option: OptionName::Weights,
                expected: "uniform or sigma, or a half/difference grid for solid-angle".to_owned(),
                found: "scattered directions, which cover no known solid angles".to_owned(),
            });
        }

        // All threads fill the rows, but one allocates them: an allocator with memory for each thread, such as
        // glibc's, would otherwise keep some of it for every thread that ever allocated a large vector.
        let room = |rows: &Vec<Vec<f64>>| -> Vec<Vec<f64>> {
            rows.iter().map(|_| Vec::with_capacity(left)).collect()
        };
        let (mut values, mut kept_sigma) = (room(&measurement.values), sigma.map(room));
        let mut weights = Vec::with_capacity(left);
        let mut directions = match &measurement.directions {
            Directions::Scattered(_) => Directions::Scattered(Vec::with_capacity(left)),
            Directions::Grid { grid, .. } => {
                Directions::Grid { grid: Arc::clone(grid), cells: Vec::with_capacity(left) }
            }
        };
        let fill = |rows: &mut Vec<Vec<f64>>, from: &Vec<Vec<f64>>| {
            rows.par_iter_mut().zip(from).for_each(|(to, row)| add_kept(row, &keep, to));
        };
        rayon::join(
            || {
                fill(&mut values, &measurement.values);
                kept_sigma.iter_mut().zip(sigma).for_each(|(kept, sigma)| fill(kept, sigma));
            },
            || {
                match (&mut directions, &measurement.directions) {
                    (Directions::Scattered(to), Directions::Scattered(pairs)) => add_kept(pairs, &keep, to),
                    (Directions::Grid { cells: to, .. }, Directions::Grid { cells, .. }) => {
                        add_kept(cells, &keep, to);
                    }
                    // `directions` was created with the same kind.
                    (Directions::Scattered(_), Directions::Grid { .. })
                    | (Directions::Grid { .. }, Directions::Scattered(_)) => {}
                }
                add_weights(&directions, weighting, &mut weights);
            },
        );
        let sigma = kept_sigma;
        let missing = values.par_iter().map(|row| missing_in(row)).collect();
        let dead = dead_channels(&values);
        let predicted = Predicted::default();
        let samples =
            Self { values, missing, directions, sigma, weights, weighting, predicted, dead, dropped };
        match samples.without_values() {
            None => Ok(samples),
            Some(channel) => {
                let name = measurement.channels.get(channel).map_or("", |channel| &channel.name);
                Err(no_values(&measurement.source.path, name, samples.len()))
            }
        }
    }

    /// The number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.directions.len()
    }

    /// Whether there are no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.directions.is_empty()
    }

    /// The first channel that has no value at any sample; `None` if all have some.
    pub(crate) fn without_values(&self) -> Option<usize> {
        self.missing.iter().position(|missing| *missing == self.len())
    }

    /// The sum of the weights of all values of some channels.
    pub(crate) fn weight_of(&self, channels: &[usize]) -> f64 {
        let missing = |channel: &usize| self.missing.get(*channel).copied().unwrap_or(0);
        if channels.iter().map(missing).sum::<usize>() == 0 {
            return count(channels.len()) * self.weights.iter().sum::<f64>();
        }
        let weights = self.weights_by_channel();
        channels.iter().filter_map(|channel| weights.get(*channel)).sum()
    }

    /// The sums of the weights of the values of each channel.
    pub(crate) fn weights_by_channel(&self) -> Vec<f64> {
        let all: f64 = self.weights.iter().sum();
        let of_channel = |(row, missing): (&Vec<f64>, &usize)| {
            let measured = row.iter().zip(&self.weights).filter(|(value, _)| !value.is_nan());
            if *missing == 0 { all } else { measured.map(|(_, weight)| weight).sum() }
        };
        self.values.iter().zip(&self.missing).map(of_channel).collect()
    }

    /// Some of the samples' numbers for a channel, with `instead` where the channel has no value.
    pub(crate) fn filled<'r>(&self, channel: usize, numbers: &'r [f64], instead: f64) -> Cow<'r, [f64]> {
        match (self.values.get(channel), self.missing.get(channel)) {
            (Some(values), Some(missing)) if *missing > 0 => {
                let filled = |(number, value): (&f64, &f64)| if value.is_nan() { instead } else { *number };
                Cow::Owned(numbers.iter().zip(values).map(filled).collect())
            }
            _ => Cow::Borrowed(numbers),
        }
    }

    /// The same with the values and predictions of each channel multiplied by its factor. Standard deviations stay.
    #[must_use]
    pub(crate) fn scaled(mut self, factors: &[f64]) -> Self {
        assert_eq!(factors.len(), self.values.len(), "a factor for each channel");
        for rows in [&mut self.values, &mut self.predicted.values] {
            for (row, factor) in rows.iter_mut().zip(factors) {
                row.iter_mut().for_each(|value| *value *= factor);
            }
        }
        self.predicted.noise_floors.iter_mut().zip(factors).for_each(|(floor, factor)| *floor *= factor);
        self
    }

    /// The samples at `indices`.
    pub(crate) fn at(&self, indices: &[usize]) -> Self {
        let gather = |rows: &Vec<Vec<f64>>| -> Vec<Vec<f64>> {
            rows.iter().map(|row| crate::geometry::gather(row, indices)).collect()
        };
        let values = gather(&self.values);
        let of_channel = |(row, missing): (&Vec<f64>, &usize)| if *missing > 0 { missing_in(row) } else { 0 };
        Self {
            directions: self.directions.select(indices),
            missing: values.iter().zip(&self.missing).map(of_channel).collect(),
            values,
            sigma: self.sigma.as_ref().map(gather),
            weights: crate::geometry::gather(&self.weights, indices),
            weighting: self.weighting,
            predicted: self.predicted.at(indices),
            dead: self.dead.clone(),
            dropped: self.dropped.clone(),
        }
    }
}

/// The error for a channel without values at the samples that are to be used.
pub(crate) fn no_values(path: &Path, channel: &str, samples: usize) -> Error {
    let reason = format!("channel {} was not measured at any of {samples} samples", short(channel));
    Error::NoSamples { path: path.to_owned(), reason }
}

/// Appends the elements for which `keep` is true to `to`, which has room for them.
fn add_kept<T: Copy>(from: &[T], keep: &[bool], to: &mut Vec<T>) {
    to.extend(from.iter().zip(keep).filter(|(_, keep)| **keep).map(|(element, _)| *element));
}

/// Appends the weights of the samples, apart from those that `sigma` gives; 1 on average.
fn add_weights(directions: &Directions, weighting: Weighting, weights: &mut Vec<f64>) {
    match (weighting, directions) {
        (Weighting::SolidAngle, Directions::Grid { grid, cells }) => {
            weights.extend(cells.iter().map(|&cell| grid.weight(cell)));
        }
        _ => weights.resize(directions.len(), 1.0),
    }
    let mean = weights.iter().sum::<f64>() / count(weights.len());
    weights.iter_mut().for_each(|w| *w /= mean);
}

/// Keeps `wanted` of the `many` samples for which `keep` is true, one drawn from each of `wanted` equal stretches.
/// Neighbours in a file are neighbours in direction, so every region keeps its share.
///
/// Files that list their samples in a regular pattern cannot alias with the stretches, because the draw within each is
/// random. Scattered files lose nothing, whether their author shuffled them or not.
fn stratify(keep: &mut [bool], many: usize, wanted: usize, seed: u64) {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut draws = (0..wanted).map(|stretch| {
        let start = stretch * many / wanted;
        let end = (stretch + 1) * many / wanted;
        rng.random_range(start..end.max(start + 1))
    });
    let mut drawn = draws.next();
    for (place, keep) in keep.iter_mut().filter(|keep| **keep).enumerate() {
        *keep = drawn == Some(place);
        if *keep {
            drawn = draws.next();
        }
    }
}

/// The standard deviations of a file, if it gives positive ones for all values.
fn usable_sigma(measurement: &Measurement) -> Result<&Vec<Vec<f64>>, Error> {
    let unmet = |expected: &str, found: String| Error::Unmet {
        path: measurement.source.path.clone(),
        option: OptionName::Weights,
        expected: expected.to_owned(),
        found,
    };
    let Some(sigma) = &measurement.sigma else {
        return Err(unmet("a column 'sigma' or 'sigma_<channel>' in the file for sigma", "none".to_owned()));
    };
    for ((row, values), channel) in sigma.iter().zip(&measurement.values).zip(&measurement.channels) {
        let mut measured = row.iter().zip(values).enumerate().filter(|(_, (_, value))| !value.is_nan());
        if let Some((index, (value, _))) = measured.find(|(_, (s, _))| s.is_nan() || **s <= 0.0) {
            let found = format!("{value} for channel {} of sample {}", short(&channel.name), index + 1);
            return Err(unmet("positive standard deviations for sigma", found));
        }
    }
    Ok(sigma)
}
