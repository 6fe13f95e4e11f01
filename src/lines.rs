//! Text for people to read, line by line, with what a terminal wants to know about each line: its role, which may be shown by a
//! colour, and the cells of a table's row, which are kept whole where a line is folded.
//!
//! [`Lines`] displayed are the plain text, as a pipe or a file gets it.

use std::fmt;

/// What a line is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Role {
    /// A line like most.
    #[default]
    Plain,
    /// The title of what follows.
    Title,
    /// The heading of a list or a table.
    Heading,
    /// Something to look at, such as a parameter at its bound.
    Caution,
    /// A good verdict.
    Good,
    /// A bad verdict.
    Bad,
}

/// The side that the text of a cell stands on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Blanks follow the text.
    Left,
    /// Blanks precede the text.
    Right,
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cell {
    /// The text, without the blanks that fill the column.
    pub text: String,
    /// The side that it stands on.
    pub side: Side,
    /// Number of characters that the cell fills at least.
    width: usize,
    /// Number of blanks between the cell and the one before it.
    gap: usize,
}

/// A cell with its text on the left.
#[must_use]
pub fn left(text: impl Into<String>, width: usize) -> Cell {
    Cell { text: text.into(), side: Side::Left, width, gap: 1 }
}

/// A cell with its text on the right.
#[must_use]
pub fn right(text: impl Into<String>, width: usize) -> Cell {
    Cell { text: text.into(), side: Side::Right, width, gap: 1 }
}

/// A cell as wide as its text, apart from the one before it by two blanks.
#[must_use]
pub fn free(text: impl Into<String>) -> Cell {
    Cell { text: text.into(), side: Side::Left, width: 0, gap: 2 }
}

/// A line of text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Line {
    /// What the line is.
    pub role: Role,
    /// The whole line, without its end.
    pub text: String,
    /// The cells of a table's row; empty for running text.
    pub cells: Vec<Cell>,
    /// Number of blanks before the first cell.
    pub indent: usize,
}

/// Lines of text. Running text is written to them by `write!` and `writeln!`, a table [`row`](Lines::row) by row.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Lines {
    lines: Vec<Line>,
    /// The role of the next text, up to the end of its line.
    role: Role,
    /// Whether the last line goes on.
    open: bool,
}

impl Lines {
    /// The lines that a function writes.
    pub fn of(write: impl FnOnce(&mut Self) -> fmt::Result) -> Self {
        let mut lines = Self::default();
        // Writing to memory cannot fail.
        let _ = write(&mut lines);
        lines
    }

    /// Gives a role to the line that is written next: `writeln!(lines.as_a(Role::Title), "...")`.
    pub fn as_a(&mut self, role: Role) -> &mut Self {
        self.role = role;
        self
    }

    /// Adds a row of a table: its cells side by side, `indent` blanks from the left.
    pub fn row(&mut self, role: Role, indent: usize, cells: impl IntoIterator<Item = Cell>) {
        let cells: Vec<Cell> = cells.into_iter().collect();
        let mut text = " ".repeat(indent);
        for (index, Cell { text: content, side, width, gap }) in cells.iter().enumerate() {
            text += &" ".repeat(if index == 0 { 0 } else { *gap });
            text += &match side {
                Side::Left => format!("{content:<width$}"),
                Side::Right => format!("{content:>width$}"),
            };
        }
        text.truncate(text.trim_end().len());
        self.lines.push(Line { role, text, cells, indent });
        self.open = false;
    }

    /// Every line.
    #[must_use]
    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// Whether the text ends within a line.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.open
    }
}

impl fmt::Write for Lines {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for piece in text.split_inclusive('\n') {
            let content = piece.strip_suffix('\n');
            match self.lines.last_mut().filter(|_| self.open) {
                Some(line) => line.text += content.unwrap_or(piece),
                None => self.lines.push(Line {
                    role: self.role,
                    text: content.unwrap_or(piece).to_owned(),
                    ..Line::default()
                }),
            }
            self.open = content.is_none();
            if !self.open {
                self.role = Role::Plain;
            }
        }
        Ok(())
    }
}

impl From<&str> for Lines {
    fn from(text: &str) -> Self {
        Self::of(|lines| fmt::Write::write_str(lines, text))
    }
}

impl fmt::Display for Lines {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, line) in self.lines.iter().enumerate() {
            f.write_str(&line.text)?;
            if !(self.open && index + 1 == self.lines.len()) {
                f.write_str("\n")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;

    #[test]
    fn lines_displayed_are_what_was_written() {
        for text in ["", "\n", "one", "one\n", "one\n\ntwo\n  three", "\n\n"] {
            assert_eq!(Lines::from(text).to_string(), text);
        }
        let mut lines = Lines::default();
        write!(lines, "in").unwrap();
        writeln!(lines, " parts").unwrap();
        assert_eq!(lines.to_string(), "in parts\n");
        assert_eq!(lines.lines().len(), 1);
    }

    #[test]
    fn a_role_lasts_for_one_line() {
        let mut lines = Lines::default();
        writeln!(lines.as_a(Role::Title), "{}: {}", 1, 2).unwrap();
        writeln!(lines, "more").unwrap();
        let roles: Vec<Role> = lines.lines().iter().map(|line| line.role).collect();
        assert_eq!(roles, [Role::Title, Role::Plain]);
    }

    #[test]
    fn rows_are_padded_and_end_without_blanks() {
        let mut lines = Lines::default();
        lines.row(Role::Plain, 2, [left("a", 4), right("12", 5), free("free")]);
        lines.row(Role::Plain, 2, [left("longer", 4), right("", 5), free("")]);
        assert_eq!(lines.to_string(), "  a       12  free\n  longer\n");
    }
}
