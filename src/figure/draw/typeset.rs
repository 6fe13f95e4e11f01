//! Text cut into runs of one size and style, and how wide it is.

use crate::figure::text::{Piece, Text};

/// The size of subscripts and superscripts, relative to that of the text.
pub(super) const SMALLER: f64 = 0.72;
/// How far below the baseline subscripts stand, relative to the size of the text.
const BELOW: f64 = 0.22;
/// How far above the baseline superscripts stand.
const ABOVE: f64 = -0.38;

/// A piece of text in one size and style.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Its characters.
    pub text: String,
    /// How far below the baseline it stands, relative to the size of the text; 0 on the baseline.
    pub shift: f64,
    /// Whether it is set in italics.
    pub italic: bool,
}

/// The letters that symbols are named by.
const GREEK: [(&str, &str); 13] = [
    ("theta", "\u{3b8}"),
    ("phi", "\u{3c6}"),
    ("alpha", "\u{3b1}"),
    ("beta", "\u{3b2}"),
    ("gamma", "\u{3b3}"),
    ("delta", "\u{3b4}"),
    ("eta", "\u{3b7}"),
    ("kappa", "\u{3ba}"),
    ("lambda", "\u{3bb}"),
    ("mu", "\u{3bc}"),
    ("rho", "\u{3c1}"),
    ("sigma", "\u{3c3}"),
    ("tau", "\u{3c4}"),
];

/// Cuts a text into runs.
#[must_use]
pub fn runs(text: &Text) -> Vec<Run> {
    let plain = |text: &str| Run { text: text.to_owned(), shift: 0.0, italic: false };
    let mut all = Vec::new();
    for piece in text.pieces() {
        match piece {
            Piece::Words(words) => all.extend(with_powers(words)),
            Piece::Degrees => all.push(plain("\u{b0}")),
            Piece::Symbol(symbol) => {
                let (letter, index) = parts(symbol);
                let greek = GREEK.iter().find(|(name, _)| *name == letter).map(|(_, letter)| *letter);
                // Single letters are quantities; longer ones are names.
                let italic = greek.is_none() && letter.chars().count() == 1;
                all.push(Run { text: greek.unwrap_or(letter).to_owned(), shift: 0.0, italic });
                if !index.is_empty() {
                    all.push(Run { text: index.to_owned(), shift: BELOW, italic: false });
                }
            }
        }
    }
    all
}

/// The letter of a symbol and its index: `theta_i` is theta with i, `f0` is f with 0.
fn parts(symbol: &str) -> (&str, &str) {
    if let Some((letter, index)) = symbol.split_once('_') {
        return (letter, index);
    }
    let letter = symbol.trim_end_matches(|c: char| c.is_ascii_digit());
    if letter.is_empty() { (symbol, "") } else { symbol.split_at(letter.len()) }
}

/// Words in which `10^-3` and `sr^-1/3` have superscripts.
fn with_powers(words: &str) -> Vec<Run> {
    let mut all = Vec::new();
    let mut rest = words;
    while let Some((before, after)) = rest.split_once('^') {
        let end = after.find(|c: char| !(c.is_ascii_digit() || c == '-' || c == '/')).unwrap_or(after.len());
        let (power, behind) = after.split_at(end);
        if power.is_empty() {
            break;
        }
        all.push(Run { text: before.to_owned(), shift: 0.0, italic: false });
        all.push(Run { text: power.replace('-', "\u{2212}"), shift: ABOVE, italic: false });
        rest = behind;
    }
    if !rest.is_empty() {
        all.push(Run { text: rest.to_owned(), shift: 0.0, italic: false });
    }
    all
}

/// Widths of the characters from the blank to the tilde in Helvetica, in thousandths of its size (Adobe's font metrics).
const WIDTHS: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556,
    556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778, 722, 278,
    500, 667, 556, 833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469,
    556, 333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, 556, 556, 333, 500,
    278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
];
/// The width of any other character.
const OTHER: u16 = 600;
/// Room for readers whose font is wider than Helvetica: DejaVu Sans, the widest of those named, needs a fifth more.
const ROOM: f64 = 1.19;

