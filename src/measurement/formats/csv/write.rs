//! Writes this project's own CSV.

use super::columns::{ANGLES, EXACT, channels_of};
use super::records::records;
use crate::error::{Error, excerpt};
use crate::geometry::{Geometry, Pair, spherical_degrees};
use crate::measurement::Measurement;
use crate::measurement::formats::writing::{Covered, Subject, Written};
use std::fmt::Write as _;

/// Writes the measurement as CSV in this project's own format, with `comments` at the beginning. What was not measured is `nan`.
///
/// # Errors
/// [`Error::Invalid`] if a value is infinite or the standard deviation of a value not finite, or if a header cannot express the names of the channels.
pub fn write(measurement: &Measurement, comments: &[String]) -> Result<String, Error> {
    let mut text = String::new();
    for comment in comments {
        // A comment ends at the end of its line.
        let _ = writeln!(text, "# {}", comment.replace(char::is_control, " "));
    }
    let header = header(measurement);
    if must_be_exact(&header, measurement)? {
        text.push_str(EXACT);
        text.push('\n');
    }
    text.push_str(&header);
    text.push('\n');
    for (index, geometry) in measurement.directions.iter().enumerate() {
        let at = |rows: &Vec<Vec<f64>>| -> Vec<f64> {
            rows.iter().filter_map(|row| row.get(index).copied()).collect()
        };
        let (values, sigma) =
            (at(&measurement.values), measurement.sigma.as_ref().map(at).unwrap_or_default());
        // The standard deviation of what was not measured says nothing.
        let unknown = values.iter().zip(&sigma).any(|(value, sigma)| !value.is_nan() && sigma.is_nan());
        let fields = [angles(&geometry).to_vec(), values, sigma].concat();
        if unknown || fields.iter().any(|v| v.is_infinite()) {
            let found = format!("NaN or infinity at sample {}", index + 1);
            return Err(Error::invalid("model", "finite values", found));
        }
        let in_words = |v: &f64| if v.is_nan() { "nan".to_owned() } else { format!("{v}") };
        let fields: Vec<String> = fields.iter().map(in_words).collect();
        text.push_str(&fields.join(","));
        text.push('\n');
    }
    Ok(text)
}

/// Writes what a [`Subject`] is: the samples of a measurement, or its values on a grid of angles.
///
/// # Errors
/// Those of [`write`].
pub(super) fn write_subject(subject: &Subject<'_>) -> Result<Written, Error> {
    let sampled = subject.sampled();
    if subject.measurement.is_none() {
        sampled.check_finite()?;
    }
    let comments = [subject.about.to_owned(), "angles in degrees, values in 1/sr".to_owned()];
    let mut covered = Covered::default();
    if subject.grid.is_some() {
        let pairs = sampled.directions.iter().map(|g| Pair { wi: g.wi.into(), wo: g.wo.into() });
        covered.count(subject, &pairs.collect::<Vec<_>>());
    }
    Ok(Written {
        bytes: write(&sampled, &comments)?.into_bytes(),
        losses: covered.loss().into_iter().collect(),
    })
}

/// The header with the names of the columns, quoted if necessary.
fn header(measurement: &Measurement) -> String {
    let mut columns: Vec<String> = ANGLES.map(str::to_owned).into();
    columns.extend(measurement.channel_names());
    match (measurement.sigma.is_some(), measurement.channels.as_slice()) {
        (false, _) => {}
        (true, [_]) => columns.push("sigma".to_owned()),
        (true, several) => columns.extend(several.iter().map(|channel| format!("sigma_{}", channel.name))),
    }
    let quoted = |name: &String| {
        if name.contains([',', '"']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.clone() }
    };
    columns.iter().map(quoted).collect::<Vec<_>>().join(",")
}

/// Whether a reader would take names of channels for something else, unless it is told that all are channels. A user who makes up names may
/// call a channel `time`, but not `sigma`, and may not end a name in a blank.
///
/// # Errors
/// [`Error::Invalid`] if no header can express the names.
fn must_be_exact(header: &str, measurement: &Measurement) -> Result<bool, Error> {
    let wanted = || measurement.channels.iter().map(|channel| &channel.name);
    let names = records(header).next().and_then(Result::ok);
    let names: Vec<String> = names.iter().flat_map(|(_, names)| names.iter().map(str::to_owned)).collect();
    for is_exact in [false, true] {
        let read = channels_of(&names, is_exact);
        if read.is_some_and(|channels| channels.iter().map(|channel| &channel.name).eq(wanted())) {
            return Ok(is_exact);
        }
    }
    let names: Vec<&str> = wanted().map(String::as_str).collect();
    let expected = "different names that a CSV header can contain";
    Err(Error::invalid("channels", expected, excerpt(&names.join(", "))))
}

fn angles(geometry: &Geometry<f64>) -> [f64; 4] {
    let (theta_i, phi_i) = spherical_degrees(geometry.wi.into());
    let (theta_o, phi_o) = spherical_degrees(geometry.wo.into());
    [theta_i, phi_i, theta_o, phi_o]
}
