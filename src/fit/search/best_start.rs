//! The search for a start of the final fit: the best of several starts, each polished on part of the samples.

use super::recombine::recombined;
use super::scan::{Profile, Scan, ScanSamples, Scanner};
use crate::error::Error;
use crate::fit::problem::loss::{LossKind, Objective};
use crate::fit::problem::observed::{BULK_OF_DATA, Observed};
use crate::fit::task::{POLISH_SAMPLES, Task};
use crate::model::Role;
use crate::parameters::{ParameterTable, shapes_differ};
use crate::solver::{Solution, Termination};
use nalgebra::DVector;
use rayon::prelude::*;
use std::sync::Arc;

/// One start of the search and where it led.
#[derive(Clone, Debug)]
pub struct Start {
    /// Cost after polishing, on the samples used for the search.
    pub cost: f64,
    /// The shapes at the start: full name and value.
    pub shapes: Vec<(String, f64)>,
    /// The shapes at the end: row of the parameter table and value, with lobes in order.
    pub reached: Vec<(usize, f64)>,
    /// Why the polishing stopped.
    pub termination: Termination,
}

/// The outcome of the search, apart from the parameters to start from.
pub(in crate::fit) struct SearchOutcome {
    /// The objective to minimise, with the scale of the loss determined.
    pub(in crate::fit) objective: Objective,
    /// The starts that were polished.
    pub(in crate::fit) starts: Vec<Start>,
    /// The lowest cost along each shape that was scanned.
    pub(in crate::fit) profiles: Vec<Profile>,
}

/// A candidate of the scan and the result of polishing it.
struct Polished {
    /// Parameters at the start.
    from: ParameterTable,
    /// The solution of the last minimisation.
    solution: Solution,
    /// Parameters at the end.
    to: ParameterTable,
}

/// Number of samples of the scan.
pub(super) const SCAN_SAMPLES: usize = 800;
/// Number of iterations for which a candidate is polished.
pub(super) const POLISH_ITERATIONS: u64 = 150;
/// Number of iterations after which only candidates near the lowest cost are continued.
pub(super) const SHORT_POLISH: u64 = 25;
/// A cost is near the lowest if it exceeds it by no more than this fraction.
const HOPEFUL: f64 = 0.2;
/// The same with several shapes, where a slow descent may yet lead to the lowest minimum.
const HOPEFUL_IN_SPACE: f64 = 1.0;
/// Starts whose costs agree within this fraction have found the same minimum.
const SAME_MINIMUM: f64 = 1e-6;
/// Minima whose costs on part of the samples exceed the lowest by no more than this fraction are compared again on
/// [`RACE_SAMPLES`].
pub(super) const CLOSE_RACE: f64 = 0.05;
/// Largest number of minima that are compared again.
const RIVALS: usize = 3;
/// Number of samples on which they are compared.
pub(super) const RACE_SAMPLES: usize = 10 * POLISH_SAMPLES;
/// Number of iterations on those samples.
pub(super) const RACE_ITERATIONS: u64 = 15;
/// Number of estimates of a loss's scale from part of the samples.
const SCALE_ROUNDS: usize = 4;
/// The smallest scale of a loss, relative to the data.
const SMALLEST_SCALE: f64 = 1e-6;

