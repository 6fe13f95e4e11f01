//! Numbers in text formats, checked.

use super::file::File;
use crate::error::{Error, Place, excerpt, short};

/// Parses a finite number.
///
/// # Errors
/// [`Error::Malformed`] for anything else, including NaN and infinity.
pub(super) fn finite(file: &File<'_>, place: Place, what: &str, token: &str) -> Result<f64, Error> {
    number(token).ok_or_else(|| no_number(file, place, what, token))
}

/// A finite number; `None` for anything else, including NaN and infinity.
pub(super) fn number(token: &str) -> Option<f64> {
    token.trim().parse().ok().filter(|value: &f64| value.is_finite())
}

/// A finite number, or NaN where the file says `nan`: there the value was not measured.
pub(super) fn value(token: &str) -> Option<f64> {
    token.trim().parse().ok().filter(|value: &f64| !value.is_infinite())
}

/// A value in a field of a table in which blank fields, too, stand for what was not measured.
///
/// # Errors
/// [`Error::Malformed`] for anything else, including infinity.
pub(super) fn value_or_blank(file: &File<'_>, place: Place, what: &str, field: &str) -> Result<f64, Error> {
    if field.trim().is_empty() {
        return Ok(f64::NAN);
    }
    value(field).ok_or_else(|| no_value(file, place, what, field))
}

/// The error for what is neither a finite number nor the mark of what was not measured.
pub(super) fn no_value(file: &File<'_>, place: Place, what: &str, token: &str) -> Error {
    let expected = format!("a finite number for {}, or nan where it was not measured", short(what));
    Error::malformed(file.path, place, expected, excerpt(token))
}

/// The error for what is no finite number.
pub(super) fn no_number(file: &File<'_>, place: Place, what: &str, token: &str) -> Error {
    Error::malformed(file.path, place, format!("a finite number for {}", short(what)), excerpt(token))
}

/// Tolerance in radians for directions at the horizon that were rounded when written.
pub(super) const HORIZON_TOLERANCE: f64 = 1e-5;

/// Checks that a polar angle in radians is at most a right angle, and returns it.
///
/// # Errors
/// [`Error::Malformed`] naming the angle in degrees.
pub(super) fn polar_angle(file: &File<'_>, place: Place, what: &str, theta: f64) -> Result<f64, Error> {
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
