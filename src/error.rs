//! The errors that the library returns, and their messages.

use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

/// The place of an error in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line, counted from 1.
    Line(u64),
    /// A byte, counted from 0.
    Byte(u64),
}

impl Place {
    /// The place of a line counted from 1.
    #[must_use]
    pub fn of_line(line: usize) -> Self {
        Self::Line(u64::try_from(line).unwrap_or(u64::MAX))
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(n) => write!(f, ":{n}"),
            Self::Byte(n) => write!(f, ": byte {n}"),
        }
    }
}

/// An option of a fit, of its input or of its output.
///
/// Its name is that of the builder's method and of the field in a report; the command line writes it with two dashes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "docs/use/fitting.md describes the options of a fit, and the help those of the program"
)]
pub enum OptionName {
    Angles,
    Azimuth,
    Bounds,
    Columns,
    Decimal,
    Fix,
    Format,
    Free,
    HoldOut,
    Init,
    LeaveOut,
    LightDirection,
    Loss,
    LossScale,
    MaxTheta,
    MeanOfSAndP,
    Metric,
    Missing,
    PerChannel,
    Quantity,
    Scale,
    /// The error of the measurement's scale.
    ScaleError,
    Separator,
    Set,
    Shared,
    SigmaScale,
    Svg,
    TargetError,
    Thickness,
    Tie,
    Timeout,
    Tolerance,
    Uncertainty,
    Weights,
}

impl OptionName {
    /// Its name, such as `hold-out`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Angles => "angles",
            Self::Azimuth => "azimuth",
            Self::Bounds => "bounds",
            Self::Columns => "columns",
            Self::Decimal => "decimal",
            Self::Fix => "fix",
            Self::Format => "format",
            Self::Free => "free",
            Self::HoldOut => "hold-out",
            Self::Init => "init",
            Self::LeaveOut => "leave-out",
            Self::LightDirection => "light-direction",
            Self::Loss => "loss",
            Self::LossScale => "loss-scale",
            Self::MaxTheta => "max-theta",
            Self::MeanOfSAndP => "mean-of-s-and-p",
            Self::Metric => "metric",
            Self::Missing => "missing",
            Self::PerChannel => "per-channel",
            Self::Quantity => "quantity",
            Self::Scale => "scale",
            Self::ScaleError => "scale-error",
            Self::Separator => "separator",
            Self::Set => "set",
            Self::Shared => "shared",
            Self::SigmaScale => "sigma-scale",
            Self::Svg => "svg",
            Self::TargetError => "target-error",
            Self::Thickness => "thickness",
            Self::Tie => "tie",
            Self::Timeout => "timeout",
            Self::Tolerance => "tolerance",
            Self::Uncertainty => "uncertainty",
            Self::Weights => "weights",
        }
    }
}

impl fmt::Display for OptionName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Serialize for OptionName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// An option that helps, and a value for it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Suggestion {
    /// The option.
    pub option: OptionName,
    /// The value to give it, such as `cook-torrance.m=LO..HI`; empty if the choice is the user's.
    pub value: String,
}

/// The subject of an error.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Subject {
    /// An option.
    Option(OptionName),
    /// An option together with what it applies to, such as the bounds of a parameter.
    OptionOf(OptionName, String),
    /// Anything else, by its name: a model, a parameter, an image.
    Named(String),
}

impl From<OptionName> for Subject {
    fn from(option: OptionName) -> Self {
        Self::Option(option)
    }
}

impl From<&str> for Subject {
    fn from(name: &str) -> Self {
        Self::Named(name.to_owned())
    }
}

impl From<String> for Subject {
    fn from(name: String) -> Self {
        Self::Named(name)
    }
}

