//! The variants that a model offers, and those that an expression chose.

use crate::error::{Error, excerpt};

/// A choice that a model offers, such as `d=ggx`.
#[derive(Clone, Copy, Debug)]
pub struct ModelOption {
    /// Name of the option.
    pub key: &'static str,
    /// What it chooses.
    pub summary: &'static str,
    /// The values that it may take.
    pub values: fn() -> Vec<&'static str>,
    /// The value that a bare model name means.
    pub default: &'static str,
}

/// The value chosen for every option of a model; complete and valid by construction.
#[derive(Clone, Debug, Default)]
pub struct Choices {
    pub(super) chosen: Vec<(&'static str, &'static str)>,
}

impl Choices {
    /// The value chosen for `key`; empty for an option that the model does not have.
    #[must_use]
    pub fn get(&self, key: &str) -> &'static str {
        self.chosen.iter().find(|(k, _)| *k == key).map_or("", |(_, value)| value)
    }

    /// The choices for a model whose expression says `given`.
    ///
    /// # Errors
    /// [`Error::Usage`] for an option or value that the model does not have, or one given twice.
    pub(super) fn complete(
        model: &str,
        options: &[ModelOption],
        given: &[(String, String)],
    ) -> Result<Self, Error> {
        let keys = || options.iter().map(|o| o.key).collect::<Vec<_>>().join(", ");
        for (index, (key, _)) in given.iter().enumerate() {
            if !options.iter().any(|o| o.key == key) {
                let expected = if options.is_empty() { "no options".to_owned() } else { keys() };
                return Err(Error::Usage(format!(
                    "{model}: expected {expected}, found option {}",
                    excerpt(key)
                )));
            }
            if given.iter().take(index).any(|(k, _)| k == key) {
                return Err(Error::Usage(format!("{model}: option {} is given twice", excerpt(key))));
            }
        }
        let mut chosen = Vec::new();
        for option in options {
            let values = (option.values)();
            let wanted =
                given.iter().find(|(k, _)| k == option.key).map_or(option.default, |(_, v)| v.as_str());
            let Some(value) = values.iter().find(|v| **v == wanted) else {
                return Err(Error::Usage(format!(
                    "{model}: expected {}={}, found {}",
                    option.key,
                    values.join("|"),
                    excerpt(wanted)
                )));
            };
            chosen.push((option.key, *value));
        }
        Ok(Self { chosen })
    }

    /// The choices in writing: `d=ggx, g=smith, f=schlick`.
    #[must_use]
    pub fn text(&self) -> String {
        self.chosen.iter().map(|(k, v)| format!("{k}={v}")).collect::<Vec<_>>().join(", ")
    }
}
