//! Reads tables of text whose columns have names.

use super::columns::{AngleColumn, AngleColumns, Columns, LARGEST_MICROMETRES, WavelengthColumn};
use super::dialect::{Beginning, beginning};
use super::names::wavelength as tidy_wavelength;
use super::number::{is_missing, number};
use super::pivot::by_wavelength;
use super::table::{Fields, read_table};
use crate::error::{Error, OptionName, Place, excerpt, short};
use crate::geometry::Pair;
use crate::measurement::formats::fields::HORIZON_TOLERANCE;
use crate::measurement::formats::file::File;
use crate::measurement::formats::format::{Confidence, Format, ReadOptions};
use crate::measurement::formats::rows::Rows;
use crate::measurement::reading::{
    Angle, AngleConventions, AngleUnit, AzimuthOrigin, LightDirection, OF_TABLES, TableLayout,
};
use crate::measurement::{Doubt, Measurement, Remark, Stated};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "csv",
    summary: "a table of text with a header such as theta_i,phi_i,theta_o,phi_o,<channel>...",
    sniff,
    read,
    directions: Some(directions),
    several_materials: false,
    own_options: &OF_TABLES,
    knows_angles: true,
    extensions: &["csv", "tsv"],
    write: Some(super::write::write_subject),
};

fn sniff(file: &File<'_>) -> Confidence {
    let head = file.head(65536);
    // Numbers as bytes have many control characters among them, and text hardly any but these.
    if head.iter().any(|byte| *byte < b' ' && !b"\t\n\r\x0c\x1b".contains(byte)) {
        return Confidence::No;
    }
    let text = String::from_utf8_lossy(head);
    if beginning(text.trim_start_matches('\u{feff}'), &TableLayout::default()).is_ok() {
        return Confidence::Yes;
    }
    let Some(line) = file.first_line(65536) else { return Confidence::No };
    let is_row = |line: &str| {
        let fields: Vec<&str> = line.split_whitespace().collect();
        fields.len() > 2 && fields.iter().all(|field| number(field, true).is_some())
    };
    let divided = [',', ';', '\t', '|'].iter().any(|separator| line.contains(*separator));
    let is_markup = line.starts_with(['<', '{', '[']);
    if (divided && !is_markup) || line.contains("theta_i") || is_row(&line) {
        Confidence::Maybe
    } else {
        Confidence::No
    }
}

/// A right angle in gradians, and a little more.
const RIGHT_ANGLE_IN_GRADIANS: f64 = 100.1;

/// The directions of a row.
struct RowDirections {
    pair: Pair,
    /// Whether the light's polar angle is negative.
    negative: bool,
    /// The azimuths of light and viewer as the row states them, radians.
    azimuths: [f64; 2],
}

/// How the directions of a row are made from its fields.
struct Geometry<'c> {
    columns: AngleColumns,
    conventions: &'c AngleConventions,
    decimal_comma: bool,
    /// Where the azimuth of the viewer begins; `None` if both azimuths count from the same axis.
    origin: Option<AzimuthOrigin>,
}

impl<'c> Geometry<'c> {
    fn new(columns: AngleColumns, conventions: &'c AngleConventions, decimal_comma: bool) -> Self {
        let origin = conventions.azimuth.or(match (columns.phi_i, columns.phi_o, columns.phi) {
            // In the plane, a positive angle of the viewer is on the side of the mirror direction.
            (None, None, None) => Some(AzimuthOrigin::Mirror),
            (_, None, Some(_)) | (None, Some(_), None) => Some(AzimuthOrigin::Light),
            _ => None,
        });
        Self { columns, conventions, decimal_comma, origin }
    }

    /// Whether the table has polar angles alone.
    fn is_in_plane(&self) -> bool {
        self.columns.phi_i.is_none() && self.columns.phi_o.is_none() && self.columns.phi.is_none()
    }

