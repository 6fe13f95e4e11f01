//! A whole fit: select the samples, search for a start, polish, and judge the result.

use super::options::{HoldOut, Options, Uncertainty};
use super::problem::loss::Objective;
use super::problem::observed::Observed;
use super::problem::reflectance::ReflectanceProblem;
use super::search::absent_lobes::minimise_escaping_absent_lobes;
use super::search::best_start::SearchOutcome;
use super::task::{SMALL, Task};
use super::verdict::bootstrap;
use super::verdict::hold_out::{Folds, HeldOut, Judged, put_together};
use super::verdict::result::Fit;
use super::verdict::warning::Warning;
use crate::error::Error;
use crate::measurement::{Measurement, Samples, Weighting, dead_channel_doubts};
use crate::model::{Expression, Role};
use crate::parameters::{ParameterTable, Status, written_inside};
use crate::progress::{Progress, Quiet};
use crate::solver::in_parts::InParts;
use crate::solver::remembered::Remembered;
use crate::solver::{
    LeastSquares, Limits, Observer, Solution, SolverKind, Termination, Tolerances, minimise, minimise_with,
};
use nalgebra::DVector;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Tolerances of the final fit. A predicted decrease of 1e-12 of the cost moves the parameters by about 1e-6 sqrt(n)
/// standard errors.
const FINAL: Tolerances = Tolerances { step: 1e-11, cost: 1e-12, gradient: 1e-11, refinements: 2 };

/// Fits `expression` to `measurement`.
///
/// # Errors
/// [`Error::Invalid`] or [`Error::UnknownName`] if the settings do not suit the model, [`Error::NoSamples`] if no
/// sample passes the filters, [`Error::Optimiser`] for a bug in this crate. A fit that does not converge is not an
/// error: see [`Fit::unusable`].
pub fn fit(
    measurement: &Measurement,
    expression: &Expression,
    options: &Options,
    progress: &Arc<dyn Progress>,
) -> Result<Fit, Error> {
    // Select the samples to fit, and the groups to leave out and to resample from.
    let (expression, options) = &constrained(measurement, expression, options)?;
    let (samples, mut table) = prepare(measurement, expression, options)?;
    let dead = dead_channel_doubts(table.channels(), &samples.values, &samples.dead);
    table.set_apart(&samples.dead);
    let folds = folds(&samples, options, measurement)?;
    let samples = samples.with_predictions();
    let groups = match options.uncertainty {
        Uncertainty::Clustered | Uncertainty::Formula | Uncertainty::Profile => None,
        Uncertainty::BlockBootstrap => Some(bootstrap::groups(&samples, measurement)?),
    };
    let with_sigma = unused_sigma(measurement, &samples, options);
    let task = Task { with_sigma: with_sigma.as_ref(), ..Task::new(expression, &samples, options) };

    let Minimum { problem, table, solution, found } = task.minimum(table, progress)?;

    // Find how far the parameters move when the angles of incidence are resampled.
    let (resampled, cut_short) = match &groups {
        None => (None, None),
        Some(groups) => bootstrap::resample(&task, found.objective, groups, &table, &solution, progress)?,
    };

    // Compute everything that depends on the parameters.
    progress.stage("judging");
    let objective = found.objective;
    let mut fit = task.judge(&problem, table, solution, found, resampled)?;
    if options.uncertainty == Uncertainty::Profile {
        fit.profiled = task.profiled(&fit, objective, progress)?;
    }
    fit.warnings.extend(cut_short);
    fit.warnings.splice(0..0, doubts(measurement).chain(dead.into_iter().map(Warning::Data)));

    // Leave angles out in turn, and test the model on them.
    if let Some(folds) = folds {
        let testing = Testing { task: &task, measurement, folds: &folds, fitted_to_all: Some(&fit.table) };
        let (held_out, warning) = testing.held_out(progress)?;
        fit.held_out = held_out;
        fit.warnings.extend(warning);
    }
    Ok(fit)
}

