//! A whole fit: select the samples, search for a start, polish, and judge the result.

use super::absent::past_absent_lobes;
use super::bootstrap::{self, Resampled, Uncertainty};
use super::coarse::{Candidate, Profile, scan};
use super::errors::{ErrorTable, score};
use super::hold_out::{self, HeldOut};
use super::least_squares::{LeastSquares, Linearisation};
use super::levenberg_marquardt::{Limits, Observer, Solution, StopSignal, Termination, Tolerances, minimise};
use super::loss::{LossKind, Objective};
use super::metric::Metric;
use super::parameters::{ParameterTable, Settings, Status};
use super::problem::ReflectanceProblem;
use super::solvers::{SolverKind, minimise_with};
use super::uncertainty::Covariance;
use super::warnings::{self, Warning};
use crate::error::Error;
use crate::math::count;
use crate::measurement::{Filters, Measurement, Samples, Weighting};
use crate::model::{Expression, Role};
use nalgebra::DVector;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

/// What to fit and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// What the residuals are differences of.
    pub metric: Metric,
    /// How large residuals count.
    pub loss: LossKind,
    /// Where they begin to count less, in units of the residual; found from the data if none.
    pub loss_scale: Option<f64>,
    /// Which samples count.
    pub filters: Filters,
    /// Wishes about parameters.
    pub settings: Settings,
    /// Seed of the draws of samples.
    pub seed: u64,
    /// Fraction of the angles of incidence that is left out of the fit, to judge it by; none if none.
    pub hold_out: Option<f64>,
    /// Where standard errors come from.
    pub uncertainty: Uncertainty,
    /// What minimises in the final fit.
    pub solver: SolverKind,
    /// Most iterations of the final fit by Levenberg-Marquardt; other solvers make more of them.
    pub iterations: u64,
    /// Set to true to stop with the best so far.
    pub stop: Option<StopSignal>,
    /// The moment to stop at.
    pub deadline: Option<Instant>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            metric: Metric::default(),
            loss: LossKind::default(),
            loss_scale: None,
            filters: Filters::default(),
            settings: Vec::new(),
            seed: 0,
            hold_out: None,
            uncertainty: Uncertainty::default(),
            solver: SolverKind::default(),
            iterations: 300,
            stop: None,
            deadline: None,
        }
    }
}

/// Hears how a fit goes on.
pub trait Progress: Send + Sync {
    /// A new stage begins.
    fn stage(&self, name: &str);
    /// An iteration of the final fit is over.
    fn iteration(&self, iteration: u64, cost: f64);
}

/// Hears nothing.
#[derive(Clone, Copy, Debug)]
pub struct Quiet;

impl Progress for Quiet {
    fn stage(&self, _: &str) {}
    fn iteration(&self, _: u64, _: f64) {}
}

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

/// Criteria that weigh the error against the number of parameters; none where the cost is no likelihood.
#[derive(Clone, Copy, Debug, Default)]
pub struct Selection {
    /// Akaike's information criterion, corrected for small samples.
    pub aicc: Option<f64>,
    /// Bayesian information criterion.
    pub bic: Option<f64>,
}

/// The result of a fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// All parameters at their final values.
    pub table: ParameterTable,
    /// How the samples were weighted.
    pub weighting: Weighting,
    /// Samples used.
    pub used: usize,
    /// Samples left out, by reason.
    pub dropped: BTreeMap<&'static str, usize>,
    /// Every error.
    pub errors: ErrorTable,
    /// Covariance of the free parameters.
    pub covariance: Option<Covariance>,
    /// The fits repeated on resampled angles of incidence, where the covariance is theirs.
    pub resampled: Option<Resampled>,
    /// The sum of squares that was minimised.
    pub cost: f64,
    /// Number of residuals.
    pub n: usize,
    /// Number of residuals less that of free parameters.
    pub dof: i64,
    /// chi^2/dof where the standard deviations were given.
    pub reduced_chi2: Option<f64>,
    /// Model selection.
    pub selection: Selection,
    /// The scale of the loss; none without one.
    pub loss_scale: Option<f64>,
    /// Errors on the samples held out, where some were.
    pub held_out: Option<HeldOut>,
    /// The starts tried.
    pub starts: Vec<Start>,
    /// Why it stopped.
    pub termination: Termination,
    /// Why the result is not usable; none if it is.
    pub unusable: Option<String>,
    /// Iterations of the final fit.
    pub iterations: u64,
    /// Evaluations of the final fit.
    pub evaluations: u64,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// The end of a fit. A promised decrease of 1e-12 of the cost moves the parameters by about
