//! Readers, chosen by content.
//!
//! To add a format: copy the file of the one most like it, and add one line to [`REGISTRY`].

mod cornell;
mod file;
pub mod merl;
mod table;

pub use file::File;

use super::{Measurement, Source};
use crate::error::{Error, Place, excerpt, short};
use crate::geometry::Pair;
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
    pub read: fn(&mut File<'_>, &ReadOptions) -> Result<Measurement, Error>,
}

/// Every format, the most easily recognised first.
pub const REGISTRY: &[Format] = &[merl::FORMAT, cornell::FORMAT, table::FORMAT];

/// Reads a measurement in the format named `format`, or in the one that its content shows.
///
/// # Errors
/// [`Error::Io`], [`Error::Malformed`] or, for an unknown format name, [`Error::Usage`].
pub fn read(path: &Path, format: Option<&str>, options: &ReadOptions) -> Result<Measurement, Error> {
    // A wrong name is told before the file is looked at.
    format.map(named).transpose()?;
    read_file(File::open(path)?, format, options)
}

/// Reads a measurement from a file that is open, or from memory: like [`read`].
///
/// # Errors
/// Like [`read`].
pub fn read_file(
    mut file: File<'_>,
    format: Option<&str>,
    options: &ReadOptions,
) -> Result<Measurement, Error> {
    let format = match format {
        Some(name) => named(name)?,
        None => recognise(&file)?,
    };
    let mut measurement = (format.read)(&mut file, options)?;
    measurement.source = Source { path: file.path.to_owned(), format: format.name, sha256: file.sha256() };
    Ok(measurement)
}

/// The directions of a file: of a measurement in any format, or of a CSV that has the four angles alone.
///
/// # Errors
/// Like [`read`].
pub fn read_directions(path: &Path, options: &ReadOptions) -> Result<Vec<Pair>, Error> {
    directions_of(File::open(path)?, options)
}

/// The directions of a file that is open, or of one in memory: like [`read_directions`].
///
/// # Errors
/// Like [`read`].
pub fn directions_of(mut file: File<'_>, options: &ReadOptions) -> Result<Vec<Pair>, Error> {
    let format = recognise(&file)?;
    if format.name == table::FORMAT.name {
        return table::directions(&mut file);
    }
    let measurement = (format.read)(&mut file, options)?;
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
        Error::Usage(format!("--format: expected {}, found {}", names.join("|"), excerpt(name)))
    })
}

fn recognise(file: &File<'_>) -> Result<&'static Format, Error> {
    if file.head(1).is_empty() {
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
        let head = file.head(4096);
        let found = if file::is_utf16(head) {
            "text in UTF-16".to_owned()
        } else if head.contains(&0) {
            "other binary data".to_owned()
        } else {
            let first = String::from_utf8_lossy(head);
            let first = first.trim_start_matches('\u{feff}');
            let content =
                first.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'));
            content
                .map_or_else(|| "nothing but blank lines and comments at its beginning".to_owned(), excerpt)
        };
        Error::malformed(file.path, Place::File, summaries.join(" or "), found)
    })
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
        _ => {
            let expected = format!("a finite number for {}", short(what));
            Err(Error::malformed(file.path, place, expected, excerpt(token)))
        }
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
