//! CSV tables of others, whose columns are found by name.

use super::csv::records;
use super::file::File;
use crate::error::{Error, Place, excerpt, listed};

/// The first line of a file that is neither blank nor a comment, as fields; `None` if the file is not text.
fn header(file: &File<'_>) -> Option<Vec<String>> {
    let head = file.head(65536);
    if head.contains(&0) {
        return None;
    }
    let head = String::from_utf8_lossy(head);
    let mut lines = head.trim_start_matches('\u{feff}').lines().map(str::trim);
    let line = lines.find(|line| !line.is_empty() && !line.starts_with('#'))?;
    Some(line.split(',').map(|field| field.trim().trim_matches('"').to_owned()).collect())
}

/// Whether the header of a file has at least `least` of these columns.
pub(super) fn has(file: &File<'_>, columns: &[&str], least: usize) -> bool {
    header(file).is_some_and(|header| {
        columns.iter().filter(|column| header.iter().any(|field| field == **column)).count() >= least
    })
}

/// Passes the fields of these columns to `take`, row by row.
///
/// # Errors
/// [`Error::Malformed`] for a column that is missing or a row that is not as wide as the header; the errors of `take`.
pub(super) fn for_each_row<const N: usize>(
    file: &File<'_>,
    text: &str,
    columns: &[&str; N],
    mut take: impl FnMut(Place, [&str; N]) -> Result<(), Error>,
) -> Result<(), Error> {
    let mut records = records(text);
    let Some((place, header)) = records.next().transpose().map_err(|bad| bad.in_file(file.path))? else {
        return Err(Error::malformed(file.path, Place::File, "a header naming the columns", "only comments"));
    };
    let mut indices = [0; N];
    for (index, column) in indices.iter_mut().zip(columns) {
        *index = header.iter().position(|field| field == *column).ok_or_else(|| {
            let expected = format!("a header with a column '{column}'");
            let names: Vec<&str> = header.iter().collect();
            Error::malformed(file.path, place, expected, excerpt(&listed(&names)))
        })?;
    }
    for record in records {
        let (place, fields) = record.map_err(|bad| bad.in_file(file.path))?;
        if fields.len() != header.len() {
            let expected = format!("{} fields, as the header has", header.len());
            return Err(Error::malformed(file.path, place, expected, format!("{}", fields.len())));
        }
        take(place, indices.map(|index| fields.get(index).unwrap_or_default()))?;
    }
    Ok(())
}

/// What the first comment of a text says, as a description.
pub(super) fn first_comment(text: &str) -> Option<String> {
    let comment = text.lines().next()?.trim_start_matches('\u{feff}').strip_prefix('#')?.trim();
    let clean: String = comment.chars().take(200).map(|c| if c.is_control() { ' ' } else { c }).collect();
    (!clean.is_empty()).then_some(clean)
}
