//! Fits within budgets of samples and iterations, and the cheapest of them that reaches a target.

use super::options::{Budget, Options};
use super::problem::metric::Metric;
use super::run::{fit, held_out};
use super::verdict::errors::score;
use super::verdict::result::Fit;
use super::verdict::warning::Warning;
use crate::error::{Error, OptionName};
use crate::measurement::{Filters, Measurement, Samples};
use crate::model::Expression;
use crate::progress::Progress;
use std::sync::Arc;

/// Fits within `budget` and measures the errors on all samples.
///
/// # Errors
/// Like [`fit`].
pub fn fit_within(
    budget: Budget,
    measurement: &Measurement,
    expression: &Expression,
    options: &Options,
    progress: &Arc<dyn Progress>,
) -> Result<Fit, Error> {
    let mut fit = fit(measurement, expression, &budget.apply(options), progress)?;
    let everything = Filters { samples: None, ..options.filters.clone() };
    let samples = Samples::select(measurement, &everything)?;
    fit.errors_on_all = Some(score(expression, &samples, &fit.table).all);
    fit.budget = Some(budget);
    Ok(fit)
}

/// The cheapest fit whose error on all samples, in the metric of the fit, is at most `target`. If no budget reaches
/// the target, it is the fit of the last budget, with the warning `target-missed`.
///
/// # Errors
/// [`Error::Invalid`] for a target that is not positive, and the errors of [`fit`].
pub fn fit_to_target(
    target: f64,
    measurement: &Measurement,
    expression: &Expression,
    options: &Options,
    progress: &Arc<dyn Progress>,
) -> Result<Fit, Error> {
    let target = checked_target(target)?;
    // Angles are left out of the fit within the budget that is found, not within all that are tried.
    let tried = Options { hold_out: None, ..options.clone() };
    let tested = |budget: Budget, mut found: Fit| {
        let within = budget.apply(options);
        let (errors, warning) = held_out(measurement, expression, &within, Some(&found.table), progress)?;
        found.held_out = errors;
        found.warnings.extend(warning);
        Ok::<Fit, Error>(found)
    };
    let mut last = None;
    for budget in Budget::ALL {
        let found = fit_within(budget, measurement, expression, &tried, progress)?;
        if error_on_all(&found, options.metric) <= target && found.unusable.is_none() {
            return tested(budget, found);
        }
        last = Some((budget, found));
    }
    let last = last.map(|(budget, found)| tested(budget, found)).transpose()?;
    let mut last = last.ok_or_else(|| Error::invalid(OptionName::TargetError, "a budget", "none"))?;
    let reached = error_on_all(&last, options.metric);
    last.warnings.push(Warning::TargetMissed { metric: options.metric, reached, target });
    Ok(last)
}

/// Checks that `target` is an error that a fit can reach, and returns it.
///
/// # Errors
/// [`Error::Invalid`] unless it is a finite number above 0.
pub fn checked_target(target: f64) -> Result<f64, Error> {
    if target > 0.0 && target.is_finite() {
        return Ok(target);
    }
    Err(Error::invalid(OptionName::TargetError, "a number above 0", target.to_string()))
}

fn error_on_all(fit: &Fit, metric: Metric) -> f64 {
    fit.errors_on_all.unwrap_or(fit.errors.all).in_metric(metric)
}
