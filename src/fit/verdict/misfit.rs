//! How far the model is from the data, beside the data's own noise.
//!
//! Where a model is true its residuals are noise: those of neighbouring samples are as different from each other as noise makes
//! them, so that the mean of (r_a - r_b)^2/2 over neighbours is the mean of r^2 (von Neumann 1941, doi:10.1214/aoms/1177731677).
//! Where it is not, neighbours miss in the same way, and the differences show how much of r is noise. What the model explains is
//! gone from the residuals, so that neighbours need not be close for this. If samples farther away differ more than neighbours do,
//! what is seen is no noise, but the model's own error changing slowly from sample to sample.

use crate::fit::problem::loss::Objective;
use crate::fit::problem::metric::Metric;
use crate::fit::problem::observed::Observed;
use crate::fit::problem::reflectance::ReflectanceProblem;
use crate::fit::task::Task;
use crate::math::count;
use crate::measurement::interpolant::{Neighbours, Twins};
use crate::measurement::{Samples, Weighting};
use crate::parameters::ParameterTable;
use nalgebra::DVector;
use std::fmt;
use std::sync::Arc;

/// What the noise of the data was estimated from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NoiseSource {
    /// The standard deviations that the file gives.
    Sigma,
    /// Samples in the same directions.
    Repeats,
    /// Samples with light and viewer exchanged.
    ReciprocalPairs,
    /// Neighbouring samples.
    Neighbours,
}

impl NoiseSource {
    /// Name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sigma => "sigma",
            Self::Repeats => "repeats",
            Self::ReciprocalPairs => "reciprocal-pairs",
            Self::Neighbours => "neighbours",
        }
    }
}

impl fmt::Display for NoiseSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sigma => "by the standard deviations of the file",
            Self::Repeats => "by samples in the same directions",
            Self::ReciprocalPairs => "by samples with light and viewer exchanged",
            Self::Neighbours => "by neighbouring samples",
        })
    }
}

/// How far the model is from the data.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Misfit {
    /// The root mean square of the residuals over that of the noise; `None` if no noise is visible.
    pub ratio: Option<f64>,
    /// What the noise was estimated from; `None` if no noise is visible.
    pub source: Option<NoiseSource>,
    /// The mean distance of the model from the data, relative to the data.
    pub relative: f64,
    /// The ratio above which the model does not fit; chance alone explains a smaller one.
    pub limit: f64,
    /// Where the model is worst.
    pub worst: Option<Worst>,
}

/// A region of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// Smallest and largest angle of incidence, degrees.
    pub theta_i_deg: [f64; 2],
    /// Whether it is the part of these directions near the mirror direction, or the rest.
    pub near_mirror: bool,
}

impl fmt::Display for Worst {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = self.theta_i_deg;
        let place = if self.near_mirror { "near" } else { "away from" };
        write!(f, "theta_i {low:.0} to {high:.0}, {place} the mirror direction")
    }
}

/// Least number of pairs that say something about noise.
const LEAST_PAIRS: usize = 20;
/// Chance moves the ratio of two mean squares over n pairs by sqrt(3/n); it counts as a misfit beyond this many times that.
const SIGNIFICANT: f64 = 6.0;
/// The least ratio that is worth a word, however many samples there are.
const LEAST_RATIO: f64 = 1.25;
/// The mean square of the differences of samples farther away over that of neighbours: above this, and above what chance explains, no
/// noise is visible.
const VISIBLE: f64 = 1.7;
/// Without noise, a mean relative distance above this is a misfit.
const LEAST_RELATIVE: f64 = 0.02;
/// A mean relative distance below this is rounding.
const ROUNDING: f64 = 1e-6;
/// Half vectors within this angle of the normal are near the mirror direction, degrees.
const NEAR_MIRROR_DEG: f64 = 10.0;
/// Width of the ranges of incidence, degrees.
const RANGE_DEG: f64 = 10.0;
/// Least number of samples of a region.
const LEAST_SAMPLES: usize = 10;

impl Misfit {
    /// Whether the model is farther from the data than their noise explains or, without noise, far from them.
    #[must_use]
    pub fn is_significant(&self) -> bool {
        let far = match self.ratio {
            Some(ratio) => ratio > self.limit,
            None => self.relative > LEAST_RELATIVE,
        };
        far && self.relative > ROUNDING
    }
}

/// The residuals of some of the samples.
struct Residuals {
    /// The index of each of these samples among all.
    samples: Vec<usize>,
    /// By channel; NaN where nothing was measured.
    rows: Vec<Vec<f64>>,
    weights: Vec<f64>,
}