/// What kind of name a caller gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NameKind {
    /// A model of the registry.
    Model,
    /// An option of a model, such as `d`.
    ModelOption,
    /// An option of a model, or one of its parameters.
    OptionOrParameter,
    /// A value of this option of a model.
    ValueOf(&'static str),
    /// A lobe of the expression.
    Lobe,
    /// A parameter of the expression.
    Parameter,
    /// A channel of the measurement.
    Channel,
    /// A file format.
    Format,
    /// A material in a file of several.
    Material,
    /// A renderer to export to.
    Target,
    /// A language that models are written in.
    Language,
    /// The primaries of a colour.
    Primaries,
}

impl fmt::Display for NameKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Model => "a model",
            Self::ModelOption => "an option",
            Self::OptionOrParameter => "an option or a parameter",
            Self::ValueOf(option) => option,
            Self::Lobe => "a lobe",
            Self::Primaries => "primaries",
            Self::Parameter => "a parameter",
            Self::Channel => "a channel",
            Self::Format => "a format",
            Self::Material => "a material",
            Self::Target => "a target",
            Self::Language => "a language",
        })
    }
}

/// Everything that the library reports to its caller. Each message is one line.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    Io {
        /// The file.
        path: PathBuf,
        /// "read" or "write".
        action: &'static str,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// A file does not contain what its format requires.
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        place: Place,
        /// What the format requires.
        expected: String,
        /// What the file contains there.
        found: String,
        /// An option that may help, and a value for it; an empty one if it has none. `None` if no option does.
        hint: Option<(OptionName, String)>,
    },
    /// A measurement has nothing left to fit.
    NoSamples {
        /// The file.
        path: PathBuf,
        /// Why the samples were left out.
        reason: String,
    },
    /// Something that the caller gave has the wrong form or size, or lies outside its range.
    Invalid {
        /// What was given.
        subject: Subject,
        /// What is allowed.
        expected: String,
        /// What was given.
        found: String,
    },
    /// The caller named something that does not exist.
    UnknownName {
        /// Where the name was given.
        subject: Subject,
        /// What the name is one of.
        kind: NameKind,
        /// The names that exist.
        known: Vec<String>,
        /// The name that was given.
        name: String,
    },
    /// The caller gave a parameter's name that several parameters share.
    AmbiguousParameter {
        /// The name that was given.
        name: String,
        /// Full names of the parameters that it could be.
        candidates: Vec<String>,
    },
    /// The caller named a channel of a parameter that all channels share.
    SharedParameter {
        /// The name that was given.
        selector: String,
        /// The parameter's own name.
        parameter: String,
    },
    /// An option needs more than the measurement has.
    Unmet {
        /// The file of the measurement.
        path: PathBuf,
        /// The option.
        option: OptionName,
        /// What it needs.
        expected: String,
        /// What the measurement has.
        found: String,
    },
    /// A result cannot be encoded in a file format.
    Encoding {
        /// The format.
        format: &'static str,
        /// The reason given by the encoder.
        reason: String,
    },
    /// The optimiser itself failed, which is a bug in this program.
    Optimiser(String),
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            _ => None,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message(|option| option.name().to_owned()))
    }
}

