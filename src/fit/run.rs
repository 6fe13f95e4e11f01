//! A whole fit: select the samples, search for a start, polish, and judge the result.

use super::options::{Options, Uncertainty};
use super::search::absent_lobes::minimise_escaping_absent_lobes;
use super::search::best_start::SearchOutcome;
use super::task::Task;
use super::verdict::bootstrap;
use super::verdict::hold_out;
use super::verdict::result::Fit;
use super::verdict::warning::Warning;
use crate::error::Error;
use crate::measurement::{Measurement, Samples};
use crate::model::{Expression, Role};
use crate::parameters::{ParameterTable, Status};
use crate::progress::Progress;
use crate::solver::remembered::Remembered;
use crate::solver::{LeastSquares, Limits, Observer, SolverKind, Tolerances, minimise, minimise_with};
use nalgebra::DVector;
use std::sync::Arc;

/// The end of a fit. A promised decrease of 1e-12 of the cost moves the parameters by about
/// 1e-6 sqrt(n) standard errors.
const FINAL: Tolerances = Tolerances { step: 1e-11, cost: 1e-12, gradient: 1e-11, refinements: 2 };

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
    let task = Task::new(expression, &samples, options);

    progress.stage("searching");
    let (table, found) = task.search(table)?;

    progress.stage("fitting");
    let problem = task.problem(&task.observe(&samples), table.clone(), found.objective);
    // The search has left its best values in the table; `initial` remembers where they came from.
    let start = DVector::from_vec(table.coordinates());
    let heard = Arc::clone(progress);
    let observer: Observer = Arc::new(move |iteration, cost| heard.iteration(iteration, cost));
    let limits = task.limits(options.iterations, Some(observer));
    let remembered = Remembered::new(&problem);
    let (start, looks) = match options.solver {
        SolverKind::LevenbergMarquardt => task.coarse_to_fine(&remembered, start, FINAL.cost)?,
        _ => (start, 0),
    };
    // A corrected round gains more digits than undamped steps do: none of these are wanted after it.
    let tolerances = if looks > 1 { Tolerances { refinements: 0, ..FINAL } } else { FINAL };
    let mut solution = minimise_escaping_absent_lobes(&problem, problem.table(), start, |start| {
        minimise_with(options.solver, &remembered, start, tolerances, limits.clone(), options.seed)
    })?;
    // The solver counts the last look again.
    solution.evaluations += looks.saturating_sub(1);
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
    let task = Task::new(expression, &samples, options);
    let found = SearchOutcome { objective: options.metric.into(), starts: Vec::new(), profiles: Vec::new() };
    let problem = task.problem(&task.observe(&samples), table.clone(), found.objective);
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
