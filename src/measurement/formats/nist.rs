//! NIST's table of sintered PTFE: Germer 2017, "Full four-dimensional and reciprocal Mueller matrix bidirectional reflectance
//! distribution function of sintered polytetrafluoroethylene", Applied Optics 56 (33), doi:10.1364/AO.56.009333;
//! <https://www.nist.gov/node/1300456>.
//!
//! A CSV header, then one line per sample: `lambda, thetai, phi, thetar, phir, f_r11` and the other elements of the Mueller
//! matrix over `f_r11`; micrometres, degrees, 1/sr. `f_r11` is the BRDF for unpolarised light. `phi` is the turn of the sample
//! about its normal. A negative polar angle stands for its absolute value half a turn further. Each wavelength is a channel.

use super::fields::finite;
use super::file::File;
use super::format::{Confidence, Format, ReadOptions};
use super::named_columns::{first_comment, for_each_row, has};
use crate::error::{Error, Place, excerpt};
use crate::geometry::{Directions, Pair, direction};
use crate::measurement::{Channel, Instrument, Measurement, Remark};
use std::collections::{BTreeMap, HashMap};

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "nist",
    summary: "NIST's CSV with a header lambda,thetai,phi,thetar,phir,f_r11...",
    sniff,
    read,
    directions: None,
    several_materials: false,
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

/// A pair of directions with the values at each wavelength.
struct Row {
    /// Where it stands first.
    place: Place,
    /// Polar angle and azimuth of light and viewer, degrees.
    angles: [f64; 4],
    /// Wavelengths by their number, and f.
    values: Vec<(usize, f64)>,
}

/// The table, by directions in the order of the file.
#[derive(Default)]
struct Table {
    rows: Vec<Row>,
    /// The number of a wavelength, by its bits.
    numbers: HashMap<u64, usize>,
    /// Wavelengths in nanometres by their number.
    wavelengths: Vec<f64>,
    /// How often a pair of directions stood at a wavelength: a repeated one stays two samples.
    repetitions: HashMap<(usize, [u64; 4]), usize>,
    /// The row of a pair of directions and its repetition.
    row_of: HashMap<([u64; 4], usize), usize>,
}

impl Table {
    fn take(&mut self, place: Place, nm: f64, angles: [f64; 4], f: f64) {
        let next = self.wavelengths.len();
        let number = *self.numbers.entry(nm.to_bits()).or_insert(next);
        if number == next {
            self.wavelengths.push(nm);
        }
        let key = angles.map(f64::to_bits);
        let seen = self.repetitions.entry((number, key)).or_default();
        let repetition = *seen;
        *seen += 1;
        let row = *self.row_of.entry((key, repetition)).or_insert(self.rows.len());
        match self.rows.get_mut(row) {
            Some(row) => row.values.push((number, f)),
            None => self.rows.push(Row { place, angles, values: vec![(number, f)] }),
        }
    }

    /// The measurement, if every direction was measured at every wavelength.
    fn finish(mut self, file: &File<'_>) -> Result<Measurement, Error> {
        let many = self.wavelengths.len();
        if let Some(row) = self.rows.iter().find(|row| row.values.len() != many) {
            let expected = format!("these directions at all {many} wavelengths of the file");
            return Err(Error::malformed(file.path, row.place, expected, format!("{}", row.values.len())));
        }
        let mut order: Vec<usize> = (0..many).collect();
        let nm = |number: &usize| self.wavelengths.get(*number).copied().unwrap_or_default();
        order.sort_by(|a, b| nm(a).total_cmp(&nm(b)));
        let channels = order.iter().map(|number| Channel::at_wavelength(nm(number))).collect();
        let mut column = vec![0; many];
        for (sorted, number) in order.iter().enumerate() {
            if let Some(column) = column.get_mut(*number) {
                *column = sorted;
            }
        }
        let mut values: Vec<Vec<f64>> = vec![Vec::new(); many];
        let mut pairs = Vec::new();
        let mut dropped = BTreeMap::new();
        for row in &mut self.rows {
            let [theta_i, phi_i, theta_o, phi_o] = row.angles;
            if theta_i >= 90.0 || theta_o >= 90.0 {
                *dropped.entry("below-horizon").or_default() += 1;
                continue;
            }
            pairs.push(Pair {
                wi: direction(theta_i.to_radians(), phi_i.to_radians()),
                wo: direction(theta_o.to_radians(), phi_o.to_radians()),
            });
            for (number, f) in &row.values {
                if let Some(values) = column.get(*number).and_then(|column| values.get_mut(*column)) {
                    values.push(*f);
                }
            }
        }
        Ok(Measurement {
            dropped,
            remarks: vec![Remark::Unpolarised],
            ..Measurement::of(channels, Directions::Scattered(pairs), values)
        })
    }
}

fn read(file: &mut File<'_>, _: &ReadOptions) -> Result<Measurement, Error> {
    let text = file.text()?;
    let file = &*file;
    let mut table = Table::default();
    for_each_row(file, &text, &COLUMNS, |place, fields| {
        let mut numbers = [0.0; 6];
        for ((number, field), column) in numbers.iter_mut().zip(fields).zip(COLUMNS) {
            *number = finite(file, place, column, field)?;
        }
        let [lambda, theta_i, turn, theta_o, phi_o, f] = numbers;
        // Nanometres without the rounding of the product.
        let nm = (1e9 * lambda).round() / 1e6;
        if !(nm > 0.0 && nm.is_finite()) {
            let [lambda, ..] = fields;
            return Err(Error::malformed(
                file.path,
                place,
                "a wavelength above 0 in micrometres",
                excerpt(lambda),
            ));
        }
        let ([theta_i, phi_i], [theta_o, phi_o]) = (turned(theta_i, turn), turned(theta_o, turn + phi_o));
        if !(phi_i.is_finite() && phi_o.is_finite()) {
            return Err(Error::malformed(file.path, place, "azimuths of reasonable size", "an overflow"));
        }
        table.take(place, nm, [theta_i, phi_i, theta_o, phi_o], f);
        Ok(())
    })?;
    if table.rows.is_empty() {
        return Err(Error::malformed(file.path, Place::File, "at least one row of data", "none"));
    }
    let instrument = Instrument { description: first_comment(&text), ..Instrument::default() };
    Ok(Measurement { instrument, ..table.finish(file)? })
}
