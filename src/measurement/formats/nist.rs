//! NIST's table of sintered PTFE: Germer 2017, "Full four-dimensional and reciprocal Mueller matrix bidirectional reflectance
//! distribution function of sintered polytetrafluoroethylene", Applied Optics 56 (33), doi:10.1364/AO.56.009333;
//! <https://www.nist.gov/node/1300456>.
//!
//! A CSV header, then one line per sample: `lambda, thetai, phi, thetar, phir, f_r11` and the other elements of the Mueller
//! matrix over `f_r11`; micrometres, degrees, 1/sr. `f_r11` is the BRDF for unpolarised light. `phi` is the turn of the sample
//! about its normal. A negative polar angle stands for its absolute value half a turn further. Each wavelength is a channel; `nan` or a
//! blank field for `f_r11` means that it was not measured there.

use super::fields::{finite, value_or_blank};
use super::file::File;
use super::format::{Confidence, Format, ReadOptions};
use super::named_columns::{first_comment, has, read_columns};
use crate::error::{Error, Place, excerpt};
use crate::geometry::{Directions, Pair, direction};
use crate::measurement::{Channel, Instrument, Measurement, Remark};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "nist",
    summary: "NIST's CSV with a header lambda,thetai,phi,thetar,phir,f_r11...",
    sniff,
    read,
    directions: None,
    several_materials: false,
    own_options: &[],
    knows_angles: false,
    extensions: &[],
    write: None,
};

/// The columns that are read.
const COLUMNS: [&str; 6] = ["lambda", "thetai", "phi", "thetar", "phir", "f_r11"];

fn sniff(file: &File<'_>) -> Confidence {
    if has(file, &COLUMNS, 3) { Confidence::Yes } else { Confidence::No }
}

/// A polar angle of at least zero and an azimuth in 0..360, degrees.
fn turned(theta: f64, phi: f64) -> [f64; 2] {
    [theta.abs(), (if theta < 0.0 { phi + 180.0 } else { phi }).rem_euclid(360.0)]
}

/// The sample of a row.
#[derive(Clone, Copy)]
struct Row {
    place: Place,
    /// Nanometres.
    wavelength: f64,
    /// Polar angle and azimuth of light and viewer, degrees.
    angles: [f64; 4],
    f: f64,
}

/// Directions as a key.
fn key(angles: [f64; 4]) -> [u64; 4] {
    angles.map(f64::to_bits)
}

/// The samples at one wavelength.
struct Spectral {
    nm: f64,
    /// Their directions, by number, and f.
    values: Vec<(usize, f64)>,
}

/// The table, by directions in the order of the file. A pair of directions that is repeated at a wavelength stays two samples.
#[derive(Default)]
struct Table {
    /// Where each pair of directions stands first, and its angles.
    directions: Vec<(Place, [f64; 4])>,
    wavelengths: Vec<Spectral>,
    /// The wavelength of each number of bits.
    numbers: HashMap<u64, usize>,
    /// What finds directions out of order; made when there are some.
    index: Option<Index>,
}

/// Where directions stand.
struct Index {
    /// How often a pair of directions stood at a wavelength.
    repetitions: HashMap<(usize, [u64; 4]), usize>,
    /// The numbers of a pair of directions, by repetition.
    numbers: HashMap<[u64; 4], Vec<usize>>,
}

impl Index {
    fn new(table: &Table) -> Self {
        let mut index = Self { repetitions: HashMap::new(), numbers: HashMap::new() };
        for (number, (_, angles)) in table.directions.iter().enumerate() {
            index.numbers.entry(key(*angles)).or_default().push(number);
        }
        for (wavelength, spectral) in table.wavelengths.iter().enumerate() {
            let directions = spectral.values.iter().filter_map(|(number, _)| table.directions.get(*number));
            for (_, angles) in directions {
                *index.repetitions.entry((wavelength, key(*angles))).or_default() += 1;
            }
        }
        index
    }
}

impl Table {
    fn take(&mut self, row: Row) {
        let bits = row.wavelength.to_bits();
        let wavelength = *self.numbers.entry(bits).or_insert(self.wavelengths.len());
        if wavelength == self.wavelengths.len() {
            let first = Spectral { nm: row.wavelength, values: Vec::new() };
            self.wavelengths.push(first);
        }
        let number = self.number_of(wavelength, &row);
        if number == self.directions.len() {
            self.directions.push((row.place, row.angles));
        }
        if let Some(spectral) = self.wavelengths.get_mut(wavelength) {
            spectral.values.push((number, row.f));
        }
    }

