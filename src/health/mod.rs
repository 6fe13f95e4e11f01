//! Checks that a model at given parameters, or a measurement, obeys physics, and how many digits a model's formula keeps.
//!
//! docs/use/checks.md says what is checked and within which limits, and describes the JSON form field by field.

#![allow(
    clippy::indexing_slicing,
    reason = "lengths are checked where they come in; an index beyond the end is a mistake in the program"
)]

mod angles;
mod channel;
mod effort;
mod judged;
pub(crate) mod laws;
mod measured;
mod mismatch;
mod numerics;
mod physics;
mod quadrature;
mod text;

pub use angles::Angles;
pub use channel::{MeasuredAlbedo, MeasuredChannel, Negative};
pub use effort::{Effort, INCIDENCES_DEG};
pub use judged::{Law, Verdict};
pub(crate) use measured::albedos_of_cells;
pub use measured::{MeasurementHealth, measurement};
pub use numerics::{Digits, Kept, LeastKept, Unfinished};
pub use physics::{Albedo, Extreme, Reciprocity};
pub use quadrature::{Integral, Quadrature, directional_albedo};
pub use text::{measurement_lines, measurement_table, model_lines, model_table};

use crate::error::{Suggestion, rounded};
use crate::model::Expression;
use crate::parameters::{ParameterTable, ParameterValue};
use crate::progress::Progress;
use angles::written;
use serde::Serialize;

/// Name of the schema of both forms.
pub const SCHEMA: &str = "brdfit.check/1";

/// How far above 1 an albedo may be, beyond the error of its quadrature, and still count as 1.
pub const ALBEDO_SLACK: f64 = 1e-6;
/// Largest relative difference between f(wi, wo) and f(wo, wi) that still counts as rounding. Reciprocal models here
/// reach 1e-9, where a steep exponential multiplies the rounding of its argument.
pub const RECIPROCITY_LIMIT: f64 = 1e-6;
/// Number of digits kept in f64 below which a warning is given.
pub const FEW_DIGITS: f64 = 8.0;

/// A violation of physics, or a warning.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// not-reciprocal, negative, gains-energy, not-finite, unresolved, derivative-not-finite, bounds-not-finite, few-digits.
    pub kind: &'static str,
    /// Whether it breaks physics; otherwise it is a warning.
    pub breaks: bool,
    /// The channel concerned; null means all.
    pub channel: Option<String>,
    /// Description.
    pub text: String,
    /// An option that would mend it, such as `quantity` with `f-cos-o`; null if there is none.
    pub suggestion: Option<Suggestion>,
}

/// The result of checking a model.
#[derive(Clone, Debug, Serialize)]
pub struct ModelHealth {
    /// `brdfit.check/1`.
    pub schema: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// "model".
    pub subject: &'static str,
    /// The report that the parameters come from; null if the caller gave them.
    pub path: Option<String>,
    /// The expression with every choice spelled out.
    pub model: String,
    /// Every parameter.
    pub parameters: Vec<ParameterValue>,
    /// Whether no finding breaks physics.
    pub sound: bool,
    /// Whether f changes when light and viewer are turned together about the normal, in any channel.
    pub anisotropic: bool,
    /// Results per channel.
    pub channels: Vec<ModelChannel>,
    /// Values and derivatives that are infinite or NaN when every shape is at one of its bounds.
    pub at_bounds: Unfinished,
    /// Violations of physics, and warnings.
    pub findings: Vec<Finding>,
}

/// The result of checking one channel of a model.
#[derive(Clone, Debug, Serialize)]
pub struct ModelChannel {
    /// Its name.
    pub name: String,
    /// How much f changes when light and viewer are exchanged.
    pub reciprocity: Reciprocity,
    /// The smallest value of f.
    pub least: Extreme,
    /// Directional albedo at every direction of incidence.
    pub albedo: Vec<Albedo>,
    /// The largest of these, which a white furnace test would show.
    pub furnace: Albedo,
    /// Values and derivatives that are infinite or NaN in the extreme directions.
    pub extremes: Unfinished,
    /// Digits kept.
    pub digits: Digits,
}

