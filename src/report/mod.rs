//! The report: what was asked, what was done, why it stopped, and what not to trust.
//!
//! The JSON form is a stable interface: docs/use/report.md describes it field by field, and a test compares
//! docs/use/report.schema.json with the schema generated from these types.

#![allow(
    clippy::indexing_slicing,
    reason = "lengths are checked where they come in; an index beyond the end is a mistake in the program"
)]

mod read;
mod text;

pub use read::{Recorded, is_report, read};
pub use text::{table, warnings};

use crate::error::Error;
use crate::fit::{Errors, Fit, HeldOut, Metric, Resampled};
use crate::measurement::Measurement;
use crate::model::Expression;
use crate::parameters::{ParameterRow, ParameterTable, Product, Status};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Serialize, Serializer};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Name of the schema of one report.
pub const SCHEMA: &str = "brdfit.report/1";
/// Name of the schema of several reports.
pub const SCHEMA_SEVERAL: &str = "brdfit.reports/1";

/// The result of one fit or evaluation.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Report {
    /// `brdfit.report/1`.
    pub schema: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// The expression with every choice spelled out.
    pub model: String,
    /// What was measured.
    pub data: Data,
    /// Which samples counted, and how much.
    pub filters: FilterRecord,
    /// The metric that was minimised: l2, log or cbrt.
    pub metric: &'static str,
    /// Every parameter, fixed and tied ones included.
    pub parameters: Vec<Parameter>,
    /// Products of parameters that the data determine better than either.
    pub derived: Vec<Derived>,
    /// Correlations of the free parameters that are not at a bound; null above 100 of them, or where there
    /// is no covariance.
    pub correlation: Option<Correlation>,
    /// Every error, all channels together.
    pub errors: ErrorRecord,
    /// Every error on all samples that pass the filters, where `--budget` or `--target-error` chose how many the fit uses; null otherwise.
    pub errors_on_all: Option<ErrorRecord>,
    /// Every error per channel.
    pub errors_by_channel: InOrder<ErrorRecord>,
    /// The size of the problem and how the uncertainty was found.
    pub fit: FitRecord,
    /// Criteria that weigh the error against the number of parameters.
    pub selection: SelectionRecord,
    /// The starts that were tried.
    pub starts: Vec<StartRecord>,
    /// Why the fit stopped.
    pub termination: TerminationRecord,
    /// The options as used.
    pub options: OptionRecord,
    /// Wall-clock times, seconds, and threads: the only part that differs from run to run.
    pub time_s: Times,
    /// What to know before relying on the result.
    pub warnings: Vec<WarningRecord>,
}

/// What was measured.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Data {
    /// The file as it was named.
    pub path: String,
    /// Its format.
    pub format: &'static str,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Wavelengths in nanometres, where every channel has one.
    pub wavelengths_nm: Option<Vec<f64>>,
    /// Samples in the file.
    pub samples: usize,
    /// Samples used.
    pub used: usize,
    /// Samples left out, by reason.
    pub dropped: BTreeMap<&'static str, usize>,
}

/// Which samples counted, and how much.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct FilterRecord {
    /// Largest angle of incidence and viewing, degrees, inclusive.
    pub max_theta_deg: f64,
    /// solid-angle, uniform or sigma.
    pub weights: &'static str,
}

/// One parameter.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Parameter {
    /// The lobe that it belongs to.
    pub lobe: String,
    /// Its symbol.
    pub name: &'static str,
    /// Its channel; null if the channels share it.
    pub channel: Option<String>,
    /// Its value, in `unit`.
    pub value: f64,
    /// "1" or "deg".
    pub unit: &'static str,
    /// Standard error; null at a bound, if not free, or if the data do not determine it.
    pub std_error: Option<f64>,
    /// 95 % confidence interval; null like the standard error.
    pub ci95: Option<[f64; 2]>,
    /// Smallest and largest value allowed.
    pub bounds: [f64; 2],
    /// The value that the fit started from.
    pub initial: f64,
    /// free, fixed, tied, at-lower or at-upper.
    pub status: &'static str,
}

/// A product of parameters.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Derived {
    /// Lobe and factors: `cook-torrance.ks*f0`.
    pub name: String,
    /// Its channel; null if the channels share it.
    pub channel: Option<String>,
    /// Its value.
    pub value: f64,
    /// Standard error; null where a factor has none.
    pub std_error: Option<f64>,
    /// 95 % confidence interval.
    pub ci95: Option<[f64; 2]>,
}

