//! The header of an ALTA file.

use super::coordinates::{Coordinates, OPEN};
use crate::error::{Error, Place, excerpt, listed};
use crate::measurement::formats::file::File;
use crate::measurement::{Channel, Remark};
use std::collections::HashMap;

/// Largest number of values in a sample: no instrument resolves more wavelengths.
const MOST_VALUES: usize = 100_000;

/// What the values of a file are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Output {
    /// f.
    Plain,
    /// f cos(theta_o).
    Weighted,
}

/// The bounds that follow the values of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Segments {
    /// Numbers per bounded value: 0, a half width or two ends.
    each: usize,
    /// Whether all values have bounds, or only the first.
    all: bool,
}

impl Segments {
    pub const NONE: Self = Self { each: 0, all: true };

    /// The number of words in a row.
    pub fn width(self, coordinates: usize, channels: usize) -> usize {
        coordinates + channels + if self.all { self.each * channels } else { self.each }
    }

    /// Half the width of each value's interval; empty if there are none.
    pub fn half_widths(self, values: &[f64], bounds: &[f64]) -> impl Iterator<Item = f64> {
        let bounds = bounds.chunks(self.each.max(1));
        let half = |(_, bounds): (&f64, &[f64])| match *bounds {
            [half] => half,
            [low, high] => 0.5 * high - 0.5 * low,
            _ => 0.0,
        };
        values.iter().zip(bounds).map(half)
    }

    /// The value that a bound belongs to, both counted from 0.
    pub fn value_of(self, bound: usize) -> usize {
        bound / self.each.max(1)
    }

    /// What became of the bounds.
    pub fn remark(self) -> Option<Remark> {
        let what = match self {
            Self { each: 0, .. } => return None,
            Self { all: true, .. } => {
                "the file gives each value an interval: half its width over sqrt(3) was taken as the standard deviation"
            }
            Self { all: false, .. } => {
                "the file gives only the first of its values an interval, which was left out"
            }
        };
        Some(Remark::Assumed { what: what.to_owned() })
    }
}

/// The header of a file.
pub(super) struct Header {
    pub coordinates: Coordinates,
    pub channels: Vec<Channel>,
    pub output: Output,
    pub remarks: Vec<Remark>,
    pub description: Option<String>,
    /// The layouts of bounds that the header allows.
    segments: Vec<Segments>,
}

/// A line of the header: its place, and what stands behind the key.
type Line<'t> = (Place, &'t str);

/// Refuses ALTA's binary files, whose header is that of a text file.
///
/// # Errors
/// [`Error::Malformed`] at the line that says so.
pub(super) fn refuse_binary(file: &File<'_>) -> Result<(), Error> {
    let head = String::from_utf8_lossy(file.head(4096));
    for (index, line) in head.lines().enumerate().take_while(|(_, line)| line.starts_with('#')) {
        if line.starts_with("#FORMAT") && line.contains("binary") {
            let place = Place::of_line(index + 1);
            return Err(Error::malformed(file.path, place, "ALTA's text format", excerpt(line.trim())));
        }
    }
    Ok(())
}

impl Header {
    /// Reads the lines before the first sample.
    ///
    /// # Errors
    /// [`Error::Malformed`] at the line that is wrong, or that names what is missing.
    pub fn parse(file: &File<'_>, text: &str) -> Result<Self, Error> {
        let lines = keys(text);
        let wrong = |place, expected: &str, found: &str| Error::malformed(file.path, place, expected, found);
        if let Some((place, rest)) = lines.get("ALTA").filter(|(_, rest)| rest.starts_with("FUNC")) {
            return Err(wrong(
                *place,
                "data",
                &excerpt(&format!("#ALTA {rest}, the header of a fitted function")),
            ));
        }
        let needed = |key: &str, of: &str| {
            let missing =
                || wrong(Place::File, &format!("a line #{key} with {of}"), "none before the first sample");
            lines.get(key).copied().ok_or_else(missing)
        };
        let (place, dimensions) = needed("DIM", "the numbers of coordinates and values")?;
        let numbers: Option<Vec<usize>> =
            dimensions.split_whitespace().map(|word| word.parse().ok()).collect();
        let (number, values) = match numbers.as_deref() {
            Some(&[x, y]) if (1..=MOST_VALUES).contains(&y) => (x, y),
            _ => {
                let expected = format!("two numbers behind #DIM, the second from 1 to {MOST_VALUES}");
                return Err(wrong(place, &expected, &excerpt(dimensions)));
            }
        };
        let coordinates = parameterisation(file, needed("PARAM_IN", "the parameterisation")?)?;
        if coordinates.number() != number {
            let expected = format!("{} coordinates, as #PARAM_IN has", coordinates.number());
            return Err(wrong(place, &expected, &excerpt(dimensions)));
        }
        let mut remarks = Vec::new();
        if let Some(what) = coordinates.assumed() {
            remarks.push(Remark::Assumed { what: what.to_owned() });
        }
        let (output, names) = output(file, lines.get("PARAM_OUT").copied(), &mut remarks)?;
        if names.is_some_and(|names| names.len() != values) {
            let expected = format!("{} values, as #PARAM_OUT has", names.map_or(0, <[&str]>::len));
            return Err(wrong(place, &expected, &excerpt(dimensions)));
        }
        let named = |index: usize| match names {
            Some(names) => names.get(index).map_or_else(String::new, |name| (*name).to_owned()),
            None if values == 1 => "y".to_owned(),
            None => format!("y{}", index + 1),
        };
        Ok(Self {
            coordinates,
            channels: (0..values).map(|index| Channel { name: named(index), wavelength_nm: None }).collect(),
            output,
            remarks,
            description: description(&lines),
            segments: segments(file, lines.get("VS").copied(), values)?,
        })
    }

