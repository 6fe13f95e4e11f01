//! The rows of a table, read piece by piece and on all threads.

use super::dialect::{Beginning, Dialect, beginning};
use crate::error::{Error, Place, excerpt};
use crate::measurement::formats::file::File;
use crate::measurement::reading::TableLayout;
use std::borrow::Cow;

/// The fields of a row.
#[derive(Clone, Copy)]
pub(super) struct Fields<'r>(&'r [Cow<'r, str>]);

impl<'r> Fields<'r> {
    /// The field of a column.
    pub(super) fn at(self, column: usize) -> &'r str {
        self.0.get(column).map(AsRef::as_ref).unwrap_or_default()
    }
}

/// Finds the header, gives it to `parse`, then passes every row to `row` together with what `start` made for its piece of the text.
/// The pieces go to `join` in their order, while the next ones are read: the text is never in memory as a whole.
///
/// # Errors
/// [`Error::Malformed`] for a text without a header, or a row that is not as wide; the errors of `parse` and `row`.
pub(super) fn read_table<C: Sync + Send, T: Send>(
    file: &mut File<'_>,
    layout: &TableLayout,
    parse: impl Fn(&Beginning) -> Result<C, Error> + Send + Sync,
    start: impl Fn(&C) -> T + Send + Sync,
    row: impl Fn(&C, &mut T, Place, Fields<'_>) -> Result<(), Error> + Send + Sync,
    mut join: impl FnMut(T) + Send,
) -> Result<C, Error> {
    let path = file.path;
    let mut begun: Option<(Dialect, usize, C)> = None;
    file.with_lines(|mut part| {
        let (dialect, width, columns) = match &begun {
            Some(begun) => begun,
            None => {
                let beginning =
                    beginning(part.text(), layout).map_err(|(place, bad)| bad.in_file(path, place))?;
                for _ in 0..beginning.lines_before {
                    part.next_line();
                }
                let columns = parse(&beginning)?;
                begun.insert((beginning.dialect, beginning.names.len(), columns))
            }
        };
        let pieces = part.read(|piece| {
            let mut read = start(columns);
            let mut divided: Vec<Cow<'_, str>> = Vec::new();
            let may_be_quoted = piece.text().contains('"');
            for (place, line) in piece.lines() {
                if line.starts_with('#') || line.trim_start().is_empty() {
                    continue;
                }
                divided.clear();
                dialect.divide(line, may_be_quoted, &mut divided);
                // A separator at the end of a row adds an empty field; spreadsheets fill rows with separators alone.
                if divided.len() == width + 1 && divided.last().is_some_and(|field| field.is_empty()) {
                    divided.pop();
                }
                let is_first_empty = divided.first().is_none_or(|field| field.is_empty());
                if is_first_empty && divided.iter().all(|field| field.is_empty()) {
                    continue;
                }
                if divided.len() != *width {
                    let expected = format!("{width} fields, as the header has");
                    let found = if divided.len() == 2 * width || line.contains('"') {
                        format!("{}: {}", divided.len(), excerpt(line))
                    } else {
                        divided.len().to_string()
                    };
                    return Err(Error::malformed(path, place, expected, found));
                }
                row(columns, &mut read, place, Fields(&divided))?;
            }
            Ok(read)
        })?;
        pieces.into_iter().for_each(&mut join);
        Ok(())
    })?;
    match begun {
        Some((_, _, columns)) => Ok(columns),
        None => Err(Error::malformed(path, Place::File, "a header naming the columns", "only comments")),
    }
}