/// 1e-6 sqrt(n) standard errors.
const FINAL: Tolerances = Tolerances { step: 1e-11, cost: 1e-12, gradient: 1e-11, refinements: 2 };
/// Samples of the scan, of the polishing of its best points, and of the check of default-fixed parameters.
const SCAN_SAMPLES: usize = 800;
const POLISH_SAMPLES: usize = 6000;
const CHECK_SAMPLES: usize = 1500;
/// Points of the scan that are polished, and for how long.
const POLISHED: usize = 5;
const POLISH_ITERATIONS: u64 = 150;
/// Minima whose costs on part of the samples lie so close compete on all of them, at most so many.
const CLOSE_RACE: f64 = 0.05;
const RIVALS: usize = 3;
const RACE_ITERATIONS: u64 = 15;
/// Estimates of a loss's scale from part of the samples.
const SCALE_ROUNDS: usize = 4;
/// The share of the measured values that the search takes seriously under a loss: outliers are fewer.
const BULK_OF_DATA: f64 = 0.95;
/// A loss that leaves a parameter less of its information than this treats what decides it as outliers.
const LEAST_INFORMATION: f64 = 0.1;
/// The smallest scale of a loss, relative to the data.
const SMALLEST_SCALE: f64 = 1e-6;
/// A parameter that would lower the cost by this share when freed is worth a warning.
const WORTH_FREEING: f64 = 0.1;
/// An amplitude whose whole effect is below this share of the data is nothing but rounding.
const NEGLIGIBLE_EFFECT: f64 = 1e-9;
/// Starts whose costs agree to this have found the same minimum.
const SAME_MINIMUM: f64 = 1e-6;

/// Fits `expression` to `measurement`.
///
/// # Errors
/// [`Error::Usage`] for settings that do not fit, [`Error::NoSamples`] if the filters leave nothing,
/// [`Error::Optimiser`] for a defect. A fit that does not converge is not an error: see [`Fit::unusable`].
pub fn fit(
    measurement: &Measurement,
    expression: &Expression,
    options: &Options,
    progress: &Arc<dyn Progress>,
) -> Result<Fit, Error> {
    let (mut samples, table) = prepare(measurement, expression, options)?;
    let mut unseen = None;
    if let Some(fraction) = options.hold_out {
        let (fitted, left_out) = hold_out::split(&samples, fraction, options.seed, measurement)?;
        samples = fitted;
        unseen = Some(left_out);
    }
    let groups = match options.uncertainty {
        Uncertainty::Formula => None,
        Uncertainty::BlockBootstrap => Some(bootstrap::groups(&samples, measurement)?),
    };
    let task = Task { expression, samples: &samples, options };

    progress.stage("searching");
    let (table, found) = task.search(table)?;

    progress.stage("fitting");
    let problem = task.problem(&samples, table.clone(), found.objective);
    // The search has left its best values in the table; `initial` remembers where they came from.
    let start = DVector::from_vec(table.coordinates());
    let heard = Arc::clone(progress);
    let observer: Observer = Arc::new(move |iteration, cost| heard.iteration(iteration, cost));
    let limits = task.limits(options.iterations, Some(observer));
    let mut solution = past_absent_lobes(&problem, start, |start| {
        minimise_with(options.solver, &problem, start, FINAL, limits.clone(), options.seed)
    })?;
    let mut table = table;
    table.set_coordinates(solution.x.as_slice());
    let dropped = task.drop_negligible(&mut table);
    let moved = table.sort_lobes();
    if dropped || moved {
        solution.x = DVector::from_vec(table.coordinates());
        solution.linearisation = problem.linearise(&solution.x);
        solution.cost = solution.linearisation.cost;
    }

    let (resampled, doubt) = match &groups {
        None => (None, None),
        Some(groups) => bootstrap::resample(&task, found.objective, groups, &table, &solution, progress)?,
    };

    progress.stage("judging");
    let mut fit = task.judge(&problem, table, solution, found, resampled)?;
    fit.warnings.extend(doubt);
    fit.held_out = unseen.map(|unseen| unseen.judge(expression, &fit.table));
    fit.warnings.splice(0..0, doubts(measurement));
    Ok(fit)
}

