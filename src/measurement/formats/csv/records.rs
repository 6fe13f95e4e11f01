//! The records of CSV as the standard has it: commas, and quotes around fields that contain them.

use crate::error::{Error, Place, excerpt};
use csv::StringRecord;
use std::path::Path;

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