/// Checks a model at the parameter values in `table`.
#[must_use]
pub fn model(
    expression: &Expression,
    table: &ParameterTable,
    effort: &Effort,
    progress: &dyn Progress,
) -> ModelHealth {
    let names = table.channels();
    let parameters: Vec<_> = (0..names.len()).map(|channel| table.formula_values(channel)).collect();
    progress.stage("reciprocity");
    let pairs = physics::pairs(effort.pairs);
    let compared = physics::compare(expression, &parameters, &pairs);
    let anisotropic = physics::is_anisotropic(expression, &parameters);
    progress.stage("albedo");
    let albedos = physics::albedos(expression, &parameters, anisotropic, effort);
    progress.stage("derivatives");
    let extremes: Vec<Unfinished> =
        parameters.iter().map(|lobes| numerics::at_extremes(expression, lobes)).collect();
    let at_bounds = numerics::at_bounds(expression);
    progress.stage("digits");
    let digits: Vec<Digits> =
        parameters.iter().map(|lobes| numerics::digits(expression, lobes, effort.wide_pairs)).collect();
    let each = names.iter().zip(compared).zip(albedos).zip(extremes).zip(digits);
    let channels: Vec<ModelChannel> = each
        .map(|((((name, (reciprocity, least)), albedo), extremes), digits)| ModelChannel {
            name: name.clone(),
            reciprocity,
            least,
            furnace: physics::largest(&albedo),
            albedo,
            extremes,
            digits,
        })
        .collect();
    let findings = findings(&channels, &at_bounds);
    ModelHealth {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        subject: "model",
        path: None,
        model: expression.canonical(),
        parameters: table.parameter_values(),
        sound: findings.iter().all(|finding| !finding.breaks),
        anisotropic,
        channels,
        at_bounds,
        findings,
    }
}

fn findings(channels: &[ModelChannel], at_bounds: &Unfinished) -> Vec<Finding> {
    let mut findings = Vec::new();
    for channel in channels {
        let mut add = |kind, breaks, text| {
            findings.push(Finding {
                kind,
                breaks,
                channel: Some(channel.name.clone()),
                text,
                suggestion: None,
            });
        };
        if channel.reciprocity.not_finite > 0 || channel.extremes.values > 0 {
            let place = channel.extremes.first.clone().unwrap_or_default();
            let count = channel.reciprocity.not_finite + channel.extremes.values;
            add(
                "not-finite",
                true,
                format!("f is infinite or NaN at {count} points {place}").trim_end().to_owned(),
            );
        }
        let r = &channel.reciprocity;
        if r.largest > RECIPROCITY_LIMIT {
            let at = written(&r.at_deg);
            add(
                "not-reciprocal",
                true,
                format!(
                    "f changes by up to {:.2e} of its value when light and viewer are exchanged, at {at} deg",
                    r.largest
                ),
            );
        }
        if channel.least.value < 0.0 {
            let at = written(&channel.least.at_deg);
            add("negative", true, format!("f is negative: {:.4e} 1/sr at {at} deg", channel.least.value));
        }
        // What is largest need not be what is known best.
        let known = channel.albedo.iter().map(|a| Some((a.theta_i_deg, a.value?, a.error?)));
        if let Some(known) = known.collect::<Option<Vec<(f64, f64, f64)>>>().filter(|known| !known.is_empty())
        {
            let most = |key: fn(&(f64, f64, f64)) -> f64| {
                known.iter().max_by(|a, b| key(a).total_cmp(&key(b))).filter(|a| key(a) > 1.0 + ALBEDO_SLACK)
            };
            if let Some((theta, value, error)) = most(|(_, value, error)| value - error) {
                let theta = written(&[*theta]);
                add(
                    "gains-energy",
                    true,
                    format!(
                        "the albedo at theta_i = {theta} deg is {} +/- {error:.1e}, above 1",
                        rounded(*value, 6)
                    ),
                );
            } else if let Some((theta, value, error)) =
                most(|(_, value, error)| value + error).filter(|(.., error)| *error > ALBEDO_SLACK)
            {
                let theta = written(&[*theta]);
                add(
                    "unresolved",
                    false,
                    format!(
                        "the albedo at theta_i = {theta} deg is {} +/- {error:.1e}: too uncertain to tell whether it is above 1",
                        rounded(*value, 6)
                    ),
                );
            }
        } else {
            add("not-finite", true, "an albedo is infinite or NaN".to_owned());
        }
        if channel.extremes.derivatives > 0 {
            let place = channel.extremes.first.clone().unwrap_or_default();
            add(
                "derivative-not-finite",
                false,
                format!("{} derivatives are infinite or NaN {place}", channel.extremes.derivatives),
            );
        }
        if let Some(least) = channel.digits.f64.least.as_ref().filter(|least| least.digits < FEW_DIGITS) {
            let at = written(&least.at_deg);
            add("few-digits", false, format!("f keeps {:.1} digits in f64, at {at} deg", least.digits));
        }
    }
    if at_bounds.values + at_bounds.derivatives > 0 {
        findings.push(Finding {
            kind: "bounds-not-finite",
            breaks: false,
            channel: None,
            text: format!(
                "with shapes at their bounds, {} values and {} derivatives are infinite or NaN {}",
                at_bounds.values,
                at_bounds.derivatives,
                at_bounds.first.clone().unwrap_or_default()
            ),
            suggestion: None,
        });
    }
    findings
}
