//! Options about parameters: `P=V`, `P=LO..HI`, `P=Q`, `P`.

use brdfit::Error;
use brdfit::fit::{Selector, Setting, Settings};
use clap::Args;

/// What the user wants of parameters.
#[derive(Args)]
pub struct SettingArguments {
    /// Keep a parameter at a value
    #[arg(long, value_name = "P=V")]
    fix: Vec<String>,
    /// Start a parameter from a value
    #[arg(long, value_name = "P=V")]
    init: Vec<String>,
    /// Keep a parameter between two values
    #[arg(long, value_name = "P=LO..HI")]
    bounds: Vec<String>,
    /// Fit a parameter that is fixed by default
    #[arg(long, value_name = "P")]
    free: Vec<String>,
    /// Make a parameter equal another
    #[arg(long, value_name = "P=Q")]
    tie: Vec<String>,
    /// Give a parameter one value per channel
    #[arg(long, value_name = "P")]
    per_channel: Vec<String>,
    /// Give a parameter one value for all channels
    #[arg(long, value_name = "P")]
    shared: Vec<String>,
}

impl SettingArguments {
    /// The settings, kind by kind.
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
        settings.extend(values("--init", &self.init, Setting::Init)?);
        settings.extend(values("--fix", &self.fix, Setting::Fix)?);
        for text in &self.tie {
            let (name, other) = split("--tie", text, "P=Q")?;
            settings.push((Selector::parse(name)?, Setting::Tie(Selector::parse(other)?)));
        }
        Ok(settings)
    }

    /// The options as given, for the report.
    pub fn as_given(&self) -> Vec<String> {
        let kinds = [
            ("--fix", &self.fix),
            ("--init", &self.init),
            ("--bounds", &self.bounds),
            ("--free", &self.free),
            ("--tie", &self.tie),
            ("--per-channel", &self.per_channel),
            ("--shared", &self.shared),
        ];
        kinds
            .iter()
            .flat_map(|(kind, texts)| texts.iter().map(move |text| format!("{kind} {text}")))
            .collect()
    }
}

/// Settings of the form `P=LO..HI`.
pub fn ranges(texts: &[String]) -> Result<Settings, Error> {
    const FORM: &str = "P=LO..HI";
    let range = |text: &String| {
        let (name, range) = split("--bounds", text, FORM)?;
        let (low, high) = range.split_once("..").ok_or_else(|| wrong("--bounds", text, FORM))?;
        let bounds =
            Setting::Bounds(number("--bounds", text, low, FORM)?, number("--bounds", text, high, FORM)?);
        Ok((Selector::parse(name)?, bounds))
    };
    texts.iter().map(range).collect()
}

/// Settings of the form `P=V`.
pub fn values(option: &str, texts: &[String], setting: impl Fn(f64) -> Setting) -> Result<Settings, Error> {
    texts
        .iter()
        .map(|text| {
            let (name, value) = split(option, text, "P=V")?;
            Ok((Selector::parse(name)?, setting(number(option, text, value, "P=V")?)))
        })
        .collect()
}

fn wrong(option: &str, text: &str, form: &str) -> Error {
    Error::Usage(format!("{option}: expected {form}, found '{text}'"))
}

fn split<'a>(option: &str, text: &'a str, form: &str) -> Result<(&'a str, &'a str), Error> {
    text.split_once('=').ok_or_else(|| wrong(option, text, form))
}

fn number(option: &str, text: &str, value: &str, form: &str) -> Result<f64, Error> {
    let number = value.trim().parse().ok().filter(|v: &f64| v.is_finite());
    number.ok_or_else(|| wrong(option, text, &format!("{form} with numbers")))
}