impl Task<'_> {
    /// Searches for a start of the final fit. Returns the best parameters found, polished on part of the samples, and
    /// a record of the search.
    pub(in crate::fit) fn search(
        &self,
        mut table: ParameterTable,
    ) -> Result<(ParameterTable, SearchOutcome), Error> {
        let scan_samples = self.draws.part(SCAN_SAMPLES, self.options.seed);
        let scan_samples = ScanSamples::new(&scan_samples, self.options.metric);
        let polish_samples = self.draws.part(POLISH_SAMPLES, self.options.seed);
        let polish_samples = self.observe(&polish_samples);
        let widest = self.widest_scale(scan_samples.in_all_channels());
        let objective = Objective { metric: self.options.metric, loss: self.options.loss, scale: widest };
        let mut outcome = SearchOutcome { objective, starts: Vec::new(), profiles: Vec::new() };

        // Scan the shapes, polish the best points, and keep the best result.
        if !table.free().is_empty() {
            let scanner = Scanner {
                expression: self.expression,
                samples: &scan_samples,
                objective,
                limits: self.limits(0, None),
            };
            let scan = scanner.scan(&table, self.options.seed)?;
            let ends = self.polish_candidates(&polish_samples, &scan, objective)?;
            outcome.starts = ends.iter().map(|(start, _)| start.clone()).collect();
            outcome.profiles = scan.profiles;
            table = self.best_of(ends, objective)?.unwrap_or(table);
        }

        // Each estimate of a loss's scale comes from a fit with the previous estimate; the last one uses all samples.
        if objective.loss != LossKind::None {
            let objective = &mut outcome.objective;
            for _ in 0..SCALE_ROUNDS {
                objective.scale = self.loss_scale(&polish_samples, &table, *objective, widest);
                let solution = self.polish(&polish_samples, table.clone(), *objective, POLISH_ITERATIONS)?;
                table.set_coordinates(solution.x.as_slice());
            }
            objective.scale = self.loss_scale(&self.observe(self.samples), &table, *objective, widest);
        }
        Ok((table, outcome))
    }

    /// Polishes the candidates of a scan, and also the combination of their ends if channels have shapes of their own.
    /// Returns a record of each and the parameters that it reached, with lobes in order.
    fn polish_candidates(
        &self,
        samples: &Arc<Observed<'_>>,
        scan: &Scan,
        objective: Objective,
    ) -> Result<Vec<(Start, ParameterTable)>, Error> {
        let polish = |from: &ParameterTable, iterations| -> Result<Polished, Error> {
            let solution = self.polish(samples, from.clone(), objective, iterations)?;
            let mut to = from.clone();
            to.set_coordinates(solution.x.as_slice());
            Ok(Polished { from: from.clone(), solution, to })
        };

        let candidates = scan.candidates.par_iter();
        let first: Result<Vec<Polished>, Error> =
            candidates.map(|candidate| polish(&candidate.table, SHORT_POLISH)).collect();
        let first = first?;

        // Only those near the lowest cost are continued.
        let lowest = first.iter().map(|end| end.solution.cost).fold(f64::INFINITY, f64::min);
        let hopeful = if scan.axes > 1 { HOPEFUL_IN_SPACE } else { HOPEFUL };
        let go_on = |end: Polished| -> Result<Polished, Error> {
            let unfinished = end.solution.termination == Termination::IterationLimit;
            if unfinished && end.solution.cost <= (1.0 + hopeful) * lowest {
                Ok(Polished { from: end.from, ..polish(&end.to, POLISH_ITERATIONS - SHORT_POLISH)? })
            } else {
                Ok(end)
            }
        };
        let ends: Result<Vec<Polished>, Error> = first.into_par_iter().map(go_on).collect();
        let mut ends = ends?;

        // Each channel alone may have its lowest cost at another end.
        let tables: Vec<&ParameterTable> = ends.iter().map(|end| &end.to).collect();
        if let Some(start) = recombined(&tables, |table| self.problem(samples, table.clone(), objective)) {
            ends.push(polish(&start, POLISH_ITERATIONS)?);
        }
        Ok(ends.into_iter().map(Polished::recorded).collect())
    }

    /// The best parameters that the starts reached; `None` without starts. Minima that are close on part of the
    /// samples are compared again on more samples.
    fn best_of(
        &self,
        mut ends: Vec<(Start, ParameterTable)>,
        objective: Objective,
    ) -> Result<Option<ParameterTable>, Error> {
        // The distinct minima near the lowest. If several starts reach the same minimum, the one that the scan ranked
        // highest is kept.
        let lowest = ends.iter().map(|(start, _)| start.cost).fold(f64::INFINITY, f64::min);
        let partial = self.samples.len() > POLISH_SAMPLES;
        if partial {
            ends.sort_by(|(a, _), (b, _)| a.cost.total_cmp(&b.cost));
        }
        let margin = if partial { CLOSE_RACE } else { SAME_MINIMUM };
        let mut rivals: Vec<(Start, ParameterTable)> = Vec::new();
        for (start, table) in ends {
            let distinct =
                rivals.iter().all(|(rival, _)| shapes_differ(&table, &rival.reached, &start.reached));
            let close = start.cost <= (1.0 + margin) * lowest;
            if close && distinct && rivals.len() < RIVALS {
                rivals.push((start, table));
            }
        }
        if rivals.len() < 2 || !partial {
            return Ok(rivals.into_iter().next().map(|(_, table)| table));
        }

        // A few iterations of each on more samples decide.
        let race_samples = self.draws.part(RACE_SAMPLES, self.options.seed);
        let race_samples = self.observe(&race_samples);
        let mut best: Option<(f64, ParameterTable)> = None;
        for (_, mut table) in rivals {
            let solution = self.polish(&race_samples, table.clone(), objective, RACE_ITERATIONS)?;
            if best.as_ref().is_none_or(|(cost, _)| solution.cost < *cost) {
                table.set_coordinates(solution.x.as_slice());
                best = Some((solution.cost, table));
            }
        }
        Ok(best.map(|(_, table)| table))
    }

    /// A loss scale beyond which no residual of a sensible fit lies. The search starts with it, while the model is
    /// still far from the bulk of the data.
    fn widest_scale(&self, samples: &Observed<'_>) -> f64 {
        if self.options.loss == LossKind::None {
            return 1.0;
        }
        let quantile = samples.quantile(BULK_OF_DATA);
        // Data that are zero everywhere have no scale; any value will do.
        if quantile > 0.0 { quantile } else { 1.0 }
    }

    /// The scale that the user gave, or else the scale of the residuals at the values in `table`.
    fn loss_scale(
        &self,
        samples: &Arc<Observed<'_>>,
        table: &ParameterTable,
        objective: Objective,
        widest: f64,
    ) -> f64 {
        self.options.loss_scale.unwrap_or_else(|| {
            let problem = self.problem(samples, table.clone(), objective);
            let deviation = problem.residual_deviation(&DVector::from_vec(table.coordinates()));
            // Without noise, the residuals are only rounding errors.
            deviation.max(SMALLEST_SCALE * widest)
        })
    }
}

impl Polished {
    /// The record of a start and the parameters that it reached, with lobes in order.
    fn recorded(mut self) -> (Start, ParameterTable) {
        self.to.sort_lobes();
        let shapes = free_shapes(&self.from).into_iter().map(|(index, value)| (self.from.name(index), value));
        let start = Start {
            cost: self.solution.cost,
            shapes: shapes.collect(),
            reached: free_shapes(&self.to),
            termination: self.solution.termination,
        };
        (start, self.to)
    }
}

/// The free shapes of a table: row and value of each.
fn free_shapes(table: &ParameterTable) -> Vec<(usize, f64)> {
    let rows = table.free().iter().map(|index| (*index, &table.rows()[*index]));
    rows.filter(|(_, row)| row.spec.role == Role::Shape).map(|(index, row)| (index, row.value)).collect()
}
