//! The options that a model offers, and the choices of an expression.

use crate::error::{Error, NameKind, excerpt};

/// A choice that a model offers, such as `d=ggx`.
#[derive(Clone, Copy, Debug)]
pub struct ModelOption {
    /// Name of the option.
    pub key: &'static str,
    /// What the option chooses, in a few words.
    pub summary: &'static str,
    /// The values that it may take.
    pub values: fn() -> Vec<&'static str>,
    /// The value if the expression does not give one.
    pub default: &'static str,
}

/// The chosen value of every option of a model; complete and valid by construction.
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

    /// Completes the choices `given` in an expression with the model's defaults.
    ///
    /// # Errors
    /// [`Error::UnknownName`] or [`Error::Invalid`] for an option or value that the model does not have, or one given twice.
    pub(super) fn complete(
        model: &str,
        options: &[ModelOption],
        given: &[(String, String)],
    ) -> Result<Self, Error> {
        for (index, (key, _)) in given.iter().enumerate() {
            if !options.iter().any(|o| o.key.eq_ignore_ascii_case(key)) {
                if options.is_empty() {
                    return Err(Error::invalid(model, "no options", excerpt(key)));
                }
                let keys: Vec<&str> = options.iter().map(|o| o.key).collect();
                return Err(Error::unknown(model, NameKind::ModelOption, &keys, key));
            }
            if given.iter().take(index).any(|(k, _)| k.eq_ignore_ascii_case(key)) {
                return Err(Error::invalid(model, format!("option {} once", excerpt(key)), "it twice"));
            }
        }
        let mut chosen = Vec::new();
        for option in options {
            let values = (option.values)();
            let wanted = given
                .iter()
                .find(|(k, _)| k.eq_ignore_ascii_case(option.key))
                .map_or(option.default, |(_, v)| v.as_str());
            let Some(value) = values.iter().find(|v| v.eq_ignore_ascii_case(wanted)) else {
                return Err(Error::unknown(model, NameKind::ValueOf(option.key), &values, wanted));
            };
            chosen.push((option.key, *value));
        }
        Ok(Self { chosen })
    }

    /// The choices without that of `key`.
    #[must_use]
    pub fn without(&self, key: &str) -> Self {
        Self { chosen: self.chosen.iter().filter(|(k, _)| *k != key).copied().collect() }
    }

    /// The choices as text: `d=ggx, g=smith, f=schlick`.
    #[must_use]
    pub fn text(&self) -> String {
        self.chosen.iter().map(|(k, v)| format!("{k}={v}")).collect::<Vec<_>>().join(", ")
    }
}
