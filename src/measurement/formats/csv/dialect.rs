//! How a table is written: what divides its fields, where its header is, and how it writes fractions.

use super::columns::{BadHeader, Columns, EXACT, Header};
use super::names::{Role, is_unit, role};
use super::number::{has_decimal_comma, is_missing, number};
use crate::error::{OptionName, Place, excerpt};
use crate::measurement::formats::rows::Part;
use crate::measurement::reading::{Angle, AngleUnits, ColumnChoice, DecimalMark, Separator, TableLayout};
use std::borrow::Cow;

/// The header is looked for among so many lines that are not blank.
const LINES_SEARCHED: usize = 1000;
/// So many rows are looked at to understand the columns.
const ROWS_SEEN: usize = 40;

/// How the rows of a table are divided into fields, and its numbers into whole and fraction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Dialect {
    pub(super) separator: Separator,
    pub(super) decimal_comma: bool,
}

impl Dialect {
    /// Appends the fields of a line, trimmed and without the quotes around them. `may_be_quoted` is whether there may be quotes in it.
    pub(super) fn divide<'l>(self, line: &'l str, may_be_quoted: bool, fields: &mut Vec<Cow<'l, str>>) {
        let quoted = may_be_quoted && line.contains('"');
        let Some(separator) = self.separator.character() else {
            let words = line.split_whitespace();
            fields
                .extend(words.map(|word| Cow::Borrowed(if quoted { word.trim_matches('"') } else { word })));
            return;
        };
        let first = fields.len();
        for field in Divided::new(line, separator) {
            let field = trimmed(field);
            let field = if quoted { unquoted(field) } else { Some(field) };
            match field {
                Some(field) => fields.push(Cow::Borrowed(field)),
                None => {
                    // A quoted separator or quote.
                    fields.truncate(first);
                    fields.extend(by_the_book(line, separator).into_iter().map(Cow::Owned));
                    return;
                }
            }
        }
    }

    /// The fields of a line, as texts of their own.
    fn fields(self, line: &str) -> Vec<String> {
        let mut fields = Vec::new();
        self.divide(line, true, &mut fields);
        fields.into_iter().map(Cow::into_owned).collect()
    }
}

/// The parts of a line between separators that are single bytes. Fields are short: a plain loop finds their ends sooner than a search that
/// looks at many bytes at a time.
struct Divided<'l> {
    rest: Option<&'l str>,
    separator: u8,
}

impl<'l> Divided<'l> {
    fn new(line: &'l str, separator: char) -> Self {
        Self { rest: Some(line), separator: u8::try_from(separator).unwrap_or(b',') }
    }
}

impl<'l> Iterator for Divided<'l> {
    type Item = &'l str;

    fn next(&mut self) -> Option<&'l str> {
        let rest = self.rest?;
        let end = rest.bytes().position(|byte| byte == self.separator);
        let (field, after) = match end.and_then(|end| Some((rest.get(..end)?, rest.get(end + 1..)?))) {
            Some((field, after)) => (field, Some(after)),
            None => (rest, None),
        };
        self.rest = after;
        Some(field)
    }
}

/// A field without the blanks around it. Most have none, which two bytes show.
fn trimmed(field: &str) -> &str {
    match field.as_bytes() {
        [only] if only.is_ascii_graphic() => field,
        [first, .., last] if first.is_ascii_graphic() && last.is_ascii_graphic() => field,
        _ => field.trim(),
    }
}

/// A field without the quotes around it, if there is nothing to it but these.
fn unquoted(field: &str) -> Option<&str> {
    if !field.contains('"') {
        return Some(field);
    }
    let inner = field.strip_prefix('"')?.strip_suffix('"')?;
    (!inner.contains('"')).then(|| inner.trim())
}

