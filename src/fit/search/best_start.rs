//! Where the final fit starts: the best of several starts, each followed to its minimum on part of the samples.

use super::recombine::recombined;
use super::scan::{Profile, Scan, ScanSamples, scan};
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

/// What the search has found out.
pub(in crate::fit) struct Found {
    /// What is minimised, the scale of the loss settled.
    pub(in crate::fit) objective: Objective,
    pub(in crate::fit) starts: Vec<Start>,
    pub(in crate::fit) profiles: Vec<Profile>,
}

/// Samples of the scan.
const SCAN_SAMPLES: usize = 800;
/// How long its best points are polished. Along one shape, all for so many iterations, and longer only those whose
/// cost is above the lowest by no more than a share.
const POLISH_ITERATIONS: u64 = 150;
const SHORT_POLISH: u64 = 25;
const HOPEFUL: f64 = 0.2;
/// Starts whose costs agree to this have found the same minimum.
const SAME_MINIMUM: f64 = 1e-6;
/// Minima whose costs on part of the samples lie so close compete on ten times as many, at most so many.
const CLOSE_RACE: f64 = 0.05;
const RIVALS: usize = 3;
const RACE_SAMPLES: usize = 10 * POLISH_SAMPLES;
const RACE_ITERATIONS: u64 = 15;
/// Estimates of a loss's scale from part of the samples.
const SCALE_ROUNDS: usize = 4;
/// The smallest scale of a loss, relative to the data.
const SMALLEST_SCALE: f64 = 1e-6;

impl Task<'_> {
    /// The best start found, polished on part of the samples, and what was seen on the way.
    pub(in crate::fit) fn search(&self, mut table: ParameterTable) -> Result<(ParameterTable, Found), Error> {
        let few = self.draws.part(SCAN_SAMPLES, self.options.seed);
        let few = ScanSamples::new(&few, self.options.metric);
        let more = self.draws.part(POLISH_SAMPLES, self.options.seed);
        let more = self.observe(&more);
        let widest = self.widest_scale(few.in_all_channels());
        let mut objective = Objective { metric: self.options.metric, loss: self.options.loss, scale: widest };
        let mut starts = Vec::new();
        let mut profiles = Vec::new();
        if !table.free().is_empty() {
            let seen =
                scan(self.expression, &few, &table, objective, self.options.seed, &self.limits(0, None))?;
            let ends = self.follow_all(&more, &seen, objective)?;
            starts = ends.iter().map(|(start, _)| start.clone()).collect();
            profiles = seen.profiles;
            table = self.best_of(ends, objective)?.unwrap_or(table);
        }
        if objective.loss != LossKind::None {
            // Each estimate of the scale rests on a fit with the one before, the last on all samples.
            for _ in 0..SCALE_ROUNDS {
                objective.scale = self.loss_scale(&more, &table, objective, widest);
                let solution = self.polish(&more, table.clone(), objective, POLISH_ITERATIONS)?;
                table.set_coordinates(solution.x.as_slice());
            }
            objective.scale = self.loss_scale(&self.observe(self.samples), &table, objective, widest);
        }
        Ok((table, Found { objective, starts, profiles }))
    }

    /// Polishes the points that a scan has chosen.
    fn follow_all(
        &self,
        samples: &Arc<Observed<'_>>,
        seen: &Scan,
        objective: Objective,
    ) -> Result<Vec<(Start, ParameterTable)>, Error> {
        let candidates = &seen.candidates;
        // With several shapes a way that is slow for long may still lead to the lowest minimum.
        let at_first = if seen.axes == 1 { SHORT_POLISH } else { POLISH_ITERATIONS };
        let follow = |table: &ParameterTable, iterations| -> Result<(Solution, ParameterTable), Error> {
            let solution = self.polish(samples, table.clone(), objective, iterations)?;
            let mut polished = table.clone();
            polished.set_coordinates(solution.x.as_slice());
            Ok((solution, polished))
        };
        let first: Result<Vec<_>, Error> =
            candidates.par_iter().map(|candidate| follow(&candidate.table, at_first)).collect();
        let first = first?;
        let lowest = first.iter().map(|(solution, _)| solution.cost).fold(f64::INFINITY, f64::min);
        let ends: Result<Vec<_>, Error> = first
            .into_par_iter()
            .map(|(solution, polished)| {
                let near = solution.cost <= (1.0 + HOPEFUL) * lowest;
                let left = POLISH_ITERATIONS - at_first;
                if left > 0 && solution.termination == Termination::IterationLimit && near {
                    follow(&polished, left)
                } else {
                    Ok((solution, polished))
                }
            })
            .collect();
        let mut ways: Vec<(ParameterTable, Solution, ParameterTable)> = candidates
            .iter()
            .zip(ends?)
            .map(|(candidate, (solution, polished))| (candidate.table.clone(), solution, polished))
            .collect();
        let ends: Vec<&ParameterTable> = ways.iter().map(|(_, _, end)| end).collect();
        if let Some(start) = recombined(&ends, |end| self.problem(samples, end.clone(), objective)) {
            let (solution, polished) = follow(&start, POLISH_ITERATIONS)?;
            ways.push((start, solution, polished));
        }
        let record = |(from, solution, mut polished): (ParameterTable, Solution, ParameterTable)| {
            polished.sort_lobes();
            let shapes = free_shapes(&from).into_iter().map(|(index, value)| (from.name(index), value));
            let start = Start {
                cost: solution.cost,
                shapes: shapes.collect(),
                reached: free_shapes(&polished),
                termination: solution.termination,
            };
            (start, polished)
        };
        Ok(ways.into_iter().map(record).collect())
    }

    /// The best of what the starts led to. Minima that are close on part of the samples compete on more.
    fn best_of(
        &self,
        mut ends: Vec<(Start, ParameterTable)>,
        objective: Objective,
    ) -> Result<Option<ParameterTable>, Error> {
        let lowest = ends.iter().map(|(start, _)| start.cost).fold(f64::INFINITY, f64::min);
        let partial = self.samples.len() > POLISH_SAMPLES;
        if partial {
            ends.sort_by(|(a, _), (b, _)| a.cost.total_cmp(&b.cost));
        }
        // Of starts that lead to the same minimum the scan's favourite is kept.
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
        let many = self.draws.part(RACE_SAMPLES, self.options.seed);
        let many = self.observe(&many);
        let mut best: Option<(f64, ParameterTable)> = None;
        for (_, mut table) in rivals {
            let solution = self.polish(&many, table.clone(), objective, RACE_ITERATIONS)?;
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

/// The free shapes of a table: row and value.
fn free_shapes(table: &ParameterTable) -> Vec<(usize, f64)> {
    let rows = table.free().iter().filter_map(|index| Some((*index, table.rows().get(*index)?)));
    rows.filter(|(_, row)| row.spec.role == Role::Shape).map(|(index, row)| (index, row.value)).collect()
}