/// Only the errors of [`fit`] on what is left out, as `options` say, and its warning about them, which needs the values of the fit to all
/// samples, if those are known; `None` if they leave nothing out, or if not all of its fits were finished.
///
/// # Errors
/// Like [`fit`].
pub(crate) fn held_out(
    measurement: &Measurement,
    expression: &Expression,
    options: &Options,
    fitted_to_all: Option<&ParameterTable>,
    progress: &Arc<dyn Progress>,
) -> Result<(Option<HeldOut>, Option<Warning>), Error> {
    if options.hold_out.is_none() {
        return Ok((None, None));
    }
    let (expression, options) = &constrained(measurement, expression, options)?;
    let (samples, _) = prepare(measurement, expression, options)?;
    let Some(folds) = folds(&samples, options, measurement)? else { return Ok((None, None)) };
    let task = Task::new(expression, &samples, options);
    Testing { task: &task, measurement, folds: &folds, fitted_to_all }.held_out(progress)
}

/// The folds that `options` ask for; `None` if they leave nothing out.
fn folds(samples: &Samples, options: &Options, measurement: &Measurement) -> Result<Option<Folds>, Error> {
    let folds = |hold_out: HoldOut| Folds::new(samples, hold_out, options.seed, measurement);
    options.hold_out.map(folds).transpose()
}

/// The fits without some of the angles.
struct Testing<'a> {
    /// The fit to all samples.
    task: &'a Task<'a>,
    measurement: &'a Measurement,
    folds: &'a Folds,
    /// Its values; `None` if they are not to be compared.
    fitted_to_all: Option<&'a ParameterTable>,
}

impl Testing<'_> {
    /// Fits without each fold, and tests the model on the fold. If not all fits are finished, there is a warning in place of the
    /// result, which could not be compared with that of another model.
    fn held_out(&self, progress: &Arc<dyn Progress>) -> Result<(Option<HeldOut>, Option<Warning>), Error> {
        let planned = self.folds.len;
        let finished = AtomicUsize::new(0);
        let tell =
            |done: usize| progress.stage(&format!("leaving angles out, {done} of {planned} folds done"));
        tell(0);
        let one = |fold: usize| {
            let judged = self.fold(fold)?;
            if judged.is_some() {
                tell(finished.fetch_add(1, Ordering::Relaxed) + 1);
            }
            Ok(judged)
        };
        // Each fit is the same whatever runs beside it.
        let judged: Result<Vec<Option<Judged>>, Error> = if self.task.samples.len() <= SMALL {
            (0..planned).into_par_iter().map(one).collect()
        } else {
            (0..planned).map(one).collect()
        };
        let judged: Vec<Judged> = judged?.into_iter().flatten().collect();
        if judged.len() < planned {
            let warning = Warning::HoldOutCutShort { finished: judged.len(), planned };
            return Ok((None, Some(warning)));
        }
        let (held_out, warning) = put_together(judged, self.task.options.metric);
        Ok((Some(held_out), warning))
    }

    /// Fits without a fold, from the search on, and tests the model on the fold; `None` if the fit was stopped.
    fn fold(&self, fold: usize) -> Result<Option<Judged>, Error> {
        let Self { task, measurement, folds, fitted_to_all } = self;
        if task.is_stopped() {
            return Ok(None);
        }
        let division = folds.divide(task.samples, fold);
        let mut table = initial(measurement, task.expression, &division.kept, task.options)?;
        table.set_apart(&division.kept.dead);
        let fit = Task::new(task.expression, &division.kept, task.options);
        let quiet: Arc<dyn Progress> = Arc::new(Quiet);
        let Minimum { table, solution, .. } = fit.minimum(table, &quiet)?;
        if [Termination::Interrupted, Termination::Timeout].contains(&solution.termination) {
            return Ok(None);
        }
        let converged = solution.termination.converged();
        Ok(Some(folds.judge(&division, task.expression, &table, converged, *fitted_to_all)))
    }
}

