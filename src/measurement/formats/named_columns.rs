//! CSV tables of others, whose columns are found by name.

use super::csv::read_rows;
use super::file::File;
use crate::error::{Error, Place, excerpt, listed};
use ::csv::StringRecord;

/// The first line of a file that is neither blank nor a comment, as fields; `None` if the file is not text.
fn header(file: &File<'_>) -> Option<Vec<String>> {
    if file.head(65536).contains(&0) {
        return None;
    }
    let line = file.first_line(65536)?;
    Some(line.split(',').map(|field| field.trim().trim_matches('"').to_owned()).collect())
}

/// Whether the header of a file has at least `least` of these columns.
pub(super) fn has(file: &File<'_>, columns: &[&str], least: usize) -> bool {
    header(file).is_some_and(|header| {
        columns.iter().filter(|column| header.iter().any(|field| field == **column)).count() >= least
    })
}

/// Passes the fields of these columns to `take`, row by row, together with what `start` made for the row's part of the text. The result
/// are these parts.
///
/// # Errors
/// [`Error::Malformed`] for a column that is missing or a row that is not as wide as the header; the errors of `take`.
pub(super) fn read_columns<T: Send, const N: usize>(
    file: &File<'_>,
    text: &str,
    columns: &[&str; N],
    start: impl Fn() -> T + Send + Sync,
    take: impl Fn(&mut T, Place, [&str; N]) -> Result<(), Error> + Send + Sync,
) -> Result<Vec<T>, Error> {
    let parse = |header: &StringRecord| {
        let mut indices = [0; N];
        for (index, column) in indices.iter_mut().zip(columns) {
            *index = header.iter().position(|field| field == *column).ok_or_else(|| {
                let names: Vec<&str> = header.iter().collect();
                (format!("a header with a column '{column}'"), excerpt(&listed(&names)))
            })?;
        }
        Ok(indices)
    };
    let row = |indices: &[usize; N], part: &mut T, place, fields: &[&str]| {
        take(part, place, indices.map(|index| fields.get(index).copied().unwrap_or_default()))
    };
    Ok(read_rows(file, text, parse, |_| start(), row)?.1)
}

/// What the first comment of a text says, as a description.
pub(super) fn first_comment(text: &str) -> Option<String> {
    let comment = text.lines().next()?.trim_start_matches('\u{feff}').strip_prefix('#')?.trim();
    let clean: String = comment.chars().take(200).map(|c| if c.is_control() { ' ' } else { c }).collect();
    (!clean.is_empty()).then_some(clean)
}
