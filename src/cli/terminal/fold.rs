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
const FARTHEST_HANG: usize = 20;

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
    let indent = rows.iter().map(|row| row.text.len() - row.text.trim_start().len()).min().unwrap_or(0);
    let parts = parts(&columns, width.saturating_sub(indent));
    let mut folded = Vec::new();
    for row in rows {
        for (index, part) in parts.iter().enumerate() {
            let indent = indent + if index == 0 { 0 } else { HANG };
            let text = part_of_row(row, part, &columns, indent);
            if display_width(&text) <= width {
                // A part without content takes no line.
                folded.extend((!text.is_empty()).then_some((row.role, text)));
            } else {
                let lines = hung(text.trim_start(), indent, indent + HANG, width);
                folded.extend(lines.into_iter().map(|line| (row.role, line)));
            }
        }
    }
    folded
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

/// Which columns stand on each line of a row, as many as fit. A column of names has a line to itself, so that they stand out.
fn parts(columns: &[Column], width: usize) -> Vec<Vec<usize>> {
    let filled = || columns.iter().enumerate().filter(|(_, column)| column.width > 0);
    let all = filled().map(|(_, column)| column.width + GAP).sum::<usize>().saturating_sub(GAP);
    let is_of_names = |column: &Column| column.side == Side::Left && column.width > width / 4;
    let names_alone = all > width && columns.first().is_some_and(is_of_names);
    let mut parts: Vec<Vec<usize>> = Vec::new();
    let mut room = 0;
    for (index, column) in filled() {
        let needed = GAP + column.width;
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

/// The cells of a row that stand on one line, padded to their columns; empty if none of them has any text.
fn part_of_row(row: &Line, part: &[usize], columns: &[Column], indent: usize) -> String {
    let mut text = " ".repeat(indent);
    for (place, index) in part.iter().enumerate() {
        let Some(column) = columns.get(*index) else { continue };
        let cell = row.cells.get(*index).map_or("", |cell| cell.text.trim());
        let padding = " ".repeat(column.width.saturating_sub(display_width(cell)));
        text += &" ".repeat(if place == 0 { 0 } else { GAP });
        text += &match column.side {
            Side::Left => format!("{cell}{padding}"),
            Side::Right => format!("{padding}{cell}"),
        };
    }
    text.trim_end().to_owned()
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
}
