//! Reads Zemax's tabular BSDF.

use super::keywords::{LISTS, WORDS, is};
use crate::error::{Error, Place, excerpt};
use crate::geometry::{Pair, direction};
use crate::measurement::formats::fields::{finite, no_number, number};
use crate::measurement::formats::file::File;
use crate::measurement::formats::format::ReadOptions;
use crate::measurement::formats::specular::{Around, Frame};
use crate::measurement::formats::tabulated::{Listed, Tabulated};
use crate::measurement::{Channel, Instrument, Measurement, Remark, TotalScatter};
use rayon::prelude::*;
use std::collections::BTreeMap;

pub(super) fn read(file: &mut File<'_>, _: &ReadOptions) -> Result<Measurement, Error> {
    file.with_text(read_text)
}

fn read_text(file: &File<'_>, text: &str) -> Result<Measurement, Error> {
    let mut lines = Lines::new(file, text);
    let header = Header::read(&mut lines)?;
    let mut total_scatter = Vec::new();
    let mut planes = Vec::new();
    for (index, name) in header.channels.iter().enumerate() {
        // One channel says how much is scattered: the only one, or that of the luminance, which is the middle one.
        let counts = index == header.channels.len() / 2;
        planes.push(header.plane(&mut lines, name, counts.then_some(&mut total_scatter))?);
    }
    if let Some(line) = lines.next() {
        return Err(lines.wrong(
            line.place,
            "the end of the file after the last DataEnd",
            &excerpt(line.text),
        ));
    }
    let instrument = Instrument { description: description(text), total_scatter, ..Instrument::default() };
    Ok(Measurement { instrument, ..header.measurement(&planes) })
}

/// A line that has content.
#[derive(Clone, Copy)]
struct Line<'t> {
    place: Place,
    text: &'t str,
}

/// The lines of a text that are neither blank nor comments.
struct Lines<'f, 'p, 't> {
    file: &'f File<'p>,
    lines: std::iter::Enumerate<std::str::Lines<'t>>,
    /// A line that was looked at and is still to come.
    ahead: Option<Line<'t>>,
    last: Place,
}

impl<'f, 'p, 't> Lines<'f, 'p, 't> {
    fn new(file: &'f File<'p>, text: &'t str) -> Self {
        Self { file, lines: text.lines().enumerate(), ahead: None, last: Place::of_line(1) }
    }

    fn peek(&mut self) -> Option<Line<'t>> {
        if self.ahead.is_none() {
            let content = |line: &str| !line.is_empty() && !line.starts_with('#');
            let (index, text) = self.lines.find(|(_, line)| content(line.trim()))?;
            self.last = Place::of_line(index + 1);
            self.ahead = Some(Line { place: self.last, text: text.trim() });
        }
        self.ahead
    }

    fn next(&mut self) -> Option<Line<'t>> {
        let line = self.peek();
        self.ahead = None;
        line
    }

    /// The next line, which must exist.
    fn need(&mut self, expected: &str) -> Result<Line<'t>, Error> {
        self.next().ok_or_else(|| self.wrong(self.last, expected, "the end of the file"))
    }

    /// The next line, which must be this word.
    fn word(&mut self, word: &str) -> Result<(), Error> {
        let line = self.need(word)?;
        if is(line.text, word) { Ok(()) } else { Err(self.wrong(line.place, word, &excerpt(line.text))) }
    }

    fn wrong(&self, place: Place, expected: &str, found: &str) -> Error {
        Error::malformed(self.file.path, place, expected, found)
    }
}

/// The values at one azimuth about a mirror direction.
struct Row<'t> {
    line: Line<'t>,
    incidence: f64,
    azimuth: f64,
}

/// Number of rows that a thread reads at a time.
const ROWS: usize = 256;

/// What a header says.
struct Header {
    channels: &'static [&'static str],
    /// Lists of angles in degrees, in the order of [`LISTS`].
    rotations: Vec<f64>,
    incidences: Vec<f64>,
    azimuths: Vec<f64>,
    radials: Vec<f64>,
}

