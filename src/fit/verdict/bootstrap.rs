//! Standard errors by resampling whole angles of incidence.
//!
//! The formulas of `covariance` assume that the samples' errors are independent. The errors of samples at one angle of
//! incidence rarely are: they share the lamp's alignment and drift, and if the model is wrong, it is wrong in the same
//! way for all of them. Here only the angles are assumed to be independent. As many angles as there are are drawn with
//! replacement, the fit is repeated from the optimum on what was drawn, and the spread of the repeated fits is the
//! error (Efron 1979, doi:10.1214/aos/1176344552; Davison and Hinkley 1997, section 2.4 and 3.8 for clusters).

use super::covariance::{Covariance, Method};
use super::warning::Warning;
use crate::error::{Error, OptionName, short};
use crate::fit::options::{Options, ScaleError};
use crate::fit::problem::loss::Objective;
use crate::fit::task::{SMALL, Task};
use crate::math::count;
use crate::measurement::{IncidenceGroups, Measurement, Samples};
use crate::parameters::ParameterTable;
use crate::progress::Progress;
use crate::solver::inverse::block_matrix::BlockMatrix;
use crate::solver::{Solution, Termination, Tolerances, minimise};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::sync::Arc;

/// The fits repeated on resampled angles of incidence.
#[derive(Clone, Debug)]
pub struct Resampled {
    /// Number of fits.
    pub replicates: usize,
    /// The smallest and the largest `theta_i` of each group of samples that could be drawn, in degrees.
    pub theta_i_deg: Vec<[f64; 2]>,
    /// Rows of the free parameters in the parameter table.
    rows: Vec<usize>,
    /// The values of each free parameter in every fit, in the parameter's own unit.
    values: Vec<Vec<f64>>,
}

/// Number of repeated fits. With this many, the standard error of a standard error is 5 %.
pub(super) const REPLICATES: usize = 200;
/// Least number of repeated fits; fewer say nothing about the ends of an interval.
const FEWEST_REPLICATES: usize = 50;
/// Least number of groups: fewer can be drawn in too few ways.
const FEWEST_GROUPS: usize = 5;
/// Tolerances of each fit. It begins close to its minimum, and its last step is far below the spread between fits.
pub(super) const LOOSE: Tolerances = Tolerances { step: 1e-5, cost: 1e-6, gradient: 1e-6, refinements: 0 };
/// Largest number of iterations. Fits that take more are creeping along a valley. They count with the values they have
/// reached, because without them the errors would come out too small.
pub(super) const ITERATIONS: u64 = 20;
/// Number of fits that run at once. It affects neither which fits are made nor their results.
const AT_ONCE: usize = 20;
/// Makes the draw of factors differ from the other draws with the same seed.
const SCALE_STREAM: u64 = 0x0073_6361_6c65;
/// Makes this draw of angles differ from the other draws with the same seed.
const BOOTSTRAP_STREAM: u64 = 0x626f_6f74_7374;

/// The groups to draw from.
///
/// # Errors
/// [`Error::Unmet`] if there are too few, or too few at which a channel has values.
pub(in crate::fit) fn groups(samples: &Samples, measurement: &Measurement) -> Result<IncidenceGroups, Error> {
    let groups = samples.incidence_groups();
    let too_few = |found: usize, of_channel: String| Error::Unmet {
        path: measurement.source.path.clone(),
        option: OptionName::Uncertainty,
        expected: format!("at least {FEWEST_GROUPS} angles of incidence{of_channel} for block-bootstrap"),
        found: found.to_string(),
    };
    if groups.len() < FEWEST_GROUPS {
        return Err(too_few(groups.len(), String::new()));
    }
    for (has_values, channel) in with_values(samples, &groups).iter().zip(&measurement.channels) {
        let found = has_values.iter().filter(|has| **has).count();
        if found < FEWEST_GROUPS {
            return Err(too_few(found, format!(" in channel {}", short(&channel.name))));
        }
    }
    Ok(groups)
}

