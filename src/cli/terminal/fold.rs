//! Folding lines at the width of a terminal. Running text is wrapped at blanks. The rows of a table that is too wide are folded
//! alike: each column keeps its place, on one of several lines per row.

use brdfit::lines::{Cell, Line, Role, Side};
use std::cmp::max;
use textwrap::core::display_width;
use textwrap::{Options, WordSplitter, wrap};

/// Continuation lines are indented by this many blanks more than the first.
const HANG: usize = 2;
/// Blanks between the columns of a folded table.
const GAP: usize = 2;
/// Text that begins at most this far from the left, after a label and two blanks, is continued where it begins.
const FARTHEST_HANG: usize = 16;

/// The lines folded at `width` columns, each with the role of the line that it is part of. A word that is wider stays whole, so
/// that paths and check sums can be copied.
pub fn folded(lines: &[Line], width: usize) -> Vec<(Role, String)> {
    let mut folded = Vec::new();
    let mut rest = lines;
    while let Some((line, after)) = rest.split_first() {
        if line.cells.is_empty() {
            folded.extend(wrapped(&line.text, width).into_iter().map(|text| (line.role, text)));
            rest = after;
        } else {
            let rows = rest.iter().take_while(|line| !line.cells.is_empty()).count();
            let (block, after) = rest.split_at(rows);
            folded.extend(table(block, width));
            rest = after;
        }
    }
    folded
}

/// A line of running text, wrapped at blanks.
pub fn wrapped(text: &str, width: usize) -> Vec<String> {
    if display_width(text) <= width {
        return vec![text.to_owned()];
    }
    let content = text.trim_start();
    let indent = text.len() - content.len();
    // `label   text` goes on below the text.
    let label = content.split_once("  ").map(|(label, text)| {
        let blanks = 2 + text.len() - text.trim_start().len();
        indent + display_width(label) + blanks
    });
    let hang = label.filter(|hang| *hang <= FARTHEST_HANG).unwrap_or(indent + HANG);
    hung(content, indent, hang, width)
}

/// Text wrapped at blanks, its first line indented by `first` and the others by `others`.
fn hung(text: &str, first: usize, others: usize, width: usize) -> Vec<String> {
    let (first, others) = (" ".repeat(first), " ".repeat(others));
    let options = Options::new(width)
        .initial_indent(&first)
        .subsequent_indent(&others)
        .break_words(false)
        .word_splitter(WordSplitter::NoHyphenation);
    wrap(text, options).into_iter().map(std::borrow::Cow::into_owned).collect()
}

/// A column of a table.
struct Column {
    width: usize,
    side: Side,
}

/// The rows of a table, all folded alike if one is too wide.
fn table(rows: &[Line], width: usize) -> Vec<(Role, String)> {
    if rows.iter().all(|row| display_width(&row.text) <= width) {
        return rows.iter().map(|row| (row.role, row.text.clone())).collect();
    }
    let columns = columns(rows);
    let indent = rows.iter().map(|row| row.indent).min().unwrap_or(0);
    let parts = parts(&columns, width.saturating_sub(indent));
    let part_of = |row: &Line, index: usize, part: &[usize]| -> Vec<(Role, String)> {
        let indent = indent + if index == 0 { 0 } else { HANG };
        part_of_row(row, part, &columns, indent, width).into_iter().map(|line| (row.role, line)).collect()
    };
    let parts = || parts.iter().enumerate();
    if rows.len() == 2 {
        // Each heading stands above its value.
        return parts()
            .flat_map(|(n, part)| rows.iter().flat_map(move |row| part_of(row, n, part)))
            .collect();
    }
    rows.iter().flat_map(|row| parts().flat_map(|(n, part)| part_of(row, n, part))).collect()
}

/// The columns of a table, each as wide as its widest cell.
fn columns(rows: &[Line]) -> Vec<Column> {
    let mut columns: Vec<Column> = Vec::new();
    for row in rows {
        for (index, Cell { text, side, .. }) in row.cells.iter().enumerate() {
            let width = display_width(text.trim());
            match columns.get_mut(index) {
                Some(column) => column.width = max(column.width, width),
                None => columns.push(Column { width, side: *side }),
            }
        }
    }
    columns
}

/// Which columns stand on each line of a row, as many as fit. A column of names has a line to itself, so that they stand out, and
/// the last column, if it is text, may be wrapped beside the others where half of the width is left for it.
fn parts(columns: &[Column], width: usize) -> Vec<Vec<usize>> {
    let filled = || columns.iter().enumerate().filter(|(_, column)| column.width > 0);
    let all = filled().map(|(_, column)| column.width + GAP).sum::<usize>().saturating_sub(GAP);
    let is_of_names = |column: &Column| column.side == Side::Left && column.width > width / 4;
    let names_alone = all > width && columns.first().is_some_and(is_of_names);
    let mut parts: Vec<Vec<usize>> = Vec::new();
    let mut room: usize = 0;
    for (index, column) in filled() {
        let may_be_wrapped = index + 1 == columns.len() && column.side == Side::Left;
        let needed = GAP + if may_be_wrapped { column.width.min(width / 2) } else { column.width };
        match parts.last_mut().filter(|_| needed <= room) {
            Some(part) => {
                part.push(index);
                room -= needed;
            }
            None => {
                let hang = if parts.is_empty() { 0 } else { HANG };
                parts.push(vec![index]);
                room = width.saturating_sub(hang + column.width);
            }
        }
        if names_alone && index == 0 {
            room = 0;
        }
    }
    parts
}