impl Residuals {
    /// The residuals of `some` samples, which are those at the indices `chosen`.
    fn new(
        task: &Task<'_>,
        some: Samples,
        chosen: Vec<usize>,
        table: &ParameterTable,
        metric: Metric,
    ) -> Self {
        let observed = Arc::new(Observed::new(&some, metric));
        let problem =
            ReflectanceProblem::of(task.expression, observed, table.clone(), Objective::from(metric));
        let mut rows = problem.residuals_of_channels(&DVector::from_vec(table.coordinates()));
        // Dead channels have none.
        rows.retain(|row| !row.is_empty());
        Self { samples: chosen, rows, weights: some.weights }
    }

    fn place(&self, sample: usize) -> Option<usize> {
        self.samples.binary_search(&sample).ok()
    }

    /// The mean squares of the residuals of the samples in `pairs`; `None` if there is no pair with values in a common channel.
    fn squares(&self, pairs: &[Twins]) -> Option<Squares> {
        let (mut own, mut apart, mut total, mut values) = (0.0, 0.0, 0.0, 0);
        for [a, b] in pairs {
            let (a, b) = (self.place(*a)?, self.place(*b)?);
            let weight = 0.5 * (self.weights[a] + self.weights[b]);
            for row in &self.rows {
                if row[a].is_nan() || row[b].is_nan() {
                    continue;
                }
                values += 1;
                own += 0.5 * weight * (row[a] * row[a] + row[b] * row[b]);
                apart += 0.5 * weight * (row[a] - row[b]).powi(2);
                total += weight;
            }
        }
        let pairs = values / self.rows.len().max(1);
        (total > 0.0).then_some(Squares { own: own / total, apart: apart / total, pairs })
    }

    /// The ratio of residuals to noise by `pairs`, and the number of those; `None` if there are too few.
    fn ratio(&self, pairs: &[Twins]) -> Option<(f64, usize)> {
        let Squares { own, apart, pairs } = self.squares(pairs).filter(Squares::are_enough)?;
        (apart > 0.0).then(|| ((own / apart).sqrt(), pairs))
    }
}

/// What pairs of samples show.
struct Squares {
    /// The mean square of the residuals.
    own: f64,
    /// Half the mean square of the differences of residuals within a pair.
    apart: f64,
    /// The number of pairs with values of both samples, on average over the channels.
    pairs: usize,
}

impl Squares {
    fn are_enough(&self) -> bool {
        self.pairs >= LEAST_PAIRS
    }
}

