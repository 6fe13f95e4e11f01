//! Text files of ALTA, the library of Belcour, Barla, Pacanowski and others (<https://alta.gitlabpages.inria.fr>): a header of
//! `#KEY value` lines, then one sample per line, coordinates first.
//!
//! `#DIM X Y` gives the numbers of coordinates and values, `#PARAM_IN` the parameterisation of the directions (see
//! [`coordinates`]), `#PARAM_OUT` what the values are, and `#VS` how many numbers behind the values bound each of them
//! (Pacanowski et al. 2012, "Rational BRDF", doi:10.1109/TVCG.2012.73): 0 none, 1 the half width of an interval about the
//! value, 2 its lower and upper end. Lines that begin with `# ` are comments. ALTA calls the light's direction l and the
//! viewer's v; `INV_STERADIAN_COSINE_FACTOR` is f times the cosine of the outgoing direction v.

mod coordinates;
mod header;

use self::header::{Header, Output, Segments};
use super::file::File;
use super::format::{Confidence, Format, ReadOptions};
use crate::error::{Error, Place, excerpt};
use crate::geometry::{Directions, Pair};
use crate::measurement::formats::fields::finite;
use crate::measurement::{Instrument, Measurement, Remark};
use std::collections::BTreeMap;

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "alta",
    summary: "an ALTA text file",
    sniff,
    read,
    directions: None,
    several_materials: false,
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
    let text = file.text()?;
    let file = &*file;
    let header = Header::parse(file, &text)?;
    let mut rows = Rows::new(&header);
    for (index, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split_whitespace().collect();
        if line.starts_with('#') || words.is_empty() {
            continue;
        }
        rows.take(file, Place::of_line(index + 1), &words)?;
    }
    Ok(rows.finish())
}

/// The samples read so far.
struct Rows<'h> {
    header: &'h Header,
    /// Where the bounds of each channel stand behind the values; known once a row has been seen.
    segments: Option<Segments>,
    pairs: Vec<Pair>,
    values: Vec<Vec<f64>>,
    sigma: Vec<Vec<f64>>,
    dropped: BTreeMap<&'static str, usize>,
}

impl<'h> Rows<'h> {
    fn new(header: &'h Header) -> Self {
        let channels = header.channels.len();
        Self {
            header,
            segments: None,
            pairs: Vec::new(),
            values: vec![Vec::new(); channels],
            sigma: vec![Vec::new(); channels],
            dropped: BTreeMap::new(),
        }
    }

    fn take(&mut self, file: &File<'_>, place: Place, words: &[&str]) -> Result<(), Error> {
        let header = self.header;
        let coordinates = header.coordinates.number();
        let channels = header.channels.len();
        let segments = match self.segments {
            Some(segments) if words.len() == segments.width(coordinates, channels) => segments,
            None if header.segments_of(words.len()).is_some() => {
                *self.segments.insert(header.segments_of(words.len()).unwrap_or(Segments::NONE))
            }
            _ => {
                let expected = header.row_in_words(self.segments);
                return Err(Error::malformed(file.path, place, expected, format!("{}", words.len())));
            }
        };
        let numbers: Vec<f64> = words
            .iter()
            .enumerate()
            .map(|(column, word)| finite(file, place, &header.column(column), word))
            .collect::<Result<_, _>>()?;
        let (position, rest) = numbers.split_at_checked(coordinates).unwrap_or((&numbers, &[]));
        let (sampled, bounds) = rest.split_at_checked(channels).unwrap_or((rest, &[]));
        let pair = header.coordinates.pair(position).map_err(|wrong| {
            let found = words.get(wrong.column).copied().unwrap_or_default();
            let expected = format!("{} in {}", wrong.expected, header.column(wrong.column));
            Error::malformed(file.path, place, expected, excerpt(found))
        })?;
        let half_widths = segments.half_widths(sampled, bounds);
        if half_widths.iter().any(|width| *width < 0.0) {
            let expected = "bounds of the value in ascending order";
            return Err(Error::malformed(file.path, place, expected, excerpt(&words.join(" "))));
        }
        let reason = match pair {
            None => "impossible-direction",
            Some(pair) if pair.wi.z.min(pair.wo.z) <= LEAST_COSINE => "below-horizon",
            Some(pair) => {
                let factor = if header.output == Output::Weighted { pair.wo.z } else { 1.0 };
                for (row, value) in self.values.iter_mut().zip(sampled) {
                    row.push(finite_quotient(file, place, *value, factor)?);
                }
                for (row, width) in self.sigma.iter_mut().zip(&half_widths) {
                    // The standard deviation of what is anywhere in the interval (JCGM 100:2008, 4.3.7).
                    row.push(finite_quotient(file, place, width / 3.0_f64.sqrt(), factor)?);
                }
                self.pairs.push(pair);
                return Ok(());
            }
        };
        *self.dropped.entry(reason).or_default() += 1;
        Ok(())
    }

    fn finish(self) -> Measurement {
        let Self { header, segments, pairs, values, sigma, dropped } = self;
        let mut remarks = header.remarks.clone();
        if header.output == Output::Weighted {
            remarks.push(Remark::CosineDividedOut { angle: "theta_o" });
        }
        remarks.extend(segments.and_then(Segments::remark));
        let complete = !pairs.is_empty() && sigma.iter().all(|row| row.len() == pairs.len());
        Measurement {
            sigma: complete.then_some(sigma),
            dropped,
            remarks,
            instrument: Instrument { description: header.description.clone(), ..Instrument::default() },
            ..Measurement::of(header.channels.clone(), Directions::Scattered(pairs), values)
        }
    }
}

/// A value over a cosine, which may be too small for it.
fn finite_quotient(file: &File<'_>, place: Place, value: f64, factor: f64) -> Result<f64, Error> {
    let quotient = value / factor;
    if quotient.is_finite() {
        return Ok(quotient);
    }
    let expected = "a value that remains finite without its cosine";
    Err(Error::malformed(file.path, place, expected, format!("{value:e}")))
}