/// Correlations between parameters.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Correlation {
    /// Full names, in the order of rows and columns.
    pub parameters: Vec<String>,
    /// Correlations, -1..1.
    pub matrix: Vec<Vec<Option<f64>>>,
}

/// Every error; docs/use/conventions.md defines each.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
#[expect(missing_docs, reason = "defined together in docs/use/conventions.md")]
pub struct ErrorRecord {
    pub l2: Option<f64>,
    pub log: Option<f64>,
    pub cbrt: Option<f64>,
    pub log_ratio: Option<f64>,
    pub relative: Option<f64>,
}

/// A number that can be written; none that overflowed on the way.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

impl From<&Errors> for ErrorRecord {
    fn from(e: &Errors) -> Self {
        let [l2, log, cbrt, log_ratio] = [e.l2, e.log, e.cbrt, e.log_ratio].map(finite);
        Self { l2, log, cbrt, log_ratio, relative: e.relative.and_then(finite) }
    }
}

/// The size of the problem and how the uncertainty was found.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct FitRecord {
    /// Number of residuals: samples times channels.
    pub n: usize,
    /// Residuals less free parameters.
    pub dof: i64,
    /// What was minimised: the weighted mean square in the metric (smoothed for cbrt), or chi^2 for
    /// weights by sigma.
    pub cost: Option<f64>,
    /// chi^2/dof for weights by sigma, else null.
    pub reduced_chi2: Option<f64>,
    /// Ratio of the largest to the smallest singular value of J with columns of unit length; null where
    /// there is no uncertainty.
    pub condition: Option<f64>,
    /// sandwich, absolute or block-bootstrap; null where there is no uncertainty.
    pub uncertainty_method: Option<&'static str>,
    /// What the block bootstrap drew; null for other methods.
    pub resampling: Option<ResamplingRecord>,
}

/// What the block bootstrap drew.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ResamplingRecord {
    /// Fits repeated.
    pub replicates: usize,
    /// Smallest and largest theta_i of each group of samples, degrees; twice the same for one angle.
    pub theta_i_deg: Vec<[f64; 2]>,
}

impl From<&Resampled> for ResamplingRecord {
    fn from(resampled: &Resampled) -> Self {
        Self { replicates: resampled.replicates, theta_i_deg: resampled.theta_i_deg.clone() }
    }
}

/// Criteria for choosing between models.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SelectionRecord {
    /// Akaike's criterion, corrected for small samples.
    pub aicc: Option<f64>,
    /// Bayesian criterion.
    pub bic: Option<f64>,
    /// Errors on samples that were held out; null where none were.
    pub held_out: Option<HeldOutRecord>,
}

/// Errors on samples that the fit has not seen.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct HeldOutRecord {
    /// Every error, all channels together.
    #[serde(flatten)]
    pub errors: ErrorRecord,
    /// How many samples were held out.
    pub samples: usize,
    /// Smallest and largest theta_i of each group of samples held out, degrees; twice the same for one
    /// angle.
    pub theta_i_deg: Vec<[f64; 2]>,
}

impl From<&HeldOut> for HeldOutRecord {
    fn from(held: &HeldOut) -> Self {
        Self {
            errors: ErrorRecord::from(&held.errors),
            samples: held.samples,
            theta_i_deg: held.theta_i_deg.clone(),
        }
    }
}

/// One start of the search.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct StartRecord {
    /// Cost that it led to, on the samples of the search.
    pub cost: Option<f64>,
    /// Shapes that it began with, by full name.
    pub shapes: InOrder<f64>,
    /// Shapes that it led to, lobes of one kind in order.
    pub reached: InOrder<f64>,
    /// Why its polishing stopped.
    pub reason: &'static str,
}

/// Why the fit stopped.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TerminationRecord {
    /// converged-step, converged-cost, converged-gradient, stalled, iteration-limit, interrupted, timeout,
    /// invalid; evaluated where nothing was fitted.
    pub reason: &'static str,
    /// Whether the result is a minimum that can be used.
    pub usable: bool,
    /// Iterations of the final fit.
    pub iterations: u64,
    /// Passes over the samples in the final fit.
    pub evaluations: u64,
}

