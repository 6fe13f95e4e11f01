//! What the values of a file are, if they are not f in 1/sr.

use crate::error::{Error, OptionName, excerpt};
use std::f64::consts::{LN_10, PI};
use std::fmt;

/// Square degrees in a steradian.
const SQUARE_DEGREES: f64 = (180.0 / PI) * (180.0 / PI);

/// A word of [`Quantity`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Word {
    F,
    CosI,
    CosO,
    CosIo,
    ReflectanceFactor,
    PerCent,
    Decibel,
    PerSquareDegree,
}

impl Word {
    const ALL: [Self; 8] = [
        Self::F,
        Self::CosI,
        Self::CosO,
        Self::CosIo,
        Self::ReflectanceFactor,
        Self::PerCent,
        Self::Decibel,
        Self::PerSquareDegree,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::F => "f",
            Self::CosI => "f-cos-i",
            Self::CosO => "f-cos-o",
            Self::CosIo => "f-cos-i-cos-o",
            Self::ReflectanceFactor => "reflectance-factor",
            Self::PerCent => "percent",
            Self::Decibel => "decibel",
            Self::PerSquareDegree => "per-square-degree",
        }
    }

    /// Whether it says what was measured, and not only how that is written.
    fn says_what(self) -> bool {
        !matches!(self, Self::PerCent | Self::Decibel | Self::PerSquareDegree)
    }
}

/// What the values of a file are: f in 1/sr unless said otherwise.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Quantity {
    words: Vec<Word>,
}

impl Quantity {
    /// The names of all parts of a quantity.
    #[must_use]
    pub fn names() -> Vec<&'static str> {
        Word::ALL.map(Word::name).into()
    }

    /// Parses what was measured and how it is written, such as `f-cos-o` or `reflectance-factor,percent`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for an unknown word, or words that exclude each other.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let wrong = |expected: String| Error::invalid(OptionName::Quantity, expected, excerpt(text));
        let mut words: Vec<Word> = Vec::new();
        for name in text.split(',').map(str::trim) {
            let known = Word::ALL.into_iter().find(|word| word.name() == name);
            let word = known.ok_or_else(|| {
                wrong(format!("words among {}, with commas between", Self::names().join(", ")))
            })?;
            if words.contains(&word) {
                return Err(wrong("every word once".to_owned()));
            }
            words.push(word);
        }
        let has = |word| words.contains(&word);
        if words.iter().filter(|word| word.says_what()).count() > 1 {
            let what = Word::ALL.into_iter().filter(|word| word.says_what()).map(Word::name);
            return Err(wrong(format!("one of {}", what.collect::<Vec<_>>().join(", "))));
        }
        if has(Word::PerCent) && has(Word::Decibel) {
            return Err(wrong("percent or decibel, not both".to_owned()));
        }
        if has(Word::PerSquareDegree) && has(Word::ReflectanceFactor) {
            return Err(wrong("no solid angle for a reflectance factor, which has none".to_owned()));
        }
        words.sort_by_key(|word| (!word.says_what(), Word::ALL.iter().position(|known| known == word)));
        Ok(Self { words })
    }

    /// Whether it is f in 1/sr.
    #[must_use]
    pub fn is_f(&self) -> bool {
        self.words.iter().all(|word| *word == Word::F)
    }

    fn has(&self, word: Word) -> bool {
        self.words.contains(&word)
    }

    /// Whether the values are logarithms, which may be negative.
    #[must_use]
    pub fn is_decibel(&self) -> bool {
        self.has(Word::Decibel)
    }

    /// Whether a cosine must be divided out.
    #[must_use]
    pub fn has_cosine(&self) -> bool {
        self.has(Word::CosI) || self.has(Word::CosO) || self.has(Word::CosIo)
    }

    /// f per unit of the value, for directions with these cosines, after decibels were undone.
    fn factor(&self, cos_i: f64, cos_o: f64) -> f64 {
        let mut factor = 1.0;
        if self.has(Word::PerCent) {
            factor /= 100.0;
        }
        if self.has(Word::PerSquareDegree) {
            factor *= SQUARE_DEGREES;
        }
        if self.has(Word::ReflectanceFactor) {
            factor /= PI;
        }
        if self.has(Word::CosI) || self.has(Word::CosIo) {
            factor /= cos_i;
        }
        if self.has(Word::CosO) || self.has(Word::CosIo) {
            factor /= cos_o;
        }
        factor
    }

    /// f in 1/sr for a value, and f per unit of the value's standard deviation, for directions with these cosines.
    #[must_use]
    pub fn f(&self, value: f64, cos_i: f64, cos_o: f64) -> (f64, f64) {
        let factor = self.factor(cos_i, cos_o);
        if self.is_decibel() {
            // 10 log10 of the quantity; its derivative turns a standard deviation in dB into one of f.
            let f = factor * 10_f64.powf(value / 10.0);
            return (f, f * LN_10 / 10.0);
        }
        (factor * value, factor)
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.words.iter().map(|word| word.name()).collect();
        f.write_str(if names.is_empty() { "f".to_owned() } else { names.join(",") }.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// A perfect white: f = 1/pi, in every way to write it.
    #[test]
    fn white_is_one_over_pi() {
        let (cos_i, cos_o) = (0.6, 0.8);
        let f = 1.0 / PI;
        for (text, value) in [
            ("f", f),
            ("f-cos-i", f * cos_i),
            ("f-cos-o", f * cos_o),
            ("f-cos-i-cos-o", f * cos_i * cos_o),
            ("reflectance-factor", 1.0),
            ("reflectance-factor,percent", 100.0),
            ("percent", 100.0 * f),
            ("reflectance-factor,decibel", 0.0),
            ("decibel", -10.0 * PI.log10()),
            ("per-square-degree", f * (PI / 180.0).powi(2)),
            ("f-cos-o,percent", 100.0 * f * cos_o),
        ] {
            let quantity = Quantity::parse(text).unwrap();
            assert_eq!(quantity.to_string(), text);
            let (found, slope) = quantity.f(value, cos_i, cos_o);
            assert_relative_eq!(found, f, max_relative = 1e-14);
            // The slope is the derivative.
            let step = 1e-6;
            let difference = (quantity.f(value + step, cos_i, cos_o).0 - found) / step;
            assert_relative_eq!(slope, difference, max_relative = 1e-6);
        }
        for wrong in [
            "",
            "brdf",
            "percent,percent",
            "f,f-cos-i",
            "percent,decibel",
            "reflectance-factor,per-square-degree",
        ] {
            assert!(Quantity::parse(wrong).is_err(), "{wrong}");
        }
    }
}