/// The samples that count, and the parameters as the options want them.
fn prepare(
    measurement: &Measurement,
    expression: &Expression,
    options: &Options,
) -> Result<(Samples, ParameterTable), Error> {
    let samples = Samples::select(measurement, &options.filters)?;
    let names: Vec<String> = measurement.channels.iter().map(|channel| channel.name.clone()).collect();
    let table = ParameterTable::new(expression, &names, measurement.directions.is_grid(), &options.settings)?;
    Ok((samples, table))
}

/// The reader's doubts about a file.
fn doubts(measurement: &Measurement) -> impl Iterator<Item = Warning> {
    measurement.doubts.iter().map(|(kind, text)| Warning { kind, parameter: None, text: text.clone() })
}

/// Scores the parameters that `options` set, without a fit.
///
/// # Errors
/// Like [`fit`].
pub fn evaluate(measurement: &Measurement, expression: &Expression, options: &Options) -> Result<Fit, Error> {
    let (samples, table) = prepare(measurement, expression, options)?;
    let defaults: Vec<String> = (0..table.rows().len())
        .filter(|index| table.rows().get(*index).is_some_and(|row| !row.given && row.status == Status::Free))
        .map(|index| table.name(index))
        .collect();
    let table = table.with_fixed(Role::Shape).with_fixed(Role::Amplitude);
    let task = Task { expression, samples: &samples, options };
    let found = Found { objective: options.metric.into(), starts: Vec::new(), profiles: Vec::new() };
    let problem = task.problem(&samples, table.clone(), found.objective);
    let solution = minimise(&problem, DVector::zeros(0), Tolerances::default(), Limits::iterations(0))?;
    let mut fit = task.judge(&problem, table, solution, found, None)?;
    fit.warnings.retain(|warning| warning.kind == "not-usable");
    fit.warnings.splice(0..0, doubts(measurement));
    if !defaults.is_empty() {
        fit.warnings.push(Warning {
            kind: "default-used",
            parameter: defaults.first().cloned(),
            text: format!(
                "no value given for {}: the default was used; give one with --set",
                defaults.join(", ")
            ),
        });
    }
    Ok(fit)
}

/// What the search has found out.
struct Found {
    /// What is minimised, the scale of the loss settled.
    objective: Objective,
    starts: Vec<Start>,
    profiles: Vec<Profile>,
}

/// A fit in progress.
pub(super) struct Task<'a> {
    pub(super) expression: &'a Expression,
    pub(super) samples: &'a Samples,
    pub(super) options: &'a Options,
}

