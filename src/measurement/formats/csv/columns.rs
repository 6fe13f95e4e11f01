//! The columns of this project's CSV, shared by its reader, its writer and `synth --at`, and the records of any CSV.

use crate::error::{Error, Place, excerpt};
use crate::measurement::Channel;
use csv::StringRecord;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// The columns that every table has, in degrees.
pub const ANGLES: [&str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];

/// A line that is not CSV.
#[derive(Debug)]
pub struct BadRecord {
    place: Place,
    found: String,
}

impl BadRecord {
    /// The error for the file that contains the line.
    #[must_use]
    pub fn in_file(self, path: &Path) -> Error {
        Error::malformed(path, self.place, "comma-separated fields", self.found)
    }
}

/// The records of a CSV text, with their lines. `#` comments and blank lines are skipped, and fields are trimmed.
pub fn records(text: &str) -> impl Iterator<Item = Result<(Place, StringRecord), BadRecord>> {
    let mut lines = Lines { byte: 0, line: 1 };
    csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes())
        .into_records()
        .map(move |record| {
            let mut place = |position: Option<&csv::Position>| {
                position.map_or(Place::File, |p| Place::Line(lines.of_record(text, p.byte())))
            };
            match record {
                Ok(record) => Ok((place(record.position()), record)),
                Err(error) => {
                    Err(BadRecord { place: place(error.position()), found: excerpt(&error.to_string()) })
                }
            }
        })
        // A line of white space only is not a record.
        .filter(|r| !matches!(r, Ok((_, fields)) if fields.len() == 1 && fields.get(0) == Some("")))
}

/// Counts lines. The reader's own count is taken before the blank lines and comments that it skips, and before the
/// second half of a CRLF.
struct Lines {
    /// Everything before this byte has been counted.
    byte: usize,
    /// The line that this byte is in, from 1.
    line: u64,
}

impl Lines {
    /// The line of the first record at or after `byte`.
    fn of_record(&mut self, text: &str, byte: u64) -> u64 {
        let bytes = text.as_bytes();
        let mut at = usize::try_from(byte).unwrap_or(usize::MAX);
        loop {
            at = match bytes.get(at) {
                Some(b'\r' | b'\n') => at + 1,
                Some(b'#') => {
                    let rest = bytes.get(at..).unwrap_or_default();
                    at + rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len())
                }
                _ => break,
            };
        }
        let passed = bytes.get(self.byte..at).unwrap_or_default();
        // A line ends with LF, CR LF or CR alone. LF after CR belongs to the same line end, even if the last record
        // ended between them.
        let before = self.byte.checked_sub(1).and_then(|byte| bytes.get(byte)).copied();
        let mut previous = before.unwrap_or_default();
        for byte in passed {
            self.line += u64::from(*byte == b'\r' || (*byte == b'\n' && previous != b'\r'));
            previous = *byte;
        }
        self.byte = self.byte.max(at);
        self.line
    }
}

/// The contents of each column.
#[derive(Clone, Debug)]
pub struct Columns {
    /// The columns of the four angles.
    pub angles: [usize; 4],
    /// The channels, in the order of their columns.
    pub channels: Vec<Channel>,
    /// The column of each channel's values.
    pub values: Vec<usize>,
    /// The column of each channel's standard deviations: `sigma_<channel>`, or else `sigma`; `None` if there is
    /// neither.
    pub sigma: Vec<Option<usize>>,
}

impl Columns {
    /// Parses a header.
    ///
    /// # Errors
    /// What was expected and what was found.
    pub fn parse(header: &StringRecord) -> Result<Self, (String, String)> {
        let mut columns = Self {
            angles: Self::angles(header)?,
            channels: Vec::new(),
            values: Vec::new(),
            sigma: Vec::new(),
        };
        // These are sets, because a header may be as wide as a file is long.
        let (mut seen, mut channels) = (HashSet::new(), HashSet::new());
        let mut sigma_of_all = None;
        let mut sigma_of = HashMap::new();
        for (index, name) in header.iter().enumerate() {
            if !seen.insert(name) {
                return Err(("column names that differ".to_owned(), format!("{} twice", excerpt(name))));
            }
            if name.contains(char::is_control) {
                return Err(("column names without control characters".to_owned(), excerpt(name)));
            }
            if name.is_empty() {
                return Err(("a name for every column".to_owned(), format!("none for column {}", index + 1)));
            }
            if ANGLES.contains(&name) {
                continue;
            }
            if name == "sigma" {
                sigma_of_all = Some(index);
            } else if let Some(channel) = name.strip_prefix("sigma_") {
                // If one wavelength is spelled in several ways, the first one counts.
                sigma_of.entry(Channel::named(channel).name).or_insert(index);
            } else {
                let channel = Channel::named(name);
                if !channels.insert(channel.name.clone()) {
                    return Err(("channels that differ".to_owned(), format!("{} twice", excerpt(name))));
                }
                columns.channels.push(channel);
                columns.values.push(index);
            }
        }
        if columns.channels.is_empty() {
            return Err(("a column of values beside the angles".to_owned(), listed(header)));
        }
        // The first in the header, so that the message does not depend on the order of a hash table.
        let stray =
            sigma_of.iter().filter(|(name, _)| !channels.contains(*name)).min_by_key(|(_, index)| **index);
        if let Some((name, _)) = stray {
            let (name, sigma) = (excerpt(name), excerpt(&format!("sigma_{name}")));
            return Err((format!("a column {name} beside {sigma}"), listed(header)));
        }
        columns.sigma =
            columns.channels.iter().map(|c| sigma_of.get(&c.name).copied().or(sigma_of_all)).collect();
        Ok(columns)
    }

    /// Finds the four angles in a header that may contain anything else.
    ///
    /// # Errors
    /// What was expected and what was found.
    pub fn angles(header: &StringRecord) -> Result<[usize; 4], (String, String)> {
        let mut angles = [0; 4];
        for (column, name) in angles.iter_mut().zip(ANGLES) {
            *column = header
                .iter()
                .position(|field| field == name)
                .ok_or_else(|| (format!("a header with a column '{name}'"), listed(header)))?;
        }
        Ok(angles)
    }
}

/// The names in a header, for a message.
fn listed(header: &StringRecord) -> String {
    let names: Vec<&str> = header.iter().collect();
    excerpt(&names.join(","))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_those_of_an_editor() {
        let text = "# comment\n\na,b\n1,2\n# another\n   \n\n\"3\n3\",4\n5,6\n";
        let lines = |text: &str| -> Vec<Place> { records(text).map(|record| record.unwrap().0).collect() };
        for text in [text.to_owned(), text.replace('\n', "\r\n")] {
            assert_eq!(lines(&text), [3, 4, 8, 10].map(Place::Line), "{text:?}");
        }
        // The CSV reader ends comments only at LF.
        assert_eq!(lines("a,b\r\r1,2\r\"3\r3\",4\r5,6"), [1, 3, 4, 6].map(Place::Line));
    }
}
