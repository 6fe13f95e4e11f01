//! What a page says about one model.

use super::fact::{Fact, known};
use super::figures::{Drawn, NotDrawn};
use crate::error::OptionName;
use crate::figure::letter;
use crate::fit::Metric;
use crate::model::Unit;
use crate::report::{
    Parameter, ParameterStatus, Report, WarningRecord, digits, full_name, misfit_in_words, or_dash,
    with_error,
};

/// A fit of a model.
#[derive(Debug)]
pub(super) struct Model {
    /// Its anchor in the page.
    pub(super) id: String,
    /// The letter that figures name it by; empty for a single model.
    pub(super) letter: String,
    /// The model with every choice spelled out.
    pub(super) expression: String,
    /// The metric that was fitted.
    pub(super) metric: String,
    /// The error in that metric.
    pub(super) error: String,
    /// The error on samples held out, and its spread over the folds; empty if there were none.
    pub(super) held_out: String,
    /// The letters of the models that the samples held out do not tell apart from it; empty if there are none.
    pub(super) alike: String,
    /// Number of parameters that were fitted.
    pub(super) fitted: usize,
    /// How much larger the residuals are than the noise.
    pub(super) over_noise: String,
    /// Whether the result can be used, in a word.
    pub(super) usable: bool,
    /// Why the fit stopped.
    pub(super) verdict: String,
    pub(super) parameters: Vec<ParameterLine>,
    pub(super) warnings: Vec<Caution>,
    pub(super) facts: Vec<Fact>,
    pub(super) figures: Vec<Drawn>,
    pub(super) not_drawn: Vec<NotDrawn>,
}

/// A line of the table of parameters.
#[derive(Debug)]
pub(super) struct ParameterLine {
    pub(super) name: String,
    /// Its value with its standard error.
    pub(super) value: String,
    /// Its 95 % interval; empty without one.
    pub(super) interval: String,
    /// What became of it, in words; empty for one that was fitted and has a standard error.
    pub(super) note: &'static str,
}

/// A warning, and the options that it suggests.
#[derive(Debug)]
pub(super) struct Caution {
    pub(super) text: String,
    pub(super) options: Vec<String>,
}

impl Caution {
    /// A warning, with its options as they are `typed`.
    pub(super) fn new(warning: &WarningRecord, typed: fn(OptionName) -> String) -> Self {
        Self { text: warning.to_string(), options: warning.options(typed) }
    }
}

/// A longer table of parameters is folded away.
const LONG: usize = 24;

impl Model {
    /// Whether the table of parameters is so long that it hides the figures.
    pub(super) fn is_long(&self) -> bool {
        self.parameters.len() > LONG
    }

    /// The model of a report, without its warnings and figures. `place` counts it among those of its material; `None` if it is the
    /// only one.
    pub(super) fn new(material: &str, place: Option<usize>, report: &Report) -> Self {
        let t = &report.termination;
        let or_unknown = |error: f64| or_dash(Some(error).filter(|error| error.is_finite()));
        let derived = report.derived.iter().map(|derived| ParameterLine {
            name: full_name(&derived.name, derived.channel.as_deref()),
            value: plus_minus(with_error(derived.value, derived.std_error, "")),
            interval: interval(derived.ci95),
            note: "product",
        });
        Self {
            id: format!("{material}-model-{}", place.unwrap_or(0) + 1),
            letter: place.map(letter).unwrap_or_default(),
            expression: report.model.clone(),
            metric: report.metric.to_string(),
            error: or_unknown(report.fitted_error()),
            held_out: report.held_out_error().map(or_unknown).unwrap_or_default() + &spread(report),
            alike: String::new(),
            fitted: report.parameters.iter().filter(|p| p.was_fitted()).count(),
            over_noise: over_noise(report),
            usable: t.usable,
            verdict: format!("{}, {} iterations", t.reason, t.iterations),
            parameters: report.parameters.iter().map(line).chain(derived).collect(),
            warnings: Vec::new(),
            facts: facts(report),
            figures: Vec::new(),
            not_drawn: Vec::new(),
        }
    }
}

/// The standard deviation of the held-out error over the folds, after a sign; empty if there are no folds.
fn spread(report: &Report) -> String {
    let spread = report.selection.held_out.as_ref().and_then(|held| held.std_dev);
    spread.map_or_else(String::new, |spread| format!(" \u{b1} {}", digits(spread, 2)))
}

/// How much larger the residuals of a fit are than the noise; a dash if no noise is visible.
fn over_noise(report: &Report) -> String {
    let ratio = report.misfit.as_ref().and_then(|misfit| misfit.ratio);
    ratio.map_or_else(|| "-".to_owned(), |ratio| digits(ratio, 3))
}

fn line(p: &Parameter) -> ParameterLine {
    let unit = if p.unit == Unit::One { String::new() } else { format!(" {}", p.unit) };
    let note = match p.status.known() {
        Some(ParameterStatus::Free) if p.std_error.is_none() => "no standard error",
        Some(ParameterStatus::Free) => "",
        Some(ParameterStatus::Fixed) => "fixed",
        Some(ParameterStatus::Tied) => "tied to another",
        Some(ParameterStatus::AtLower) => "at its lower bound",
        Some(ParameterStatus::AtUpper) => "at its upper bound",
        Some(ParameterStatus::Absent) => "without effect: its lobe is absent",
        None => "",
    };
    ParameterLine {
        name: full_name(&format!("{}.{}", p.lobe, p.name), p.channel.as_deref()),
        value: plus_minus(with_error(p.value, p.std_error, &unit)),
        interval: interval(p.ci95),
        note,
    }
}

/// A value and its error with the sign that a page can show.
fn plus_minus(text: String) -> String {
    text.replace("+/-", "\u{b1}")
}

fn interval(ci95: Option<[f64; 2]>) -> String {
    ci95.map_or_else(String::new, |[low, high]| format!("{} to {}", digits(low, 4), digits(high, 4)))
}

fn facts(report: &Report) -> Vec<Fact> {
    let e = &report.errors;
    let errors = Metric::ALL.iter().map(|metric| (metric.name(), e.of(*metric)));
    let others = [("log_ratio", e.log_ratio), ("relative", e.relative)];
    let errors: Vec<String> =
        errors.chain(others).map(|(name, error)| format!("{name} {}", or_dash(error))).collect();
    let residuals = report.misfit.as_ref().map(misfit_in_words).unwrap_or_default();
    let method = report.fit.uncertainty_method.as_ref().map(|method| method.name().to_owned());
    let facts = [
        ("errors", errors.join(", ")),
        ("residuals", residuals.trim_start_matches("residuals: ").to_owned()),
        (
            "fitted",
            format!(
                "metric {}, weights {}, theta up to {} deg; {} values, {} degrees of freedom",
                report.metric,
                report.filters.weights,
                report.filters.max_theta_deg,
                report.fit.n,
                report.fit.dof
            ),
        ),
        ("standard errors", method.unwrap_or_else(|| "none".to_owned())),
    ];
    known(facts)
}
