//! Reads SSDD.

use super::parameters::{Pairs, Parameters};
use crate::error::{Error, Place, excerpt};
use crate::measurement::formats::fields::{finite, number};
use crate::measurement::formats::file::File;
use crate::measurement::formats::format::ReadOptions;
use crate::measurement::formats::tabulated::Tabulated;
use crate::measurement::{Channel, Instrument, Measurement, Remark};
use std::collections::HashSet;

/// The largest file that is read, bytes.
const MOST_BYTES: u64 = 1 << 31;
/// The keywords about the whole file.
const HEADER: [&str; 4] = ["VERSION", "SOFTWARE", "API", "DATE"];
/// The kinds of a block.
const KINDS: [&str; 4] = ["brdf", "btdf", "specular_reflectance", "specular_transmittance"];
/// The keywords of a block whose words are a text.
const TEXTS: [&str; 5] = ["NAME", "SOURCE_TYPE", "DEVICE", "CREATION_DATE", "MEASUREMENT_DATE"];
/// The lists of parameters.
const LISTS: [&str; 5] = ["PARAM0_LIST", "PARAM1_LIST", "PARAM2_LIST", "PARAM3_LIST", "PARAM4_LIST"];

pub(super) fn read(file: &mut File<'_>, _: &ReadOptions) -> Result<Measurement, Error> {
    file.with_bytes(MOST_BYTES, read_bytes)
}

fn read_bytes(file: &File<'_>, bytes: &[u8]) -> Result<Measurement, Error> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut text = Text { file, rest: bytes, line: 0 };
    let expected = "VERSION 0.1, 0.2 or 0.3";
    let first = text.need(expected)?;
    if !matches!(first.words().as_slice(), ["VERSION", number] if number.starts_with("0.")) {
        return Err(text.wrong(first.place, expected, &excerpt(first.text)));
    }
    let mut read = None;
    let mut remarks = Vec::new();
    let mut seen = HashSet::new();
    let mut begun = false;
    while let Some(line) = text.next()? {
        let words = line.words();
        match words.as_slice() {
            [keyword, ..] if HEADER.contains(keyword) && !begun => {}
            ["DATA_TYPE", kind] if KINDS.contains(kind) => {
                begun = true;
                if !seen.insert((*kind).to_owned()) {
                    return Err(text.wrong(
                        line.place,
                        "one block of each DATA_TYPE",
                        &format!("{kind} twice"),
                    ));
                }
                let block = Block::read(&mut text, kind)?;
                let table = block.table(&mut text, *kind == "brdf")?;
                let remark = match *kind {
                    "brdf" => {
                        read = Some(block.measurement(table));
                        continue;
                    }
                    "specular_reflectance" => Remark::MirrorLeftOut,
                    _ => Remark::TransmissionLeftOut,
                };
                if !remarks.contains(&remark) {
                    remarks.push(remark);
                }
            }
            _ => {
                let expected = format!("DATA_TYPE {}", KINDS.join(" or "));
                return Err(text.wrong(line.place, &expected, &excerpt(line.text)));
            }
        }
    }
    let Some(measurement) = read else {
        let mut kinds: Vec<String> = seen.into_iter().collect();
        kinds.sort_unstable();
        let found =
            if kinds.is_empty() { "no block".to_owned() } else { format!("only {}", kinds.join(", ")) };
        return Err(text.wrong(Place::File, "a block DATA_TYPE brdf", &found));
    };
    Ok(Measurement { remarks, ..measurement })
}

/// A line that has content.
#[derive(Clone, Copy)]
struct Line<'b> {
    place: Place,
    text: &'b str,
}

impl<'b> Line<'b> {
    /// Its words up to a comment.
    fn words(self) -> Vec<&'b str> {
        self.split_words().collect()
    }

    fn split_words(self) -> impl Iterator<Item = &'b str> {
        self.text.split('#').next().unwrap_or_default().split_whitespace()
    }
}

/// What is left of a file, which is text but for the tables.
struct Text<'f, 'p, 'b> {
    file: &'f File<'p>,
    rest: &'b [u8],
    line: usize,
}

impl<'b> Text<'_, '_, 'b> {
    /// The next line that is neither blank nor a comment.
    fn next(&mut self) -> Result<Option<Line<'b>>, Error> {
        while !self.rest.is_empty() {
            let line = self.rest.split_inclusive(|byte| *byte == b'\n').next().unwrap_or_default();
            self.rest = self.rest.get(line.len()..).unwrap_or_default();
            self.line += 1;
            let place = Place::of_line(self.line);
            let text = std::str::from_utf8(line).ok().filter(|text| !text.contains('\0'));
            let Some(text) = text.map(str::trim) else {
                return Err(self.wrong(place, "text in UTF-8", "bytes that are no text"));
            };
            if !text.is_empty() && !text.starts_with('#') {
                return Ok(Some(Line { place, text }));
            }
        }
        Ok(None)
    }

    /// The next line, which must exist.
    fn need(&mut self, expected: &str) -> Result<Line<'b>, Error> {
        self.next()?.ok_or_else(|| self.at_end(expected))
    }

    fn at_end(&self, expected: &str) -> Error {
        self.wrong(Place::of_line(self.line.max(1)), expected, "the end of the file")
    }

    fn wrong(&self, place: Place, expected: &str, found: &str) -> Error {
        Error::malformed(self.file.path, place, expected, found)
    }
}