/// The fields of a line with quoted separators or quotes, as the `csv` crate divides it. A reader of that crate for every line would take
/// longer to build than the line to read.
fn by_the_book(line: &str, separator: char) -> Vec<String> {
    let mut fields = Vec::new();
    let mut field = String::new();
    let (mut in_quotes, mut is_begun) = (false, false);
    let mut characters = line.chars().peekable();
    while let Some(c) = characters.next() {
        match c {
            '"' if in_quotes && characters.peek() == Some(&'"') => {
                characters.next();
                field.push('"');
            }
            '"' if in_quotes => in_quotes = false,
            '"' if !is_begun => (in_quotes, is_begun) = (true, true),
            c if c == separator && !in_quotes => {
                fields.push(std::mem::take(&mut field));
                is_begun = false;
            }
            c => {
                // A quote begins a field only where it is the first character but for blanks.
                is_begun |= !c.is_whitespace();
                if is_begun {
                    field.push(c);
                }
            }
        }
    }
    fields.push(field);
    fields.into_iter().map(|field| field.trim().to_owned()).collect()
}

/// A table's header, and what else its first lines tell.
#[derive(Debug)]
pub(super) struct Beginning {
    pub(super) dialect: Dialect,
    /// The names of the columns.
    pub(super) names: Vec<String>,
    /// The units of the columns, from a line of units; empty if there is none.
    pub(super) units: Vec<String>,
    /// The fields of the first rows.
    pub(super) rows: Vec<Vec<String>>,
    /// The line of the header; [`Place::File`] if there is none.
    pub(super) place: Place,
    /// The number of lines before the first row.
    pub(super) lines_before: usize,
    /// The header as it stands in the file; empty if there is none.
    text: String,
    /// Whether it says that every column beside the angles is a channel.
    is_exact: bool,
    /// What is unusual about it, in words; `None` for a header at the beginning, commas and points.
    pub(super) said: Option<String>,
}

impl Beginning {
    /// The parts from which columns are understood.
    pub(super) fn header(&self) -> Header<'_> {
        Header {
            names: &self.names,
            rows: &self.rows,
            units: &self.units,
            text: &self.text,
            is_exact: self.is_exact,
        }
    }
}

/// A line of the text.
#[derive(Clone, Copy)]
struct Line<'t> {
    place: Place,
    /// Its number, from 1.
    number: usize,
    text: &'t str,
    is_comment: bool,
}

/// A header that was found.
struct Found {
    separator: Separator,
    names: Vec<String>,
    line: usize,
    place: Place,
    is_comment: bool,
}

/// The lines of a text that are not blank.
fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    let all = Part::new(text).lines().zip(1..).map(|((place, text), number)| Line {
        place,
        number,
        text: text.trim_end(),
        is_comment: text.starts_with('#'),
    });
    all.filter(|line| !line.text.trim_start().is_empty())
}

/// The separators to try.
fn separators(layout: &TableLayout) -> Vec<Separator> {
    layout.separator.map_or_else(|| Separator::ALL.to_vec(), |separator| vec![separator])
}

/// The names in a header. A unit in brackets belongs to the name before it.
fn names(line: &str, separator: Separator) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for field in (Dialect { separator, decimal_comma: false }).fields(line) {
        match names.last_mut() {
            Some(name) if separator == Separator::Blanks && field.starts_with(['[', '(']) => {
                name.push(' ');
                name.push_str(&field);
            }
            _ => names.push(field),
        }
    }
    names
}

/// How many angles the names of a header tell; `None` if not both polar angles.
fn angles_told(names: &[String], choice: &ColumnChoice) -> Option<usize> {
    let mut told: Vec<Angle> = Vec::new();
    let mut either = 0;
    for name in names {
        match role(name) {
            Role::Angle(angle, _) if !told.contains(&angle) => told.push(angle),
            Role::OtherPolarAngle(_) => either += 1,
            _ => {}
        }
    }
    // Names that the user chose count wherever they stand; numbers tell nothing about a line.
    let is_name = |column: &String| number(column, true).is_none();
    let chosen = choice.angles.iter().filter(|(_, c)| is_name(c) && names.iter().any(|name| name == c));
    for (angle, _) in chosen {
        if !told.contains(angle) {
            told.push(*angle);
        }
    }
    let polar = told.iter().filter(|angle| angle.is_polar()).count() + either.min(1);
    (polar >= 2).then_some(told.len() + either.min(1))
}