/// The options as used.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct OptionRecord {
    /// `--samples`; null for all.
    pub samples: Option<usize>,
    /// `--budget`, or the one that `--target-error` ended with: fast, balanced or full; null without either.
    pub budget: Option<&'static str>,
    /// `--target-error`; null for none.
    pub target_error: Option<f64>,
    /// `--seed`.
    pub seed: u64,
    /// `--hold-out`; null for none.
    pub hold_out: Option<f64>,
    /// `--solver`; null where nothing was fitted.
    pub solver: Option<&'static str>,
    /// `--uncertainty`; null where nothing was fitted.
    pub uncertainty: Option<&'static str>,
    /// `--merl-bins`.
    pub merl_bins: &'static str,
    /// `--loss`: none, huber or cauchy.
    pub loss: &'static str,
    /// Where residuals begin to count less, in units of the residual (standard deviations for weights by
    /// sigma), given or found; null without a loss.
    pub loss_scale: Option<f64>,
    /// Whether that scale was found from the residuals; null without a loss.
    pub loss_scale_auto: Option<bool>,
    /// `--timeout`, seconds.
    pub timeout_s: Option<f64>,
    /// `--fix`, `--init`, `--bounds`, `--free`, `--tie`, `--per-channel`, `--shared`, `--set`, as given.
    pub parameters: Vec<String>,
}

/// Wall-clock times.
#[derive(Clone, Copy, Debug, Default, Serialize, JsonSchema)]
pub struct Times {
    /// Reading the file.
    pub read: f64,
    /// Fitting.
    pub fit: f64,
    /// Both.
    pub total: f64,
    /// Threads used.
    pub threads: usize,
}

/// Something to know before relying on the result.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct WarningRecord {
    /// Its kind; docs/use/report.md lists them.
    pub kind: &'static str,
    /// The parameter concerned, if it is one.
    pub parameter: Option<String>,
    /// What it is and what to do next.
    pub text: String,
}

/// The result of several fits.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Reports {
    /// `brdfit.reports/1`.
    pub schema: &'static str,
    /// One report per input and model, in the order given.
    pub reports: Vec<Report>,
    /// The models of each input from best to worst.
    pub ranking: Vec<Rank>,
    /// Inputs that could not be fitted.
    pub failed: Vec<Failure>,
}

/// A place in the ranking.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Rank {
    /// Index into `reports`.
    pub index: usize,
    /// What was compared.
    pub criterion: &'static str,
    /// Its value; smaller is better, null is worst.
    pub value: Option<f64>,
}

/// An input that could not be fitted.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Failure {
    /// The file as it was named.
    pub path: String,
    /// Why.
    pub error: String,
}

/// A JSON object whose members keep their order.
#[derive(Clone, Debug)]
pub struct InOrder<T>(pub Vec<(String, T)>);

impl<T: Serialize> Serialize for InOrder<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl<T: JsonSchema> JsonSchema for InOrder<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("map_of_{}", T::schema_name()).into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        BTreeMap::<String, T>::json_schema(generator)
    }
    fn inline_schema() -> bool {
        true
    }
}

/// What the caller knows beyond the fit itself.
#[derive(Clone, Debug)]
pub struct Circumstances {
    /// The metric that was minimised.
    pub metric: Metric,
    /// Largest angle, degrees.
    pub max_theta_deg: f64,
    /// The options as used.
    pub options: OptionRecord,
    /// Times and threads.
    pub times: Times,
    /// Whether anything was fitted.
    pub fitted: bool,
}

