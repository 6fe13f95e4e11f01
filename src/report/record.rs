//! The JSON form of a report: one set of types for both writing and reading.
//!
//! Fields that later versions added are optional when reading, so that older reports can still be read.

use super::open::{Criterion, Open, ParameterStatus, StopReason};
use crate::error::OptionName;
use crate::fit::{
    Budget, Errors, Fit, FittedParameter, Fold, Grouping, HeldOut, HoldOut, LossKind, Method, Metric, Misfit,
    NoiseSource, OpenEnd, Options, Resampled, SigmaScale, Suggestion, Uncertainty, Warning, WarningKind,
};
use crate::measurement::formats::BinPosition;
use crate::measurement::{ClusterKind, Weighting};
use crate::model::Unit;
use crate::solver::SolverKind;
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

/// Name of the schema of one report.
pub const SCHEMA: &str = "brdfit.report/1";
/// Name of the schema of several reports.
pub const SCHEMA_SEVERAL: &str = "brdfit.reports/1";

/// The result of one fit or evaluation.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Report {
    /// `brdfit.report/1`.
    pub schema: Cow<'static, str>,
    /// Version of the program.
    #[serde(default)]
    pub version: Cow<'static, str>,
    /// The model as an expression with every choice spelled out.
    pub model: String,
    /// The measurement.
    pub data: Data,
    /// Which samples were fitted, and with what weights.
    #[serde(default)]
    pub filters: FilterRecord,
    /// The metric that was minimised.
    #[serde(default)]
    pub metric: Open<Metric>,
    /// Every parameter, including fixed and tied ones.
    pub parameters: Vec<Parameter>,
    /// Products of parameters that the data determine better than either factor.
    #[serde(default)]
    pub derived: Vec<Derived>,
    /// Correlations of the free parameters that are not at a bound; null above 100 of them, or if there is no
    /// covariance.
    #[serde(default)]
    pub correlation: Option<Correlation>,
    /// Every error, all channels together.
    #[serde(default)]
    pub errors: ErrorRecord,
    /// Every error on all samples that pass the filters, if `--budget` or `--target-error` chose how many the fit
    /// uses; null otherwise.
    #[serde(default)]
    pub errors_on_all: Option<ErrorRecord>,
    /// How far the model is from the data, beside their noise; null if there are too few samples to tell.
    #[serde(default)]
    pub misfit: Option<MisfitRecord>,
    /// Every error of each channel.
    #[serde(default)]
    pub errors_by_channel: InOrder<ErrorRecord>,
    /// The size of the problem and how the uncertainty was found.
    #[serde(default)]
    pub fit: FitRecord,
    /// Criteria that weigh the error against the number of parameters.
    #[serde(default)]
    pub selection: SelectionRecord,
    /// The starts that were polished.
    #[serde(default)]
    pub starts: Vec<StartRecord>,
    /// Why the fit stopped.
    #[serde(default)]
    pub termination: TerminationRecord,
    /// The options as used.
    #[serde(default)]
    pub options: OptionRecord,
    /// Wall-clock times in seconds, and threads: the only part that differs from run to run.
    #[serde(default)]
    pub time_s: Times,
    /// What to know before relying on the result.
    #[serde(default)]
    pub warnings: Vec<WarningRecord>,
}

/// The measurement.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Data {
    /// The path of the file, as given.
    #[serde(default)]
    pub path: String,
    /// Its format.
    #[serde(default)]
    pub format: Cow<'static, str>,
    /// SHA-256 of the file.
    #[serde(default)]
    pub sha256: String,
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Wavelengths in nanometres; null unless every channel has one.
    #[serde(default)]
    pub wavelengths_nm: Option<Vec<f64>>,
    /// Number of samples in the file.
    #[serde(default)]
    pub samples: usize,
    /// Number of samples used.
    #[serde(default)]
    pub used: usize,
    /// Number of samples left out, by reason.
    #[serde(default)]
    pub dropped: BTreeMap<Cow<'static, str>, usize>,
    /// Number of values of the samples used that were not measured, for each channel that lacks any; left out if none does.
    #[serde(default, skip_serializing_if = "InOrder::is_empty")]
    pub missing: InOrder<usize>,
    /// What the reader did that a user should know, in words.
    #[serde(default)]
    pub remarks: Vec<String>,
}

/// Which samples were fitted, and with what weights.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct FilterRecord {
    /// Largest angle of incidence and viewing, in degrees, inclusive.
    pub max_theta_deg: f64,
    /// How the samples were weighted.
    pub weights: Open<Weighting>,
    /// Whether the file gives standard deviations that do not weight the samples.
    pub sigma_unused: bool,
}

