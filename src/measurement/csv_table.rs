//! The columns of this project's CSV, shared by its reader, its writer and `synth --at`.

use super::Channel;
use crate::error::{Error, Place, excerpt};
use csv::StringRecord;
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
    /// The error for the file that the line stands in.
    #[must_use]
    pub fn in_file(self, path: &Path) -> Error {
        Error::malformed(path, self.place, "comma-separated fields", self.found)
    }
}

/// The records of a CSV text with their lines; `#` comments and blank lines are left out, fields trimmed.
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
        // A line of nothing but white space is not a record.
        .filter(|r| !matches!(r, Ok((_, fields)) if fields.len() == 1 && fields.get(0) == Some("")))
}

/// Counts lines. The reader's own count stands before the blank lines and comments that it skips, and before the
/// second half of a CRLF.
struct Lines {
    /// All before this byte is counted.
    byte: usize,
    /// The line that it is in, from 1.
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
        self.line += passed.iter().map(|b| u64::from(*b == b'\n')).sum::<u64>();
        self.byte = self.byte.max(at);
        self.line
    }
}

/// Which column holds what.
#[derive(Clone, Debug)]
pub struct Columns {
    /// Of the four angles.
    pub angles: [usize; 4],
    /// The channels, in the order of their columns.
    pub channels: Vec<Channel>,
    /// Of each channel's values.
    pub values: Vec<usize>,
    /// Of `sigma` (no channel) and each `sigma_<channel>`.
    sigma: Vec<(Option<String>, usize)>,
}

impl Columns {
    /// Reads a header.
    ///
    /// # Errors
    /// What was expected and what was found.
    pub fn parse(header: &StringRecord) -> Result<Self, (String, String)> {
        let angles = Self::angles(header)?;
        let mut columns = Self { angles, channels: Vec::new(), values: Vec::new(), sigma: Vec::new() };
        for (index, name) in header.iter().enumerate() {
            if header.iter().take(index).any(|earlier| earlier == name) {
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
                columns.sigma.push((None, index));
            } else if let Some(channel) = name.strip_prefix("sigma_") {
                columns.sigma.push((Some(Channel::named(channel).name), index));
            } else {
                let channel = Channel::named(name);
                if columns.channels.iter().any(|c| c.name == channel.name) {
                    return Err(("channels that differ".to_owned(), format!("{} twice", excerpt(name))));
                }
                columns.channels.push(channel);
                columns.values.push(index);
            }
        }
        if columns.channels.is_empty() {
            return Err(("a column of values beside the angles".to_owned(), listed(header)));
        }
        let known = |name: &str| columns.channels.iter().any(|channel| channel.name == name);
        if let Some((Some(name), _)) =
            columns.sigma.iter().find(|(name, _)| name.as_deref().is_some_and(|name| !known(name)))
        {
            return Err((format!("a column '{name}' beside 'sigma_{name}'"), listed(header)));
        }
        Ok(columns)
    }

    /// Finds the four angles in a header that may hold anything else.
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

    /// The column of the standard deviation of a channel.
    #[must_use]
    pub fn sigma_of(&self, channel: &str) -> Option<usize> {
        let of = |wanted: Option<&str>| {
            self.sigma.iter().find(|(name, _)| name.as_deref() == wanted).map(|(_, column)| *column)
        };
        of(Some(channel)).or_else(|| of(None))
    }
}

/// The names in a header, as found.
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
        for text in [text.to_owned(), text.replace('\n', "\r\n")] {
            let lines: Vec<Place> = records(&text).map(|record| record.unwrap().0).collect();
            assert_eq!(lines, [3, 4, 8, 10].map(Place::Line), "{text:?}");
        }
    }
}