    /// An angle of a row, radians.
    fn angle(
        &self,
        path: &Path,
        place: Place,
        fields: Fields<'_>,
        angle: Angle,
        column: AngleColumn,
    ) -> Result<f64, Error> {
        let AngleColumn { column, unit } = column;
        let found = fields.at(column);
        let value = number(found, self.decimal_comma);
        let value = value.ok_or_else(|| no_number(path, place, angle.name(), found))?;
        unit.radians(value).ok_or_else(|| {
            let expected = format!("a cosine from -1 to 1 for {}", angle.name());
            Error::malformed(path, place, expected, excerpt(found))
        })
    }

    /// The directions of a row.
    fn row(&self, path: &Path, place: Place, fields: Fields<'_>) -> Result<RowDirections, Error> {
        let angle = |angle: Angle, column: Option<AngleColumn>| {
            column.map_or(Ok(0.0), |column| self.angle(path, place, fields, angle, column))
        };
        let AngleColumns { theta_i, theta_o, phi_i, phi_o, phi } = self.columns;
        let theta_i = self.angle(path, place, fields, Angle::ThetaI, theta_i)?;
        let theta_o = self.angle(path, place, fields, Angle::ThetaO, theta_o)?;
        let phi_i = angle(Angle::PhiI, phi_i)?;
        let phi_o = angle(Angle::PhiO, phi_o.or(phi))?;
        let [to_light, _] = self.conventions.light.to_light(theta_i, phi_i);
        for (angle, theta) in [(Angle::ThetaI, to_light), (Angle::ThetaO, theta_o)] {
            if theta.abs() > FRAC_PI_2 + HORIZON_TOLERANCE {
                let degrees = theta.to_degrees();
                let found = if degrees.abs() < 1e6 {
                    format!("{} degrees", (degrees * 1e6).round() / 1e6)
                } else {
                    format!("{degrees:e} degrees")
                };
                let expected = format!("{} within 90 degrees of the normal", angle.name());
                let error = Error::malformed(path, place, expected, found);
                return Err(match degrees.abs() {
                    ..RIGHT_ANGLE_IN_GRADIANS => {
                        error.with_hint(OptionName::Angles, AngleUnit::Gradians.name())
                    }
                    ..=180.0 if angle == Angle::ThetaI => {
                        error.with_hint(OptionName::LightDirection, LightDirection::AsItTravels.name())
                    }
                    _ => error,
                });
            }
        }
        Ok(RowDirections {
            pair: self.conventions.pair([theta_i, phi_i, theta_o, phi_o], self.origin),
            negative: theta_i < 0.0,
            azimuths: [phi_i, phi_o],
        })
    }

    /// Whether signs that both angles have count from one axis, in a plane: the mirror direction of -30 degrees is +30.
    fn settles(&self, some_negative: bool) -> bool {
        self.is_in_plane() && self.conventions.azimuth.is_none() && some_negative
    }

    /// Makes the signs of both angles count from one axis where they do.
    fn settle(&self, pairs: &mut [Pair], some_negative: bool) {
        if self.settles(some_negative) {
            for Pair { wo, .. } in pairs {
                (wo.x, wo.y) = (-wo.x, -wo.y);
            }
        }
    }
}

/// The error for a field that is no number.
fn no_number(path: &Path, place: Place, what: &str, found: &str) -> Error {
    Error::malformed(path, place, format!("a finite number for {}", short(what)), excerpt(found))
}

