//! Text of figures: words, symbols with subscripts, and degrees.

use std::fmt;

/// A text in which symbols are told apart from words, so that a drawing typesets them and a table spells them out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Text(Vec<Piece>);

/// A part of a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Piece {
    /// Words, shown as they are.
    Words(String),
    /// A symbol such as `theta_i`: drawn as the Greek letter with a subscript, spelled out in tables.
    Symbol(String),
    /// The unit of an angle: drawn as a ring, spelled ` deg` in tables.
    Degrees,
}

impl Text {
    /// A symbol alone.
    #[must_use]
    pub fn of_symbol(symbol: &str) -> Self {
        Self::default().symbol(symbol)
    }

    /// The text followed by words.
    #[must_use]
    pub fn words(mut self, words: impl Into<String>) -> Self {
        self.0.push(Piece::Words(words.into()));
        self
    }

    /// The text followed by a symbol.
    #[must_use]
    pub fn symbol(mut self, symbol: impl Into<String>) -> Self {
        self.0.push(Piece::Symbol(symbol.into()));
        self
    }

    /// The text followed by an angle in degrees, with up to two decimals.
    #[must_use]
    pub fn degrees(self, degrees: f64) -> Self {
        // Rounding may leave a negative zero.
        let rounded = (degrees * 100.0).round() / 100.0 + 0.0;
        self.words(rounded.to_string()).and(&Self::degree())
    }

    /// The unit of an angle alone.
    pub(super) fn degree() -> Self {
        Self(vec![Piece::Degrees])
    }

    /// The text followed by another.
    #[must_use]
    pub fn and(mut self, other: &Self) -> Self {
        self.0.extend_from_slice(&other.0);
        self
    }

    /// The parts of the text.
    #[must_use]
    pub fn pieces(&self) -> &[Piece] {
        &self.0
    }

    /// Whether there is nothing to show.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl From<&str> for Text {
    fn from(words: &str) -> Self {
        Self::default().words(words)
    }
}

impl From<String> for Text {
    fn from(words: String) -> Self {
        Self::default().words(words)
    }
}

impl fmt::Display for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|piece| match piece {
            Piece::Words(text) | Piece::Symbol(text) => f.write_str(text),
            Piece::Degrees => f.write_str(" deg"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_spells_symbols_out() {
        let text = Text::from("f at ").symbol("theta_i").words(" = ").degrees(-0.001);
        assert_eq!(text.to_string(), "f at theta_i = 0 deg");
        assert_eq!(Text::default().degrees(32.456).to_string(), "32.46 deg");
    }
}
