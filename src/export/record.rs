//! What an export says about itself.

use crate::report::Report;
use serde::Serialize;

/// Name of the schema of a record.
pub const SCHEMA: &str = "brdfit.export/1";

/// How close what was written is to what was fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Agreement {
    /// The target's formula is that of the fit, and its values are those written.
    Exact,
    /// The target's own formula was fitted to the measurement.
    Refitted,
    /// Values were moved into the target's range.
    Approximate,
}

impl Agreement {
    /// The word.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Refitted => "refitted",
            Self::Approximate => "approximate",
        }
    }
}

/// Everything about an export but the file.
#[derive(Clone, Debug, Serialize)]
pub struct ExportRecord {
    /// `brdfit.export/1`.
    pub schema: &'static str,
    /// The target.
    pub target: &'static str,
    /// How close the file is to the fit.
    pub agreement: Agreement,
    /// The model that was written.
    pub model: String,
    /// The model of the report, and its error; null without a report.
    pub fitted: Option<ModelError>,
    /// The error of what was written; null without a measurement.
    pub exported: Option<ModelError>,
    /// The measurement.
    pub measurement: String,
    /// The primaries of the colours.
    pub primaries: String,
    /// Values that were moved into the target's range: name, value of the fit, value written.
    pub clamped: Vec<(String, f64, f64)>,
    /// What to know before relying on the file.
    pub notes: Vec<String>,
    /// The report of the model that was written.
    #[serde(skip)]
    pub report: Option<Report>,
}

impl From<&Report> for ModelError {
    fn from(report: &Report) -> Self {
        Self {
            model: report.model.clone(),
            unbiased_cbrt: report.errors.unbiased_cbrt,
            relative: report.errors.relative,
        }
    }
}

/// A model and its errors on the measurement.
#[derive(Clone, Debug, Serialize)]
pub struct ModelError {
    /// The model.
    pub model: String,
    /// Error in `unbiased-cbrt`.
    pub unbiased_cbrt: Option<f64>,
    /// Relative error.
    pub relative: Option<f64>,
}