impl Error {
    /// The message, with options written as `name` writes them: a command line writes `--hold-out`, for example.
    #[must_use]
    pub fn message(&self, name: impl Fn(OptionName) -> String) -> String {
        let called = |subject: &Subject| match subject {
            Subject::Option(option) => name(*option),
            Subject::OptionOf(option, of) => format!("{} {of}", name(*option)),
            Subject::Named(text) => text.clone(),
        };
        match self {
            Self::Io { path, action, source } => {
                format!("{}: cannot {action}: {}", path.display(), plain(source))
            }
            Self::Malformed { path, place, expected, found, hint } => {
                let hint = hint.as_ref().map_or_else(String::new, |(option, value)| {
                    format!(" ({} {value})", name(*option)).replace(" )", ")")
                });
                format!("{}{place}: expected {expected}, found {found}{hint}", path.display())
            }
            Self::NoSamples { path, reason } => format!("{}: no usable sample: {reason}", path.display()),
            Self::Invalid { subject, expected, found } => {
                format!("{}: expected {expected}, found {found}", called(subject))
            }
            Self::UnknownName { subject, kind, known, name } => {
                /// With more names than this, only the nearest are listed.
                const MANY: usize = 24;
                let subject = called(subject);
                let hint =
                    nearest(name, known).map_or_else(String::new, |near| format!("; did you mean '{near}'?"));
                let found = excerpt(name);
                if known.len() <= MANY {
                    format!("{subject}: expected {kind} among {}, found {found}{hint}", listed(known))
                } else if hint.is_empty() {
                    let near = listed(&most_alike(name, known));
                    format!(
                        "{subject}: expected {kind}, found {found}; the nearest of {} are {near}",
                        known.len()
                    )
                } else {
                    format!("{subject}: expected {kind}, found {found}{hint}")
                }
            }
            Self::AmbiguousParameter { name, candidates } => {
                format!("{name}: several parameters have this name: write one of {}", listed(candidates))
            }
            Self::SharedParameter { selector, parameter } => format!(
                "{selector}: '{parameter}' is shared by all channels: name it without a channel, or give it one value \
                 per channel ({} {parameter})",
                name(OptionName::PerChannel)
            ),
            Self::Unmet { path, option, expected, found } => {
                format!("{}: {}: expected {expected}, found {found}", path.display(), name(*option))
            }
            Self::Encoding { format, reason } => format!("cannot be written as {format}: {reason}"),
            Self::Optimiser(reason) => format!("the optimiser failed: {reason} (please report this)"),
        }
    }

    /// An error for a value that is not allowed.
    pub fn invalid(
        subject: impl Into<Subject>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        Self::Invalid { subject: subject.into(), expected: expected.into(), found: found.into() }
    }

    /// An error for a name that does not exist.
    pub fn unknown<Name: AsRef<str>>(
        subject: impl Into<Subject>,
        kind: NameKind,
        known: &[Name],
        name: impl Into<String>,
    ) -> Self {
        let known = known.iter().map(|name| name.as_ref().to_owned()).collect();
        Self::UnknownName { subject: subject.into(), kind, known, name: name.into() }
    }

    /// An error for a malformed file.
    #[must_use]
    pub fn malformed(
        path: &Path,
        place: Place,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        let (path, expected, found) = (path.to_owned(), expected.into(), found.into());
        Self::Malformed { path, place, expected, found, hint: None }
    }

    /// The same error with an option that may help, if it is about a malformed file.
    #[must_use]
    pub fn with_hint(self, option: OptionName, value: impl Into<String>) -> Self {
        match self {
            Self::Malformed { path, place, expected, found, .. } => {
                Self::Malformed { path, place, expected, found, hint: Some((option, value.into())) }
            }
            other => other,
        }
    }

    /// An error for a measurement with no samples left; `dropped` counts them by reason.
    #[must_use]
    pub fn no_samples(path: &Path, dropped: &BTreeMap<&'static str, usize>) -> Self {
        let reasons: Vec<String> = dropped.iter().map(|(reason, n)| format!("{n} {reason}")).collect();
        let reason =
            if reasons.is_empty() { "the file has no rows of data".to_owned() } else { reasons.join(", ") };
        Self::NoSamples { path: path.to_owned(), reason }
    }

    /// An error for a file that could not be read.
    pub fn read(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, action: "read", source }
    }

    /// An error for a file that could not be written.
    pub fn write(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, action: "write", source }
    }
}

/// The operating system's message without the error number that Rust appends.
pub(crate) fn plain(error: &std::io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or(&text).to_owned()
}

/// A number for people: with so many decimals, or as a power of ten where that would be long. A file may hold anything.
#[must_use]
pub fn rounded(value: f64, decimals: usize) -> String {
    /// From here on, digits before the point say nothing.
    const LONG: f64 = 1e7;
    if value.abs() < LONG { format!("{value:.decimals$}") } else { format!("{value:.3e}") }
}

/// A piece of a file's content for a one-line message: shortened, without control characters, in quotes.
#[doc(hidden)]
#[must_use]
pub fn excerpt(text: &str) -> String {
    format!("'{}'", short(text))
}