impl Report {
    /// The report of a fit.
    #[must_use]
    pub fn new(
        measurement: &Measurement,
        expression: &Expression,
        fit: &Fit,
        circumstances: &Circumstances,
    ) -> Self {
        let table = &fit.table;
        let wavelengths: Vec<f64> = measurement.channels.iter().filter_map(|c| c.wavelength_nm).collect();
        let channels: Vec<String> = table.channels().to_vec();
        let by_channel = channels.iter().cloned().zip(fit.errors.by_channel.iter().map(ErrorRecord::from));
        let record = |(index, row)| parameter(fit, index, row, &channels);
        Self {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            model: expression.canonical(),
            data: Data {
                path: measurement.source.path.display().to_string(),
                format: measurement.source.format,
                sha256: measurement.source.sha256.clone(),
                wavelengths_nm: (wavelengths.len() == channels.len()).then_some(wavelengths),
                samples: measurement.total(),
                used: fit.used,
                dropped: fit.dropped.clone(),
                channels: channels.clone(),
            },
            filters: FilterRecord {
                max_theta_deg: circumstances.max_theta_deg,
                weights: fit.weighting.name(),
            },
            metric: circumstances.metric.name(),
            parameters: table.rows().iter().enumerate().map(record).collect(),
            derived: derived(fit),
            correlation: correlation(fit),
            errors: ErrorRecord::from(&fit.errors.all),
            errors_on_all: fit.errors_on_all.as_ref().map(ErrorRecord::from),
            errors_by_channel: InOrder(by_channel.collect()),
            fit: FitRecord {
                n: fit.n,
                dof: fit.dof,
                cost: finite(fit.cost),
                reduced_chi2: fit.reduced_chi2,
                condition: fit.covariance.as_ref().map(|c| c.condition).filter(|c| c.is_finite()),
                uncertainty_method: fit.covariance.as_ref().map(|c| c.method.name()),
                resampling: fit.resampled.as_ref().map(ResamplingRecord::from),
            },
            selection: SelectionRecord {
                aicc: fit.selection.aicc,
                bic: fit.selection.bic,
                held_out: fit.held_out.as_ref().map(HeldOutRecord::from),
            },
            starts: fit
                .starts
                .iter()
                .map(|start| StartRecord {
                    cost: finite(start.cost),
                    shapes: InOrder(start.shapes.clone()),
                    reached: InOrder(
                        start.reached.iter().map(|(row, value)| (table.name(*row), *value)).collect(),
                    ),
                    reason: start.termination.name(),
                })
                .collect(),
            termination: TerminationRecord {
                reason: if circumstances.fitted { fit.termination.name() } else { "evaluated" },
                usable: fit.unusable.is_none(),
                iterations: fit.iterations,
                evaluations: fit.evaluations,
            },
            options: circumstances.options.clone(),
            time_s: circumstances.times,
            warnings: fit
                .warnings
                .iter()
                .map(|w| WarningRecord { kind: w.kind, parameter: w.parameter.clone(), text: w.text.clone() })
                .collect(),
        }
    }

    /// The report as JSON, which docs/use/report.md describes: what `brdfit fit` writes.
    ///
    /// # Errors
    /// [`Error::Usage`] if it cannot be written, which is a defect.
    pub fn to_json(&self) -> Result<String, Error> {
        let text = serde_json::to_string_pretty(self);
        text.map(|text| text + "\n")
            .map_err(|e| Error::Usage(format!("the report cannot be written as JSON: {e}")))
    }

    /// The error in the metric that was fitted.
    #[must_use]
    pub fn fitted_error(&self) -> f64 {
        self.in_fitted_metric(&self.errors)
    }

    /// The error in the metric that was fitted, on samples held out; none where none were.
    #[must_use]
    pub fn held_out_error(&self) -> Option<f64> {
        self.selection.held_out.as_ref().map(|held| self.in_fitted_metric(&held.errors))
    }

    /// Infinite where it is no number, so that it ranks last.
    fn in_fitted_metric(&self, errors: &ErrorRecord) -> f64 {
        let error = match self.metric {
            "l2" => errors.l2,
            "log" => errors.log,
            _ => errors.cbrt,
        };
        error.unwrap_or(f64::INFINITY)
    }

    /// What the error of samples held out is called in a ranking.
    fn held_out_criterion(&self) -> &'static str {
        match self.metric {
            "l2" => "held-out l2",
            "log" => "held-out log",
            _ => "held-out cbrt",
        }
    }
}

impl Reports {
    /// Several reports, ranked input by input: by the error on samples held out where all have one, else by
    /// that on the samples fitted.
    #[must_use]
    pub fn new(reports: Vec<Report>, failed: Vec<Failure>) -> Self {
        let held_out: Option<Vec<f64>> = reports.iter().map(Report::held_out_error).collect();
        let fitted = || reports.iter().map(Report::fitted_error).collect();
        let by_held_out = held_out.is_some();
        let values = held_out.unwrap_or_else(fitted);
        let mut ranking: Vec<(usize, (&Report, f64))> = reports.iter().zip(values).enumerate().collect();
        let input = |report: &Report| reports.iter().position(|r| r.data.path == report.data.path);
        ranking.sort_by(|(_, (a, x)), (_, (b, y))| input(a).cmp(&input(b)).then(x.total_cmp(y)));
        let ranking = ranking
            .into_iter()
            .map(|(index, (report, value))| {
                let criterion = if by_held_out { report.held_out_criterion() } else { report.metric };
                Rank { index, criterion, value: finite(value) }
            })
            .collect();
        Self { schema: SCHEMA_SEVERAL, ranking, reports, failed }
    }
}

