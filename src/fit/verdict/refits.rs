//! Clustered errors where the linear model does not tell how far fits scatter.
//!
//! An error from the linear model sees the cost as a parabola around its minimum. Some costs are bent valleys, or have another minimum
//! beside it that is as low for other samples: there fits repeated on other samples scatter several times as far. Hence the fit is repeated
//! on a part of the samples, from which groups are drawn with replacement, and a standard error is multiplied by how much more these fits
//! scatter than the linear model of the same part says. The part has too few samples for errors of its own, but it has the valleys of all.
//!
//! Valleys lie between shapes, so that a model with a single one is spared this. So few samples make it cheap: as long as a pass or two over a
//! full table.

use super::bootstrap::{ITERATIONS, LOOSE, REPLICATES, counted, draws, standard_deviation};
use super::covariance::{Covariance, Method, Noise};
use crate::fit::problem::loss::Objective;
use crate::fit::task::Task;
use crate::math::count;
use crate::measurement::{Clusters, Samples};
use crate::model::Role;
use crate::parameters::ParameterTable;
use crate::solver::inverse::arrow::Arrow;
use crate::solver::inverse::curvature::beyond_linear;
use crate::solver::inverse::jackknife::GroupedRows;
use crate::solver::{Linearisation, minimise};
use nalgebra::DVector;
use rayon::prelude::*;

/// Largest number of samples of the part.
const SAMPLES: usize = 3000;
/// Number of values that all repeated fits may have together, which limits how many there are for many channels.
const VALUES: usize = 2_000_000;
/// Least number of repeated fits. With so few, the standard error of a standard error is 10 %.
const FEWEST: usize = 50;
/// Least number of free shapes between which a valley can lie.
const FEWEST_SHAPES: usize = 2;
/// A standard error is multiplied if that makes it at least this many times as large: twice the error of what 200 fits say.
const WORTHWHILE: f64 = 1.1;
/// Largest part of the repeated fits that may fail.
const MOST_FAILED: f64 = 0.25;

/// The part of the samples on which fits are repeated.
struct Part {
    samples: Samples,
    clusters: Clusters,
    /// The parameters at its own minimum.
    table: ParameterTable,
    objective: Objective,
}

impl Task<'_> {
    /// The covariance with errors that are as large as repeated fits scatter, where these scatter farther than the linear model says.
    pub(super) fn as_refits_scatter(
        &self,
        covariance: Covariance,
        table: &ParameterTable,
        objective: Objective,
    ) -> Covariance {
        match self.excess(&covariance, table, objective) {
            Some((factors, refits)) => covariance.widened(&factors, refits),
            None => covariance,
        }
    }

    /// How many times as far as the linear model says fits scatter in each parameter, and 1 where that is about as far, with the number of fits;
    /// `None` if it is so in all of them, or if too many fits fail.
    fn excess(
        &self,
        covariance: &Covariance,
        table: &ParameterTable,
        objective: Objective,
    ) -> Option<(Vec<f64>, usize)> {
        let grouping = covariance.grouping?;
        let shapes = table.free_rows().filter(|row| row.spec.role == Role::Shape).count();
        if shapes < FEWEST_SHAPES {
            return None;
        }
        let samples = self.draws.part(SAMPLES, self.options.seed);
        let problem = self.problem(&self.observe(&samples), table.clone(), objective);
        let start = DVector::from_vec(table.coordinates());
        let solution = minimise(&problem, start, LOOSE, self.limits(ITERATIONS, None)).ok()?;
        if !solution.termination.converged() {
            return None;
        }
        let same =
            |clusters: &Clusters| (clusters.kind, clusters.width_deg) == (grouping.kind, grouping.width_deg);
        let clusters = samples.clusters(problem.most_columns()).find(same)?;
        let mut table = table.clone();
        table.set_coordinates(solution.x.as_slice());
        let sums = problem.group_sums(&solution.x, clusters.groups, &clusters.of_sample);
        let curvature = beyond_linear(&problem, &solution.x);
        let dof = count(problem.residuals()) - count(table.free().len());
        let typical = (solution.cost / dof).sqrt();
        let scatter = |arrow: &Arrow| -> Linearisation {
            problem.scatter(&solution.x, |columns| arrow.root(columns), typical)
        };
        let rows = GroupedRows { sums: &sums, curvature: &curvature };
        let noise = Noise::Groups(grouping, rows, Some(&scatter));
        let linear = Covariance::new(&table, &solution.linearisation, Method::Clustered, &noise, dof)?;
        let part = Part { samples, clusters, table, objective };
        let fits = self.refits(&part)?;
        let excess = |row: &usize| {
            let values: Vec<f64> = fits.iter().map(|fit| fit.rows()[*row].value).collect();
            let excess = standard_deviation(&values) / linear.std_error(*row)?;
            (excess.is_finite() && excess >= WORTHWHILE).then_some(excess)
        };
        let all: Vec<Option<f64>> = covariance.rows.iter().map(excess).collect();
        let any = all.iter().any(Option::is_some);
        any.then(|| (all.into_iter().map(|excess| excess.unwrap_or(1.0)).collect(), fits.len()))
    }

    /// The fits of the part with its groups drawn as the block bootstrap draws them; `None` if too many fail.
    fn refits(&self, part: &Part) -> Option<Vec<ParameterTable>> {
        let mut draws = draws(part.clusters.groups, self.options.seed, |_| true);
        let values = part.samples.len() * part.samples.values.len();
        draws.truncate((VALUES / values.max(1)).clamp(FEWEST, REPLICATES));
        let fits: Vec<ParameterTable> =
            draws.par_iter().filter_map(|times| self.refit(part, times)).collect();
        (count(draws.len() - fits.len()) <= MOST_FAILED * count(draws.len())).then_some(fits)
    }

    /// The fit of the part with each group counted so many times; `None` if it fails.
    fn refit(&self, part: &Part, times: &[usize]) -> Option<ParameterTable> {
        let Part { samples, clusters, table, objective } = part;
        if self.is_stopped() {
            return None;
        }
        let group = |sample: usize| clusters.of_sample.get(sample).map_or(0, |group| *group as usize);
        let drawn = counted(samples, |sample| times[group(sample)]);
        self.fit_again(&drawn, *objective, table).ok().flatten().map(|(found, _)| found)
    }
}