impl Task<'_> {
    /// How far the model at the values in `table` is from the samples; `None` if there are too few of them. `chi2` is the reduced
    /// chi-square if the residuals are in standard deviations, and `relative` the mean relative distance.
    pub(super) fn misfit(
        &self,
        table: &ParameterTable,
        chi2: Option<f64>,
        relative: Option<f64>,
    ) -> Option<Misfit> {
        let relative = relative.filter(|relative| relative.is_finite())?;
        let samples = self.samples;
        let neighbours = Neighbours::of(&samples.directions);
        let chosen = neighbours.samples();
        if chosen.len() < LEAST_PAIRS {
            return None;
        }
        let residuals = Residuals::new(self, samples.at(&chosen), chosen.clone(), table, self.options.metric);
        let worst = worst(samples, &residuals);
        let by_chance = |n: usize| 1.0 + SIGNIFICANT * (3.0 / count(n.max(1))).sqrt();
        let limit = |n: usize| by_chance(n).sqrt().max(LEAST_RATIO);
        let found = |ratio: f64, source: NoiseSource, n: usize| {
            Some(Misfit { ratio: Some(ratio), source: Some(source), relative, limit: limit(n), worst })
        };

        // What the file says about its noise comes first, then repeats, which show it without a model.
        if let Some(chi2) = chi2.or_else(|| self.chi_square(table)) {
            return found(chi2.sqrt(), NoiseSource::Sigma, samples.len());
        }
        if let Some((ratio, pairs)) = residuals.ratio(&neighbours.repeats) {
            return found(ratio, NoiseSource::Repeats, pairs);
        }

        // Exchanged pairs are compared relative to their values, which the two cosines weigh differently.
        let of_exchanged = neighbours.exchanged.len();
        let in_values =
            if of_exchanged < LEAST_PAIRS { None } else { self.residuals_in_values(&chosen, table) };
        let exchanged = in_values.and_then(|residuals| residuals.ratio(&neighbours.exchanged));
        let near = residuals.squares(&neighbours.near).filter(Squares::are_enough);
        let far = residuals.squares(&neighbours.far);
        let by_neighbours = near.zip(far).and_then(|(near, far)| {
            let visible = by_chance(near.pairs).max(VISIBLE);
            let is_visible = near.apart > 0.0 && far.apart <= visible * near.apart;
            is_visible.then(|| ((near.own / near.apart).sqrt(), near.pairs))
        });
        match (by_neighbours, exchanged) {
            // What is not reciprocal differs by more than noise.
            (_, Some((exchanged, pairs)))
                if exchanged > by_neighbours.map_or_else(|| limit(pairs), |(ratio, _)| ratio) =>
            {
                found(exchanged, NoiseSource::ReciprocalPairs, pairs)
            }
            (Some((ratio, pairs)), _) => found(ratio, NoiseSource::Neighbours, pairs),
            (None, _) => Some(Misfit { ratio: None, source: None, relative, limit: LEAST_RATIO, worst }),
        }
    }

    /// The mean square of the residuals in the standard deviations of the file; `None` if it gives none.
    fn chi_square(&self, table: &ParameterTable) -> Option<f64> {
        let values = self.standardised(self.with_sigma?, table);
        (!values.is_empty()).then(|| sum_of_squares(&values) / count(values.len()))
    }

    /// The sum of the squares of the residuals in the standard deviations of the samples, which must have some.
    pub(super) fn chi_square_of(&self, samples: &Samples, table: &ParameterTable) -> f64 {
        sum_of_squares(&self.standardised(samples, table))
    }

    /// The residuals of all values in the standard deviations of the samples.
    fn standardised(&self, samples: &Samples, table: &ParameterTable) -> Vec<f64> {
        // Whatever was minimised: other metrics bend the noise.
        let metric = Metric::L2;
        let all: Vec<usize> = (0..samples.len()).collect();
        let rows = Residuals::new(self, samples.clone(), all, table, metric).rows;
        rows.into_iter().flatten().filter(|residual| !residual.is_nan()).collect()
    }

    /// The residuals in units of the measured values; `None` if a value is 0 or below.
    fn residuals_in_values(&self, chosen: &[usize], table: &ParameterTable) -> Option<Residuals> {
        let some = self.samples.at(chosen);
        if some.values.iter().flatten().any(|value| *value <= 0.0) {
            return None;
        }
        let sigma = Some(some.values.clone());
        let relative = Samples { sigma, weighting: Weighting::Sigma, weights: vec![1.0; some.len()], ..some };
        Some(Residuals::new(self, relative, chosen.to_vec(), table, self.options.metric))
    }
}

fn sum_of_squares(values: &[f64]) -> f64 {
    values.iter().map(|r| r * r).sum()
}

/// The region in which the mean square of the residuals is largest; `None` if no region has enough samples.
fn worst(samples: &Samples, residuals: &Residuals) -> Option<Worst> {
    /// The number of ranges of incidence, each near the mirror direction or away from it.
    const RANGES: usize = 9;
    let mut sums = [[(0.0, 0_usize, 0_usize); 2]; RANGES];
    let directions = samples.directions.select(&residuals.samples);
    for (place, g) in directions.iter().enumerate() {
        let theta_i = g.theta_i_deg();
        let range = (0..RANGES - 1).filter(|range| theta_i > RANGE_DEG * count(range + 1)).count();
        let near = usize::from(g.theta_h_deg() < NEAR_MIRROR_DEG);
        let measured = || residuals.rows.iter().map(|row| row[place]).filter(|residual| !residual.is_nan());
        let square: f64 = measured().map(|residual| residual * residual).sum();
        let (sum, samples, values) = &mut sums[range][near];
        *sum += residuals.weights[place] * square;
        *samples += 1;
        *values += measured().count();
    }
    let regions = sums.iter().enumerate().flat_map(|(range, sides)| {
        sides.iter().enumerate().map(move |(near, (sum, n, values))| (range, near, *sum, *n, *values))
    });
    let channels = count(residuals.rows.len());
    let full = regions
        .filter(|(.., n, values)| *n >= LEAST_SAMPLES && *values > 0)
        .map(|(range, near, sum, _, values)| (range, near, sum / (count(values) / channels)));
    full.max_by(|(.., a), (.., b)| a.total_cmp(b)).map(|(range, near, _)| Worst {
        theta_i_deg: [RANGE_DEG * count(range), RANGE_DEG * count(range + 1)],
        near_mirror: near == 1,
    })
}
