//! Names of parameters as a user writes them, and the constraints on them.

use crate::error::{Error, NameKind, excerpt, short};
use crate::model::ParamSpec;
use std::fmt;

/// The name of one or more parameters: `[lobe.]name[.channel]`, or with the channel in brackets, `[channel]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selector {
    text: String,
    /// The parts before a bracketed channel, split at dots.
    parts: Vec<String>,
    /// The channel in brackets; `None` if there is none.
    bracketed: Option<String>,
}

impl Selector {
    /// Reads a parameter's name.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a text that cannot be a parameter's name.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let text = text.trim();
        let wrong = || {
            let expected = "a name such as 'm', 'lambert.kd.r' or 'cook-torrance#2.f0[700]'";
            Error::invalid("parameter", expected, excerpt(text))
        };
        let (name, bracketed) = match text.split_once('[') {
            Some((name, rest)) => (name, Some(rest.strip_suffix(']').ok_or_else(wrong)?.to_owned())),
            None => (text, None),
        };
        let parts: Vec<String> = name.split('.').map(str::to_owned).collect();
        let most = if bracketed.is_some() { 2 } else { 3 };
        if parts.len() > most || parts.iter().any(String::is_empty) {
            return Err(wrong());
        }
        Ok(Self { text: text.to_owned(), parts, bracketed })
    }
}

impl Selector {
    /// The channel, if the name certainly has one: `name[channel]`, `lobe.name.channel`, or `name.channel` if there is
    /// no model of that name. Otherwise `None`.
    #[must_use]
    pub fn channel_if_any(&self) -> Option<String> {
        match (self.parts.as_slice(), &self.bracketed) {
            (_, Some(channel)) => Some(channel.clone()),
            ([_, _, channel], None) => Some(channel.clone()),
            ([first, channel], None) => {
                let model = first.split('#').next().unwrap_or_default();
                let is_lobe =
                    crate::model::REGISTRY.iter().any(|entry| entry.name.eq_ignore_ascii_case(model));
                (!is_lobe).then(|| channel.clone())
            }
            _ => None,
        }
    }
}

impl Selector {
    /// The parameter's own name, without lobe and channel.
    #[must_use]
    pub fn parameter(&self) -> &str {
        let of_lobe = match (self.parts.len(), self.channel_if_any()) {
            (3, _) => 1,
            (2, Some(_)) if self.bracketed.is_none() => 0,
            (count, _) => count.saturating_sub(1),
        };
        self.parts.get(of_lobe).map_or("", String::as_str)
    }

    /// The name of the same parameter in one channel.
    #[must_use]
    pub fn of_channel(&self, channel: &str) -> Self {
        let text = format!("{}[{channel}]", self.text);
        Self { text, parts: self.parts.clone(), bracketed: Some(channel.to_owned()) }
    }
}

impl fmt::Display for Selector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&short(&self.text))
    }
}

/// One constraint on a parameter.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Setting {
    /// Keep the parameter at a value.
    Fix(f64),
    /// Start from a value.
    Init(f64),
    /// Keep the parameter between two values.
    Bounds(f64, f64),
    /// Fit the parameter although it is fixed by default.
    Free,
    /// Keep the parameter equal to another.
    Tie(Selector),
    /// Give each channel its own value.
    PerChannel,
    /// Give all channels the same value.
    Shared,
    /// Set the value, for an evaluation.
    Set(f64),
}

/// All constraints on parameters, in the order given.
pub type Settings = Vec<(Selector, Setting)>;

/// A parameter's name with a channel appended.
#[must_use]
pub fn channel_suffix(channel: &str) -> String {
    if channel.contains('.') || channel.parse::<f64>().is_ok() {
        format!("[{channel}]")
    } else {
        format!(".{channel}")
    }
}

/// The lobe (if named), parameter and channel (if named) of a selector.
pub(super) fn resolve(
    selector: &Selector,
    lobes: &[String],
    specs: &[Vec<ParamSpec>],
    channels: &[String],
) -> Result<(Option<usize>, String, Option<usize>), Error> {
    let find_lobe = |name: &String| lobes.iter().position(|lobe| lobe.eq_ignore_ascii_case(name));
    let (lobe, name, channel) = match (selector.parts.as_slice(), &selector.bracketed) {
        ([name], channel) => (None, name, channel.as_ref()),
        ([lobe, name], Some(channel)) => (Some(lobe), name, Some(channel)),
        ([first, second], None) if find_lobe(first).is_some() => (Some(first), second, None),
        ([first, second], None)
            if specs.iter().flatten().any(|spec| spec.name.eq_ignore_ascii_case(first)) =>
        {
            (None, first, Some(second))
        }
        ([first, second], None) => (Some(first), second, None),
        ([lobe, name, channel], None) => (Some(lobe), name, Some(channel)),
        _ => return Err(Error::invalid("parameter", "a name", excerpt(&selector.to_string()))),
    };
    let lobe = match lobe {
        None => None,
        Some(lobe) => Some(
            find_lobe(lobe)
                .ok_or_else(|| Error::unknown(selector.to_string(), NameKind::Lobe, lobes, lobe))?,
        ),
    };
    let holders: Vec<usize> = specs
        .iter()
        .enumerate()
        .filter(|(index, lobe_specs)| {
            lobe.is_none_or(|l| l == *index)
                && lobe_specs.iter().any(|spec| spec.name.eq_ignore_ascii_case(name))
        })
        .map(|(index, _)| index)
        .collect();
    match holders.as_slice() {
        [] => {
            let mut known: Vec<String> = Vec::new();
            for (lobe, lobe_specs) in lobes.iter().zip(specs) {
                known.extend(lobe_specs.iter().map(|spec| format!("{lobe}.{}", spec.name)));
            }
            return Err(Error::unknown(selector.to_string(), NameKind::Parameter, &known, name));
        }
        [_] => {}
        several => {
            let names: Vec<String> = several
                .iter()
                .filter_map(|index| lobes.get(*index))
                .map(|lobe| format!("{lobe}.{name}"))
                .collect();
            return Err(Error::AmbiguousParameter { name: selector.to_string(), candidates: names });
        }
    }
    let channel = match channel {
        None => None,
        Some(wanted) => Some(
            channels
                .iter()
                .position(|channel| channel == wanted)
                .or_else(|| channels.iter().position(|channel| channel.eq_ignore_ascii_case(wanted)))
                .ok_or_else(|| Error::unknown(selector.to_string(), NameKind::Channel, channels, wanted))?,
        ),
    };
    let canonical = specs.iter().flatten().find(|spec| spec.name.eq_ignore_ascii_case(name));
    Ok((lobe, canonical.map_or_else(|| name.clone(), |spec| spec.name.to_owned()), channel))
}