/// Whether each group has a value, by channel. Dead channels have no say in the fits, and need none.
fn with_values(samples: &Samples, groups: &IncidenceGroups) -> Vec<Vec<bool>> {
    let of_channel = |((row, missing), dead): ((&Vec<f64>, &usize), &bool)| {
        let needs_none = *missing == 0 || *dead;
        let mut has_values = vec![needs_none; groups.len()];
        if !needs_none {
            let measured = row.iter().zip(&groups.of_sample).filter(|(value, _)| !value.is_nan());
            measured.for_each(|(_, group)| has_values[*group] = true);
        }
        has_values
    };
    samples.values.iter().zip(&samples.missing).zip(&samples.dead).map(of_channel).collect()
}

/// Repeats the fit that ended at `table`. If that was cut short, there is a warning, with or without the result.
pub(in crate::fit) fn resample(
    task: &Task<'_>,
    objective: Objective,
    groups: &IncidenceGroups,
    table: &ParameterTable,
    solution: &Solution,
    progress: &Arc<dyn Progress>,
) -> Result<(Option<Resampled>, Option<Warning>), Error> {
    if table.free().is_empty() {
        return Ok((None, None));
    }
    if !solution.termination.converged() {
        return Ok((None, Some(Warning::NotResampled)));
    }
    progress.stage("resampling");
    let with_values = with_values(task.samples, groups);
    let draws = draws(groups.len(), task.options.seed, |times| {
        let is_drawn = |has_values: &Vec<bool>| has_values.iter().zip(times).any(|(has, n)| *has && *n > 0);
        with_values.iter().all(is_drawn)
    });
    let factors = scale_factors(task.samples.values.len(), task.options);
    let drawn: Vec<(Vec<usize>, Vec<f64>)> = draws.into_iter().zip(factors).collect();
    let at_once = if task.samples.len() <= SMALL { AT_ONCE } else { 1 };
    let mut fits: Vec<Vec<f64>> = Vec::with_capacity(REPLICATES);
    for drawn in drawn.chunks(at_once) {
        let repeat = |(times, factors): &(Vec<usize>, Vec<f64>)| {
            task.repeat(objective, groups, (times, factors), table)
        };
        let results: Result<Vec<Option<Repeated>>, Error> = drawn.par_iter().map(repeat).collect();
        for fit in results?.into_iter().flatten() {
            fits.push(fit.values);
            progress.iteration(u64::try_from(fits.len()).unwrap_or(u64::MAX), fit.cost);
        }
    }
    let finished = fits.len();
    let cut_short = |enough| Warning::ResamplingCutShort { finished, planned: REPLICATES, enough };
    if finished < FEWEST_REPLICATES {
        return Ok((None, Some(cut_short(false))));
    }
    let short = (finished < REPLICATES).then(|| cut_short(true));
    let rows = table.free().to_vec();
    let column = |place: usize| fits.iter().map(|fit| fit[place]).collect();
    let values = (0..rows.len()).map(column).collect();
    let theta_i_deg = groups.theta_i_deg.clone();
    Ok((Some(Resampled { replicates: finished, theta_i_deg, rows, values }), short))
}

/// The number of times each of `n` groups is drawn, for each replicate. What is not accepted, because it would leave a channel without
/// values, is drawn again.
pub(super) fn draws(n: usize, seed: u64, accepted: impl Fn(&[usize]) -> bool) -> Vec<Vec<usize>> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed ^ BOOTSTRAP_STREAM);
    let mut one = || {
        let mut times = vec![0; n];
        for _ in 0..n {
            times[rng.random_range(0..n)] += 1;
        }
        times
    };
    let mut accepted_one = || std::iter::repeat_with(&mut one).find(|times| accepted(times));
    (0..REPLICATES).filter_map(|_| accepted_one()).collect()
}