impl Task<'_> {
    pub(super) fn limits(&self, iterations: u64, observer: Option<Observer>) -> Limits {
        Limits { iterations, stop: self.options.stop.clone(), deadline: self.options.deadline, observer }
    }

    pub(super) fn problem<'s>(
        &'s self,
        samples: &'s Samples,
        table: ParameterTable,
        objective: Objective,
    ) -> ReflectanceProblem<'s> {
        ReflectanceProblem::new(self.expression, samples, table, objective)
    }

    /// The best start found, polished on part of the samples, and what was seen on the way.
    fn search(&self, mut table: ParameterTable) -> Result<(ParameterTable, Found), Error> {
        let few = self.samples.subset(SCAN_SAMPLES, self.options.seed);
        let more = self.samples.subset(POLISH_SAMPLES, self.options.seed);
        let widest = self.widest_scale(&few, &table);
        let mut objective = Objective { metric: self.options.metric, loss: self.options.loss, scale: widest };
        let mut starts = Vec::new();
        let mut profiles = Vec::new();
        if !table.free().is_empty() {
            let wanted = (POLISHED, self.options.seed);
            let seen = scan(self.expression, &few, &table, objective, wanted, &self.limits(0, None))?;
            let ends: Result<Vec<(Start, ParameterTable)>, Error> = seen
                .candidates
                .into_iter()
                .map(|candidate| self.follow(&more, candidate, objective))
                .collect();
            let ends = ends?;
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
            objective.scale = self.loss_scale(self.samples, &table, objective, widest);
        }
        Ok((table, Found { objective, starts, profiles }))
    }

    /// Polishes one point of the scan.
    fn follow(
        &self,
        samples: &Samples,
        candidate: Candidate,
        objective: Objective,
    ) -> Result<(Start, ParameterTable), Error> {
        let table = candidate.table;
        let solution = self.polish(samples, table.clone(), objective, POLISH_ITERATIONS)?;
        let mut polished = table.clone();
        polished.set_coordinates(solution.x.as_slice());
        polished.sort_lobes();
        let shapes = free_shapes(&table).into_iter().map(|(index, value)| (table.name(index), value));
        let start = Start {
            cost: solution.cost,
            shapes: shapes.collect(),
            reached: free_shapes(&polished),
            termination: solution.termination,
        };
        Ok((start, polished))
    }

    /// The best of what the starts led to. Minima that are close on part of the samples compete on all.
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
            let distinct = rivals
                .iter()
                .all(|(rival, _)| warnings::shapes_differ(&table, &rival.reached, &start.reached));
            let close = start.cost <= (1.0 + margin) * lowest;
            if close && distinct && rivals.len() < RIVALS {
                rivals.push((start, table));
            }
        }
        if rivals.len() < 2 || !partial {
            return Ok(rivals.into_iter().next().map(|(_, table)| table));
        }
        let mut best: Option<(f64, ParameterTable)> = None;
        for (_, mut table) in rivals {
            let solution = self.polish(self.samples, table.clone(), objective, RACE_ITERATIONS)?;
            if best.as_ref().is_none_or(|(cost, _)| solution.cost < *cost) {
                table.set_coordinates(solution.x.as_slice());
                best = Some((solution.cost, table));
            }
        }
        Ok(best.map(|(_, table)| table))
    }

    /// A scale of the loss beyond which no residual of a sensible fit lies: the search starts with it,
    /// while the bulk of the data is still far from any model.
    fn widest_scale(&self, samples: &Samples, table: &ParameterTable) -> f64 {
        if self.options.loss == LossKind::None {
            return 1.0;
        }
        let quantile =
            self.problem(samples, table.clone(), self.options.metric.into()).data_quantile(BULK_OF_DATA);
        // Data that are zero throughout have no scale; any will do.
        if quantile > 0.0 { quantile } else { 1.0 }
    }

    /// The scale that the user gave, or that of the residuals at the values in `table`.
    fn loss_scale(
        &self,
        samples: &Samples,
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

    fn polish(
        &self,
        samples: &Samples,
        table: ParameterTable,
        objective: Objective,
        iterations: u64,
    ) -> Result<Solution, Error> {
        let problem = self.problem(samples, table, objective);
        let start = DVector::from_vec(problem.table().coordinates());
        let tolerances = Tolerances { step: 1e-6, cost: 1e-7, gradient: 1e-6, refinements: 0 };
        past_absent_lobes(&problem, start, |start| {
            minimise(&problem, start, tolerances, self.limits(iterations, None))
        })
    }

    /// Sets amplitudes without any effect to their bound; returns whether there were any.
    fn drop_negligible(&self, table: &mut ParameterTable) -> bool {
        let samples = self.samples.subset(POLISH_SAMPLES, self.options.seed);
        let problem = ReflectanceProblem::new(self.expression, &samples, table.clone(), Metric::L2);
        let x = DVector::from_vec(table.coordinates());
        let lengths = problem.linearise(&x).column_lengths(x.len());
        let data = problem.magnitude();
        let free = table.free().to_vec();
        let mut any = false;
        for (column, index) in free.into_iter().enumerate() {
            let Some(row) = table.rows().get(index) else { continue };
            let effect = row.value.abs() * lengths.get(column).copied().unwrap_or(0.0);
            if row.spec.role == Role::Amplitude
                && row.bounds.0 == 0.0
                && row.value > 0.0
                && effect < NEGLIGIBLE_EFFECT * data
            {
                table.set_value(index, 0.0);
                any = true;
            }
        }
        any
    }

    /// The rows that a loss leaves little of what the samples know about them.
    fn discarded(&self, table: &ParameterTable, solution: &Solution) -> Vec<usize> {
        let plain = self.problem(self.samples, table.clone(), self.options.metric.into());
        let lengths = |model: &Linearisation| model.column_lengths(solution.x.len());
        let (kept, all) = (lengths(&solution.linearisation), lengths(&plain.linearise(&solution.x)));
        let lost = |((row, kept), all): ((&usize, &f64), &f64)| {
            (kept * kept < LEAST_INFORMATION * all * all).then_some(*row)
        };
        table.free().iter().zip(kept.iter()).zip(all.iter()).filter_map(lost).collect()
    }

    /// Everything that follows from the parameters found.
    fn judge(
        &self,
        problem: &ReflectanceProblem<'_>,
        table: ParameterTable,
        solution: Solution,
        found: Found,
        resampled: Option<Resampled>,
    ) -> Result<Fit, Error> {
        let samples = self.samples;
        let robust = found.objective.loss != LossKind::None;
        let errors = score(self.expression, samples, &table);
        let n = problem.residuals();
        let free = table.free().len();
        let signed = |count: usize| i64::try_from(count).unwrap_or(i64::MAX);
        let dof = signed(n) - signed(free);
        let freedom = count(n) - count(free);
        // A loss other than squares is no likelihood of the given standard deviations.
        let absolute = samples.weighting == Weighting::Sigma && !robust;
        let typical = (solution.cost / freedom).sqrt();
        let scatter = (!absolute).then_some(|root: &_| problem.scatter(&solution.x, root, typical));
        let mut covariance = Covariance::new(&table, &solution.linearisation.matrix(free), scatter, freedom);
        if robust && let Some(covariance) = &mut covariance {
            covariance.discard(self.discarded(&table, &solution));
        }
        // Without a covariance by the formula nothing says which parameters are determined.
        let resampled = resampled.filter(|_| covariance.is_some());
        let covariance = match &resampled {
            Some(resampled) => covariance.map(|formula| resampled.covariance(formula)),
            None => covariance,
        };
        let unusable = unusable(&solution, free, dof, &errors);
        let mut fit = Fit {
            weighting: samples.weighting,
            used: samples.len(),
            dropped: samples.dropped.clone(),
            reduced_chi2: (absolute && dof > 0).then(|| solution.cost / freedom),
            selection: if robust {
                Selection::default()
            } else {
                selection(solution.cost, n, free, absolute)
            },
            loss_scale: robust.then_some(found.objective.scale),
            errors,
            held_out: None,
            covariance,
            resampled,
            cost: solution.cost,
            n,
            dof,
            starts: found.starts,
            termination: solution.termination,
            unusable,
            iterations: solution.iterations,
            evaluations: solution.evaluations,
            warnings: Vec::new(),
            table,
        };
        let mut warnings = self.general_warnings(&fit);
        warnings.extend(warnings::at_bounds(&fit));
        warnings.extend(warnings::identifiability(&fit, samples, &found.profiles));
        warnings.extend(warnings::ties(&fit));
        warnings.extend(warnings::discarded(&fit));
        if fit.unusable.is_none() {
            warnings.extend(self.worth_freeing(&fit.table, found.objective)?);
        }
        fit.warnings = warnings;
        Ok(fit)
    }

    fn general_warnings(&self, fit: &Fit) -> Vec<Warning> {
        let mut warnings = Vec::new();
        if let Some(reason) = &fit.unusable {
            warnings.push(Warning { kind: "not-usable", parameter: None, text: reason.clone() });
        }
        if self.samples.directions.is_grid() {
            let tied = fit.table.rows().iter().enumerate();
            let tied = tied
                .filter(|(_, row)| row.spec.isotropic_as.is_some() && matches!(row.status, Status::Tied(_)));
            for (index, row) in tied {
                warnings.push(Warning {
                    kind: "isotropic",
                    parameter: Some(fit.table.name(index)),
                    text: format!(
                        "tied to {}: a half/difference grid does not hold the half vector's azimuth; measure \
                         with varied phi_i to tell them apart",
                        row.spec.isotropic_as.unwrap_or_default()
                    ),
                });
            }
        }
        warnings
    }

    /// Parameters that are fixed by default and should not have been.
    fn worth_freeing(&self, table: &ParameterTable, objective: Objective) -> Result<Vec<Warning>, Error> {
        let mut warnings = Vec::new();
        let mut seen: Vec<(usize, usize)> = Vec::new();
        // Drawn and fitted as it is once, for the first parameter that asks.
        let mut baseline: Option<(Samples, f64)> = None;
        for row in table.rows() {
            let place = (row.lobe, row.parameter);
            if !row.spec.fixed || row.status != Status::Fixed || row.given || seen.contains(&place) {
                continue;
            }
            seen.push(place);
            let (few, held) = match baseline.take() {
                Some(known) => known,
                None => {
                    let few = self.samples.subset(CHECK_SAMPLES, self.options.seed);
                    let held = self.polish(&few, table.clone(), objective, 30)?.cost;
                    (few, held)
                }
            };
            let freed = table.with_freed(table.places(row.lobe, row.parameter));
            let loose = self.polish(&few, freed, objective, 30)?.cost;
            if loose < (1.0 - WORTH_FREEING) * held {
                let name = table.parameter_name(row);
                warnings.push(Warning {
                    kind: "worth-freeing",
                    parameter: Some(name.clone()),
                    text: format!(
                        "fixed at {}, but the cost falls by {:.0} % without that: try --free {name}",
                        row.value,
                        100.0 * (1.0 - loose / held)
                    ),
                });
            }
            baseline = Some((few, held));
        }
        Ok(warnings)
    }
}

