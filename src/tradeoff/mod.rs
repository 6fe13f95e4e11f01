//! `brdfit tradeoff`: what accuracy costs. It compares models from a single number to one without a parametric form,
//! approximations inside one model, and numbers of samples, each with its errors and the cost of an evaluation.
//!
//! docs/use/tradeoff.md describes what is measured and the JSON form field by field.

#![allow(
    clippy::indexing_slicing,
    reason = "lengths are checked where they come in; an index beyond the end is a mistake in the program"
)]

mod cost;
mod ladder;
mod text;

pub(crate) use cost::counted;
pub use cost::{BasisCost, Cost, Nanoseconds, Spread, basis_cost, in_single_precision};
pub use ladder::{BUDGETS, LADDER, SHORTCUTS, Shortcut, Step};
pub use text::{csv, lines, table};

use crate::error::Error;
use crate::fit::{ErrorTable, Errors, Fit, HoldOut, Metric, Options, fit, held_out, score};
use crate::geometry::{Directions, Pair};
use crate::measurement::{Draws, Filters, Measurement, Samples};
use crate::model::Expression;
use crate::parameters::{Selector, Setting};
use crate::progress::{Progress, Quiet};
use crate::report::{ErrorRecord, Failure, Open};
use glam::DVec3;
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

/// Name of the schema.
pub const SCHEMA: &str = "brdfit.tradeoff/1";
/// Default number of samples that the fits of the ladder use. Errors are always computed on all samples.
pub const FIT_SAMPLES: usize = 20_000;
/// Share of the angles of incidence that is left out at a time of the further fits of every model.
pub const HOLD_OUT: HoldOut = HoldOut::Fraction(0.2);
/// Number of pairs of directions at which single precision and approximations are compared.
const COMPARED: usize = 4000;

/// The cost of accuracy for one measurement.
#[derive(Clone, Debug, Serialize)]
pub struct Tradeoff {
    /// `brdfit.tradeoff/1`.
    pub schema: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// The measurement.
    pub data: Data,
    /// The metric that fits minimise and that defines the front.
    #[serde(serialize_with = "metric_name")]
    pub metric: Metric,
    /// Number of samples that each fit of `models` and `approximations` uses; null means all.
    pub fit_samples: Option<usize>,
    /// Seed of every draw.
    pub seed: u64,
    /// Every model, in the order of the request.
    pub models: Vec<Entry>,
    /// Approximations inside one model; empty if models were named.
    pub approximations: Vec<Approximation>,
    /// Fits of the model with the least error to parts of the samples.
    pub samples: Budgets,
    /// Models that could not be fitted.
    pub failed: Vec<Failure>,
}

/// The measurement.
#[derive(Clone, Debug, Serialize)]
pub struct Data {
    /// The file as it was named.
    pub path: String,
    /// Its format.
    pub format: &'static str,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Number of samples on which errors are computed.
    pub used: usize,
}

/// One model.
#[derive(Clone, Debug, Serialize)]
pub struct Entry {
    /// The expression with every choice spelled out.
    pub model: String,
    /// Parameters that are fixed by default and were freed.
    pub free: &'static [&'static str],
    /// Number of values to store: the parameters of all channels that are neither fixed nor tied.
    pub parameters: usize,
    /// The cost of an evaluation.
    pub cost: Cost,
    /// The errors on all samples, in every metric.
    pub errors: ErrorRecord,
    /// The errors on angles of incidence that were left out of further fits, each angle once; null if there are too few angles.
    pub held_out: Option<ErrorRecord>,
    /// Relative difference between single and double precision: the root of the sum of squared differences of
    /// f cos(theta_i), divided by the root of the sum of squares of f cos(theta_i).
    pub single_precision: f64,
    /// Whether the fit is usable.
    pub usable: bool,
    /// Whether no other usable model has both a lower cost and a smaller error.
    pub on_front: bool,
    /// How long the first fit took, seconds; differs from run to run.
    pub fit_s: f64,
}

/// An exact formula and an approximation that replaces it.
#[derive(Clone, Debug, Serialize)]
pub struct Approximation {
    /// What replaces what.
    pub name: &'static str,
    /// The expression with the exact formula.
    pub exact: String,
    /// The expression with the approximation.
    pub approximate: String,
    /// Weighted operations of the exact and the approximate form.
    pub weighted: [u64; 2],
    /// Errors of both in the metric, after a fit of each.
    pub errors: [f64; 2],
    /// Relative difference of the approximation from the exact form at the parameters of the exact form, defined like
    /// `single_precision`: the error of a renderer that replaces one by the other without a new fit. Null if the two have
    /// different parameters.
    pub unfitted: Option<f64>,
}

