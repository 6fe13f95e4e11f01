//! The angles of a pair of directions, as reports give them.

use crate::geometry::{Pair, spherical_degrees};

/// Angles of a pair of directions, degrees: theta_i, phi_i, theta_o, phi_o.
pub type Angles = [f64; 4];

/// The angles of a pair, degrees.
pub(super) fn angles(pair: &Pair) -> Angles {
    let (theta_i, phi_i) = spherical_degrees(pair.wi);
    let (theta_o, phi_o) = spherical_degrees(pair.wo);
    [theta_i, phi_i, theta_o, phi_o]
}

/// Angles as text, separated by commas and rounded to four decimals.
pub(super) fn written(angles: &[f64]) -> String {
    let round = |angle: &f64| (angle * 1e4).round() / 1e4;
    let texts: Vec<String> = angles.iter().map(|angle| format!("{}", round(angle) + 0.0)).collect();
    texts.join(", ")
}
