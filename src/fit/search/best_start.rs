//! Where the final fit starts: the best of several starts, each followed to its minimum on part of the samples.

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
    /// Cost after polishing, on the samples of the search.
    pub cost: f64,
    /// The shapes that it started from: full name and value.
    pub shapes: Vec<(String, f64)>,
    /// The shapes that it led to: row of the parameter table and value, lobes in order.
    pub reached: Vec<(usize, f64)>,
    /// Why the polishing stopped.
    pub termination: Termination,
}

/// What the search found, beside the parameters to start from.
pub(in crate::fit) struct SearchOutcome {
    /// What is minimised, the scale of the loss settled.
    pub(in crate::fit) objective: Objective,
    /// The starts that were polished.
    pub(in crate::fit) starts: Vec<Start>,
    /// The lowest cost along each shape that was scanned.
    pub(in crate::fit) profiles: Vec<Profile>,
}

/// A candidate of the scan and where polishing led it.
struct Polished {
    /// Parameters at the start.
    from: ParameterTable,
    /// The end of the last minimisation.
    solution: Solution,
    /// Parameters at the end.
    to: ParameterTable,
}

/// Samples of the scan.
const SCAN_SAMPLES: usize = 800;
/// Iterations that a candidate is polished for.
const POLISH_ITERATIONS: u64 = 150;
/// Iterations after which, with one shape, only candidates near the lowest cost go on.
const SHORT_POLISH: u64 = 25;
/// A cost above the lowest by no more than this share is near it.
const HOPEFUL: f64 = 0.2;
/// Starts whose costs agree to this share have found the same minimum.
const SAME_MINIMUM: f64 = 1e-6;
/// Minima whose costs on part of the samples are above the lowest by no more than this share are compared again on
/// [`RACE_SAMPLES`].
const CLOSE_RACE: f64 = 0.05;
/// Most minima that are compared again.
const RIVALS: usize = 3;
/// Samples that they are compared on.
const RACE_SAMPLES: usize = 10 * POLISH_SAMPLES;
/// Iterations on those samples.
const RACE_ITERATIONS: u64 = 15;
/// Estimates of a loss's scale from part of the samples.
const SCALE_ROUNDS: usize = 4;
/// The smallest scale of a loss, relative to the data.
const SMALLEST_SCALE: f64 = 1e-6;

impl Task<'_> {
    /// Searches for a start of the final fit: the best start found, polished on part of the samples, and what was found
    /// on the way.
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

        // A scan over the shapes; the best of its points are polished, and the best of those is kept.
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

        // Each estimate of the scale of a loss rests on a fit with the one before, the last on all samples.
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

    /// Polishes the candidates of a scan, and what the channels make of their ends where each has shapes of its own. Yields
    /// a record of each and the parameters that it led to, lobes in order.
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

        // With several shapes a way that is slow for long may still lead to the lowest minimum: all go on to the end.
        let at_first = if scan.axes == 1 { SHORT_POLISH } else { POLISH_ITERATIONS };
        let candidates = scan.candidates.par_iter();
        let first: Result<Vec<Polished>, Error> =
            candidates.map(|candidate| polish(&candidate.table, at_first)).collect();
        let first = first?;

        // With one shape, only those near the lowest cost do.
        let lowest = first.iter().map(|end| end.solution.cost).fold(f64::INFINITY, f64::min);
        let left = POLISH_ITERATIONS - at_first;
        let go_on = |end: Polished| -> Result<Polished, Error> {
            let unfinished = left > 0 && end.solution.termination == Termination::IterationLimit;
            if unfinished && end.solution.cost <= (1.0 + HOPEFUL) * lowest {
                Ok(Polished { from: end.from, ..polish(&end.to, left)? })
            } else {
                Ok(end)
            }
        };
        let ends: Result<Vec<Polished>, Error> = first.into_par_iter().map(go_on).collect();
        let mut ends = ends?;

        // Each channel by itself may do best elsewhere.
        let tables: Vec<&ParameterTable> = ends.iter().map(|end| &end.to).collect();
        if let Some(start) = recombined(&tables, |table| self.problem(samples, table.clone(), objective)) {
            ends.push(polish(&start, POLISH_ITERATIONS)?);
        }
        Ok(ends.into_iter().map(Polished::recorded).collect())
    }

    /// The best of what the starts led to; `None` without starts. Minima that are close on part of the samples compete on
    /// more.
    fn best_of(
        &self,
        mut ends: Vec<(Start, ParameterTable)>,
        objective: Objective,
    ) -> Result<Option<ParameterTable>, Error> {
        // The distinct minima near the lowest. Of starts that lead to the same one the scan's favourite is kept.
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

    /// A scale of the loss beyond which no residual of a sensible fit lies: the search starts with it,
    /// while the bulk of the data is still far from any model.
    fn widest_scale(&self, samples: &Observed<'_>) -> f64 {
        if self.options.loss == LossKind::None {
            return 1.0;
        }
        let quantile = samples.quantile(BULK_OF_DATA);
        // Data that are zero throughout have no scale; any will do.
        if quantile > 0.0 { quantile } else { 1.0 }
    }

    /// The scale that the user gave, or that of the residuals at the values in `table`.
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
            // Of data without noise only rounding is left.
            deviation.max(SMALLEST_SCALE * widest)
        })
    }
}

impl Polished {
    /// The record of a start, and the parameters that it led to, lobes in order.
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

/// The free shapes of a table: row and value.
fn free_shapes(table: &ParameterTable) -> Vec<(usize, f64)> {
    let rows = table.free().iter().map(|index| (*index, &table.rows()[*index]));
    rows.filter(|(_, row)| row.spec.role == Role::Shape).map(|(index, row)| (index, row.value)).collect()
}