/// Fits to parts of the samples.
#[derive(Clone, Debug, Serialize)]
pub struct Budgets {
    /// The model; null if no model is usable.
    pub model: Option<String>,
    /// One fit per number of samples, the last one with all of them.
    pub fits: Vec<Budget>,
}

/// A fit to some of the samples.
#[derive(Clone, Debug, Serialize)]
pub struct Budget {
    /// Number of samples.
    pub samples: usize,
    /// Error on all samples, in the metric.
    pub error: f64,
    /// How long the fit took, seconds; differs from run to run.
    pub fit_s: f64,
}

/// The models to compare, and how.
pub struct Request<'a> {
    /// The models; if empty, [`LADDER`] and [`SHORTCUTS`].
    pub expressions: &'a [Expression],
    /// Metric, filters, settings, seed and deadline of the fits; each fit uses `filters.samples` samples.
    pub options: &'a Options,
}

/// A model to be fitted.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub(crate) expression: Expression,
    /// Parameters that are fixed by default and to be freed.
    pub(crate) free: &'static [&'static str],
}

impl Candidate {
    /// The models in `named` or, if it is empty, those of the ladder.
    pub(crate) fn all(named: &[Expression]) -> Result<Vec<Self>, Error> {
        match named {
            [] => LADDER.iter().map(Self::of).collect(),
            named => Ok(named.iter().map(Self::plain).collect()),
        }
    }

    fn plain(expression: &Expression) -> Self {
        Self { expression: expression.clone(), free: &[] }
    }

    fn of(step: &Step) -> Result<Self, Error> {
        Ok(Self { expression: Expression::parse(step.model)?, free: step.free })
    }

    /// Returns `options` with this candidate's parameters freed.
    pub(crate) fn options(&self, options: &Options) -> Result<Options, Error> {
        let mut options = options.clone();
        for name in self.free {
            options.settings.push((Selector::parse(name)?, Setting::Free));
        }
        Ok(options)
    }
}

/// A fit and its errors on all samples.
struct Fitted {
    expression: Expression,
    fit: Fit,
    errors: ErrorTable,
    seconds: f64,
}

/// The state of a comparison.
struct Comparison<'a> {
    measurement: &'a Measurement,
    options: &'a Options,
    /// All samples, on which errors are computed.
    samples: &'a Samples,
    /// The pairs of directions at which costs and approximations are evaluated.
    pairs: Vec<Pair>,
    /// The fits done so far, by canonical expression.
    fits: BTreeMap<String, Result<Arc<Fitted>, Error>>,
}

/// Fits every model, counts its operations and times it.
///
/// # Errors
/// Those of [`fit`], if no model can be fitted.
pub fn compare(
    measurement: &Measurement,
    request: &Request<'_>,
    progress: &dyn Progress,
) -> Result<Tradeoff, Error> {
    let options = request.options;
    let samples = Samples::select(measurement, &Filters { samples: None, ..options.filters.clone() })?;
    let mut work = Comparison {
        measurement,
        options,
        samples: &samples,
        pairs: pairs(&samples, options.seed),
        fits: BTreeMap::new(),
    };
    let ladder = Candidate::all(request.expressions)?;
    let mut models = Vec::new();
    for (index, candidate) in ladder.iter().enumerate() {
        let name = candidate.expression.canonical();
        progress.stage(&format!("model {} of {}: {name}", index + 1, ladder.len()));
        models.extend(work.entry(candidate));
    }
    mark_front(&mut models, options.metric);
    let mut approximations = Vec::new();
    if request.expressions.is_empty() {
        for shortcut in SHORTCUTS {
            progress.stage(shortcut.name);
            approximations.extend(work.approximation(shortcut)?);
        }
    }
    let failed = work.failures();
    if models.is_empty() {
        let error = work.fits.into_values().find_map(Result::err);
        return Err(error.unwrap_or_else(|| Error::invalid("model", "at least one", "none")));
    }
    let samples = work.budgets(&models, progress)?;
    Ok(Tradeoff {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        data: Data {
            path: measurement.source.path.display().to_string(),
            format: measurement.source.format,
            sha256: measurement.source.sha256.clone(),
            channels: measurement.channel_names(),
            used: work.samples.len(),
        },
        metric: options.metric,
        fit_samples: options.filters.samples,
        seed: options.seed,
        models,
        approximations,
        samples,
        failed,
    })
}