/// Whether a line holds numbers only, divided in one of these ways.
fn is_row(line: &str, separators: &[Separator]) -> bool {
    separators.iter().any(|separator| {
        let fields = Dialect { separator: *separator, decimal_comma: false }.fields(line);
        let with_comma = *separator != Separator::Comma;
        let is_number = |field: &String| number(field, with_comma).is_some() || is_missing(field);
        fields.len() > 2 && fields.iter().all(is_number) && fields.iter().any(|f| !is_missing(f))
    })
}

/// The header in a line: with the separator that tells the most angles.
fn header_in(line: &Line<'_>, separators: &[Separator], layout: &TableLayout) -> Option<Found> {
    let text = if line.is_comment { line.text.trim_start_matches('#').trim_start() } else { line.text };
    let mut best: Option<(usize, Found)> = None;
    for separator in separators {
        let names = names(text, *separator);
        let Some(told) = angles_told(&names, &layout.columns) else { continue };
        if best.as_ref().is_none_or(|(known, _)| told > *known) {
            let (line, place, is_comment) = (line.number, line.place, line.is_comment);
            best = Some((told, Found { separator: *separator, names, line, place, is_comment }));
        }
    }
    best.map(|(_, found)| found)
}

/// The separator with which a line has the most fields.
fn most_fields(line: &str, separators: &[Separator]) -> Separator {
    let fields =
        |separator: &&Separator| Dialect { separator: **separator, decimal_comma: false }.fields(line).len();
    // `max_by_key` returns the last of several equal elements, and the first is preferred.
    separators.iter().rev().max_by_key(fields).copied().unwrap_or(Separator::Comma)
}

/// Finds the header of a table, which may follow other lines and stand in a comment, and looks at the first rows.
///
/// # Errors
/// Where in the text what was expected and what was found.
pub(super) fn beginning(text: &str, layout: &TableLayout) -> Result<Beginning, (Place, BadHeader)> {
    let separators = separators(layout);
    let lines = || lines(text);
    let mut comments: Vec<Line<'_>> = Vec::new();
    let mut first = None;
    let mut found = None;
    let mut before: Option<Line<'_>> = None;
    for line in lines().take(LINES_SEARCHED) {
        if line.is_comment {
            comments.push(line);
            continue;
        }
        found = header_in(&line, &separators, layout);
        if found.is_some() {
            break;
        }
        first = first.or(Some(line));
        if is_row(line.text, &separators) {
            // Rows without a header: it may be the last comment, or the user may have numbered the columns.
            let fields = |separator| Dialect { separator, decimal_comma: false }.fields(line.text).len();
            let in_comment =
                comments.iter().rev().find_map(|comment| header_in(comment, &separators, layout));
            found = in_comment.filter(|found| found.names.len() == fields(found.separator));
            if found.is_none() {
                found = numbered(&line, &separators, layout);
            }
            if found.is_none() && before.is_some() {
                first = before;
            } else if found.is_none() {
                let expected = "a header that names the columns";
                let bad = BadHeader {
                    expected: expected.to_owned(),
                    found: excerpt(line.text),
                    hint: Some((
                        OptionName::Columns,
                        "theta_i=1,phi_i=2,theta_o=3,phi_o=4,channels=5".to_owned(),
                    )),
                };
                return Err((line.place, bad));
            }
            break;
        }
        before = Some(line);
    }
    let Some(found) = found else {
        let Some(line) = first else {
            let bad = BadHeader {
                expected: "a header naming the columns".to_owned(),
                found: "only comments".to_owned(),
                hint: None,
            };
            return Err((Place::File, bad));
        };
        // Whatever its columns lack is the error.
        let names = names(line.text, most_fields(line.text, &separators));
        let header = Header { text: line.text, ..Header::of(&names) };
        let bad = Columns::parse(&header, &layout.columns, &AngleUnits::default()).err();
        return Err((
            line.place,
            bad.unwrap_or_else(|| BadHeader {
                expected: "a header naming the columns".to_owned(),
                found: excerpt(line.text),
                hint: None,
            }),
        ));
    };
    let is_header = |line: &Line<'_>| line.number == found.line && found.place != Place::File;
    let header =
        lines().find(is_header).map(|line| line.text.trim_start_matches('#').trim()).unwrap_or_default();
    if header.matches('"').count() % 2 == 1 {
        let expected = "quotes that end on the line where they begin".to_owned();
        return Err((found.place, BadHeader { expected, found: excerpt(header), hint: None }));
    }
    let begun = with_rows(found, before, lines().filter(|line| !line.is_comment), layout);
    let is_exact = comments.iter().any(|line| line.text == EXACT);
    Ok(Beginning { text: header.to_owned(), is_exact, ..begun })
}

