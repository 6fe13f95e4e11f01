//! A renderer's file format.

use super::values::{About, NotHeld, Values};
use crate::geometry::Azimuths;
use crate::image::Primaries;
use crate::model::Expression;
use crate::parameters::{ParameterTable, Settings};

/// A renderer's file format.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Name on the command line.
    pub name: &'static str,
    /// What is written, in a few words.
    pub summary: &'static str,
    /// The usual ending of the file's name, without the dot.
    pub extension: &'static str,
    /// The model that is fitted if the target cannot hold another, with its constraints; empty if a report must be given.
    pub own: &'static str,
    /// What the target holds.
    pub holds: Holds,
    /// The primaries that its colours may have, and the target's name for each; the name is empty if a file cannot state it.
    pub primaries: &'static [(&'static str, &'static str)],
    /// What to know before relying on the file; empty if there is nothing.
    pub caveat: &'static str,
}

/// What a target holds.
#[derive(Clone, Copy, Debug)]
pub enum Holds {
    /// Some models, in red, green and blue.
    Materials(fn(&Values) -> Result<String, NotHeld>),
    /// Every model, in the channels that it has.
    Models(fn(&Expression, &ParameterTable, &About<'_>) -> Result<String, NotHeld>),
}

/// Primaries of a target whose files cannot state theirs, so that the scene must be rendered in the same.
pub(super) const UNSTATED: &[(&str, &str)] = &[
    ("rec709", ""),
    ("rec2020", ""),
    ("display-p3", ""),
    ("acescg", ""),
    ("aces2065-1", ""),
    ("radiance", ""),
];

impl Target {
    /// The target's name for these primaries; `None` if its colours cannot have them.
    #[must_use]
    pub fn name_of_primaries(&self, primaries: &Primaries) -> Option<&'static str> {
        self.primaries.iter().find(|(name, _)| *name == primaries.name).map(|(_, own)| *own)
    }

    /// Whether the target has a form for the model at its default values in red, green and blue.
    #[must_use]
    pub fn holds_model(&self, expression: &Expression) -> bool {
        let channels = ["r", "g", "b"].map(str::to_owned);
        let table = ParameterTable::new(expression, &channels, Azimuths::Several, &Settings::new());
        table.is_ok_and(|table| self.write(expression, &table, &About::default()).is_ok())
    }

    /// Writes a model at its values; `None` with the reason if the target cannot hold it.
    ///
    /// # Errors
    /// [`NotHeld`] if the target has no such model, or cannot take its values.
    pub fn write(
        &self,
        expression: &Expression,
        table: &ParameterTable,
        about: &About<'_>,
    ) -> Result<Written, NotHeld> {
        match self.holds {
            Holds::Materials(holds) => {
                let values = Values::new(expression, table, about)?;
                let text = holds(&values)?;
                Ok(Written { text, clamped: values.clamped() })
            }
            Holds::Models(holds) => {
                Ok(Written { text: holds(expression, table, about)?, clamped: Vec::new() })
            }
        }
    }
}

/// A file, and what it does not hold as it was fitted.
#[derive(Clone, Debug)]
pub struct Written {
    /// The content of the file.
    pub text: String,
    /// Values that were moved into the target's range: name, value, and what was written.
    pub clamped: Vec<(String, f64, f64)>,
}