impl Comparison<'_> {
    /// Fits a model to at most `samples` samples. `None` means all.
    fn fit(&self, candidate: &Candidate, samples: Option<usize>) -> Result<Fitted, Error> {
        let expression = &candidate.expression;
        let mut options = candidate.options(self.options)?;
        options.filters.samples = samples;
        let started = Instant::now();
        let fit = fit(self.measurement, expression, &options, &(Arc::new(Quiet) as Arc<dyn Progress>))?;
        let seconds = started.elapsed().as_secs_f64();
        let errors = score(expression, self.samples, &fit.table);
        Ok(Fitted { expression: expression.clone(), fit, errors, seconds })
    }

    /// The fit of a model, which is made once and kept. `None` if it failed.
    fn fitted(&mut self, candidate: &Candidate) -> Option<Arc<Fitted>> {
        let name = candidate.expression.canonical();
        if let Some(known) = self.fits.get(&name) {
            return known.as_ref().ok().cloned();
        }
        let found = self.fit(candidate, self.options.filters.samples);
        let known = self.fits.entry(name).or_insert(found.map(Arc::new));
        known.as_ref().ok().cloned()
    }

    /// Errors on angles of incidence that were left out of further fits. `None` if there are no such fits.
    fn held_out(&self, candidate: &Candidate) -> Option<Errors> {
        let options = Options { hold_out: Some(HOLD_OUT), ..candidate.options(self.options).ok()? };
        let quiet = Arc::new(Quiet) as Arc<dyn Progress>;
        held_out(self.measurement, &candidate.expression, &options, None, &quiet)
            .ok()?
            .0
            .map(|held_out| held_out.errors)
    }

    fn entry(&mut self, candidate: &Candidate) -> Option<Entry> {
        let expression = &candidate.expression;
        let fitted = self.fitted(candidate)?;
        let Fitted { fit, errors, seconds, .. } = fitted.as_ref();
        let values = fit.table.formula_values(0);
        let double = self.values(&fitted);
        let single = in_single_precision(expression, &values, &self.pairs);
        Some(Entry {
            model: expression.canonical(),
            parameters: stored(fit),
            cost: cost::cost(expression, &values, &self.pairs),
            errors: (&errors.all).into(),
            free: candidate.free,
            held_out: self.held_out(candidate).as_ref().map(ErrorRecord::from),
            single_precision: self.distance(&single, &double),
            usable: fit.unusable.is_none(),
            on_front: false,
            fit_s: *seconds,
        })
    }

    /// Values of the first channel at the pairs of the comparison.
    fn values(&self, fitted: &Fitted) -> Vec<f64> {
        let directions = Directions::Scattered(self.pairs.clone());
        let mut values = fitted.expression.values(&directions, &[fitted.fit.table.formula_values(0)]);
        values.swap_remove(0)
    }

    /// Relative difference from `reference`: the root of the sum of squared differences of f cos(theta_i), divided by that of
    /// `reference`.
    fn distance(&self, found: &[f64], reference: &[f64]) -> f64 {
        assert_eq!(found.len(), self.pairs.len(), "one value per pair");
        assert_eq!(reference.len(), self.pairs.len(), "one value per pair");
        let (mut difference, mut size) = (0.0, 0.0);
        for ((found, reference), pair) in found.iter().zip(reference).zip(&self.pairs) {
            difference += ((found - reference) * pair.wi.z).powi(2);
            size += (reference * pair.wi.z).powi(2);
        }
        if size > 0.0 { (difference / size).sqrt() } else { 0.0 }
    }

    fn approximation(&mut self, shortcut: &Shortcut) -> Result<Option<Approximation>, Error> {
        let (exact, approximate) =
            (Expression::parse(shortcut.exact)?, Expression::parse(shortcut.approximate)?);
        let (Some(of_exact), Some(of_other)) =
            (self.fitted(&Candidate::plain(&exact)), self.fitted(&Candidate::plain(&approximate)))
        else {
            return Ok(None);
        };
        let metric = self.options.metric;
        let weighted = [&of_exact, &of_other].map(|fitted| {
            counted(&fitted.expression, &fitted.fit.table.formula_values(0), &self.pairs).0.weighted()
        });
        let unfitted = with_parameters_of(&of_other, &of_exact)
            .map(|swapped| self.distance(&self.values(&swapped), &self.values(&of_exact)));
        Ok(Some(Approximation {
            name: shortcut.name,
            exact: exact.canonical(),
            approximate: approximate.canonical(),
            weighted,
            errors: [&of_exact, &of_other].map(|fitted| fitted.errors.all.in_metric(metric)),
            unfitted,
        }))
    }

    /// Fits the best model to increasing numbers of samples.
    fn budgets(&self, models: &[Entry], progress: &dyn Progress) -> Result<Budgets, Error> {
        let metric = self.options.metric;
        let usable = models.iter().filter(|entry| entry.usable);
        let best = usable.min_by(|a, b| recorded(&a.errors, metric).total_cmp(&recorded(&b.errors, metric)));
        let mut fits = Vec::new();
        if let Some(best) = best {
            let candidate = Candidate { expression: Expression::parse(&best.model)?, free: best.free };
            let all = self.samples.len();
            for samples in BUDGETS.into_iter().filter(|budget| *budget < all).chain([all]) {
                progress.stage(&format!("{samples} samples of {all}"));
                // The fit fails if there are too few samples for the parameters, or all are at one angle; it is left out.
                let Ok(fitted) = self.fit(&candidate, Some(samples)) else { continue };
                let error = fitted.errors.all.in_metric(metric);
                fits.push(Budget { samples, error, fit_s: fitted.seconds });
            }
        }
        Ok(Budgets { model: best.map(|entry| entry.model.clone()), fits })
    }

    fn failures(&self) -> Vec<Failure> {
        let failed = self.fits.iter().filter_map(|(model, found)| Some((model, found.as_ref().err()?)));
        failed.map(|(model, error)| Failure { path: model.clone(), error: error.to_string() }).collect()
    }
}