/// Reads only the directions; other columns may contain anything.
fn directions(file: &mut File<'_>, options: &ReadOptions) -> Result<Vec<Pair>, Error> {
    let conventions = &options.conventions;
    let path = file.path;
    let mut pairs: Vec<Pair> = Vec::new();
    let mut some_negative = false;
    let parse = |begun: &Beginning| {
        let columns = Columns::angles(&begun.header(), &conventions.table.columns, &conventions.angles.units);
        let columns = columns.map_err(|bad| bad.in_file(path, begun.place))?;
        Ok(Geometry::new(columns, &conventions.angles, begun.dialect.decimal_comma))
    };
    let take = |geometry: &Geometry<'_>, part: &mut (Vec<Pair>, bool), place, fields: Fields<'_>| {
        let row = geometry.row(path, place, fields)?;
        part.0.push(row.pair);
        part.1 |= row.negative;
        Ok(())
    };
    let join = |part: (Vec<Pair>, bool)| {
        pairs.extend(part.0);
        some_negative |= part.1;
    };
    let geometry = read_table(file, &conventions.table, parse, |_| (Vec::new(), false), take, join)?;
    geometry.settle(&mut pairs, some_negative);
    if pairs.is_empty() {
        return Err(Error::malformed(path, Place::File, "at least one pair of directions", "none"));
    }
    Ok(pairs)
}

/// What is known about a table before its rows are read.
struct Table<'c> {
    columns: Columns,
    geometry: Geometry<'c>,
    decimal_comma: bool,
    said: Option<String>,
}

/// What rows gave.
struct Taken {
    rows: Rows,
    /// The wavelength of each row as the file states it, in a table with a row for each.
    wavelengths: Vec<f64>,
    /// Whether a polar angle of the light is negative.
    some_negative: bool,
    /// The smallest azimuths of light and viewer, radians.
    least_azimuths: [f64; 2],
}

impl Taken {
    fn new(channels: usize) -> Self {
        let least_azimuths = [f64::INFINITY; 2];
        Self { rows: Rows::new(channels), wavelengths: Vec::new(), some_negative: false, least_azimuths }
    }

    fn append(&mut self, part: Self) {
        self.rows.append(part.rows);
        self.wavelengths.extend(part.wavelengths);
        self.some_negative |= part.some_negative;
        self.include(part.least_azimuths);
    }

    fn include(&mut self, azimuths: [f64; 2]) {
        for (least, azimuth) in self.least_azimuths.iter_mut().zip(azimuths) {
            *least = least.min(azimuth);
        }
    }
}

fn read(file: &mut File<'_>, options: &ReadOptions) -> Result<Measurement, Error> {
    let conventions = &options.conventions;
    let path = file.path;
    let parse = |begun: &Beginning| {
        let columns = Columns::parse(&begun.header(), &conventions.table.columns, &conventions.angles.units);
        let columns = columns.map_err(|bad| bad.in_file(path, begun.place))?;
        let decimal_comma = begun.dialect.decimal_comma;
        let geometry = Geometry::new(columns.angles, &conventions.angles, decimal_comma);
        Ok(Table { columns, geometry, decimal_comma, said: begun.said.clone() })
    };
    let start = |table: &Table<'_>| Taken::new(table.columns.channels.len());
    let take = |table: &Table<'_>, taken: &mut Taken, place, fields: Fields<'_>| {
        table.take(path, taken, place, fields)
    };
    let mut taken: Option<Taken> = None;
    let join = |part: Taken| match &mut taken {
        Some(taken) => taken.append(part),
        None => taken = Some(part),
    };
    let table = read_table(file, &conventions.table, parse, start, take, join)?;
    let taken = taken.unwrap_or_else(|| Taken::new(table.columns.channels.len()));
    table.measurement(path, taken)
}

