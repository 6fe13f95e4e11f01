//! Constraints on parameters as text: `P=V`, `P=LO..HI`, `P=Q`, `P`.

use super::selector::{Selector, Setting, Settings};
use crate::error::{Error, OptionName, excerpt};
use crate::model::parts::fresnel::{Known, NAMES, f0_of_eta, known_f0};

/// Constraints on parameters, as texts in the form used on the command line, by kind.
#[derive(Clone, Debug, Default)]
pub struct SettingTexts {
    /// `P=V`: keep a parameter at a value.
    pub fix: Vec<String>,
    /// `P=V`: start a parameter from a value.
    pub init: Vec<String>,
    /// `P=LO..HI`: keep a parameter between two values.
    pub bounds: Vec<String>,
    /// `P`: fit a parameter that is fixed by default.
    pub free: Vec<String>,
    /// `P=Q`: keep a parameter equal to another.
    pub tie: Vec<String>,
    /// `P`: give a parameter one value per channel.
    pub per_channel: Vec<String>,
    /// `P`: give a parameter one value for all channels.
    pub shared: Vec<String>,
}

impl SettingTexts {
    /// Parses the texts, kind by kind.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a text that does not have the form of its kind.
    pub fn settings(&self) -> Result<Settings, Error> {
        let mut settings = Vec::new();
        for text in &self.per_channel {
            settings.push((Selector::parse(text)?, Setting::PerChannel));
        }
        for text in &self.shared {
            settings.push((Selector::parse(text)?, Setting::Shared));
        }
        // Freeing comes before fixing, so that one channel of a freed parameter can be held.
        for text in &self.free {
            settings.push((Selector::parse(text)?, Setting::Free));
        }
        settings.extend(ranges(&self.bounds)?);
        settings.extend(values(OptionName::Init, &self.init, Setting::Init)?);
        settings.extend(values(OptionName::Fix, &self.fix, Setting::Fix)?);
        for text in &self.tie {
            let (name, other) = split(OptionName::Tie, text, "P=Q")?;
            settings.push((Selector::parse(name)?, Setting::Tie(Selector::parse(other)?)));
        }
        Ok(settings)
    }

    /// The texts as given, each with the option that it belongs to.
    #[must_use]
    pub fn as_given(&self) -> Vec<(OptionName, &str)> {
        let kinds = [
            (OptionName::Fix, &self.fix),
            (OptionName::Init, &self.init),
            (OptionName::Bounds, &self.bounds),
            (OptionName::Free, &self.free),
            (OptionName::Tie, &self.tie),
            (OptionName::PerChannel, &self.per_channel),
            (OptionName::Shared, &self.shared),
        ];
        kinds.iter().flat_map(|(option, texts)| texts.iter().map(|text| (*option, text.as_str()))).collect()
    }
}

/// Parses settings of the form `P=LO..HI`.
///
/// # Errors
/// [`Error::Invalid`] for a text that does not have this form.
pub fn ranges(texts: &[String]) -> Result<Settings, Error> {
    const FORM: &str = "P=LO..HI";
    let range = |text: &String| {
        let (name, range) = split(OptionName::Bounds, text, FORM)?;
        let (low, high) = range.split_once("..").ok_or_else(|| wrong(OptionName::Bounds, text, FORM))?;
        let bounds = Setting::Bounds(
            number(OptionName::Bounds, text, low, FORM)?,
            number(OptionName::Bounds, text, high, FORM)?,
        );
        Ok((Selector::parse(name)?, bounds))
    };
    texts.iter().map(range).collect()
}

/// Parses settings of the form `P=V`.
///
/// For f0 the value may also be a material's name or `eta:` and an index of refraction. `option` is the option that
/// the texts were given to, for error messages.
///
/// # Errors
/// [`Error::Invalid`] for a text that does not have this form.
pub fn values(
    option: OptionName,
    texts: &[String],
    setting: impl Fn(f64) -> Setting,
) -> Result<Settings, Error> {
    let mut settings = Vec::new();
    for text in texts {
        let (name, value) = split(option, text, "P=V")?;
        let selector = Selector::parse(name)?;
        match normal_incidence(option, text, &selector, value.trim())? {
            None => settings.push((selector, setting(number(option, text, value, "P=V")?))),
            Some(Known::Grey(f0)) => settings.push((selector, setting(f0))),
            Some(Known::Rgb(f0)) => {
                let value_in =
                    |channel: &str| RGB.iter().zip(f0).find(|(c, _)| **c == channel).map(|(_, f0)| f0);
                if let Some(channel) = selector.channel_if_any() {
                    let f0 = value_in(&channel).ok_or_else(|| only_rgb(option, text))?;
                    settings.push((selector, setting(f0)));
                } else {
                    for (channel, f0) in RGB.iter().zip(f0) {
                        settings.push((selector.of_channel(channel), setting(f0)));
                    }
                }
            }
        }
    }
    Ok(settings)
}

/// The channels in which the colour of a metal is known.
const RGB: [&str; 3] = ["r", "g", "b"];

fn only_rgb(option: OptionName, text: &str) -> Error {
    Error::invalid(option, "channels r, g and b for the colour of a metal", excerpt(text))
}

/// f0 given by a material's name or by `eta:` and an index; `None` if the text gives it in neither way.
fn normal_incidence(
    option: OptionName,
    text: &str,
    selector: &Selector,
    value: &str,
) -> Result<Option<Known>, Error> {
    let is_name = value.starts_with(|c: char| c.is_ascii_alphabetic());
    // inf and nan parse as numbers, although they are not acceptable values.
    if selector.parameter() != "f0" || !is_name || value.parse::<f64>().is_ok() {
        return Ok(None);
    }
    let form = || format!("f0 as a number, eta:INDEX, or one of {}", NAMES.join(", "));
    let known = match value.strip_prefix("eta:") {
        Some(index) => {
            index.parse().ok().filter(|eta: &f64| *eta >= 1.0).map(|eta| Known::Grey(f0_of_eta(eta)))
        }
        None => known_f0(&value.to_ascii_lowercase()),
    };
    known.map(Some).ok_or_else(|| wrong(option, text, &form()))
}

fn wrong(option: OptionName, text: &str, form: &str) -> Error {
    Error::invalid(option, form, excerpt(text))
}

fn split<'a>(option: OptionName, text: &'a str, form: &str) -> Result<(&'a str, &'a str), Error> {
    text.split_once('=').ok_or_else(|| wrong(option, text, form))
}

fn number(option: OptionName, text: &str, value: &str, form: &str) -> Result<f64, Error> {
    let number = value.trim().parse().ok().filter(|v: &f64| v.is_finite());
    number.ok_or_else(|| wrong(option, text, &format!("{form} with numbers")))
}