/// The factors by which the values of each channel are multiplied in each replicate, drawn from the error of the measurement's scale; 1
/// without one.
fn scale_factors(channels: usize, options: &Options) -> Vec<Vec<f64>> {
    let Some(ScaleError { relative, per_channel }) = options.scale_error else {
        return vec![vec![1.0; channels]; REPLICATES];
    };
    let mut rng = Pcg64Mcg::seed_from_u64(options.seed ^ SCALE_STREAM);
    let mut factor = || 1.0 + relative * rng.sample::<f64, _>(StandardNormal);
    let mut one =
        || if per_channel { (0..channels).map(|_| factor()).collect() } else { vec![factor(); channels] };
    (0..REPLICATES).map(|_| one()).collect()
}

/// A repeated fit.
struct Repeated {
    /// The values of the free parameters, in their own units.
    values: Vec<f64>,
    cost: f64,
}

impl Task<'_> {
    /// Fits the groups, each counted as many times as `times` says, with the values of each channel multiplied by its factor; `None` if the
    /// fit was stopped or its cost is not finite.
    fn repeat(
        &self,
        objective: Objective,
        groups: &IncidenceGroups,
        (times, factors): (&[usize], &[f64]),
        table: &ParameterTable,
    ) -> Result<Option<Repeated>, Error> {
        // On a large table even one pass would keep the user waiting.
        if self.is_stopped() {
            return Ok(None);
        }
        assert_eq!(times.len(), groups.len(), "number of groups");
        let mut drawn = counted(self.samples, |sample| times[groups.of_sample[sample]]);
        if self.options.scale_error.is_some() {
            drawn = drawn.scaled(factors);
        }
        let found = self.fit_again(&drawn, objective, table)?;
        Ok(found.map(|(found, cost)| {
            let values = found.free_rows().map(|row| row.value).collect();
            Repeated { values, cost }
        }))
    }

    /// The parameters and the cost of a fit of samples that were drawn, from the optimum of all; `None` if it was stopped or its cost is not
    /// finite.
    pub(super) fn fit_again(
        &self,
        drawn: &Samples,
        objective: Objective,
        table: &ParameterTable,
    ) -> Result<Option<(ParameterTable, f64)>, Error> {
        let problem = self.problem(&self.observe(drawn), table.clone(), objective);
        let start = DVector::from_vec(table.coordinates());
        let solution = minimise(&problem, start, LOOSE, self.limits(ITERATIONS, None))?;
        let stopped = [Termination::Interrupted, Termination::Timeout, Termination::Invalid];
        if stopped.contains(&solution.termination) {
            return Ok(None);
        }
        let mut found = table.clone();
        found.set_coordinates(solution.x.as_slice());
        // Order the lobes, so that each is the same one in every fit.
        found.sort_lobes();
        Ok(Some((found, solution.cost)))
    }
}

/// The samples that are drawn at least once, each counted as many times as it is.
pub(super) fn counted(samples: &Samples, times: impl Fn(usize) -> usize) -> Samples {
    let kept: Vec<usize> = (0..samples.len()).filter(|sample| times(*sample) > 0).collect();
    let mut drawn = samples.at(&kept);
    for (weight, sample) in drawn.weights.iter_mut().zip(&kept) {
        *weight *= count(times(*sample));
    }
    drawn
}

impl Resampled {
    /// The value of the parameter in a row of the table, for each fit; `None` if it is not free.
    fn values_of(&self, row: usize) -> Option<&[f64]> {
        let place = self.rows.iter().position(|r| *r == row)?;
        Some(&self.values[place])
    }

    /// The 95 % interval of the parameter in a row of the table: the 2.5th and 97.5th percentiles. `None` if it is not
    /// free.
    #[must_use]
    pub fn interval(&self, row: usize) -> Option<[f64; 2]> {
        self.values_of(row).map(percentiles)
    }

