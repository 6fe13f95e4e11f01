//! The report: the options, the data, the result, why the fit stopped, and warnings.
//!
//! The JSON form is a stable interface: docs/use/report.md describes it field by field, and a test compares
//! docs/use/report.schema.json with the schema generated from these types.

#![allow(
    clippy::indexing_slicing,
    reason = "lengths are checked where they come in; an index beyond the end is a mistake in the program"
)]

mod apart;
mod open;
mod read;
mod record;
mod spread;
mod summary;
mod text;

pub use open::{Criterion, Named, Open, ParameterStatus, StopReason};
pub use read::{Recorded, is_report, read};
pub use record::{
    Correlation, Data, Derived, ErrorRecord, Failure, FilterRecord, FitRecord, FoldRecord, GroupingRecord,
    HeldOutRecord, HoldOutRecord, InOrder, MisfitRecord, OptionRecord, Parameter, Rank, Report, Reports,
    ResamplingRecord, SCHEMA, SCHEMA_SEVERAL, SelectionRecord, StartRecord, SuggestionRecord,
    TerminationRecord, Times, WarningRecord, WorstRecord, schema,
};
#[doc(hidden)]
pub use spread::Spread;
pub use summary::SummaryRow;
#[cfg(feature = "page")]
pub(crate) use text::{digits, full_name, misfit_in_words, or_dash, with_error};
pub use text::{lines, table};

pub(crate) use apart::are_told_apart;

use crate::error::Error;
use crate::fit::{Fit, Metric};
use crate::measurement::Measurement;
use crate::parameters::{ParameterRow, Product, Status};
use record::finite;
use serde::Serialize;

/// What the caller knows about the fit that the fit itself does not contain.
#[derive(Clone, Debug)]
pub struct Circumstances {
    /// The metric that was minimised.
    pub metric: Metric,
    /// Largest angle of incidence and viewing, in degrees.
    pub max_theta_deg: f64,
    /// The options as used.
    pub options: OptionRecord,
    /// Times and threads.
    pub times: Times,
    /// Whether anything was fitted.
    pub fitted: bool,
}

impl Report {
    /// Creates the report of a fit.
    #[must_use]
    pub fn new(measurement: &Measurement, fit: &Fit, circumstances: &Circumstances) -> Self {
        let table = &fit.table;
        let wavelengths: Vec<f64> = measurement.channels.iter().filter_map(|c| c.wavelength_nm).collect();
        let channels: Vec<String> = table.channels().to_vec();
        let missing = channels.iter().cloned().zip(fit.missing.iter().copied()).filter(|(_, n)| *n > 0);
        let by_channel = channels.iter().cloned().zip(fit.errors.by_channel.iter().map(ErrorRecord::from));
        Self {
            schema: SCHEMA.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            model: fit.model.canonical(),
            data: Data {
                path: measurement.source.path.display().to_string(),
                format: measurement.source.format.into(),
                sha256: measurement.source.sha256.clone(),
                wavelengths_nm: (wavelengths.len() == channels.len()).then_some(wavelengths),
                samples: measurement.total(),
                used: fit.used,
                dropped: fit.dropped.iter().map(|(reason, n)| ((*reason).into(), *n)).collect(),
                channels: channels.clone(),
                missing: InOrder(missing.collect()),
                remarks: measurement.remarks.iter().map(ToString::to_string).collect(),
            },
            filters: FilterRecord {
                max_theta_deg: circumstances.max_theta_deg,
                weights: fit.weighting.into(),
                sigma_unused: fit.sigma_unused,
            },
            metric: circumstances.metric.into(),
            parameters: fit.parameters().into_iter().map(Parameter::from).collect(),
            derived: derived(fit),
            correlation: correlation(fit),
            errors: ErrorRecord::from(&fit.errors.all),
            errors_on_all: fit.errors_on_all.as_ref().map(ErrorRecord::from),
            misfit: fit.misfit.as_ref().map(MisfitRecord::from),
            errors_by_channel: InOrder(by_channel.collect()),
            fit: FitRecord {
                n: fit.n,
                dof: fit.dof,
                cost: finite(fit.cost),
                reduced_chi2: fit.reduced_chi2,
                condition: fit.covariance.as_ref().map(|c| c.condition).filter(|c| c.is_finite()),
                uncertainty_method: fit.covariance.as_ref().map(|c| c.method.into()),
                grouping: fit.covariance.as_ref().and_then(|c| c.grouping).map(GroupingRecord::from),
                resampling: fit.resampled.as_ref().map(ResamplingRecord::from),
            },
            selection: SelectionRecord {
                aicc: fit.selection.aicc,
                bic: fit.selection.bic,
                held_out: fit.held_out.as_ref().map(|held| HeldOutRecord::new(held, circumstances.metric)),
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
                    reason: StopReason::from(start.termination).into(),
                })
                .collect(),
            termination: TerminationRecord {
                reason: if circumstances.fitted { fit.termination.into() } else { StopReason::Evaluated }
                    .into(),
                usable: fit.unusable.is_none(),
                iterations: fit.iterations,
                evaluations: fit.evaluations,
            },
            options: circumstances.options.clone(),
            time_s: circumstances.times,
            warnings: fit.warnings.iter().chain(&fit.energy_warning()).map(WarningRecord::from).collect(),
        }
    }

    /// The report as JSON, as `brdfit fit` writes it and docs/use/report.md describes it.
    ///
    /// # Errors
    /// [`Error::Encoding`] if it cannot be encoded, which is a bug.
    pub fn to_json(&self) -> Result<String, Error> {
        json(self)
    }

    /// The error in the metric that was fitted.
    #[must_use]
    pub fn fitted_error(&self) -> f64 {
        self.in_fitted_metric(&self.errors)
    }

    /// The error in the metric that was fitted, on the samples held out; `None` if none were.
    #[must_use]
    pub fn held_out_error(&self) -> Option<f64> {
        self.selection.held_out.as_ref().map(|held| self.in_fitted_metric(&held.errors))
    }

    /// Whether samples were held out in folds, so that models can be compared fold by fold.
    pub(crate) fn has_folds(&self) -> bool {
        self.selection.held_out.as_ref().is_some_and(|held| !held.folds.is_empty())
    }

    /// The error in the metric that was fitted; infinite if it is not a number, so that it ranks last.
    fn in_fitted_metric(&self, errors: &ErrorRecord) -> f64 {
        self.metric.known().and_then(|metric| errors.of(metric)).unwrap_or(f64::INFINITY)
    }
}