    /// The number of a row's directions, which is new if they stand there for the first time.
    fn number_of(&mut self, wavelength: usize, row: &Row) -> usize {
        let new = self.directions.len();
        let key_of_row = key(row.angles);
        if self.index.is_none()
            && let Some(spectral) = self.wavelengths.get(wavelength)
        {
            // All wavelengths have their directions in the same order, as a rule.
            let next = spectral.values.len();
            if self.directions.get(next).is_none_or(|(_, angles)| key(*angles) == key_of_row) {
                return next;
            }
        }
        let index = match self.index.take() {
            Some(index) => index,
            None => Index::new(self),
        };
        let index = self.index.insert(index);
        let repetition = index.repetitions.entry((wavelength, key_of_row)).or_default();
        let numbers = index.numbers.entry(key_of_row).or_default();
        let number = numbers.get(*repetition).copied().unwrap_or(new);
        if number == new {
            numbers.push(new);
        }
        *repetition += 1;
        number
    }

    /// The measurement, if every direction was measured at every wavelength.
    fn finish(mut self, file: &File<'_>) -> Result<Measurement, Error> {
        let (many, samples) = (self.wavelengths.len(), self.directions.len());
        if self.wavelengths.iter().any(|spectral| spectral.values.len() != samples) {
            let mut found = vec![0; samples];
            for (number, _) in self.wavelengths.iter().flat_map(|spectral| &spectral.values) {
                if let Some(found) = found.get_mut(*number) {
                    *found += 1;
                }
            }
            let mut all = self.directions.iter().zip(found);
            if let Some(((place, _), found)) = all.find(|(_, found)| *found != many) {
                let expected = format!("these directions at all {many} wavelengths of the file");
                return Err(Error::malformed(file.path, *place, expected, format!("{found}")));
            }
        }
        self.wavelengths.sort_by(|a, b| a.nm.total_cmp(&b.nm));
        let below = |[theta_i, _, theta_o, _]: [f64; 4]| theta_i >= 90.0 || theta_o >= 90.0;
        let above: Vec<[f64; 4]> =
            self.directions.iter().map(|(_, angles)| *angles).filter(|angles| !below(*angles)).collect();
        let pairs = above.par_iter().map(|angles| {
            let [theta_i, phi_i, theta_o, phi_o] = angles.map(f64::to_radians);
            Pair { wi: direction(theta_i, phi_i), wo: direction(theta_o, phi_o) }
        });
        let pairs = pairs.collect();
        let values = self.wavelengths.iter_mut().map(|spectral| {
            spectral.values.sort_by_key(|(number, _)| *number);
            let values = spectral.values.iter().zip(&self.directions);
            values.filter(|(_, (_, angles))| !below(*angles)).map(|((_, f), _)| *f).collect()
        });
        let values = values.collect();
        let mut dropped = BTreeMap::new();
        if above.len() < samples {
            dropped.insert("below-horizon", samples - above.len());
        }
        let channels = self.wavelengths.iter().map(|spectral| Channel::at_wavelength(spectral.nm)).collect();
        Ok(Measurement {
            dropped,
            remarks: vec![Remark::Unpolarised],
            ..Measurement::of(channels, Directions::Scattered(pairs), values)
        })
    }
}

fn read(file: &mut File<'_>, _: &ReadOptions) -> Result<Measurement, Error> {
    file.with_text(read_text)
}

fn read_text(file: &File<'_>, text: &str) -> Result<Measurement, Error> {
    let take = |rows: &mut Vec<Row>, place, fields: [&str; 6]| {
        rows.push(row(file, place, fields)?);
        Ok(())
    };
    let mut table = Table::default();
    for row in read_columns(file, text, &COLUMNS, Vec::new, take)?.into_iter().flatten() {
        table.take(row);
    }
    if table.directions.is_empty() {
        return Err(Error::malformed(file.path, Place::File, "at least one row of data", "none"));
    }
    let instrument = Instrument { description: first_comment(text), ..Instrument::default() };
    Ok(Measurement { instrument, ..table.finish(file)? })
}

/// The sample of a row.
fn row(file: &File<'_>, place: Place, fields: [&str; 6]) -> Result<Row, Error> {
    let mut numbers = [0.0; 5];
    for ((number, field), column) in numbers.iter_mut().zip(fields).zip(COLUMNS) {
        *number = finite(file, place, column, field)?;
    }
    let [lambda, theta_i, turn, theta_o, phi_o] = numbers;
    let ([.., field], [.., column]) = (fields, COLUMNS);
    let f = value_or_blank(file, place, column, field)?;
    // Nanometres without the rounding of the product.
    let wavelength = (1e9 * lambda).round() / 1e6;
    if !(wavelength > 0.0 && wavelength.is_finite()) {
        let [lambda, ..] = fields;
        let expected = "a wavelength above 0 in micrometres";
        return Err(Error::malformed(file.path, place, expected, excerpt(lambda)));
    }
    let ([theta_i, phi_i], [theta_o, phi_o]) = (turned(theta_i, turn), turned(theta_o, turn + phi_o));
    if !(phi_i.is_finite() && phi_o.is_finite()) {
        return Err(Error::malformed(file.path, place, "azimuths of reasonable size", "an overflow"));
    }
    Ok(Row { place, wavelength, angles: [theta_i, phi_i, theta_o, phi_o], f })
}
