//! Text files of ALTA, the library of Belcour, Barla, Pacanowski and others (<https://alta.gitlabpages.inria.fr>): a header of
//! `#KEY value` lines, then one sample per line, coordinates first.
//!
//! `#DIM X Y` gives the numbers of coordinates and values, `#PARAM_IN` the parameterisation of the directions (see
//! [`coordinates`]), `#PARAM_OUT` what the values are, and `#VS` how many numbers behind the values bound each of them
//! (Pacanowski et al. 2012, "Rational BRDF", doi:10.1109/TVCG.2012.73): 0 none, 1 the half width of an interval about the
//! value, 2 its lower and upper end. A value that was not measured is `nan`. Lines that begin with `# ` are comments. ALTA calls the light's direction l and the
//! viewer's v; `INV_STERADIAN_COSINE_FACTOR` is f times the cosine of the outgoing direction v.

mod coordinates;
mod header;

use self::header::{Header, Output, Segments};
use super::file::File;
use super::format::{Confidence, Format, ReadOptions};
use crate::error::{Error, Place, excerpt};
use crate::measurement::formats::fields::{no_number, no_value, number, value};
use crate::measurement::formats::rows::{Part, Rows};
use crate::measurement::{Instrument, Measurement, Remark};

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "alta",
    summary: "an ALTA text file",
    sniff,
    read,
    directions: None,
    several_materials: false,
    own_options: &[],
    knows_angles: false,
    extensions: &[],
    write: None,
};

/// A direction closer to the horizon than this is in the horizon: its cosine is nothing to divide by.
const LEAST_COSINE: f64 = 1e-6;

fn sniff(file: &File<'_>) -> Confidence {
    let head = String::from_utf8_lossy(file.head(4096));
    let lines = head.trim_start_matches('\u{feff}').lines().filter(|line| !line.trim().is_empty());
    let mut header = lines.take_while(|line| line.starts_with('#'));
    let ours = |line: &str| {
        let key = line.split_whitespace().next().unwrap_or_default();
        ["#DIM", "#PARAM_IN", "#PARAM_OUT"].contains(&key) || line.starts_with("#ALTA ")
    };
    if header.any(ours) { Confidence::Yes } else { Confidence::No }
}

fn read(file: &mut File<'_>, _: &ReadOptions) -> Result<Measurement, Error> {
    header::refuse_binary(file)?;
    file.with_text(read_text)
}

fn read_text(file: &File<'_>, text: &str) -> Result<Measurement, Error> {
    let header = Header::parse(file, text)?;
    let part = Part::new(text);
    let mut rows = part.lines().filter(|(_, line)| is_row(line));
    // The first row shows which bounds follow the values.
    let segments = rows.next().and_then(|(_, line)| header.segments_of(line.split_whitespace().count()));
    let parts = part.read(|part| {
        let mut samples = Samples::new(&header, segments);
        let mut words = Vec::new();
        for (place, line) in part.lines().filter(|(_, line)| is_row(line)) {
            words.clear();
            words.extend(line.split_whitespace());
            samples.take(file, place, &words)?;
        }
        Ok(samples.rows)
    })?;
    let mut remarks = header.remarks;
    if header.output == Output::Weighted {
        remarks.push(Remark::CosineDividedOut { angle: "theta_o" });
    }
    remarks.extend(segments.and_then(Segments::remark));
    Ok(Measurement {
        remarks,
        instrument: Instrument { description: header.description, ..Instrument::default() },
        ..Rows::joined(header.channels.len(), parts).measurement(header.channels)
    })
}

/// Whether a line has a sample.
fn is_row(line: &str) -> bool {
    !line.starts_with('#') && !line.trim_start().is_empty()
}

/// The samples of a part of the text.
struct Samples<'h> {
    header: &'h Header,
    /// Where the bounds of each channel stand behind the values; `None` if the first row has no layout of the header.
    segments: Option<Segments>,
    coordinates: usize,
    rows: Rows,
    /// The numbers of the current row.
    numbers: Vec<f64>,
}

impl<'h> Samples<'h> {
    fn new(header: &'h Header, segments: Option<Segments>) -> Self {
        let (coordinates, channels) = (header.coordinates.number(), header.channels.len());
        Self { header, segments, coordinates, rows: Rows::new(channels), numbers: Vec::new() }
    }

    fn take(&mut self, file: &File<'_>, place: Place, words: &[&str]) -> Result<(), Error> {
        let Self { header, coordinates, rows, numbers, .. } = self;
        let (coordinates, channels) = (*coordinates, header.channels.len());
        let fits = |segments: &Segments| words.len() == segments.width(coordinates, channels);
        let Some(segments) = self.segments.filter(fits) else {
            let expected = header.row_in_words(self.segments);
            return Err(Error::malformed(file.path, place, expected, format!("{}", words.len())));
        };
        numbers.clear();
        for (column, word) in words.iter().enumerate() {
            let bound = column.checked_sub(coordinates + channels);
            let is_value = bound.is_none() && column >= coordinates;
            // A value that was not measured has no bounds.
            let is_of_missing = bound.is_some_and(|bound| {
                numbers.get(coordinates + segments.value_of(bound)).is_some_and(|value: &f64| value.is_nan())
            });
            let read = if is_value || is_of_missing { value(word) } else { number(word) };
            let wrong = || {
                let error = if is_value { no_value } else { no_number };
                error(file, place, &header.column(column), word)
            };
            numbers.push(read.ok_or_else(wrong)?);
        }
        let (position, rest) = numbers.split_at_checked(coordinates).unwrap_or((numbers, &[]));
        let (sampled, bounds) = rest.split_at_checked(channels).unwrap_or((rest, &[]));
        let pair = header.coordinates.pair(position).map_err(|wrong| {
            let found = words.get(wrong.column).copied().unwrap_or_default();
            let expected = format!("{} in {}", wrong.expected, header.column(wrong.column));
            Error::malformed(file.path, place, expected, excerpt(found))
        })?;
        let half_widths = || segments.half_widths(sampled, bounds);
        if half_widths().any(|width| width < 0.0) {
            let expected = "bounds of the value in ascending order";
            return Err(Error::malformed(file.path, place, expected, excerpt(&words.join(" "))));
        }
        let reason = match pair {
            None => "impossible-direction",
            Some(pair) if pair.wi.z.min(pair.wo.z) <= LEAST_COSINE => "below-horizon",
            Some(pair) => {
                let factor = if header.output == Output::Weighted { pair.wo.z } else { 1.0 };
                for (row, value) in rows.values.iter_mut().zip(sampled) {
                    row.push(finite_quotient(file, place, *value, factor)?);
                }
                for (row, width) in rows.sigma.iter_mut().zip(half_widths()) {
                    // The standard deviation of what is anywhere in the interval (JCGM 100:2008, 4.3.7).
                    row.push(finite_quotient(file, place, width / 3.0_f64.sqrt(), factor)?);
                }
                rows.pairs.push(pair);
                return Ok(());
            }
        };
        rows.drop(reason);
        Ok(())
    }
}

/// A value, which may be missing, over a cosine, which may be too small for it.
fn finite_quotient(file: &File<'_>, place: Place, value: f64, factor: f64) -> Result<f64, Error> {
    let quotient = value / factor;
    if !quotient.is_infinite() {
        return Ok(quotient);
    }
    let expected = "a value that remains finite without its cosine";
    Err(Error::malformed(file.path, place, expected, format!("{value:e}")))
}