/// A header for rows whose columns the user numbered.
fn numbered(line: &Line<'_>, separators: &[Separator], layout: &TableLayout) -> Option<Found> {
    let is_number = |column: &String| column.trim_start_matches('#').parse::<usize>().is_ok();
    let has_numbers =
        layout.columns.angles.len() > 1 && layout.columns.angles.iter().all(|(_, c)| is_number(c));
    if !has_numbers {
        return None;
    }
    let separator = most_fields(line.text, separators);
    let fields = Dialect { separator, decimal_comma: false }.fields(line.text).len();
    Some(Found {
        separator,
        names: (1..=fields).map(|k| format!("column {k}")).collect(),
        // The row itself is not a header.
        line: line.number - 1,
        place: Place::File,
        is_comment: false,
    })
}

/// Adds to a header what the lines around it say. `lines` are all that are no comments.
fn with_rows<'t>(
    found: Found,
    before: Option<Line<'t>>,
    lines: impl Iterator<Item = Line<'t>>,
    layout: &TableLayout,
) -> Beginning {
    let Found { separator, names, line, place, is_comment } = found;
    let plain = Dialect { separator, decimal_comma: false };
    let units_in = |line: &Line<'_>| {
        let fields = plain.fields(line.text);
        let is_line_of_units = fields.len() == names.len()
            && fields.iter().all(|field| is_unit(field))
            && fields.iter().any(|field| !field.is_empty() && number(field, true).is_none());
        is_line_of_units.then_some(fields)
    };
    let mut units = before.as_ref().and_then(units_in);
    let mut lines_before = line;
    let mut rows = Vec::new();
    for row in lines.filter(|row| row.number > line) {
        if rows.is_empty() && units.is_none() {
            units = units_in(&row);
            if units.is_some() {
                lines_before = row.number;
                continue;
            }
        }
        rows.push(row.text);
        if rows.len() == ROWS_SEEN {
            break;
        }
    }
    let rows: Vec<Vec<String>> = rows.into_iter().map(|row| plain.fields(row)).collect();
    let decimal_comma = match layout.decimal {
        Some(mark) => mark == DecimalMark::Comma,
        None => rows.iter().flatten().any(|field| has_decimal_comma(field)),
    };
    let mut said = Vec::new();
    if place == Place::File {
        said.push("no header".to_owned());
    } else if is_comment {
        said.push("the header is a comment".to_owned());
    } else if before.is_some() {
        said.push("lines before the header left out".to_owned());
    }
    if separator != Separator::Comma {
        said.push(format!(
            "divided by {}",
            match separator {
                Separator::Tab => "tabs",
                Separator::Semicolon => "semicolons",
                Separator::Bar => "bars",
                _ => "blanks",
            }
        ));
    }
    if decimal_comma {
        said.push("decimal commas".to_owned());
    }
    Beginning {
        dialect: Dialect { separator, decimal_comma },
        names,
        units: units.unwrap_or_default(),
        rows,
        place,
        lines_before,
        text: String::new(),
        is_exact: false,
        said: (!said.is_empty()).then(|| said.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn begin(text: &str) -> Beginning {
        beginning(text, &TableLayout::default()).unwrap_or_else(|(place, bad)| panic!("{place:?} {bad:?}"))
    }

    #[test]
    fn headers_are_found() {
        for (text, separator, before) in [
            ("theta_i,theta_o,f\n1,2,3\n", Separator::Comma, 1),
            ("theta_i\ttheta_o\tf\n1\t2\t3\n", Separator::Tab, 1),
            ("theta_i;theta_o;f\n1;2;0,3\n", Separator::Semicolon, 1),
            ("# theta_i theta_o f\n1 2 3\n", Separator::Blanks, 1),
            (
                "Sample: red, Date: today\n\ntheta_i | theta_o | f\ndeg | deg | 1/sr\n1 | 2 | 3\n",
                Separator::Bar,
                4,
            ),
            ("  theta_i [deg]   theta_o [deg]  f\n 1 2 3\n", Separator::Blanks, 1),
        ] {
            let found = begin(text);
            assert_eq!((found.dialect.separator, found.lines_before), (separator, before), "{text}");
            assert_eq!(found.names.len(), 3, "{:?}", found.names);
            assert_eq!(found.rows.len(), 1);
        }
        assert!(begin("theta_i;theta_o;f\n1;2;0,3\n").dialect.decimal_comma);
        assert_eq!(begin("a;b\ntheta_i;theta_o;f\nrad;rad;-\n1;2;3\n").units, ["rad", "rad", "-"]);
        assert_eq!(begin("deg,deg,1/sr\ntheta_i,theta_o,f\n1,2,3\n").units, ["deg", "deg", "1/sr"]);
        let (place, bad) = beginning("1,2,3\n", &TableLayout::default()).unwrap_err();
        assert_eq!((place, bad.hint.unwrap().0), (Place::Line(1), OptionName::Columns));
        let columns = ColumnChoice::parse("theta_i=1,theta_o=2,channels=3").unwrap();
        let layout = TableLayout { columns, ..TableLayout::default() };
        let found = beginning("1 2 3\n4 5 6\n", &layout).unwrap();
        assert_eq!((found.lines_before, found.rows.len()), (0, 2));
    }

    #[test]
    fn quoted_fields() {
        let dialect = Dialect { separator: Separator::Comma, decimal_comma: false };
        assert_eq!(dialect.fields(r#""1",2," 3 ""#), ["1", "2", "3"]);
        assert_eq!(dialect.fields(r#""a,b",2,"say ""no""""#), ["a,b", "2", r#"say "no""#]);
        assert_eq!(dialect.fields("\"1,2"), ["1,2"]);
        assert_eq!(dialect.fields(r#"1, "a, b" ,2"#), ["1", "a, b", "2"]);
    }

    proptest! {
        /// The `csv` crate is the reference for lines in which quotes stand at the ends of fields, or in pairs within them.
        #[test]
        fn quoted_lines_are_divided_as_the_csv_crate_does(line in "((a|\"(a|,|\"\"| ){0,3}\"|)(,|,)){0,5}a") {
            let mut reader = csv::ReaderBuilder::new()
                .has_headers(false)
                .flexible(true)
                .trim(csv::Trim::All)
                .from_reader(line.as_bytes());
            let expected: Vec<String> =
                reader.records().next().unwrap().unwrap().iter().map(str::to_owned).collect();
            prop_assert_eq!(by_the_book(&line, ','), expected);
        }
    }
}