/// Draws up to [`COMPARED`] pairs of directions of the samples.
fn pairs(samples: &Samples, seed: u64) -> Vec<Pair> {
    let part = Draws::new(samples).part(COMPARED, seed);
    let pair = |w: [f64; 3]| DVec3::from_array(w);
    part.directions.iter().map(|g| Pair { wi: pair(g.wi), wo: pair(g.wo) }).collect()
}

/// Number of parameters that are neither fixed nor tied, over all channels.
fn stored(fit: &Fit) -> usize {
    fit.table.free().len()
}

/// The model of `to` with the parameter values of `from`. `None` if they have different parameters.
fn with_parameters_of(to: &Fitted, from: &Fitted) -> Option<Fitted> {
    let mut fit = to.fit.clone();
    if fit.table.rows().len() != from.fit.table.rows().len() {
        return None;
    }
    for (index, row) in from.fit.table.rows().iter().enumerate() {
        if fit.table.name(index) != from.fit.table.name(index) {
            return None;
        }
        fit.table.set_value(index, row.value);
    }
    Some(Fitted { expression: to.expression.clone(), fit, errors: to.errors.clone(), seconds: 0.0 })
}

/// Writes a metric by its name, as reports do.
fn metric_name<S: Serializer>(metric: &Metric, serializer: S) -> Result<S::Ok, S::Error> {
    Open::Known(*metric).serialize(serializer)
}

/// The error in the metric; infinite if there is none.
fn recorded(errors: &ErrorRecord, metric: Metric) -> f64 {
    errors.of(metric).unwrap_or(f64::INFINITY)
}

/// Marks the usable models that no other beats in both cost and error. Costs are operations, which are the same on every
/// machine.
fn mark_front(models: &mut [Entry], metric: Metric) {
    let points: Vec<(u64, f64, bool)> =
        models.iter().map(|m| (m.cost.weighted, recorded(&m.errors, metric), m.usable)).collect();
    for (entry, (cost, error, usable)) in models.iter_mut().zip(&points) {
        let beaten = points.iter().any(|(other_cost, other_error, other_usable)| {
            let no_worse = other_cost <= cost && other_error <= error;
            *other_usable && no_worse && (other_cost < cost || other_error < error)
        });
        entry.on_front = *usable && !beaten;
    }
}
