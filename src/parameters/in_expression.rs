//! Constraints written inside an expression: `cook-torrance(m=0.2, ks=free, f0=0.02..0.08)`.

use super::selector::{Selector, Setting, Settings, channel_suffix};
use super::settings::{ranges, values};
use crate::error::{Error, OptionName, excerpt, short};
use std::fmt;

/// A constraint on a parameter of one lobe, as an expression holds it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LobeSetting {
    /// Index of the lobe in the expression.
    pub(crate) lobe: usize,
    /// The parameter, without its lobe.
    pub(crate) name: String,
    /// The channel; `None` for all channels.
    pub(crate) channel: Option<String>,
    /// The constraint. A tie is to a parameter of the same lobe.
    pub(crate) setting: Setting,
}

/// Reads `key=value` of a lobe called `lobe_name`, whose parameters are called `names`. A colour is one constraint per channel.
///
/// # Errors
/// [`Error::Invalid`] for a value that is no constraint.
pub(crate) fn parse(
    lobe: usize,
    lobe_name: &str,
    names: &[&str],
    key: &str,
    value: &str,
) -> Result<Vec<LobeSetting>, Error> {
    let full = format!("{lobe_name}.{key}");
    let text = vec![format!("{full}={value}")];
    let alone = |setting| Ok(vec![(Selector::parse(&full)?, setting)]);
    let value = if value.starts_with(|c: char| c.is_ascii_alphabetic()) {
        value.to_ascii_lowercase()
    } else {
        value.to_owned()
    };
    let settings: Settings = match value.as_str() {
        "free" => alone(Setting::Free),
        "per-channel" => alone(Setting::PerChannel),
        "shared" => alone(Setting::Shared),
        other if names.contains(&other) => {
            alone(Setting::Tie(Selector::parse(&format!("{lobe_name}.{other}"))?))
        }
        range if range.contains("..") => ranges(&text),
        _ => values(OptionName::Fix, &text, Setting::Fix),
    }?;
    let mut channels = settings.iter().filter_map(|(selector, _)| selector.channel_if_any());
    if let Some(channel) = channels.find(|channel| !is_plain(channel)) {
        return Err(Error::invalid(
            short(&full),
            "a channel's name without brackets, commas, '+' and '='",
            excerpt(&channel),
        ));
    }
    let of_lobe = |(selector, setting): (Selector, Setting)| LobeSetting {
        lobe,
        name: parameter_of(key).to_owned(),
        channel: selector.channel_if_any(),
        setting,
    };
    Ok(settings.into_iter().map(of_lobe).collect())
}

/// The parameter in a key such as `f0`, `f0.r` or `f0[700]`.
pub(crate) fn parameter_of(key: &str) -> &str {
    key.split(['.', '[']).next().unwrap_or(key)
}

impl LobeSetting {
    /// Whether it can stand in an expression, apart from what a tie is to. Starts stay options, and so do values for an
    /// evaluation and channels whose names an expression cannot hold.
    pub(crate) fn can_be_written(&self) -> bool {
        !matches!(self.setting, Setting::Init(_) | Setting::Set(_))
            && self.channel.as_deref().is_none_or(is_plain)
    }

    /// The same as a constraint on a parameter of the lobe called `lobe_name`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a channel that cannot be part of a name.
    pub(crate) fn full(&self, lobe_name: &str) -> Result<(Selector, Setting), Error> {
        let channel = self.channel.as_deref().map(channel_suffix).unwrap_or_default();
        let setting = match &self.setting {
            Setting::Tie(other) => {
                Setting::Tie(Selector::parse(&format!("{lobe_name}.{}", other.parameter()))?)
            }
            setting => setting.clone(),
        };
        Ok((Selector::parse(&format!("{lobe_name}.{}{channel}", self.name))?, setting))
    }
}

/// Writes `m=0.2`.
impl fmt::Display for LobeSetting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let suffix = self.channel.as_deref().map(channel_suffix).unwrap_or_default();
        write!(f, "{}{suffix}=", self.name)?;
        match &self.setting {
            Setting::Fix(value) | Setting::Set(value) | Setting::Init(value) => write!(f, "{value}"),
            Setting::Bounds(low, high) => write!(f, "{low}..{high}"),
            Setting::Free => f.write_str("free"),
            Setting::PerChannel => f.write_str("per-channel"),
            Setting::Shared => f.write_str("shared"),
            Setting::Tie(other) => f.write_str(other.parameter()),
        }
    }
}

/// Whether a channel's name is read back from an expression as it is written there.
fn is_plain(channel: &str) -> bool {
    !channel.is_empty() && !channel.contains(|c: char| c.is_control() || "()[],+=".contains(c))
}

/// Whether two constraints on the same parameter contradict each other.
pub(crate) fn contradict(a: &Setting, b: &Setting) -> bool {
    use Setting::{Bounds, Fix, Free, Init, PerChannel, Set, Shared, Tie};
    match (a, b) {
        (Fix(_) | Free | Tie(_) | Bounds(..) | PerChannel | Shared | Init(_) | Set(_), _) if a == b => false,
        (Fix(x) | Set(x), Fix(y) | Set(y)) | (Init(x), Init(y)) => x != y,
        (Fix(_), Free | Tie(_) | Init(_)) | (Free | Tie(_) | Init(_), Fix(_)) => true,
        (Free, Tie(_)) | (Tie(_), Free | Tie(_)) => true,
        (Bounds(..), Bounds(..)) | (PerChannel, Shared) | (Shared, PerChannel) => true,
        _ => false,
    }
}
