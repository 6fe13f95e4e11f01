//! The rows of a CSV text, read on all threads.

use super::records::records;
use crate::error::{Error, Place};
use crate::measurement::formats::file::File;
use crate::measurement::formats::rows::Part;
use csv::StringRecord;

/// Reads the header with `parse`, then passes every row to `row`, together with what `start` made for its part of the text.
///
/// # Errors
/// [`Error::Malformed`] for a text without a header, or a row that is not as wide; the errors of `parse`, as what was expected and what was
/// found, and of `row`.
pub(crate) fn read_rows<C: Sync, T: Send>(
    file: &File<'_>,
    text: &str,
    parse: impl Fn(&StringRecord) -> Result<C, (String, String)>,
    start: impl Fn(&C) -> T + Send + Sync,
    row: impl Fn(&C, &mut T, Place, &[&str]) -> Result<(), Error> + Send + Sync,
) -> Result<(C, Vec<T>), Error> {
    let headed = |header: Option<(Place, StringRecord)>| {
        let Some((place, header)) = header else {
            let expected = "a header naming the columns";
            return Err(Error::malformed(file.path, Place::File, expected, "only comments"));
        };
        let columns = parse(&header)
            .map_err(|(expected, found)| Error::malformed(file.path, place, expected, found))?;
        Ok((header.len(), columns))
    };
    let wide = |width: usize, place: Place, fields: usize| {
        if fields == width {
            return Ok(());
        }
        let expected = format!("{width} fields, as the header has");
        Err(Error::malformed(file.path, place, expected, format!("{fields}")))
    };
    if is_plain(text) {
        let mut rest = Part::new(text);
        let first = std::iter::from_fn(|| rest.next_line()).find(|(_, line)| is_record(line));
        let (width, columns) = headed(first.map(|(place, line)| (place, fields(line).collect())))?;
        let parts = rest.read(|part| {
            let mut read = start(&columns);
            let mut row_fields = Vec::new();
            for (place, line) in part.lines().filter(|(_, line)| is_record(line)) {
                row_fields.clear();
                row_fields.extend(fields(line));
                wide(width, place, row_fields.len())?;
                row(&columns, &mut read, place, &row_fields)?;
            }
            Ok(read)
        })?;
        return Ok((columns, parts));
    }
    let mut records = records(text).map(|record| record.map_err(|bad| bad.in_file(file.path)));
    let (width, columns) = headed(records.next().transpose()?)?;
    let mut read = start(&columns);
    for record in records {
        let (place, record) = record?;
        wide(width, place, record.len())?;
        row(&columns, &mut read, place, &record.iter().collect::<Vec<_>>())?;
    }
    Ok((columns, vec![read]))
}

/// Whether nothing in a text is quoted and no line ends in CR alone, so that lines are records and commas divide them.
fn is_plain(text: &str) -> bool {
    let mut after_cr = text.split('\r').skip(1);
    !text.contains('"') && !text.starts_with('\u{feff}') && after_cr.all(|rest| rest.starts_with('\n'))
}

/// Whether a line of a plain text is a record, neither blank nor a comment.
fn is_record(line: &str) -> bool {
    !line.starts_with('#') && !line.trim_start().is_empty()
}

/// The fields of a record of a plain text.
fn fields(record: &str) -> impl Iterator<Item = &str> {
    record.split(',').map(str::trim)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::path::Path;

    proptest! {
        /// The `csv` crate is the reference for texts that it need not read.
        #[test]
        fn a_plain_text_is_divided_as_the_csv_crate_does(text in "(a|#|,| |\t|\u{a0}|\n|\r\n){0,40}") {
            prop_assert!(is_plain(&text));
            let expected: Vec<(Place, Vec<String>)> = records(&text)
                .map(|record| record.unwrap())
                .map(|(place, fields)| (place, fields.iter().map(str::to_owned).collect()))
                .collect();
            let found: Vec<(Place, Vec<String>)> = Part::new(&text)
                .lines()
                .filter(|(_, line)| is_record(line))
                .map(|(place, line)| (place, fields(line).map(str::to_owned).collect()))
                .collect();
            prop_assert_eq!(found, expected);
        }
    }

    /// A text of several parts has the lines and the first error that a short one has.
    #[test]
    fn parts_keep_their_order() {
        let text: String = std::iter::once("a,b\n".to_owned())
            .chain(
                (1..100_000_usize).map(|k| format!("{k},{}{}\n", k * k, if k % 7 == 0 { "\r" } else { "" })),
            )
            .collect();
        let read = |text: &str| {
            let file = File::new(Path::new("long.csv"), text.as_bytes()).unwrap();
            read_rows(
                &file,
                text,
                |header| Ok(header.len()),
                |_| Vec::new(),
                |_, rows, place, fields| {
                    rows.push((place, fields.join(",")));
                    Ok(())
                },
            )
        };
        let (_, parts) = read(&text).unwrap();
        assert!(parts.len() > 2);
        for (index, (place, fields)) in parts.concat().into_iter().enumerate() {
            let k = index + 1;
            assert_eq!((place, fields), (Place::of_line(k + 1), format!("{k},{}", k * k)));
        }
        let wrong = text.replace("\n90000,", "\n").replace("\n60000,", "\n");
        let error = read(&wrong).unwrap_err().to_string();
        assert_eq!(error, "long.csv:60001: expected 2 fields, as the header has, found 1");
    }
}
