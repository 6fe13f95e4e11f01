//! Readers, chosen by content.
//!
//! To add a format: copy the file of the one most like it, and add one line to [`REGISTRY`].

mod cornell;
pub mod genuine_merl;
pub mod merl;
mod table;

use super::{Measurement, Source};
use crate::error::{Error, Place, excerpt};
use crate::geometry::Pair;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::path::Path;

/// How sure a format is that a file is its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Confidence {
    /// Some other format's.
    No,
    /// It looks like an attempt at this format; reading it will say what is wrong.
    Maybe,
    /// This format's beyond doubt.
    Yes,
}

/// A file in memory.
#[derive(Clone, Copy, Debug)]
pub struct File<'a> {
    /// Its name as the user gave it.
    pub path: &'a Path,
    /// Its content.
    pub bytes: &'a [u8],
}

/// Which directions the cells of a half/difference table stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum BinPosition {
    /// The centre of the bin.
    #[default]
    Center,
    /// Its lower edge.
    Edge,
}

/// What a reader may be told.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReadOptions {
    /// Which directions the cells of a MERL table stand for.
    pub merl_bins: BinPosition,
}

/// A reader of one format.
pub struct Format {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// What it is, in one line.
    pub summary: &'static str,
    /// Whether a file is of this format.
    pub sniff: fn(&File<'_>) -> Confidence,
    /// Reads it. The caller fills in the source.
    pub read: fn(&File<'_>, &ReadOptions) -> Result<Measurement, Error>,
}

/// Every format, the most easily recognised first.
pub const REGISTRY: &[Format] = &[merl::FORMAT, cornell::FORMAT, table::FORMAT];

/// Reads a measurement in the format named `format`, or in the one that its content shows.
///
/// # Errors
/// [`Error::Io`], [`Error::Malformed`] or, for an unknown format name, [`Error::Usage`].
pub fn read(path: &Path, format: Option<&str>, options: &ReadOptions) -> Result<Measurement, Error> {
    let chosen = format.map(named).transpose()?;
    let bytes = std::fs::read(path).map_err(Error::read(path))?;
    let file = File { path, bytes: &bytes };
    let format = match chosen {
        Some(format) => format,
        None => recognise(&file)?,
    };
    let (read, sha256) = rayon::join(|| (format.read)(&file, options), || hexadecimal(&bytes));
    let mut measurement = read?;
    measurement.source = Source { path: path.to_owned(), format: format.name, sha256 };
    Ok(measurement)
}

/// The directions of a file: of a measurement in any format, or of a CSV that has the four angles alone.
///
/// # Errors
/// Like [`read`].
pub fn read_directions(path: &Path, options: &ReadOptions) -> Result<Vec<Pair>, Error> {
    let bytes = std::fs::read(path).map_err(Error::read(path))?;
    let file = File { path, bytes: &bytes };
    let format = recognise(&file)?;
    if format.name == table::FORMAT.name {
        return table::directions(&file);
    }
    let measurement = (format.read)(&file, options)?;
    let pairs = measurement.directions.iter().map(|g| Pair { wi: g.wi.into(), wo: g.wo.into() });
    Ok(pairs.collect())
}

/// The format of that name.
///
/// # Errors
/// [`Error::Usage`] if there is none.
pub fn named(name: &str) -> Result<&'static Format, Error> {
    REGISTRY.iter().find(|format| format.name == name).ok_or_else(|| {
        let names: Vec<&str> = REGISTRY.iter().map(|format| format.name).collect();
        Error::Usage(format!("--format: expected {}, found '{name}'", names.join("|")))
    })
}

fn recognise(file: &File<'_>) -> Result<&'static Format, Error> {
    if file.bytes.is_empty() {
        return Err(Error::malformed(file.path, Place::File, "a measurement", "an empty file"));
    }
    let best = REGISTRY
        .iter()
        .map(|format| ((format.sniff)(file), format))
        .filter(|(confidence, _)| *confidence > Confidence::No)
        // `max_by_key` keeps the last of equals; the registry puts the better first.
        .rev()
        .max_by_key(|(confidence, _)| *confidence);
    best.map(|(_, format)| format).ok_or_else(|| {
        let summaries: Vec<&str> = REGISTRY.iter().map(|format| format.summary).collect();
        let head = file.bytes.get(..file.bytes.len().min(4096)).unwrap_or_default();
        let found = if head.contains(&0) {
            "other binary data".to_owned()
        } else {
            let first = String::from_utf8_lossy(head);
            let content =
                first.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'));
            content
                .map_or_else(|| "nothing but blank lines and comments at its beginning".to_owned(), excerpt)
        };
        Error::malformed(file.path, Place::File, summaries.join(" or "), found)
    })
}

fn hexadecimal(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::with_capacity(64), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// The file as text, without a byte-order mark.
///
/// # Errors
/// [`Error::Malformed`] at the first byte that is not UTF-8.
fn text<'a>(file: &File<'a>) -> Result<&'a str, Error> {
    let text = std::str::from_utf8(file.bytes).map_err(|error| {
        let at = error.valid_up_to();
        let line = file.bytes.iter().take(at).filter(|b| **b == b'\n').count() + 1;
        Error::malformed(file.path, line_place(line), "text in UTF-8", format!("a stray byte at offset {at}"))
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// The place of a line counted from 1.
fn line_place(line: usize) -> Place {
    Place::Line(u64::try_from(line).unwrap_or(u64::MAX))
}

/// A finite number.
///
/// # Errors
/// [`Error::Malformed`] for anything else, NaN and infinity included.
fn finite(file: &File<'_>, place: Place, what: &str, token: &str) -> Result<f64, Error> {
    match token.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(Error::malformed(file.path, place, format!("a finite number for {what}"), excerpt(token))),
    }
}

/// Room for directions at the horizon that were rounded in writing, radians.
const HORIZON_TOLERANCE: f64 = 1e-5;

/// Checks that a polar angle in radians is at most a right angle.
///
/// # Errors
/// [`Error::Malformed`] naming the angle in degrees.
fn polar_angle(file: &File<'_>, place: Place, what: &str, theta: f64) -> Result<f64, Error> {
    if theta.abs() <= std::f64::consts::FRAC_PI_2 + HORIZON_TOLERANCE {
        return Ok(theta);
    }
    let degrees = theta.to_degrees();
    let found = if degrees.abs() < 1e6 {
        format!("{} degrees", (degrees * 1e6).round() / 1e6)
    } else {
        format!("{degrees:e} degrees")
    };
    Err(Error::malformed(file.path, place, format!("{what} within 90 degrees of the normal"), found))
}