/// One parameter.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Parameter {
    /// The lobe that it belongs to.
    pub lobe: String,
    /// Its symbol.
    pub name: Cow<'static, str>,
    /// Its channel; null if the channels share it.
    pub channel: Option<String>,
    /// Its value, in `unit`.
    pub value: f64,
    /// Its unit; "1" is dimensionless.
    #[serde(default)]
    pub unit: Open<Unit>,
    /// Standard error; null at a bound, if not free, or if the data do not determine it.
    pub std_error: Option<f64>,
    /// 95 % confidence interval; null like the standard error, unless it comes from a profile of the cost.
    pub ci95: Option<[f64; 2]>,
    /// Why that interval is open below and above, and its end only the last value tried; null where it is not.
    #[serde(default)]
    pub ci95_open: [Option<Open<OpenEnd>>; 2],
    /// Smallest and largest value allowed.
    pub bounds: [f64; 2],
    /// The value that the fit started from.
    #[serde(default)]
    pub initial: f64,
    /// Whether it was fitted, and where it ended.
    #[serde(default)]
    pub status: Open<ParameterStatus>,
}

impl Parameter {
    /// Whether the fit moved it, be it to a bound.
    #[must_use]
    pub fn was_fitted(&self) -> bool {
        let status = self.status.known();
        matches!(status, Some(ParameterStatus::Free | ParameterStatus::AtLower | ParameterStatus::AtUpper))
    }
}

impl From<FittedParameter> for Parameter {
    fn from(p: FittedParameter) -> Self {
        Self {
            lobe: p.lobe,
            name: p.name.into(),
            channel: p.channel,
            value: p.value,
            unit: p.unit.into(),
            std_error: p.std_error,
            ci95: p.ci95,
            ci95_open: p.open.map(|open| open.map(Into::into)),
            bounds: [p.bounds.0, p.bounds.1],
            initial: p.initial,
            status: ParameterStatus::from(&p.state).into(),
        }
    }
}

/// A product of parameters.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Derived {
    /// Lobe and factors: `cook-torrance.ks*f0`.
    pub name: String,
    /// Its channel; null if the channels share it.
    pub channel: Option<String>,
    /// Its value.
    pub value: f64,
    /// Standard error; null if the data do not determine the product.
    pub std_error: Option<f64>,
    /// 95 % confidence interval.
    pub ci95: Option<[f64; 2]>,
}

/// Correlations between parameters.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Correlation {
    /// Full names, in the order of rows and columns.
    pub parameters: Vec<String>,
    /// Correlations, -1..1.
    pub matrix: Vec<Vec<Option<f64>>>,
}

/// Every error; docs/use/conventions.md defines each.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[expect(missing_docs, reason = "defined together in docs/use/conventions.md")]
#[serde(default)]
pub struct ErrorRecord {
    pub l2: Option<f64>,
    pub log: Option<f64>,
    pub cbrt: Option<f64>,
    pub unbiased_cbrt: Option<f64>,
    pub log_ratio: Option<f64>,
    pub relative: Option<f64>,
}

/// A number that JSON can represent; `None` if it is infinite or NaN.
pub(super) fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

impl ErrorRecord {
    /// The error in a metric; `None` if it is not a number.
    #[must_use]
    pub fn of(&self, metric: Metric) -> Option<f64> {
        match metric {
            Metric::L2 => self.l2,
            Metric::Log => self.log,
            Metric::Cbrt => self.cbrt,
            Metric::UnbiasedCbrt => self.unbiased_cbrt,
        }
    }
}

impl From<&Errors> for ErrorRecord {
    fn from(e: &Errors) -> Self {
        let [l2, log, cbrt, unbiased_cbrt, log_ratio] =
            [e.l2, e.log, e.cbrt, e.unbiased_cbrt, e.log_ratio].map(finite);
        Self { l2, log, cbrt, unbiased_cbrt, log_ratio, relative: e.relative.and_then(finite) }
    }
}