/// The cells of a row that stand side by side, padded to their columns; nothing if none of them has any text. Only the last may be
/// too wide: it is wrapped.
fn part_of_row(row: &Line, part: &[usize], columns: &[Column], indent: usize, width: usize) -> Vec<String> {
    let mut text = String::new();
    let mut last = 0;
    for (place, index) in part.iter().enumerate() {
        let Some(column) = columns.get(*index) else { continue };
        let cell = row.cells.get(*index).map_or("", |cell| cell.text.trim());
        let padding = " ".repeat(column.width.saturating_sub(display_width(cell)));
        text += &" ".repeat(if place == 0 { 0 } else { GAP });
        last = display_width(&text);
        text += &match column.side {
            Side::Left => format!("{cell}{padding}"),
            Side::Right => format!("{padding}{cell}"),
        };
    }
    let text = text.trim_end();
    if text.is_empty() {
        return Vec::new();
    }
    if indent + display_width(text) <= width {
        return vec![" ".repeat(indent) + text];
    }
    hung(text, indent, indent + if last > 0 { last } else { HANG }, width)
}

#[cfg(test)]
mod tests {
    use super::*;
    use brdfit::lines::{Lines, free, left, right};

    fn folded_text(lines: &Lines, width: usize) -> String {
        folded(lines.lines(), width).into_iter().map(|(_, line)| line + "\n").collect()
    }

    #[test]
    fn running_text_is_wrapped_with_a_hanging_indent() {
        let text = Lines::from("  short\n\n  one two three four\nlabel   of one two three four\n");
        let expected = "  short\n\n  one two three\n    four\nlabel   of one two\n        three four\n";
        assert_eq!(folded_text(&text, 18), expected);
    }

    #[test]
    fn a_word_that_is_too_long_stays_whole() {
        assert_eq!(wrapped("a 0123456789-0123456789 b", 12), ["a", "  0123456789-0123456789", "  b"]);
    }

    #[test]
    fn the_width_is_that_of_characters_as_displayed() {
        assert_eq!(wrapped("\u{e9}\u{e9}\u{e9}\u{e9} \u{e9}\u{e9}\u{e9}\u{e9}", 9).len(), 1);
        assert_eq!(
            wrapped("\u{6f22}\u{5b57} \u{6f22}\u{5b57}", 8).len(),
            2,
            "each of these takes two columns"
        );
    }

    #[test]
    fn rows_of_a_table_are_folded_alike() {
        let mut lines = Lines::default();
        for [name, value, initial, remark] in [
            ["parameter", "value +/- error", "initial", ""],
            ["a.rather_long_name", "0.1", "0.12", "at-lower"],
            ["b.m", "0.1 +/- 0.02", "0.5", ""],
        ] {
            let cells = [left(name, 12), left(value, 16), right(initial, 8), free(remark)];
            lines.row(Role::Plain, 0, cells);
        }
        assert_eq!(folded_text(&lines, 80), lines.to_string());
        let narrow = "\
parameter
  value +/- error  initial
a.rather_long_name
  0.1                 0.12
  at-lower
b.m
  0.1 +/- 0.02         0.5
";
        assert_eq!(folded_text(&lines, 30), narrow);
    }

    #[test]
    fn a_table_that_fits_without_its_padding_keeps_one_line_per_row() {
        let mut lines = Lines::default();
        lines.row(Role::Plain, 0, [left("a", 20), right("1", 20), free("x")]);
        lines.row(Role::Plain, 0, [left("bb", 20), right("22", 20), free("y")]);
        assert_eq!(folded_text(&lines, 20), "a    1  x\nbb  22  y\n");
    }

    #[test]
    fn text_in_the_last_column_is_wrapped_below_itself() {
        let mut lines = Lines::default();
        for value in ["0.1", "0.2", "0.3"] {
            lines.row(Role::Plain, 2, [right(value, 8), free("one + two + three")]);
        }
        let row = |value: &str| format!("  {value}  one + two\n       + three\n");
        assert_eq!(folded_text(&lines, 17), ["0.1", "0.2", "0.3"].map(row).concat());
    }

    #[test]
    fn the_heading_of_a_single_row_stands_above_each_value() {
        let mut lines = Lines::default();
        lines.row(Role::Heading, 0, ["first", "second", "third"].map(|name| right(name, 9)));
        lines.row(Role::Plain, 0, ["1", "2", "3"].map(|value| right(value, 9)));
        assert_eq!(folded_text(&lines, 14), "first  second\n    1       2\n  third\n      3\n");
    }
}