    /// The standard error and the 95 % interval of the product of the parameters in two rows; `None` unless both are
    /// free.
    #[must_use]
    pub fn product(&self, a: usize, b: usize) -> Option<(f64, [f64; 2])> {
        let products: Vec<f64> =
            self.values_of(a)?.iter().zip(self.values_of(b)?).map(|(x, y)| x * y).collect();
        Some((covariance(&products, &products).sqrt(), percentiles(&products)))
    }

    /// Replaces the covariance of `formula` by that of the repeated fits. Which parameters are determined stays as the
    /// formula says.
    pub(super) fn covariance(&self, formula: Covariance) -> Covariance {
        let fits = self.replicates;
        // Differences from the mean, scaled so that their products are unbiased covariances.
        let of_row = |row: &usize| {
            let values = self.values_of(*row)?;
            let mean = mean(values);
            let unit = (count(fits) - 1.0).sqrt();
            Some(DVector::from_fn(fits, |k, _| (values[k] - mean) / unit))
        };
        let columns: Vec<DVector<f64>> = formula.rows.iter().filter_map(of_row).collect();
        assert_eq!(columns.len(), formula.rows.len(), "the free parameters are those of the repeated fits");
        let entries = BlockMatrix::products(DMatrix::from_columns(&columns));
        Covariance { method: Method::BlockBootstrap, entries, ..formula }
    }
}

/// The standard deviation of values, estimated without bias of its square.
pub(super) fn standard_deviation(values: &[f64]) -> f64 {
    covariance(values, values).sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / count(values.len())
}

fn covariance(a: &[f64], b: &[f64]) -> f64 {
    let (mean_a, mean_b) = (mean(a), mean(b));
    let sum: f64 = a.iter().zip(b).map(|(x, y)| (x - mean_a) * (y - mean_b)).sum();
    sum / (count(a.len()) - 1.0)
}

/// The 2.5th and 97.5th percentiles, interpolated linearly between the values.
fn percentiles(values: &[f64]) -> [f64; 2] {
    assert!(!values.is_empty(), "values to sort");
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let last = sorted.len() - 1;
    [0.025, 0.975].map(|share| {
        let position = share * count(last);
        let below = (0..=last).rev().find(|k| count(*k) <= position).unwrap_or(0);
        let at = |k: usize| sorted[k.min(last)];
        let (low, high) = (at(below), at(below + 1));
        low + (position - count(below)) * (high - low)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn percentiles_are_linear_between_values() {
        // Hyndman and Fan 1996, definition 7: position p (n - 1) from 0.
        let values: Vec<f64> = (0..=200).rev().map(f64::from).collect();
        assert_eq!(percentiles(&values), [5.0, 195.0]);
        let [low, high] = percentiles(&[2.0, 1.0]);
        assert_relative_eq!(low, 1.025);
        assert_relative_eq!(high, 1.975);
        assert_eq!(percentiles(&[3.0]), [3.0, 3.0]);
    }

    #[test]
    fn covariances_are_unbiased() {
        // 1, 2, 3, 4: variance 5/3; against 2, 1, 4, 3: covariance 1.
        let (a, b) = ([1.0, 2.0, 3.0, 4.0], [2.0, 1.0, 4.0, 3.0]);
        assert_relative_eq!(covariance(&a, &a), 5.0 / 3.0, max_relative = 1e-15);
        assert_relative_eq!(covariance(&a, &b), 1.0, max_relative = 1e-15);
    }

    #[test]
    fn as_many_groups_are_drawn_as_there_are() {
        let draws = draws(8, 0, |_| true);
        assert_eq!(draws.len(), REPLICATES);
        assert!(draws.iter().all(|times| times.iter().sum::<usize>() == 8));
        // A group is never drawn with probability (7/8)^8 = 0.344: 550 of 1600, standard deviation below 19.
        let missed = draws.iter().flatten().filter(|times| **times == 0).count();
        assert!((480..620).contains(&missed), "{missed}");
    }
}