/// Where a fit ended.
struct Minimum<'t> {
    problem: ReflectanceProblem<'t>,
    table: ParameterTable,
    solution: Solution,
    found: SearchOutcome,
}

impl Task<'_> {
    /// Searches from the values in `table`, and minimises on all samples.
    fn minimum(&self, table: ParameterTable, progress: &Arc<dyn Progress>) -> Result<Minimum<'_>, Error> {
        // Search for the best start, which is already close to the minimum. The search leaves its best values in the
        // table, and their `initial` says where they started.
        progress.stage("searching");
        let (mut table, found) = self.search_with_smaller_sums(table)?;

        // Minimise on all samples, set amplitudes without effect to 0, and put lobes in order.
        progress.stage("fitting");
        let observed = self.observe(self.samples);
        let mut problem = self.problem(&observed, table.clone(), found.objective);
        let mut solution = self.minimise_on_all(&problem, progress)?;
        self.tidy(&problem, &mut table, &mut solution);
        if table.drop_absent_lobes() {
            problem = self.problem(&observed, table.clone(), found.objective);
            move_to(&mut solution, &problem, &table);
        }
        self.fit_dead_channels(&mut table, found.objective)?;
        Ok(Minimum { problem, table, solution, found })
    }

    /// Minimises on all samples from the values in the problem's table.
    fn minimise_on_all(
        &self,
        problem: &ReflectanceProblem<'_>,
        progress: &Arc<dyn Progress>,
    ) -> Result<Solution, Error> {
        let Options { solver, iterations, seed, .. } = *self.options;
        let parts = InParts::new(problem, &problem.table().free_products());
        let start = DVector::from_vec(problem.table().coordinates());
        let progress = Arc::clone(progress);
        let observer: Observer = Arc::new(move |iteration, cost| progress.iteration(iteration, cost));
        let limits = self.limits(iterations, Some(observer));

        // With many samples, go most of the way on a part of them.
        let remembered = Remembered::new(&parts);
        let (start, passes) = match solver {
            SolverKind::LevenbergMarquardt => {
                let (start, passes) =
                    self.coarse_to_fine(problem, &remembered, parts.parts(&start), FINAL.cost)?;
                (parts.whole(&start), passes)
            }
            #[cfg(feature = "solvers")]
            _ => (start, 0),
        };

        // Go the rest on all samples. A corrected round gains more digits than undamped steps do, so none are needed
        // after it.
        let tolerances = if passes > 1 { Tolerances { refinements: 0, ..FINAL } } else { FINAL };
        let mut solution = minimise_escaping_absent_lobes(problem, problem.table(), start, |start| {
            minimise_with(solver, &remembered, parts.parts(&start), tolerances, limits.clone(), seed)
                .map(|solution| parts.solution(solution))
        })?;
        // The solver counts the last pass a second time.
        solution.evaluations += passes.saturating_sub(1);
        Ok(solution)
    }

    /// Fits the amplitudes of dead channels to them, with everything that channels share as it is.
    fn fit_dead_channels(&self, table: &mut ParameterTable, objective: Objective) -> Result<(), Error> {
        let Some(apart) = table.only_apart() else { return Ok(()) };
        let observed = Arc::new(Observed::of_dead_channels(self.samples, self.options.metric));
        let start = DVector::from_vec(apart.coordinates());
        let problem = self.problem(&observed, apart.clone(), objective);
        let solution = minimise(&problem, start, FINAL, self.limits(self.options.iterations, None))?;
        let mut found = apart;
        found.set_coordinates(solution.x.as_slice());
        table.take_apart_values(&found);
        Ok(())
    }

    /// Copies the parameters of a solution into `table`, sets amplitudes without effect to 0, and puts lobes in order.
    fn tidy(&self, problem: &ReflectanceProblem<'_>, table: &mut ParameterTable, solution: &mut Solution) {
        table.set_coordinates(solution.x.as_slice());
        let dropped = self.drop_negligible(table);
        let moved = table.sort_lobes();
        if dropped || moved {
            move_to(solution, problem, table);
        }
    }
}