/// The size of the problem and how the uncertainty was found.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct FitRecord {
    /// Number of residuals: samples times channels, less the values that were not measured.
    pub n: usize,
    /// Number of residuals less number of free parameters.
    pub dof: i64,
    /// What was minimised: the weighted mean square in the metric (smoothed for cbrt), or chi^2 for
    /// weights by sigma.
    pub cost: Option<f64>,
    /// chi^2/dof for weights by sigma, else null.
    pub reduced_chi2: Option<f64>,
    /// Ratio of the largest to the smallest singular value of J with columns of unit length; null if there is no
    /// covariance.
    pub condition: Option<f64>,
    /// How the uncertainty was found; null if there is none.
    pub uncertainty_method: Option<Open<Method>>,
    /// The groups of samples that err together, from which the standard errors were found; null for other methods.
    #[serde(default)]
    pub grouping: Option<GroupingRecord>,
    /// What the block bootstrap drew; null for other methods.
    pub resampling: Option<ResamplingRecord>,
}

/// Groups of samples that err together.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct GroupingRecord {
    /// What the samples of a group have in common.
    pub kind: Open<ClusterKind>,
    /// Width of a neighbourhood in the direction of the viewer, degrees; null for other kinds.
    pub width_deg: Option<f64>,
    /// Number of groups.
    pub groups: usize,
    /// Number of repeated fits whose scatter the standard errors have, because the cost is no parabola; null if none were needed.
    #[serde(default)]
    pub refits: Option<usize>,
}

impl From<Grouping> for GroupingRecord {
    fn from(Grouping { kind, width_deg, groups, refits }: Grouping) -> Self {
        Self { kind: kind.into(), width_deg, groups, refits }
    }
}

/// What the block bootstrap drew.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ResamplingRecord {
    /// Number of repeated fits.
    pub replicates: usize,
    /// Smallest and largest theta_i of each group of samples, in degrees; both the same for a single angle.
    pub theta_i_deg: Vec<[f64; 2]>,
}

impl From<&Resampled> for ResamplingRecord {
    fn from(resampled: &Resampled) -> Self {
        Self { replicates: resampled.replicates, theta_i_deg: resampled.theta_i_deg.clone() }
    }
}

/// Criteria for choosing between models.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct SelectionRecord {
    /// Akaike's criterion, corrected for small samples.
    pub aicc: Option<f64>,
    /// Bayesian criterion.
    pub bic: Option<f64>,
    /// Errors on the samples held out; null if none were.
    pub held_out: Option<HeldOutRecord>,
}

/// Errors on samples that were left out of fits, each group of incidence angles once.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct HeldOutRecord {
    /// Every error on all samples held out, each predicted by the fit that left it out, all channels together.
    #[serde(flatten)]
    pub errors: ErrorRecord,
    /// Number of samples held out.
    pub samples: usize,
    /// Smallest and largest theta_i of each group of samples held out, in degrees; both the same for a single angle.
    pub theta_i_deg: Vec<[f64; 2]>,
    /// Mean over the folds of the error in the metric that was fitted.
    pub mean: Option<f64>,
    /// Standard deviation over the folds of that error.
    pub std_dev: Option<f64>,
    /// The groups that were left out together; empty in reports of earlier versions, which left out some groups once.
    pub folds: Vec<FoldRecord>,
}

/// Errors on samples that were left out together.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct FoldRecord {
    /// Every error on these samples, all channels together.
    #[serde(flatten)]
    pub errors: ErrorRecord,
    /// Number of samples.
    pub samples: usize,
    /// Smallest and largest theta_i of each group of samples, in degrees; both the same for a single angle.
    pub theta_i_deg: Vec<[f64; 2]>,
    /// Whether the fit to all other samples reached a minimum.
    pub converged: bool,
}

impl HeldOutRecord {
    /// The record of errors of fits in `metric`.
    pub(super) fn new(held: &HeldOut, metric: Metric) -> Self {
        Self {
            errors: ErrorRecord::from(&held.errors),
            samples: held.samples,
            theta_i_deg: held.theta_i_deg.clone(),
            mean: held.mean(metric),
            std_dev: held.std_dev(metric),
            folds: held.folds.iter().map(FoldRecord::from).collect(),
        }
    }
}

impl From<&Fold> for FoldRecord {
    fn from(fold: &Fold) -> Self {
        Self {
            errors: ErrorRecord::from(&fold.errors),
            samples: fold.samples,
            theta_i_deg: fold.theta_i_deg.clone(),
            converged: fold.converged,
        }
    }
}

/// One start of the search.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct StartRecord {
    /// Cost at the end, on the samples of the search.
    pub cost: Option<f64>,
    /// Shapes at the beginning, by full name.
    pub shapes: InOrder<f64>,
    /// Shapes at the end, with lobes of one kind in order.
    pub reached: InOrder<f64>,
    /// Why its polishing stopped.
    pub reason: Open<StopReason>,
}

