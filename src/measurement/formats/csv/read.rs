//! Reads this project's own CSV.

use super::columns::{ANGLES, Columns, records};
use crate::error::{Error, Place, excerpt, short};
use crate::geometry::{Directions, Pair, direction};
use crate::measurement::formats::fields::{HORIZON_TOLERANCE, finite, polar_angle};
use crate::measurement::formats::file::File;
use crate::measurement::formats::format::{Confidence, Format, ReadOptions};
use crate::measurement::{Doubt, Measurement};
use csv::StringRecord;

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
    let head = file.head(65536);
    if head.contains(&0) {
        return Confidence::No;
    }
    let head = String::from_utf8_lossy(head);
    let header = head
        .trim_start_matches('\u{feff}')
        .lines()
        .map(str::trim)
        .find(|line| !line.is_empty() && !line.starts_with('#'));
    match header {
        Some(line) if ANGLES.iter().any(|name| line.contains(name)) => Confidence::Yes,
        Some(line) if line.contains(',') => Confidence::Maybe,
        _ => Confidence::No,
    }
}

/// Reads the header with `parse`, then passes every record to `row`.
fn for_each_record<C>(
    file: &File<'_>,
    text: &str,
    parse: impl Fn(&StringRecord) -> Result<C, (String, String)>,
    mut row: impl FnMut(&C, Place, &StringRecord) -> Result<(), Error>,
) -> Result<C, Error> {
    let mut records = records(text);
    let Some((place, header)) = records.next().transpose().map_err(|e| e.in_file(file.path))? else {
        return Err(Error::malformed(file.path, Place::File, "a header naming the columns", "only comments"));
    };
    let columns =
        parse(&header).map_err(|(expected, found)| Error::malformed(file.path, place, expected, found))?;
    for record in records {
        let (place, fields) = record.map_err(|e| e.in_file(file.path))?;
        if fields.len() != header.len() {
            let expected = format!("{} fields, as the header has", header.len());
            return Err(Error::malformed(file.path, place, expected, format!("{}", fields.len())));
        }
        row(&columns, place, &fields)?;
    }
    Ok(columns)
}

/// A finite number from a column.
fn number(
    file: &File<'_>,
    place: Place,
    fields: &StringRecord,
    column: usize,
    what: &str,
) -> Result<f64, Error> {
    finite(file, place, what, fields.get(column).unwrap_or_default())
}

/// The pair of directions of a record.
fn pair(file: &File<'_>, place: Place, fields: &StringRecord, columns: &[usize; 4]) -> Result<Pair, Error> {
    let mut angles = [0.0; 4];
    for ((angle, &column), name) in angles.iter_mut().zip(columns).zip(ANGLES) {
        let value = number(file, place, fields, column, name)?.to_radians();
        *angle = if name.starts_with("theta") { polar_angle(file, place, name, value)? } else { value };
    }
    let [theta_i, phi_i, theta_o, phi_o] = angles;
    Ok(Pair { wi: direction(theta_i, phi_i), wo: direction(theta_o, phi_o) })
}

/// Reads only the directions; other columns may contain anything.
fn directions(file: &mut File<'_>) -> Result<Vec<Pair>, Error> {
    let text = file.text()?;
    let file = &*file;
    let mut pairs = Vec::new();
    for_each_record(file, &text, Columns::angles, |columns, place, fields| {
        pairs.push(pair(file, place, fields, columns)?);
        Ok(())
    })?;
    if pairs.is_empty() {
        return Err(Error::malformed(file.path, Place::File, "at least one pair of directions", "none"));
    }
    Ok(pairs)
}

fn read(file: &mut File<'_>, _: &ReadOptions) -> Result<Measurement, Error> {
    let text = file.text()?;
    let file = &*file;
    let mut pairs = Vec::new();
    let mut values: Vec<Vec<f64>> = Vec::new();
    let mut sigma: Vec<Vec<f64>> = Vec::new();
    let columns = for_each_record(file, &text, Columns::parse, |columns, place, fields| {
        pairs.push(pair(file, place, fields, &columns.angles)?);
        values.resize(columns.channels.len(), Vec::new());
        sigma.resize(columns.channels.len(), Vec::new());
        let of_channel = columns.channels.iter().zip(&columns.values).zip(&columns.sigma);
        for ((row, deviations), ((channel, &column), &of_sigma)) in
            values.iter_mut().zip(&mut sigma).zip(of_channel)
        {
            row.push(number(file, place, fields, column, &channel.name)?);
            let Some(column) = of_sigma else { continue };
            let what = format!("sigma of {}", channel.name);
            let deviation = number(file, place, fields, column, &what)?;
            if deviation < 0.0 {
                let found = excerpt(fields.get(column).unwrap_or_default());
                return Err(Error::malformed(
                    file.path,
                    place,
                    format!("{} of 0 or more", short(&what)),
                    found,
                ));
            }
            deviations.push(deviation);
        }
        Ok(())
    })?;
    values.resize(columns.channels.len(), Vec::new());
    let directions = Directions::Scattered(pairs);
    let complete = sigma.iter().all(|row| row.len() == directions.len()) && !directions.is_empty();
    Ok(Measurement {
        sigma: complete.then_some(sigma),
        doubts: doubts(&directions),
        ..Measurement::of(columns.channels, directions, values)
    })
}

/// Angles in radians, if read as degrees, look like a measurement within two degrees of the normal.
fn doubts(directions: &Directions) -> Vec<Doubt> {
    let right_angle = std::f64::consts::FRAC_PI_2.to_radians();
    let steepest = directions.iter().map(|g| g.sin2_i().max(g.sin2_o()).sqrt().asin()).fold(0.0, f64::max);
    if directions.len() < 2 || steepest > right_angle + HORIZON_TOLERANCE || steepest == 0.0 {
        return Vec::new();
    }
    vec![Doubt::SuspiciousAngles { steepest_deg: steepest.to_degrees() }]
}