    /// The layout of bounds that makes a row that wide.
    pub fn segments_of(&self, width: usize) -> Option<Segments> {
        let fits = |s: &&Segments| s.width(self.coordinates.number(), self.channels.len()) == width;
        self.segments.iter().find(fits).copied()
    }

    /// What a row holds, for a message.
    pub fn row_in_words(&self, known: Option<Segments>) -> String {
        let (coordinates, channels) = (self.coordinates.number(), self.channels.len());
        let segments = known.or(self.segments.first().copied()).unwrap_or(Segments::NONE);
        match segments.width(coordinates, channels) - coordinates - channels {
            0 => format!("{coordinates} coordinates and {channels} values"),
            bounds => format!("{coordinates} coordinates, {channels} values and {bounds} bounds"),
        }
    }

    /// What a column holds, for a message.
    pub fn column(&self, index: usize) -> String {
        let columns = self.coordinates.columns();
        let beyond = || index.checked_sub(columns.len()).and_then(|index| self.channels.get(index));
        match columns.get(index) {
            Some(name) => (*name).to_owned(),
            None => beyond().map_or_else(|| "a bound".to_owned(), |channel| channel.name.clone()),
        }
    }
}

/// The lines `#KEY value` before the first sample; of a repeated key the last counts, but the first `#ALTA` says what the file
/// is. `# ` begins a comment.
fn keys(text: &str) -> HashMap<&str, Line<'_>> {
    let mut keys = HashMap::new();
    for (index, line) in text.lines().enumerate() {
        let Some(line) = line.strip_prefix('#') else {
            if line.trim().is_empty() {
                continue;
            }
            break;
        };
        let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        if !(key.is_empty() || key == "ALTA" && keys.contains_key(key)) {
            keys.insert(key, (Place::of_line(index + 1), rest.trim()));
        }
    }
    keys
}

/// The parameterisation of that name.
fn parameterisation(file: &File<'_>, (place, name): Line<'_>) -> Result<Coordinates, Error> {
    Coordinates::named(name).ok_or_else(|| {
        let (expected, found) = if OPEN.contains(&name) {
            ("a parameterisation that determines two directions".to_owned(), excerpt(name))
        } else {
            (format!("a parameterisation among {}", listed(&Coordinates::names())), excerpt(name))
        };
        Error::malformed(file.path, place, expected, found)
    })
}

/// What the values are, and the names of the channels that this determines.
fn output(
    file: &File<'_>,
    line: Option<Line<'_>>,
    remarks: &mut Vec<Remark>,
) -> Result<(Output, Option<&'static [&'static str]>), Error> {
    match line.map_or("UNKNOWN_OUTPUT", |(_, name)| name) {
        "INV_STERADIAN" => Ok((Output::Plain, None)),
        "INV_STERADIAN_COSINE_FACTOR" => Ok((Output::Weighted, None)),
        "RGB_COLOR" => Ok((Output::Plain, Some(&["r", "g", "b"]))),
        "XYZ_COLOR" => Ok((Output::Plain, Some(&["X", "Y", "Z"]))),
        "UNKNOWN_OUTPUT" => {
            let what = "the file does not say what its values are (#PARAM_OUT): they were taken as f in 1/sr";
            remarks.push(Remark::Assumed { what: what.to_owned() });
            Ok((Output::Plain, None))
        }
        other => {
            let expected = "#PARAM_OUT INV_STERADIAN, INV_STERADIAN_COSINE_FACTOR, RGB_COLOR or XYZ_COLOR";
            let place = line.map_or(Place::File, |(place, _)| place);
            Err(Error::malformed(file.path, place, expected, excerpt(other)))
        }
    }
}

/// The layouts of bounds that `#VS` allows. One number stands for all values or, in ALTA's later versions, for the first;
/// the width of the rows tells which. A number for each value must be the same for all.
fn segments(file: &File<'_>, line: Option<Line<'_>>, values: usize) -> Result<Vec<Segments>, Error> {
    let Some((place, text)) = line else { return Ok(vec![Segments::NONE]) };
    let mut numbers: Vec<&str> = text.split_whitespace().collect();
    let several = numbers.len() > 1;
    if numbers.len() == values {
        numbers.dedup();
    }
    let each = match *numbers.as_slice() {
        ["0"] => 0,
        ["1"] => 1,
        ["2"] => 2,
        _ => {
            let expected = "0, 1 or 2 behind #VS, once or the same for each value";
            return Err(Error::malformed(file.path, place, expected, excerpt(text)));
        }
    };
    let all = Segments { each, all: true };
    Ok(if several { vec![all] } else { vec![all, Segments { each, all: false }] })
}

/// What the file says about the sample.
fn description(lines: &HashMap<&str, Line<'_>>) -> Option<String> {
    let said = ["SAMPLE", "ORIGIN", "URL"].iter().filter_map(|key| lines.get(key));
    let said = said.map(|(_, text)| short_line(text)).filter(|text| !text.is_empty());
    let text = said.collect::<Vec<_>>().join("; ");
    (!text.is_empty()).then_some(text)
}

/// A text without quotes and control characters.
fn short_line(text: &str) -> String {
    let unquoted = text.trim_matches('"');
    let cut: String = unquoted.chars().take(200).map(|c| if c.is_control() { ' ' } else { c }).collect();
    cut.trim().to_owned()
}