/// What a block says before its table.
struct Block {
    channels: Vec<Channel>,
    parameters: Parameters,
    /// The lists of parameters, degrees; the last one is as long as the first.
    lists: [Vec<f64>; 5],
    binary: bool,
    description: Option<String>,
}

impl Block {
    fn read(text: &mut Text<'_, '_, '_>, kind: &str) -> Result<Self, Error> {
        let scatters = kind.ends_with("df");
        let mut colour = None;
        let mut wavelengths = Vec::new();
        let mut parameters = None;
        let mut lists: [Option<Vec<f64>>; 5] = [const { None }; 5];
        let mut said = Vec::new();
        let mut seen = HashSet::new();
        let (end, binary) = loop {
            let line = text.need("DATA ascii or DATA binary")?;
            let words = line.words();
            let Some((keyword, rest)) = words.split_first() else { continue };
            if !seen.insert(*keyword) {
                return Err(text.wrong(line.place, "each keyword once", &excerpt(line.text)));
            }
            let wrong = |expected: &str| Err(text.wrong(line.place, expected, &excerpt(line.text)));
            match (*keyword, rest) {
                ("DATA", ["ascii"]) => break (line.place, false),
                ("DATA", ["binary"]) => break (line.place, true),
                ("DATA", _) => return wrong("DATA ascii or DATA binary"),
                ("COLOR_MODEL", [model]) if MODELS.iter().any(|(name, _)| name == model) => {
                    colour = Some(*model)
                }
                ("COLOR_MODEL", _) => return wrong("COLOR_MODEL monochrome, rgb, xyz or spectrum"),
                ("WAVELENGTH_LIST", list) => wavelengths = spectrum(text, line, list)?,
                ("PARAM_TYPE", [name]) => {
                    parameters = Parameters::ALL.into_iter().find(|parameters| parameters.name() == *name);
                    if parameters.is_none() {
                        let names = Parameters::ALL.map(Parameters::name).join(" or ");
                        return wrong(&format!("PARAM_TYPE {names}"));
                    }
                }
                ("REDUCTION_TYPE", types)
                    if types.iter().all(|word| ["bilateral_symmetry", "reciprocity"].contains(word)) => {}
                ("REDUCTION_TYPE", _) => return wrong("REDUCTION_TYPE bilateral_symmetry or reciprocity"),
                (keyword, _) if TEXTS.contains(&keyword) => {
                    let words = line.text.get(keyword.len()..).unwrap_or_default().trim();
                    if ["NAME", "DEVICE", "MEASUREMENT_DATE"].contains(&keyword) && !words.is_empty() {
                        said.push(words);
                    }
                }
                (keyword, list) => {
                    let Some(place) = LISTS.iter().position(|name| *name == keyword) else {
                        return wrong("a keyword such as COLOR_MODEL, PARAM0_LIST or DATA");
                    };
                    if let Some(found) = lists.get_mut(place) {
                        *found = Some(numbers(text, line, list)?);
                    }
                }
            }
        };
        let missing = |what: &str| text.wrong(end, &format!("{what} before DATA"), "none");
        let colour = colour.ok_or_else(|| missing("COLOR_MODEL"))?;
        let channels = match MODELS.iter().find(|(name, _)| *name == colour) {
            Some((_, names)) if !names.is_empty() => names.iter().map(|name| Channel::named(name)).collect(),
            _ if wavelengths.is_empty() => return Err(missing("WAVELENGTH_LIST")),
            _ => wavelengths,
        };
        // The reflectance of a mirror depends on the incidence only.
        let parameters = match parameters {
            None if scatters => return Err(missing("PARAM_TYPE")),
            None => Parameters::Spherical,
            Some(parameters) => parameters,
        };
        let [first, second, third, fourth, offsets] = lists;
        let one = || vec![0.0];
        let first = first.ok_or_else(|| missing("PARAM0_LIST"))?;
        let [third, fourth] =
            [(third, "PARAM2_LIST"), (fourth, "PARAM3_LIST")].map(|(list, name)| match list {
                Some(list) if scatters => Ok(list),
                None if scatters => Err(missing(name)),
                _ => Ok(one()),
            });
        let offsets = match offsets {
            Some(offsets) if parameters.has_offsets() && offsets.len() != first.len() => {
                let expected = format!("{} offsets, one per angle of PARAM0_LIST", first.len());
                return Err(text.wrong(end, &expected, &offsets.len().to_string()));
            }
            Some(offsets) if parameters.has_offsets() => offsets,
            _ => vec![0.0; first.len()],
        };
        let lists = [first, second.unwrap_or_else(one), third?, fourth?, offsets];
        for (number, (list, name)) in lists.iter().zip(LISTS).enumerate().take(4) {
            for angle in list {
                if let Err(most) = parameters.check(number, *angle) {
                    let expected = format!("{name} from 0 to {most} degrees");
                    return Err(text.wrong(end, &expected, &angle.to_string()));
                }
            }
        }
        let said: String =
            said.join("; ").chars().map(|c| if c.is_control() { ' ' } else { c }).take(300).collect();
        Ok(Self { channels, parameters, lists, binary, description: (!said.is_empty()).then_some(said) })
    }