/// Why a result is not to be used.
fn unusable(solution: &Solution, free: usize, dof: i64, errors: &ErrorTable) -> Option<String> {
    let finite = [errors.all.l2, errors.all.log, errors.all.cbrt].iter().all(|e| e.is_finite());
    if !finite || !solution.cost.is_finite() {
        return Some("the model is not finite at some samples".to_owned());
    }
    if dof < 0 {
        return Some(format!(
            "fewer values than the {free} free parameters: measure more directions, or --fix some parameters"
        ));
    }
    match solution.termination {
        reason if reason.converged() => None,
        Termination::IterationLimit => Some(
            "the iteration limit was reached before a minimum: start closer with --init, or fit fewer parameters"
                .to_owned(),
        ),
        Termination::Interrupted => Some("interrupted before a minimum was reached".to_owned()),
        Termination::Timeout => Some("the time limit was reached before a minimum: raise --timeout".to_owned()),
        _ => Some("no step lowers the error, though it should: the model may be too flat or not smooth here"
            .to_owned()),
    }
}

fn selection(cost: f64, n: usize, free: usize, absolute: bool) -> Selection {
    let (n, k) = (count(n), count(free));
    // With unknown noise its variance is estimated too.
    let (deviance, k) = if absolute { (cost, k) } else { (n * cost.ln(), k + 1.0) };
    let finite = |value: f64| value.is_finite().then_some(value);
    let correction = 2.0 * k * (k + 1.0) / (n - k - 1.0);
    Selection {
        aicc: if n > k + 1.0 { finite(deviance + 2.0 * k + correction) } else { None },
        bic: finite(deviance + k * n.ln()),
    }
}

/// The free shapes of a table: row and value.
fn free_shapes(table: &ParameterTable) -> Vec<(usize, f64)> {
    let rows = table.free().iter().filter_map(|index| Some((*index, table.rows().get(*index)?)));
    rows.filter(|(_, row)| row.spec.role == Role::Shape).map(|(index, row)| (index, row.value)).collect()
}
