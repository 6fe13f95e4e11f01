//! What can go wrong, and for whom.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Where in a file something is wrong.
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

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(n) => write!(f, ":{n}"),
            Self::Byte(n) => write!(f, ": byte {n}"),
        }
    }
}

/// Everything that the library reports to its caller. Each message is one line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("{}: cannot {action}: {}", path.display(), plain(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// "read" or "write".
        action: &'static str,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// A file does not hold what its format says.
    #[error("{}{place}: expected {expected}, found {found}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// What the format asks for.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// The user asked for something that does not exist or does not fit.
    #[error("{0}")]
    Usage(String),
    /// A measurement has nothing left to fit.
    #[error("{}: no usable sample: {reason}", path.display())]
    NoSamples {
        /// The file.
        path: PathBuf,
        /// What became of the samples.
        reason: String,
    },
    /// The optimiser itself failed: a defect of this program.
    #[error("the optimiser failed: {0} (please report this)")]
    Optimiser(String),
}

impl Error {
    /// A malformed file.
    #[must_use]
    pub fn malformed(
        path: &Path,
        place: Place,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        Self::Malformed { path: path.to_owned(), place, expected: expected.into(), found: found.into() }
    }

    /// A measurement of which nothing is left; `dropped` counts the reasons.
    #[must_use]
    pub fn no_samples(path: &Path, dropped: &BTreeMap<&'static str, usize>) -> Self {
        let reasons: Vec<String> = dropped.iter().map(|(reason, n)| format!("{n} {reason}")).collect();
        let reason =
            if reasons.is_empty() { "the file has no rows of data".to_owned() } else { reasons.join(", ") };
        Self::NoSamples { path: path.to_owned(), reason }
    }

    /// A file that could not be read.
    pub fn read(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, action: "read", source }
    }

    /// A file that could not be written.
    pub fn write(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, action: "write", source }
    }
}

/// The operating system's words without the error number that Rust appends.
pub(crate) fn plain(error: &std::io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or(&text).to_owned()
}

/// A piece of a file as it may stand in a one-line message: short, without control characters, in quotes.
#[doc(hidden)]
#[must_use]
pub fn excerpt(text: &str) -> String {
    format!("'{}'", short(text))
}

/// Like [`excerpt`], without the quotes.
#[doc(hidden)]
#[must_use]
pub fn short(text: &str) -> String {
    /// Characters that are kept.
    const LONGEST: usize = 60;
    let clean: String = text.chars().take(LONGEST).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.chars().nth(LONGEST).is_some() { format!("{clean}...") } else { clean }
}

/// Names as a one-line message may list them: each as [`short`] has it, and the number of those that would make the list too long.
#[doc(hidden)]
#[must_use]
pub fn listed<Name: AsRef<str>>(names: &[Name]) -> String {
    /// Bytes after which no further name is begun: all models with their parameters' names fit.
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