impl Header {
    /// Reads up to the line before the first channel.
    fn read(lines: &mut Lines<'_, '_, '_>) -> Result<Self, Error> {
        let mut found: BTreeMap<&str, &str> = BTreeMap::new();
        let mut lists: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        while let Some(line) = lines.peek() {
            let mut words = line.text.split_whitespace();
            let first = words.next().unwrap_or_default();
            let Some(keyword) = WORDS.iter().chain(&LISTS).find(|keyword| is(first, keyword)).copied() else {
                break;
            };
            lines.next();
            if found.contains_key(keyword) || lists.contains_key(keyword) {
                return Err(lines.wrong(line.place, "each keyword once", &excerpt(line.text)));
            }
            let rest: Vec<&str> = words.collect();
            if LISTS.contains(&keyword) {
                lists.insert(keyword, angles(lines, line, keyword, &rest)?);
                continue;
            }
            let &[word] = rest.as_slice() else {
                return Err(lines.wrong(
                    line.place,
                    &format!("one word after {keyword}"),
                    &excerpt(line.text),
                ));
            };
            allowed(lines, line, keyword, word)?;
            found.insert(keyword, word);
        }
        // `Source` has one value only, which says nothing.
        let needed = WORDS.iter().chain(&LISTS).filter(|keyword| **keyword != "Source");
        let missing: Vec<&str> =
            needed.filter(|k| !found.contains_key(*k) && !lists.contains_key(*k)).copied().collect();
        if !missing.is_empty() {
            let expected = missing.join(", ");
            let line = lines.need(&expected)?;
            return Err(lines.wrong(line.place, &expected, &excerpt(line.text)));
        }
        let content = found.get("SpectralContent").copied().unwrap_or_default();
        let channels =
            CONTENTS.iter().find(|(name, _)| is(name, content)).map_or(ONE, |(_, channels)| *channels);
        let mut list = |name| lists.remove(name).unwrap_or_default();
        let [rotations, incidences, azimuths, radials] = LISTS.map(&mut list);
        Ok(Self { channels, rotations, incidences, azimuths, radials })
    }

    /// Reads the values of one channel.
    fn plane(
        &self,
        lines: &mut Lines<'_, '_, '_>,
        channel: &str,
        mut scattered: Option<&mut Vec<TotalScatter>>,
    ) -> Result<Vec<f64>, Error> {
        let expected =
            if self.channels.len() == 1 { "Monochrome".to_owned() } else { format!("Tristimulus{channel}") };
        let line = lines.need(&expected)?;
        let short = line.text.strip_prefix("Tristimulus").unwrap_or(line.text);
        if !(is(line.text, &expected) || is(short, channel)) {
            return Err(lines.wrong(line.place, &expected, &excerpt(line.text)));
        }
        lines.word("DataBegin")?;
        // Rows are found one after the other, but read on all threads. Those before a fault may have an earlier one.
        let mut rows = Vec::new();
        let found = self.rows(lines, &mut rows, &mut scattered);
        let file = lines.file;
        let pieces = rows.par_chunks(ROWS).map(|rows| self.values(file, rows)).collect::<Vec<_>>();
        let values = pieces.into_iter().collect::<Result<Vec<_>, _>>()?.concat();
        found?;
        lines.word("DataEnd")?;
        Ok(values)
    }

    /// Finds the rows of a channel.
    fn rows<'t>(
        &self,
        lines: &mut Lines<'_, '_, 't>,
        rows: &mut Vec<Row<'t>>,
        scattered: &mut Option<&mut Vec<TotalScatter>>,
    ) -> Result<(), Error> {
        let expected = self.row_in_words();
        for rotation in &self.rotations {
            for incidence in &self.incidences {
                let share = total(lines)?;
                if let Some(scattered) = scattered {
                    scattered.push(TotalScatter::new(*incidence, *rotation, share));
                }
                for azimuth in &self.azimuths {
                    let line = lines.need(&expected)?;
                    rows.push(Row { line, incidence: *incidence, azimuth: *azimuth });
                }
            }
        }
        Ok(())
    }

    /// Reads the values of rows.
    fn values(&self, file: &File<'_>, rows: &[Row<'_>]) -> Result<Vec<f64>, Error> {
        let mut values = Vec::new();
        for Row { line, incidence, azimuth } in rows {
            let before = values.len();
            for word in line.text.split_whitespace() {
                values.push(number(word).ok_or_else(|| {
                    let what = format!("incidence {incidence}, azimuth {azimuth}");
                    no_number(file, line.place, &what, word)
                })?);
            }
            let found = values.len() - before;
            if found != self.radials.len() {
                return Err(Error::malformed(file.path, line.place, self.row_in_words(), found.to_string()));
            }
        }
        Ok(values)
    }

    fn row_in_words(&self) -> String {
        format!("{} values, one per radial angle", self.radials.len())
    }

    /// The samples of these values, in the order of the file.
    fn measurement(&self, planes: &[Vec<f64>]) -> Measurement {
        let mut table = Tabulated::new(planes.len());
        let mut rows: Vec<_> = planes.iter().map(|plane| plane.iter()).collect();
        let mut sample = Vec::new();
        let empty = |sample: &[f64]| sample.iter().all(|value| *value == 0.0);
        let angles =
            self.rotations.iter().flat_map(|phi| self.incidences.iter().map(move |theta| [*theta, *phi]));
        let lights: Vec<[f64; 2]> = angles.map(|angles| angles.map(f64::to_radians)).collect();
        let listed_lights = Listed::all(lights.iter().map(|[theta, phi]| direction(*theta, *phi)));
        let views = Around::all(&self.radials, &self.azimuths);
        let listed_views = Listed::all(views.iter().map(|view| view.direction()));
        for ([theta, phi], light) in lights.into_iter().zip(listed_lights) {
            let (wi, frame) = (direction(theta, phi), Frame::new(theta, phi));
            for (around, view) in views.iter().zip(&listed_views) {
                sample.clear();
                sample.extend(rows.iter_mut().filter_map(Iterator::next));
                let twins = light.turning(*view, views.len());
                table.take(Pair { wi, wo: frame.view(*around) }, twins, &sample, empty);
            }
        }
        let mut measurement =
            table.measurement(self.channels.iter().map(|name| Channel::named(name)).collect());
        if self.rotations.len() > 1 {
            let what = "the rotation of the sample was taken as the azimuth of the light".to_owned();
            measurement.remarks.push(Remark::Assumed { what });
        }
        measurement
    }
}

