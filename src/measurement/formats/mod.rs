//! The readers of all formats, chosen by content.
//!
//! To add a format, copy the file of the most similar one, and add its `mod` and a line to [`REGISTRY`].

mod alta;
mod cornell;
pub mod csv;
#[cfg(feature = "images")]
mod exr_slice;
mod fields;
mod file;
mod format;
pub mod merl;
mod mwir;
mod named_columns;
mod nist;
mod npz;
mod resampling;
mod rgl;
mod rows;
mod specular;
mod ssdd;
mod tabulated;
mod utia;
mod writing;
mod zemax;

pub use file::File;
pub use format::{BinPosition, Confidence, Format, ReadDirections, ReadOptions};
pub use resampling::{Resampling, resampling};
pub use writing::{AngleGrid, Reflectance, Subject, Write, Written, everywhere};

use super::reading::OF_TABLES;
use super::repeated_values::doubts as repeated_values;
use super::{Measurement, Source};
use crate::error::{Error, NameKind, OptionName, Place, excerpt};
use crate::geometry::Pair;
use std::path::Path;

/// Every format, the most easily recognised first.
pub const REGISTRY: &[Format] = &[
    merl::FORMAT,
    rgl::FORMAT,
    zemax::FORMAT,
    ssdd::FORMAT,
    #[cfg(feature = "images")]
    exr_slice::FORMAT,
    npz::FORMAT,
    alta::FORMAT,
    cornell::FORMAT,
    nist::FORMAT,
    mwir::FORMAT,
    csv::FORMAT,
    utia::FORMAT,
];

/// Reads a measurement in the format called `format`, or in the one recognised by its content.
///
/// # Errors
/// [`Error::Io`], [`Error::Malformed`] or, for an unknown format name, [`Error::UnknownName`].
pub fn read(path: &Path, format: Option<&str>, options: &ReadOptions) -> Result<Measurement, Error> {
    // A wrong name is reported before the file is opened.
    format.map(named).transpose()?;
    read_file(File::open(path)?, format, options)
}

/// Reads a measurement from an open file or from memory, like [`read`].
///
/// # Errors
/// The errors of [`read`].
pub fn read_file(
    mut file: File<'_>,
    format: Option<&str>,
    options: &ReadOptions,
) -> Result<Measurement, Error> {
    let format = match format {
        Some(name) => named(name)?,
        None => recognise(&file)?,
    };
    if let Some(material) = options.material.as_ref().filter(|_| !format.several_materials) {
        let several: Vec<&str> = REGISTRY.iter().filter(|f| f.several_materials).map(|f| f.name).collect();
        let expected = format!(
            "no such option for {}, whose files hold one material; for {}",
            format.name,
            several.join(", ")
        );
        return Err(Error::invalid("--material", expected, excerpt(material)));
    }
    check_own_options(format, options)?;
    let mut measurement = (format.read)(&mut file, options)?;
    options.conventions.apply(&mut measurement, format.knows_angles)?;
    measurement.leave_out_empty();
    measurement.doubts.extend(repeated_values(&measurement));
    measurement.source = Source { path: file.path.to_owned(), format: format.name, sha256: file.sha256() };
    Ok(measurement)
}

/// Fails for an option that other formats have and this one does not.
fn check_own_options(format: &Format, options: &ReadOptions) -> Result<(), Error> {
    let wrong = |option: OptionName, has: fn(&Format, OptionName) -> bool| {
        let others: Vec<&str> = REGISTRY.iter().filter(|f| has(f, option)).map(|f| f.name).collect();
        let expected = format!("no such option for {}; it is one of {}", format.name, others.join(", "));
        Err(Error::invalid(option, expected, "one"))
    };
    let given = options.conventions.given().iter().map(|(option, _)| *option);
    if let Some(option) = given.clone().find(|o| OF_TABLES.contains(o) && !format.own_options.contains(o)) {
        return wrong(option, |format, option| format.own_options.contains(&option));
    }
    if given.clone().any(|option| option == OptionName::Angles) && !format.knows_angles {
        return wrong(OptionName::Angles, |format, _| format.knows_angles);
    }
    Ok(())
}

/// The directions of a measurement in any format, or of a CSV file that contains only the four angles.
///
/// # Errors
/// The errors of [`read`].
pub fn read_directions(path: &Path, options: &ReadOptions) -> Result<Vec<Pair>, Error> {
    directions_of(File::open(path)?, options)
}

/// The directions of an open file or of one in memory, like [`read_directions`].
///
/// # Errors
/// The errors of [`read`].
pub fn directions_of(mut file: File<'_>, options: &ReadOptions) -> Result<Vec<Pair>, Error> {
    let format = recognise(&file)?;
    if let Some(directions) = format.directions {
        return directions(&mut file, options);
    }
    let measurement = read_file(file, Some(format.name), options)?;
    let pairs = measurement.directions.iter().map(|g| Pair { wi: g.wi.into(), wo: g.wo.into() });
    Ok(pairs.collect())
}

/// The format called `name`.
///
/// # Errors
/// [`Error::UnknownName`] if there is no such format.
pub fn named(name: &str) -> Result<&'static Format, Error> {
    REGISTRY.iter().find(|format| format.name == name).ok_or_else(|| {
        let names: Vec<&str> = REGISTRY.iter().map(|format| format.name).collect();
        Error::unknown(OptionName::Format, NameKind::Format, &names, name)
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
        // `max_by_key` returns the last of several equal elements, and the registry lists the better format first.
        .rev()
        .max_by_key(|(confidence, _)| *confidence);
    best.map(|(_, format)| format).ok_or_else(|| {
        let names: Vec<&str> = REGISTRY.iter().map(|format| format.name).collect();
        let expected = format!("a measurement in one of the formats {}", names.join(", "));
        let head = file.head(4096);
        let found = if file::is_utf16(head) {
            "text in UTF-16".to_owned()
        } else if head.contains(&0) {
            "other binary data".to_owned()
        } else {
            let nothing = || "nothing but blank lines and comments at its beginning".to_owned();
            file.first_line(4096).map_or_else(nothing, |line| excerpt(&line))
        };
        Error::malformed(file.path, Place::File, expected, found)
    })
}
