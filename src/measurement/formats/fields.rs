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