impl Table<'_> {
    /// Takes the sample of a row.
    fn take(&self, path: &Path, taken: &mut Taken, place: Place, fields: Fields<'_>) -> Result<(), Error> {
        let columns = &self.columns;
        let row = self.geometry.row(path, place, fields)?;
        taken.rows.pairs.push(row.pair);
        taken.some_negative |= row.negative;
        taken.include(row.azimuths);
        if let Some(WavelengthColumn { column, .. }) = columns.wavelength {
            let found = fields.at(column);
            let is_length = |value: &f64| *value > 0.0 && (*value * 1e9).is_finite();
            let value = number(found, self.decimal_comma).filter(is_length);
            taken.wavelengths.push(
                value.ok_or_else(|| Error::malformed(path, place, "a wavelength above 0", excerpt(found)))?,
            );
        }
        let of_channel = columns.channels.iter().zip(&columns.values).zip(&columns.sigma);
        for ((row, deviations), ((channel, column), sigma)) in
            taken.rows.values.iter_mut().zip(&mut taken.rows.sigma).zip(of_channel)
        {
            let found = fields.at(*column);
            let value = match number(found, self.decimal_comma) {
                Some(value) => value,
                None if is_missing(found) => f64::NAN,
                None => return Err(no_number(path, place, &channel.name, found)),
            };
            row.push(value);
            let Some(sigma) = sigma else { continue };
            let found = fields.at(sigma.column);
            let what = || format!("sigma of {}", channel.name);
            let deviation = match number(found, self.decimal_comma) {
                Some(deviation) => deviation * sigma.factor * if sigma.relative { value.abs() } else { 1.0 },
                // What was not measured has no standard deviation.
                None if value.is_nan() && is_missing(found) => f64::NAN,
                None => return Err(no_number(path, place, &what(), found)),
            };
            if deviation < 0.0 {
                let expected = format!("{} of 0 or more", short(&what()));
                return Err(Error::malformed(path, place, expected, excerpt(found)));
            }
            deviations.push(deviation);
        }
        Ok(())
    }

    /// The measurement of all rows.
    fn measurement(self, path: &Path, mut taken: Taken) -> Result<Measurement, Error> {
        self.geometry.settle(&mut taken.rows.pairs, taken.some_negative);
        let Columns { channels, wavelength, said, doubts, angles, .. } = self.columns;
        let mut remarks = Vec::new();
        let mut measurement = match wavelength {
            None => taken.rows.measurement(channels),
            Some(column) => {
                let (nm, micrometres) = in_nanometres(column, taken.wavelengths);
                if micrometres {
                    let what = "wavelengths below 100 were taken for micrometres".to_owned();
                    remarks.push(Remark::Assumed { what });
                }
                by_wavelength(taken.rows, &nm, &channels)
                    .map_err(|(expected, found)| Error::malformed(path, Place::File, expected, found))?
            }
        };
        let layout: Vec<String> = self.said.into_iter().chain(said).collect();
        if !layout.is_empty() {
            remarks.insert(0, Remark::Columns { what: layout.join("; ") });
        }
        if self.geometry.is_in_plane() && self.geometry.conventions.azimuth.is_none() {
            let what = if taken.some_negative {
                "no azimuths: signs of both polar angles count from one axis, so that theta_i = -30 reflects to theta_o = 30"
            } else {
                "no azimuths: a positive theta_o was taken to be on the side of the mirror direction"
            };
            remarks.push(Remark::Assumed { what: what.to_owned() });
        }
        let conventions = self.geometry.conventions;
        // Signs that both polar angles have count from one axis.
        let signed = self.geometry.settles(taken.some_negative);
        measurement.stated = Some(Stated {
            units: angles.all().map(|(angle, column)| (angle, column.unit)).collect(),
            origin: self.geometry.origin.filter(|_| !signed),
            light: conventions.light,
            least_azimuths: taken.least_azimuths,
        });
        let not_f = |(column, what)| Doubt::NotReflectance { column, what };
        measurement.doubts.extend(doubts.into_iter().map(not_f));
        measurement.remarks = remarks;
        Ok(measurement)
    }
}

/// Wavelengths in nanometres, and whether they were taken for micrometres.
fn in_nanometres(column: WavelengthColumn, mut wavelengths: Vec<f64>) -> (Vec<f64>, bool) {
    let small = !wavelengths.is_empty() && wavelengths.iter().all(|value| *value < LARGEST_MICROMETRES);
    let micrometres = column.nanometres.is_none() && small;
    let factor = column.nanometres.unwrap_or(if micrometres { 1e3 } else { 1.0 });
    if factor != 1.0 {
        for value in &mut wavelengths {
            *value = tidy_wavelength(*value, factor);
        }
    }
    (wavelengths, micrometres)
}
