//! Reads this project's own CSV.

use super::columns::{ANGLES, Columns};
use super::rows::read_rows;
use crate::error::{Error, Place, excerpt, short};
use crate::geometry::{Directions, Pair, direction};
use crate::measurement::formats::fields::{HORIZON_TOLERANCE, finite, no_number, number, polar_angle};
use crate::measurement::formats::file::File;
use crate::measurement::formats::format::{Confidence, Format, ReadOptions};
use crate::measurement::formats::rows::Rows;
use crate::measurement::{Doubt, Measurement};

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "csv",
    summary: "CSV with a header theta_i,phi_i,theta_o,phi_o,<channel>...",
    sniff,
    read,
    directions: Some(directions),
    several_materials: false,
    extensions: &["csv"],
    write: Some(super::write::write_subject),
};

fn sniff(file: &File<'_>) -> Confidence {
    if file.head(65536).contains(&0) {
        return Confidence::No;
    }
    match file.first_line(65536) {
        Some(line) if ANGLES.iter().any(|name| line.contains(name)) => Confidence::Yes,
        Some(line) if line.contains(',') => Confidence::Maybe,
        _ => Confidence::No,
    }
}

/// A field of a row.
fn field<'r>(fields: &[&'r str], column: usize) -> &'r str {
    fields.get(column).copied().unwrap_or_default()
}

/// The pair of directions of a row.
fn pair(file: &File<'_>, place: Place, fields: &[&str], columns: &[usize; 4]) -> Result<Pair, Error> {
    let mut angles = [0.0; 4];
    for ((angle, &column), name) in angles.iter_mut().zip(columns).zip(ANGLES) {
        let value = finite(file, place, name, field(fields, column))?.to_radians();
        *angle = if name.starts_with("theta") { polar_angle(file, place, name, value)? } else { value };
    }
    let [theta_i, phi_i, theta_o, phi_o] = angles;
    Ok(Pair { wi: direction(theta_i, phi_i), wo: direction(theta_o, phi_o) })
}

/// Reads only the directions; other columns may contain anything.
fn directions(file: &mut File<'_>) -> Result<Vec<Pair>, Error> {
    file.with_text(|file, text| {
        let take = |columns: &[usize; 4], pairs: &mut Vec<Pair>, place, fields: &[&str]| {
            pairs.push(pair(file, place, fields, columns)?);
            Ok(())
        };
        let (_, parts) = read_rows(file, text, Columns::angles, |_| Vec::new(), take)?;
        let pairs = parts.concat();
        if pairs.is_empty() {
            return Err(Error::malformed(file.path, Place::File, "at least one pair of directions", "none"));
        }
        Ok(pairs)
    })
}

fn read(file: &mut File<'_>, _: &ReadOptions) -> Result<Measurement, Error> {
    file.with_text(|file, text| {
        let start = |columns: &Columns| Rows::new(columns.channels.len());
        let take = |columns: &Columns, rows: &mut Rows, place, fields: &[&str]| {
            take(file, columns, rows, place, fields)
        };
        let (columns, parts) = read_rows(file, text, Columns::parse, start, take)?;
        let measurement = Rows::joined(columns.channels.len(), parts).measurement(columns.channels);
        Ok(Measurement { doubts: doubts(&measurement.directions), ..measurement })
    })
}

/// Takes the sample of a row.
fn take(
    file: &File<'_>,
    columns: &Columns,
    rows: &mut Rows,
    place: Place,
    fields: &[&str],
) -> Result<(), Error> {
    rows.pairs.push(pair(file, place, fields, &columns.angles)?);
    let of_channel = columns.channels.iter().zip(&columns.values).zip(&columns.sigma);
    for ((row, deviations), ((channel, &column), &of_sigma)) in
        rows.values.iter_mut().zip(&mut rows.sigma).zip(of_channel)
    {
        row.push(finite(file, place, &channel.name, field(fields, column))?);
        let Some(column) = of_sigma else { continue };
        let found = field(fields, column);
        let what = || format!("sigma of {}", channel.name);
        let deviation = number(found).ok_or_else(|| no_number(file, place, &what(), found))?;
        if deviation < 0.0 {
            let expected = format!("{} of 0 or more", short(&what()));
            return Err(Error::malformed(file.path, place, expected, excerpt(found)));
        }
        deviations.push(deviation);
    }
    Ok(())
}

/// Angles in radians, if read as degrees, look like a measurement within two degrees of the normal.
fn doubts(directions: &Directions) -> Vec<Doubt> {
    let right_angle = std::f64::consts::FRAC_PI_2.to_radians();
    let steepest = directions.iter().map(|g| g.sin2_i().max(g.sin2_o())).fold(0.0, f64::max).sqrt().asin();
    if directions.len() < 2 || steepest > right_angle + HORIZON_TOLERANCE || steepest == 0.0 {
        return Vec::new();
    }
    vec![Doubt::SuspiciousAngles { steepest_deg: steepest.to_degrees() }]
}