/// Moves a solution to the values in `table`.
fn move_to(solution: &mut Solution, problem: &ReflectanceProblem<'_>, table: &ParameterTable) {
    solution.x = DVector::from_vec(table.coordinates());
    solution.linearisation = problem.linearise(&solution.x);
    solution.cost = solution.linearisation.cost;
}

/// The expression with the constraints of `options` written inside it, and the options with those that remain.
fn constrained(
    measurement: &Measurement,
    expression: &Expression,
    options: &Options,
) -> Result<(Expression, Options), Error> {
    let (expression, settings) = written_inside(expression, &options.settings, &measurement.channel_names())?;
    Ok((expression, options.clone().with_settings(settings)))
}

/// Selects the samples, without predictions, and sets up the parameters according to the options.
fn prepare(
    measurement: &Measurement,
    expression: &Expression,
    options: &Options,
) -> Result<(Samples, ParameterTable), Error> {
    options.check()?;
    let samples = Samples::select_without_predictions(measurement, &options.filters)?;
    let table = initial(measurement, expression, &samples, options)?;
    Ok((samples, table))
}

/// The parameters of a fit to these samples, according to the options.
fn initial(
    measurement: &Measurement,
    expression: &Expression,
    samples: &Samples,
    options: &Options,
) -> Result<ParameterTable, Error> {
    let azimuths = samples.directions.azimuths();
    ParameterTable::new(expression, &measurement.channel_names(), azimuths, &options.settings)
}

/// The samples with the standard deviations of the file; `None` if it gives none, or if the fit uses them.
fn unused_sigma(measurement: &Measurement, samples: &Samples, options: &Options) -> Option<Samples> {
    if measurement.sigma.is_none() || samples.weighting == Weighting::Sigma {
        return None;
    }
    // Standard deviations of 0 say nothing.
    let filters = options.filters.clone().with_weighting(Weighting::Sigma);
    Samples::select_without_predictions(measurement, &filters).ok()
}

/// The warnings that the reader of the file raised.
fn doubts(measurement: &Measurement) -> impl Iterator<Item = Warning> {
    measurement.doubts.iter().cloned().map(Warning::Data)
}

/// Computes the errors of the parameters that `options` set, without fitting.
///
/// # Errors
/// The errors of [`fit`].
pub fn evaluate(measurement: &Measurement, expression: &Expression, options: &Options) -> Result<Fit, Error> {
    let (expression, options) = &constrained(measurement, expression, options)?;
    let (samples, table) = prepare(measurement, expression, options)?;
    let rows = table.rows().iter().enumerate();
    let defaults: Vec<String> = rows
        .filter(|(_, row)| !row.given && row.status == Status::Free)
        .map(|(index, _)| table.name(index))
        .collect();

    // A fit without free parameters stops where it starts.
    let samples = samples.with_predictions();
    let table = table.with_fixed(Role::Shape).with_fixed(Role::Amplitude);
    let with_sigma = unused_sigma(measurement, &samples, options);
    let task = Task { with_sigma: with_sigma.as_ref(), ..Task::new(expression, &samples, options) };
    let found = SearchOutcome { objective: options.metric.into(), starts: Vec::new(), profiles: Vec::new() };
    let problem = task.problem(&task.observe(&samples), table.clone(), found.objective);
    let solution = minimise(&problem, DVector::zeros(0), Tolerances::default(), Limits::iterations(0))?;
    let mut fit = task.judge(&problem, table, solution, found, None)?;
    let stays = |warning: &Warning| {
        matches!(warning, Warning::NotUsable(_) | Warning::Misfit(_) | Warning::ChiSquare { .. })
    };
    fit.warnings.retain(stays);
    fit.warnings.splice(0..0, doubts(measurement));
    if !defaults.is_empty() {
        fit.warnings.push(Warning::DefaultUsed { parameters: defaults });
    }
    Ok(fit)
}