/// Why the fit stopped.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct TerminationRecord {
    /// Why it stopped, or that nothing was fitted.
    pub reason: Open<StopReason>,
    /// Whether the result is a minimum that can be used.
    pub usable: bool,
    /// Number of iterations of the final fit.
    pub iterations: u64,
    /// Number of passes over the samples in the final fit.
    pub evaluations: u64,
}

/// How far the model is from the data, beside the data's own noise.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct MisfitRecord {
    /// Root mean square of the residuals over that of the noise; null if no noise is visible.
    pub ratio: Option<f64>,
    /// What the noise was estimated from; null if none is visible.
    pub noise: Option<Open<NoiseSource>>,
    /// Mean distance of the model from the data, relative to the data.
    pub relative: f64,
    /// Above this ratio the warning `misfit` is given; chance alone explains a smaller one.
    pub limit: f64,
    /// Where the residuals are largest; null if no region has enough samples.
    pub worst: Option<WorstRecord>,
}

/// A region of directions.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct WorstRecord {
    /// Smallest and largest angle of incidence, degrees.
    pub theta_i_deg: [f64; 2],
    /// Whether it is the part of these directions within 10 degrees of the mirror direction, by the half vector, or the rest.
    pub near_mirror: bool,
}

impl From<&Misfit> for MisfitRecord {
    fn from(misfit: &Misfit) -> Self {
        let worst = misfit
            .worst
            .map(|worst| WorstRecord { theta_i_deg: worst.theta_i_deg, near_mirror: worst.near_mirror });
        Self {
            ratio: misfit.ratio.and_then(finite),
            noise: misfit.source.map(Into::into),
            relative: misfit.relative,
            limit: misfit.limit,
            worst,
        }
    }
}

/// The options as used.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct OptionRecord {
    /// Number of samples that were drawn; null for all.
    pub samples: Option<usize>,
    /// The budget, as given or as the one that reached the target; null if there was none.
    pub budget: Option<Open<Budget>>,
    /// The target error; null if there was none.
    pub target_error: Option<f64>,
    /// The seed of all random draws.
    pub seed: u64,
    /// The angles of incidence held out at a time: a fraction of them, or `each` for a single one; null if none were.
    pub hold_out: Option<HoldOutRecord>,
    /// The optimiser; null if nothing was fitted.
    pub solver: Option<Open<SolverKind>>,
    /// The source of the standard errors; null if nothing was fitted.
    pub uncertainty: Option<Open<Uncertainty>>,
    /// What the standard deviations of the file mean; null unless they are the weights.
    pub sigma_scale: Option<Open<SigmaScale>>,
    /// The error of the measurement's scale that standard errors include, such as `0.02,shared`; null if there is none.
    pub scale_error: Option<String>,
    /// The directions that the cells of a MERL table stand for.
    pub merl_bins: Open<BinPosition>,
    /// The material that was read from a file that holds several, as given; null if none was named.
    pub material: Option<String>,
    /// How the numbers of the file were understood, where the user said so: options and their values, such as `quantity=f-cos-o`.
    pub reading: Vec<String>,
    /// How strongly outliers are down-weighted.
    pub loss: Open<LossKind>,
    /// Residual above which the loss down-weights a sample, in units of the residual (standard deviations for weights by
    /// sigma), given or estimated; null without a loss.
    pub loss_scale: Option<f64>,
    /// Whether that scale was estimated from the residuals; null without a loss.
    pub loss_scale_auto: Option<bool>,
    /// The time limit in seconds; null if there was none.
    pub timeout_s: Option<f64>,
    /// Options about parameters, as given.
    pub parameters: Vec<String>,
}

/// The angles of incidence that were held out at a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum HoldOutRecord {
    /// A fraction of them.
    Fraction(f64),
    /// `each`: a single one. Later versions may have other words.
    Word(String),
}

impl From<HoldOut> for HoldOutRecord {
    fn from(hold_out: HoldOut) -> Self {
        match hold_out {
            HoldOut::Fraction(fraction) => Self::Fraction(fraction),
            HoldOut::Each => Self::Word(hold_out.to_string()),
        }
    }
}