/// About how wide a text is, in the unit of its size.
pub(super) fn width(text: &Text, size: f64) -> f64 {
    let of = |c: char| {
        let place = u32::from(c).checked_sub(32).and_then(|place| usize::try_from(place).ok());
        f64::from(place.and_then(|place| WIDTHS.get(place)).copied().unwrap_or(OTHER)) / 1000.0
    };
    let of_run = |run: &Run| {
        let scale = if run.shift == 0.0 { 1.0 } else { SMALLER };
        scale * run.text.chars().map(of).sum::<f64>()
    };
    ROOM * size * runs(text).iter().map(of_run).sum::<f64>()
}

/// Breaks a text into lines no wider than `most`, at blanks where there are any.
pub(super) fn lines(text: &Text, size: f64, most: f64) -> Vec<Text> {
    let mut all: Vec<Text> = Vec::new();
    let mut line = Text::default();
    for word in words(text) {
        let longer = line.clone().and(&word);
        if width(&longer, size) > most && !line.is_empty() {
            all.push(line);
            // A line does not begin with a blank.
            line = match word.pieces() {
                [Piece::Words(text), rest @ ..] if text.starts_with(' ') => {
                    let first = Text::from(text.trim_start());
                    rest.iter().fold(first, with_piece)
                }
                _ => word,
            };
        } else {
            line = longer;
        }
    }
    if !line.is_empty() {
        all.push(line);
    }
    all
}

fn with_piece(text: Text, piece: &Piece) -> Text {
    match piece {
        Piece::Words(words) => text.words(words.clone()),
        Piece::Symbol(symbol) => text.symbol(symbol.clone()),
        Piece::Degrees => text.and(&Text::degree()),
    }
}

/// The words of a text, each with the blank before it. Symbols stay with the word that they touch, and long words are cut.
fn words(text: &Text) -> Vec<Text> {
    /// Longer words, such as paths, are cut after a slash or here.
    const LONG: usize = 48;
    let mut all: Vec<Text> = Vec::new();
    let mut last = Text::default();
    for piece in text.pieces() {
        let Piece::Words(words) = piece else {
            last = with_piece(last, piece);
            continue;
        };
        let mut word = String::new();
        for c in words.chars() {
            let full = word.chars().count() >= LONG;
            if (c == ' ' && !(word.is_empty() && last.is_empty())) || full {
                all.push(std::mem::take(&mut last).words(std::mem::take(&mut word)));
            }
            word.push(c);
        }
        if !word.is_empty() {
            last = last.words(word);
        }
    }
    if !last.is_empty() {
        all.push(last);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_become_letters_with_an_index() {
        let shown = |text: &Text| runs(text).into_iter().map(|run| (run.text, run.shift)).collect::<Vec<_>>();
        assert_eq!(
            shown(&Text::of_symbol("theta_i")),
            [("\u{3b8}".to_owned(), 0.0), ("i".to_owned(), BELOW)]
        );
        assert_eq!(shown(&Text::of_symbol("f0")), [("f".to_owned(), 0.0), ("0".to_owned(), BELOW)]);
        assert_eq!(shown(&Text::from("10^-3")), [("10".to_owned(), 0.0), ("\u{2212}3".to_owned(), ABOVE)]);
        // A file's name is no formula.
        assert_eq!(shown(&Text::from("theta_i.csv")), [("theta_i.csv".to_owned(), 0.0)]);
        assert_eq!(shown(&Text::from("a^b")), [("a^b".to_owned(), 0.0)]);
    }

    #[test]
    fn lines_keep_every_word_and_their_width() {
        let text = Text::from("one two three ")
            .symbol("theta_i")
            .words(" = ")
            .degrees(30.0)
            .words(", four five six");
        let lines = lines(&text, 7.0, 60.0);
        assert!(lines.len() > 2 && lines.iter().all(|line| width(line, 7.0) <= 60.0), "{lines:?}");
        let joined: Vec<String> = lines.iter().map(ToString::to_string).collect();
        assert_eq!(joined.join(" "), text.to_string());
    }
}