/// The channel of a file without colour.
const ONE: &[&str] = &["f"];
/// The channels of each spectral content.
const CONTENTS: [(&str, &[&str]); 3] =
    [("Monochrome", ONE), ("XYZ", &["X", "Y", "Z"]), ("RGB", &["r", "g", "b"])];

/// Checks the word of a keyword.
fn allowed(lines: &Lines<'_, '_, '_>, line: Line<'_>, keyword: &str, word: &str) -> Result<(), Error> {
    let known: &[&str] = match keyword {
        "Symmetry" => &["PlaneSymmetrical", "Asymmetrical", "Asymmetrical4D"],
        "SpectralContent" => &["Monochrome", "XYZ", "RGB"],
        "ScatterType" => &["BRDF"],
        _ => return Ok(()),
    };
    if known.iter().any(|known| is(word, known)) {
        return Ok(());
    }
    let found = if keyword == "ScatterType" && is(word, "BTDF") {
        "BTDF: transmission is not read".to_owned()
    } else {
        excerpt(word)
    };
    Err(lines.wrong(line.place, &format!("{keyword} {}", known.join(" or ")), &found))
}

/// The angles of a list, which are on the lines after their number.
fn angles(
    lines: &mut Lines<'_, '_, '_>,
    line: Line<'_>,
    keyword: &str,
    rest: &[&str],
) -> Result<Vec<f64>, Error> {
    let number = match rest {
        [number] => number.parse::<usize>().ok().filter(|number| *number > 0),
        _ => None,
    };
    let Some(number) = number else {
        let expected = format!("the number of angles after {keyword}");
        return Err(lines.wrong(line.place, &expected, &excerpt(line.text)));
    };
    let (least, most) = match keyword {
        "AngleOfIncidence" => (0.0, 90.0),
        "ScatterRadial" => (0.0, 180.0),
        _ => (-360.0, 360.0),
    };
    let expected = format!("{number} angles of {keyword}");
    let mut angles = Vec::new();
    while angles.len() < number {
        let line = lines.need(&expected)?;
        for word in line.text.split_whitespace() {
            let angle = finite(lines.file, line.place, keyword, word)?;
            if !(least..=most).contains(&angle) {
                let expected = format!("{keyword} from {least} to {most} degrees");
                return Err(lines.wrong(line.place, &expected, &excerpt(word)));
            }
            angles.push(angle);
        }
        if angles.len() > number {
            return Err(lines.wrong(line.place, &expected, &angles.len().to_string()));
        }
    }
    Ok(angles)
}

/// The total integrated scatter of a block.
fn total(lines: &mut Lines<'_, '_, '_>) -> Result<f64, Error> {
    let expected = "TIS and a number";
    let line = lines.need(expected)?;
    match line.text.split_whitespace().collect::<Vec<_>>().as_slice() {
        [keyword, number] if is(keyword, "TIS") => finite(lines.file, line.place, "TIS", number),
        _ => Err(lines.wrong(line.place, expected, &excerpt(line.text))),
    }
}

/// What the comments before the header say, in one line; `None` if there are none.
fn description(text: &str) -> Option<String> {
    /// The largest number of characters.
    const LONGEST: usize = 300;
    let comments = text.lines().map(str::trim).take_while(|line| line.is_empty() || line.starts_with('#'));
    let said: Vec<&str> =
        comments.map(|line| line.trim_matches(['#', ' ', '\t'])).filter(|line| !line.is_empty()).collect();
    let said: String =
        said.join("; ").chars().map(|c| if c.is_control() { ' ' } else { c }).take(LONGEST).collect();
    (!said.is_empty()).then_some(said)
}