    /// The samples of the table, which are only counted if they are not kept.
    fn table(&self, text: &mut Text<'_, '_, '_>, keep: bool) -> Result<Tabulated, Error> {
        let channels = self.channels.len();
        let mut sizes = self.lists.iter().take(4).map(Vec::len).chain([channels]);
        let numbers = sizes.try_fold(1_usize, usize::checked_mul);
        // A number takes four bytes, or a digit and a blank; the last blank may be missing.
        let room = if self.binary { text.rest.len() / 4 } else { text.rest.len().div_ceil(2) };
        if numbers.is_none_or(|numbers| numbers > room) {
            let many = numbers.map_or_else(|| "more than 2^64".to_owned(), |numbers| numbers.to_string());
            let expected = format!("{many} numbers after DATA, as the lists say");
            let found = format!("{} bytes", text.rest.len());
            return Err(text.wrong(Place::of_line(text.line), &expected, &found));
        }
        let mut table = Tabulated::new(channels);
        let mut colour = Vec::with_capacity(channels);
        for (pair, twins) in Pairs::new(self.parameters, &self.lists).iter() {
            colour.clear();
            if self.binary {
                self.floats(text, &mut colour)?
            } else {
                self.words(text, &mut colour)?
            }
            if keep {
                table.take(pair, twins, &colour, |_| false);
            }
        }
        Ok(table)
    }

    /// The next colour of a table that is text.
    fn words(&self, text: &mut Text<'_, '_, '_>, colour: &mut Vec<f64>) -> Result<(), Error> {
        let expected = || format!("a line of {} numbers, as the lists say", self.channels.len());
        let Some(line) = text.next()? else { return Err(text.at_end(&expected())) };
        let mut words = 0;
        for word in line.split_words() {
            words += 1;
            colour.extend(number(word));
        }
        if words != self.channels.len() {
            return Err(text.wrong(line.place, &expected(), &excerpt(line.text)));
        }
        if colour.len() == words {
            return Ok(());
        }
        let mut named = line.split_words().zip(&self.channels);
        named.try_for_each(|(word, channel)| {
            finite(text.file, line.place, &channel.name, word)?;
            Ok(())
        })
    }

    /// The next colour of a table of floats.
    fn floats(&self, text: &mut Text<'_, '_, '_>, colour: &mut Vec<f64>) -> Result<(), Error> {
        for channel in &self.channels {
            let Some((word, rest)) = text.rest.split_first_chunk::<4>() else {
                return Err(text.wrong(
                    Place::of_line(text.line),
                    "a float for each value",
                    "the end of the file",
                ));
            };
            let value = f64::from(f32::from_le_bytes(*word));
            if !value.is_finite() {
                let expected = format!("a finite number for {}", crate::error::short(&channel.name));
                return Err(text.wrong(Place::of_line(text.line), &expected, &value.to_string()));
            }
            text.rest = rest;
            colour.push(value);
        }
        Ok(())
    }

    fn measurement(self, table: Tabulated) -> Measurement {
        let instrument = Instrument { description: self.description, ..Instrument::default() };
        Measurement { instrument, ..table.measurement(self.channels) }
    }
}

/// The channels of each colour model but a spectrum, which lists them.
const MODELS: [(&str, &[&str]); 4] =
    [("monochrome", &["f"]), ("rgb", &["r", "g", "b"]), ("xyz", &["X", "Y", "Z"]), ("spectrum", &[])];

/// The numbers of a list.
fn numbers(text: &Text<'_, '_, '_>, line: Line<'_>, words: &[&str]) -> Result<Vec<f64>, Error> {
    if words.is_empty() {
        return Err(text.wrong(line.place, "a list of numbers", &excerpt(line.text)));
    }
    words.iter().map(|word| finite(text.file, line.place, "the list", word)).collect()
}

/// The channels of a list of wavelengths.
fn spectrum(text: &Text<'_, '_, '_>, line: Line<'_>, words: &[&str]) -> Result<Vec<Channel>, Error> {
    let list = numbers(text, line, words)?;
    let mut seen = HashSet::new();
    for nm in &list {
        if *nm <= 0.0 || !seen.insert(nm.to_bits()) {
            return Err(text.wrong(line.place, "positive wavelengths in nm, each once", &nm.to_string()));
        }
    }
    Ok(list.into_iter().map(Channel::at_wavelength).collect())
}