/// A value as JSON text, ending in a newline.
///
/// # Errors
/// [`Error::Encoding`] if it cannot be written, which is a defect.
#[doc(hidden)]
pub fn json(value: &impl Serialize) -> Result<String, Error> {
    let text = serde_json::to_string_pretty(value);
    text.map(|text| text + "\n").map_err(|e| Error::Encoding { format: "JSON", reason: e.to_string() })
}

impl Reports {
    /// Several reports, ranked for each input by the error on the samples held out, if all reports have one, and
    /// otherwise by the error on the samples fitted. Models that the samples held out do not tell apart are listed.
    #[must_use]
    pub fn new(reports: Vec<Report>, failed: Vec<Failure>) -> Self {
        let (criterion, values) = compared(&reports.iter().collect::<Vec<_>>());
        let mut ranking: Vec<(usize, (&Report, f64))> = reports.iter().zip(values).enumerate().collect();
        let input = |report: &Report| reports.iter().position(|r| r.data.path == report.data.path);
        ranking.sort_by(|(_, (a, x)), (_, (b, y))| input(a).cmp(&input(b)).then(x.total_cmp(y)));
        let order: Vec<usize> = ranking.iter().map(|(index, _)| *index).collect();
        let not_told_apart = |index: usize| {
            let others = order.iter().filter(|other| **other != index);
            let alike = |other: &&usize| {
                let (report, other) = (&reports[index], &reports[**other]);
                report.data.path == other.data.path && !are_told_apart(report, other)
            };
            reports[index].has_folds().then(|| others.filter(alike).copied().collect())
        };
        let by_held_out = matches!(criterion(Metric::default()), Criterion::HeldOut(_));
        let ranking = ranking
            .into_iter()
            .map(|(index, (report, value))| {
                let compared = report.metric.known().map(|metric| criterion(metric).into());
                let not_told_apart = if by_held_out { not_told_apart(index) } else { None };
                Rank { index, criterion: compared.unwrap_or_default(), value: finite(value), not_told_apart }
            })
            .collect();
        Self { schema: SCHEMA_SEVERAL.into(), ranking, reports, failed }
    }
}

/// What ranks reports, and its value for each: the error on the samples held out, if all reports have one, and otherwise the error on
/// the samples fitted.
pub(crate) fn compared(reports: &[&Report]) -> (fn(Metric) -> Criterion, Vec<f64>) {
    let held_out: Option<Vec<f64>> = reports.iter().map(|report| report.held_out_error()).collect();
    match held_out {
        Some(errors) => (Criterion::HeldOut, errors),
        None => (Criterion::Fitted, reports.iter().map(|report| report.fitted_error()).collect()),
    }
}

/// The products that the lobes declare, if both factors are fitted.
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

/// The estimate of the product of two rows.
struct Estimate {
    value: f64,
    std_error: Option<f64>,
    ci95: Option<[f64; 2]>,
}

/// Estimates the product of two rows; `None` unless both are fitted.
fn estimate(fit: &Fit, a: usize, b: usize) -> Option<Estimate> {
    let rows = fit.table.rows();
    let (row_a, row_b) = (&rows[a], &rows[b]);
    let is_fitted = |row: &ParameterRow| matches!(row.status, Status::Free | Status::Tied(_));
    if !is_fitted(row_a) || !is_fitted(row_b) {
        return None;
    }
    let (x, y) = (row_a.value, row_b.value);
    let (a, b) = (fit.table.source(a), fit.table.source(b));
    let value = x * y;
    // A product whose value is 0 is at its bound.
    let covariance = fit.covariance.as_ref().filter(|_| value != 0.0);
    let std_error = covariance.and_then(|c| c.combined_error(&[(a, y), (b, x)]));
    // The repeated fits give the product's own error, if the formula says that the product is determined.
    if let Some(resampled) = &fit.resampled {
        let (std_error, ci95) = std_error.and_then(|_| resampled.product(a, b)).unzip();
        return Some(Estimate { value, std_error, ci95 });
    }
    let half_interval = covariance.map(|covariance| covariance.widest_half_interval([a, b]));
    let ci95 = std_error.zip(half_interval).map(|(error, half)| [value - half * error, value + half * error]);
    Some(Estimate { value, std_error, ci95 })
}

fn correlation(fit: &Fit) -> Option<Correlation> {
    /// Above this number of parameters the matrix is larger than the rest of the report.
    const MOST: usize = 100;
    let covariance = fit.covariance.as_ref()?;
    if fit.table.free().len() > MOST {
        return None;
    }
    let entry = |a: usize| covariance.rows.iter().map(|b| covariance.correlation(a, *b)).collect();
    Some(Correlation {
        parameters: covariance.rows.iter().map(|row| fit.table.name(*row)).collect(),
        matrix: covariance.rows.iter().map(|row| entry(*row)).collect(),
    })
}