/// Like [`excerpt`], without the quotes.
#[doc(hidden)]
#[must_use]
pub fn short(text: &str) -> String {
    /// Largest number of characters that are kept.
    const LONGEST: usize = 60;
    let visible = |c: char| match c {
        '\t' => "\\t".to_owned(),
        c if c.is_control() => " ".to_owned(),
        c => c.to_string(),
    };
    let clean: String = text.chars().take(LONGEST).map(visible).collect();
    if text.chars().nth(LONGEST).is_some() { format!("{clean}...") } else { clean }
}

/// A list of names for a one-line message: each shortened by [`short`], then the number of names that were left out to
/// limit the length.
#[doc(hidden)]
#[must_use]
pub fn listed<Name: AsRef<str>>(names: &[Name]) -> String {
    /// Number of bytes after which no further name is begun: enough for all models with their parameters' names.
    const LONGEST: usize = 1000;
    let mut list = String::new();
    for (index, name) in names.iter().enumerate() {
        if list.len() > LONGEST {
            return format!("{list} and {} others", names.len() - index);
        }
        if index > 0 {
            list.push_str(", ");
        }
        list.push_str(&short(name.as_ref()));
    }
    list
}

/// How alike a mistyped name and a known one are, 0 to 1. A parameter may be called by its full name or by the last part of it.
fn likeness(name: &str, candidate: &str) -> f64 {
    // A long text is not a typing mistake, and comparing it would be slow.
    let name: String = name.chars().take(60).collect();
    let name = name.to_lowercase();
    let last = candidate.rsplit('.').next().unwrap_or(candidate);
    strsim::jaro_winkler(&name, candidate).max(strsim::jaro_winkler(&name, last))
}

/// The few known names that are most like a mistyped one, the most alike first.
fn most_alike<'a>(name: &str, known: &'a [String]) -> Vec<&'a str> {
    /// Number of names.
    const FEW: usize = 4;
    let mut names: Vec<(f64, &str)> =
        known.iter().map(|candidate| (likeness(name, candidate), candidate.as_str())).collect();
    names.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    names.into_iter().take(FEW).map(|(_, name)| name).collect()
}

/// The known name that a mistyped one most likely stands for; `None` if none resembles it.
fn nearest<'a>(name: &str, known: &'a [String]) -> Option<&'a str> {
    /// The least similarity at which a name is suggested: two exchanged letters in a short word qualify, another word
    /// does not.
    const ALIKE: f64 = 0.8;
    let best = known.iter().map(|candidate| (likeness(name, candidate), candidate));
    let best = best.max_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(likeness, _)| *likeness > ALIKE).map(|(_, candidate)| candidate.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistyped_name_is_answered_with_the_one_meant() {
        let known = ["lambert", "cook-torrance", "openpbr.specular_roughness", "openpbr.base_color"]
            .map(str::to_owned);
        for (name, meant) in [
            ("lambrt", Some("lambert")),
            ("Cook-Torance", Some("cook-torrance")),
            ("spcular_roughness", Some("openpbr.specular_roughness")),
            ("ward", None),
            ("", None),
        ] {
            assert_eq!(nearest(name, &known), meant, "{name}");
        }
    }

    #[test]
    fn options_are_called_as_whoever_shows_the_message_calls_them() {
        let error = Error::invalid(OptionName::HoldOut, "a fraction above 0 and below 1", "2");
        assert_eq!(error.to_string(), "hold-out: expected a fraction above 0 and below 1, found 2");
        let typed = error.message(|option| format!("--{option}"));
        assert_eq!(typed, "--hold-out: expected a fraction above 0 and below 1, found 2");
        let error = Error::invalid(Subject::OptionOf(OptionName::Bounds, "m".to_owned()), "1..2", "2..1");
        assert_eq!(error.message(|option| format!("--{option}")), "--bounds m: expected 1..2, found 2..1");
    }
}