impl OptionRecord {
    /// The record of a fit under `options`, without what they do not hold: the target error, the bins of MERL tables, the time
    /// limit and the options about parameters as given.
    #[must_use]
    pub fn new(options: &Options, fit: &Fit) -> Self {
        Self {
            samples: fit.budget.map_or(options.filters.samples, Budget::samples),
            budget: fit.budget.map(Into::into),
            seed: options.seed,
            hold_out: options.hold_out.map(HoldOutRecord::from),
            solver: Some(options.solver.into()),
            uncertainty: Some(options.uncertainty.into()),
            sigma_scale: (fit.weighting == Weighting::Sigma).then(|| options.sigma_scale.into()),
            scale_error: options.scale_error.map(|scale_error| scale_error.to_string()),
            loss: options.loss.into(),
            loss_scale: fit.loss_scale,
            loss_scale_auto: fit.loss_scale.map(|_| options.loss_scale.is_none()),
            ..Self::default()
        }
    }
}

/// Wall-clock times.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Times {
    /// Time for reading the file.
    pub read: f64,
    /// Time for fitting.
    pub fit: f64,
    /// Time for both.
    pub total: f64,
    /// Number of threads used.
    pub threads: usize,
}

/// Something to know before relying on the result.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct WarningRecord {
    /// Its kind; docs/use/report.md lists them.
    pub kind: Open<WarningKind>,
    /// The full name of the parameter that it is about, or of the first of several; null if it is about the whole fit.
    pub parameter: Option<String>,
    /// What the warning means and what to do next.
    pub text: String,
    /// Options that help, and values for them.
    #[serde(default)]
    pub suggestions: Vec<SuggestionRecord>,
}

impl fmt::Display for WarningRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.parameter {
            Some(parameter) => write!(f, "{parameter}: {}", self.text),
            None => f.write_str(&self.text),
        }
    }
}

impl From<&Warning> for WarningRecord {
    fn from(warning: &Warning) -> Self {
        let suggestions = warning.suggestions().into_iter();
        Self {
            kind: warning.kind().into(),
            parameter: warning.parameter().map(str::to_owned),
            text: warning.to_string(),
            suggestions: suggestions
                .map(|Suggestion { option, value }| SuggestionRecord { option: option.into(), value })
                .collect(),
        }
    }
}

impl WarningRecord {
    /// The options that it suggests, as `typed` spells them, such as `--fix cook-torrance.m=V`.
    #[must_use]
    pub fn options(&self, typed: impl Fn(OptionName) -> String) -> Vec<String> {
        let option = |SuggestionRecord { option, value }: &SuggestionRecord| {
            let option = option.known().map_or_else(|| option.to_string(), &typed);
            if value.is_empty() { option } else { format!("{option} {value}") }
        };
        self.suggestions.iter().map(option).collect()
    }
}

/// An option that helps with the cause of a warning.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SuggestionRecord {
    /// The option.
    pub option: Open<OptionName>,
    /// The value to give it, such as `cook-torrance.m=LO..HI`; empty if the choice is the user's.
    pub value: String,
}

/// The result of several fits.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Reports {
    /// `brdfit.reports/1`.
    pub schema: Cow<'static, str>,
    /// One report per input and model, in the order given.
    pub reports: Vec<Report>,
    /// The models of each input from best to worst.
    pub ranking: Vec<Rank>,
    /// Inputs that could not be fitted.
    #[serde(default)]
    pub failed: Vec<Failure>,
}

/// A place in the ranking.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Rank {
    /// Index into `reports`.
    pub index: usize,
    /// The criterion that was compared.
    #[serde(default)]
    pub criterion: Open<Criterion>,
    /// Its value; smaller is better, and null is worst.
    pub value: Option<f64>,
    /// Indices into `reports` of the models of the same input that the samples held out do not tell apart from this one, the best
    /// first; null where nothing was held out in folds.
    #[serde(default)]
    pub not_told_apart: Option<Vec<usize>>,
}

/// An input that could not be fitted.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Failure {
    /// The path of the file, as given.
    pub path: String,
    /// Why it could not be fitted.
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

impl<'de, T: Deserialize<'de>> Deserialize<'de> for InOrder<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        /// Reads the members one by one.
        struct Members<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for Members<T> {
            type Value = InOrder<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(InOrder(members))
            }
        }

        deserializer.deserialize_map(Members(PhantomData))
    }
}

impl<T> InOrder<T> {
    /// Whether it has no members.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl<T> Default for InOrder<T> {
    fn default() -> Self {
        Self(Vec::new())
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

/// The JSON Schema of one report or several.
#[must_use]
pub fn schema() -> Schema {
    /// A file with one report or several.
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
    // The schema is that of what is written, because readers may rely on every field of it.
    SchemaSettings::default().for_serialize().into_generator().into_root_schema_for::<Either>()
}