fn parameter(fit: &Fit, index: usize, row: &ParameterRow, channels: &[String]) -> Parameter {
    Parameter {
        lobe: fit.table.lobes()[row.lobe].clone(),
        name: row.spec.name,
        channel: row.channel.map(|channel| channels[channel].clone()),
        value: row.value,
        unit: row.spec.unit.symbol(),
        std_error: fit.std_error(index),
        ci95: fit.ci95(index),
        bounds: [row.bounds.0, row.bounds.1],
        initial: row.initial,
        status: match row.status {
            Status::Fixed => "fixed",
            Status::Tied(_) => "tied",
            Status::Free if row.at_lower() => "at-lower",
            Status::Free if row.at_upper() => "at-upper",
            Status::Free => "free",
        },
    }
}

/// The products that lobes declare, where both factors are fitted.
fn derived(fit: &Fit) -> Vec<Derived> {
    let table = &fit.table;
    let mut derived = Vec::new();
    for Product { lobe, first, second } in table.products() {
        let shared = [*first, *second].iter().all(|p| table.places(*lobe, *p).len() == 1);
        let spec_name = |parameter: usize| table.rows()[table.places(*lobe, parameter)[0]].spec.name;
        let lobe_name = &table.lobes()[*lobe];
        for channel in 0..if shared { 1 } else { table.channels().len() } {
            let (a, b) = (table.place(*lobe, *first, channel), table.place(*lobe, *second, channel));
            derived.extend(estimate(fit, a, b).map(|product| Derived {
                name: format!("{lobe_name}.{}*{}", spec_name(*first), spec_name(*second)),
                channel: (!shared).then(|| table.channels()[channel].clone()),
                value: product.value,
                std_error: product.std_error,
                ci95: product.ci95,
            }));
        }
    }
    derived
}

/// A product of two rows.
struct Estimate {
    value: f64,
    std_error: Option<f64>,
    ci95: Option<[f64; 2]>,
}

/// The product of two rows; none unless both are fitted.
fn estimate(fit: &Fit, a: usize, b: usize) -> Option<Estimate> {
    let rows = fit.table.rows();
    let (row_a, row_b) = (&rows[a], &rows[b]);
    if row_a.status == Status::Fixed || row_b.status == Status::Fixed {
        return None;
    }
    let (x, y) = (row_a.value, row_b.value);
    let (a, b) = (fit.table.source(a), fit.table.source(b));
    let value = x * y;
    // A product of 0 is at its bound.
    let covariance = fit.covariance.as_ref().filter(|_| value != 0.0);
    let std_error = covariance.and_then(|c| c.combined_error(&[(a, y), (b, x)]));
    // Repeated fits give the product's own, where the formula says that it is determined.
    if let Some(resampled) = &fit.resampled {
        let (std_error, ci95) = std_error.and_then(|_| resampled.product(a, b)).unzip();
        return Some(Estimate { value, std_error, ci95 });
    }
    let ci95 = std_error.and_then(|error| fit.interval(value, error));
    Some(Estimate { value, std_error, ci95 })
}

fn correlation(fit: &Fit) -> Option<Correlation> {
    /// Beyond this the matrix is larger than all the rest.
    const MOST: usize = 100;
    let covariance = fit.covariance.as_ref()?;
    if fit.table.free().len() > MOST {
        return None;
    }
    let entry = |a: usize| covariance.rows.iter().map(|b| covariance.correlation(a, *b)).collect();
    Some(Correlation {
        parameters: covariance.rows.iter().map(|row| full_name(&fit.table, *row)).collect(),
        matrix: covariance.rows.iter().map(|row| entry(*row)).collect(),
    })
}

fn full_name(table: &ParameterTable, row: usize) -> String {
    table.name(row)
}

/// The JSON Schema of one report or several.
#[must_use]
pub fn schema() -> Schema {
    /// Either form.
    #[derive(JsonSchema)]
    #[serde(untagged)]
    #[schemars(title = "brdfit report", rename = "AnyReport")]
    #[expect(dead_code, reason = "only its schema is used")]
    enum Either {
        /// One input and one model.
        One(Box<Report>),
        /// Several.
        Several(Reports),
    }
    schemars::schema_for!(Either)
}
