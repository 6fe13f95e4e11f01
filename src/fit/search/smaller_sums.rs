//! Searches the sums that remain without one or more lobes, so that a larger model is never worse than a smaller one.
//!
//! The search for a start of a sum may end in a minimum that is worse than the best fit of the sum without a lobe. And
//! a lobe whose strength is 1 may be present or absent, and nothing between: no descent leads from one to the
//! other. So every smaller sum is searched as if it were fitted alone, and the sum starts from there if that is lower.

use super::best_start::{
    CLOSE_RACE, POLISH_ITERATIONS, RACE_ITERATIONS, RACE_SAMPLES, SCAN_SAMPLES, SHORT_POLISH, SearchOutcome,
    Start,
};
use super::scan::{Profile, ScanSamples, Scanner};
use crate::error::Error;
use crate::fit::problem::loss::Objective;
use crate::fit::problem::observed::Observed;
use crate::fit::task::{POLISH_SAMPLES, Task};
use crate::parameters::{ParameterTable, Smaller};
use crate::solver::LeastSquares;
use nalgebra::DVector;
use std::sync::Arc;

/// A cost below this share of the sum of squares of the data cannot be improved noticeably.
const PERFECT: f64 = 1e-18;
/// A smaller sum is searched in full if a short search comes within this factor of the best cost so far. The minimum of the
/// smaller sum is rarely lower by more than that.
const PROMISING: f64 = 2.0;
/// Number of starts of a short search.
const PROBES: usize = 2;

/// A start of the final fit: the parameters, and the search that led to them.
struct Found {
    table: ParameterTable,
    outcome: SearchOutcome,
    /// The cost on the samples used to compare starts.
    cost: f64,
}

impl Task<'_> {
    /// Searches for a start of the final fit in the sum and in every sum that remains without some of its lobes.
    pub(in crate::fit) fn search_with_smaller_sums(
        &self,
        table: ParameterTable,
    ) -> Result<(ParameterTable, SearchOutcome), Error> {
        let samples = self.draws.part(POLISH_SAMPLES, self.options.seed);
        let found = self.search_from(table, 0, &self.observe(&samples))?;
        Ok((found.table, found.outcome))
    }

    /// The same without lobes before `first`, which have been left out before. Starts are compared on `samples`.
    fn search_from(
        &self,
        table: ParameterTable,
        first: usize,
        samples: &Arc<Observed<'_>>,
    ) -> Result<Found, Error> {
        let removable = table.removable();
        let (start, outcome) = self.search(table.clone())?;
        let perfect = PERFECT * samples.magnitude2();
        let partial = self.samples.len() > POLISH_SAMPLES;
        let margin = if partial { CLOSE_RACE } else { 0.0 };
        let mut best =
            Found { cost: self.cost_on(samples, &start, outcome.objective), table: start, outcome };
        for lobe in removable.into_iter().filter(|lobe| *lobe >= first) {
            let Some(expression) = self.expression.without(lobe) else { continue };
            if best.cost <= perfect {
                break;
            }
            // Many samples leave no time to search again what the search of the whole sum has scanned.
            let scanned = !table.has_free_shapes(lobe);
            if partial && scanned && table.vanishes_gradually(lobe) {
                continue;
            }
            let mut smaller = table.without(lobe);
            let task = self.of(&expression);
            let starts = if scanned {
                vec![best.table.without(lobe).table]
            } else {
                task.short_scan(&smaller.table, best.outcome.objective)?
            };
            if task.probe(starts, samples, best.outcome.objective)? > PROMISING * best.cost {
                continue;
            }
            let below = task.search_from(smaller.table.clone(), lobe, samples)?;
            if below.cost > (1.0 + margin) * best.cost {
                continue;
            }
            smaller.table = below.table;
            let rival = self.extended(&table, &smaller, lobe, below.outcome, samples)?;
            if self.is_better(&rival, &best)? {
                best = rival;
            }
        }
        Ok(best)
    }

    /// The best few points of a scan.
    fn short_scan(&self, table: &ParameterTable, objective: Objective) -> Result<Vec<ParameterTable>, Error> {
        let samples = self.draws.part(SCAN_SAMPLES, self.options.seed);
        let samples = ScanSamples::new(&samples, self.options.metric);
        let limits = self.limits(0, None);
        let scanner = Scanner { expression: self.expression, samples: &samples, objective, limits };
        let candidates = scanner.scan(table, self.options.seed)?.candidates.into_iter().take(PROBES);
        Ok(candidates.map(|candidate| candidate.table).collect())
    }

    /// The lowest cost to which a few iterations lead from `starts`.
    fn probe(
        &self,
        starts: Vec<ParameterTable>,
        samples: &Arc<Observed<'_>>,
        objective: Objective,
    ) -> Result<f64, Error> {
        let cost = |start| Ok(self.polish(samples, start, objective, SHORT_POLISH)?.cost);
        let costs: Result<Vec<f64>, Error> = starts.into_iter().map(cost).collect();
        Ok(costs?.into_iter().fold(f64::INFINITY, f64::min))
    }

    /// Continues the fit of a smaller sum in the whole one.
    fn extended(
        &self,
        table: &ParameterTable,
        smaller: &Smaller,
        lobe: usize,
        below: SearchOutcome,
        samples: &Arc<Observed<'_>>,
    ) -> Result<Found, Error> {
        let mut table = table.with_values_of(smaller, lobe);
        let SearchOutcome { objective, starts, profiles } = below;
        let solution = self.polish(samples, table.clone(), objective, POLISH_ITERATIONS)?;
        table.set_coordinates(solution.x.as_slice());
        table.sort_lobes();
        let row = |row: &usize| smaller.origins.get(*row).copied();
        let start = |start: Start| {
            let reached = start.reached.iter().filter_map(|(index, value)| Some((row(index)?, *value)));
            Start { reached: reached.collect(), ..start }
        };
        let profile = |profile: Profile| Some(Profile { row: row(&profile.row)?, ..profile });
        let outcome = SearchOutcome {
            objective,
            starts: starts.into_iter().map(start).collect(),
            profiles: profiles.into_iter().filter_map(profile).collect(),
        };
        Ok(Found { table, outcome, cost: solution.cost })
    }

    /// Whether a start is better than another: its cost on part of the samples is lower or, if the two are close and there
    /// are more samples, after a few iterations on more of them.
    fn is_better(&self, rival: &Found, best: &Found) -> Result<bool, Error> {
        let close = (rival.cost - best.cost).abs() <= CLOSE_RACE * best.cost;
        if !close || self.samples.len() <= POLISH_SAMPLES {
            return Ok(rival.cost < best.cost);
        }
        let samples = self.draws.part(RACE_SAMPLES, self.options.seed);
        let observed = self.observe(&samples);
        let cost = |found: &Found| -> Result<f64, Error> {
            Ok(self.polish(&observed, found.table.clone(), found.outcome.objective, RACE_ITERATIONS)?.cost)
        };
        Ok(cost(rival)? < cost(best)?)
    }

    fn cost_on(&self, samples: &Arc<Observed<'_>>, table: &ParameterTable, objective: Objective) -> f64 {
        let problem = self.problem(samples, table.clone(), objective);
        problem.linearise(&DVector::from_vec(table.coordinates())).cost
    }
}
