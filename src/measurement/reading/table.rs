//! How a text table is laid out, where the user says so.

use super::angles::Angle;
use crate::error::{Error, OptionName, excerpt};
use std::fmt;

/// What divides the fields of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Separator {
    /// A tab.
    Tab,
    /// A semicolon.
    Semicolon,
    /// A comma.
    Comma,
    /// A vertical bar.
    Bar,
    /// Any number of blanks and tabs.
    Blanks,
}

impl Separator {
    /// All separators, in the order in which they are tried: one that is rarely part of a name comes first.
    pub const ALL: [Self; 5] = [Self::Tab, Self::Semicolon, Self::Comma, Self::Bar, Self::Blanks];

    /// Its name in options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tab => "tab",
            Self::Semicolon => "semicolon",
            Self::Comma => "comma",
            Self::Bar => "bar",
            Self::Blanks => "blanks",
        }
    }

    /// Parses its name, or the character itself.
    ///
    /// # Errors
    /// [`Error::Invalid`] for anything else.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let named = Self::ALL.into_iter().find(|separator| separator.name() == text);
        let character = || match text {
            "\t" | "\\t" => Some(Self::Tab),
            ";" => Some(Self::Semicolon),
            "," => Some(Self::Comma),
            "|" => Some(Self::Bar),
            " " => Some(Self::Blanks),
            _ => None,
        };
        named.or_else(character).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::invalid(OptionName::Separator, format!("one of {names}"), excerpt(text))
        })
    }

    /// The character; `None` for blanks, which are several.
    #[must_use]
    pub fn character(self) -> Option<char> {
        match self {
            Self::Tab => Some('\t'),
            Self::Semicolon => Some(';'),
            Self::Comma => Some(','),
            Self::Bar => Some('|'),
            Self::Blanks => None,
        }
    }
}

/// What stands before the fraction of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DecimalMark {
    /// A point.
    Point,
    /// A comma.
    Comma,
}

impl DecimalMark {
    /// Its name in options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Comma => "comma",
        }
    }

    /// Parses its name, or the character itself.
    ///
    /// # Errors
    /// [`Error::Invalid`] for anything else.
    pub fn parse(text: &str) -> Result<Self, Error> {
        match text {
            "point" | "." => Ok(Self::Point),
            "comma" | "," => Ok(Self::Comma),
            _ => Err(Error::invalid(OptionName::Decimal, "point or comma", excerpt(text))),
        }
    }
}

/// Which columns of a table are what, each by its name or by its number from 1.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ColumnChoice {
    /// The columns of angles.
    pub angles: Vec<(Angle, String)>,
    /// The columns of values. Where there are any, all columns without a part are left out.
    pub channels: Vec<String>,
    /// The columns of standard deviations: one for all channels, or one each.
    pub sigma: Vec<String>,
    /// The column of wavelengths, of a table with a row for each.
    pub wavelength: Option<String>,
    /// The columns to leave out.
    pub ignore: Vec<String>,
}

impl ColumnChoice {
    /// The names of all parts that a column can have.
    fn parts() -> String {
        let angles = Angle::ALL.map(Angle::name).join(", ");
        format!("{angles}, channels, sigma, wavelength, ignore")
    }

    /// Parses a list such as `theta_i=A,theta_o=B,channels=R;G;B,sigma=S`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for an unknown part, or one that is given twice.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let wrong = |found: &str| {
            let expected = format!("PART=COLUMN with parts among {}, with commas between", Self::parts());
            Error::invalid(OptionName::Columns, expected, excerpt(found))
        };
        let mut choice = Self::default();
        for item in text.split(',') {
            let (part, column) = item.split_once('=').ok_or_else(|| wrong(item))?;
            let columns: Vec<String> = column.split(';').map(|name| name.trim().to_owned()).collect();
            let part = part.trim();
            let angle = Angle::ALL.into_iter().find(|angle| angle.name() == part);
            let is_new = match (part, angle) {
                (_, Some(angle)) => choice.angles.iter().all(|(known, _)| *known != angle),
                ("channels", _) => choice.channels.is_empty(),
                ("sigma", _) => choice.sigma.is_empty(),
                ("ignore", _) => choice.ignore.is_empty(),
                ("wavelength", _) => choice.wavelength.is_none(),
                _ => false,
            };
            if !is_new || columns.iter().any(String::is_empty) {
                return Err(wrong(item));
            }
            match (part, angle, columns.as_slice()) {
                (_, Some(angle), [only]) => choice.angles.push((angle, only.clone())),
                ("wavelength", _, [only]) => choice.wavelength = Some(only.clone()),
                ("channels", _, _) => choice.channels = columns,
                ("sigma", _, _) => choice.sigma = columns,
                ("ignore", _, _) => choice.ignore = columns,
                _ => return Err(wrong(item)),
            }
        }
        Ok(choice)
    }

    /// Whether nothing was chosen.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl fmt::Display for ColumnChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts: Vec<String> =
            self.angles.iter().map(|(angle, column)| format!("{}={column}", angle.name())).collect();
        parts.extend(self.wavelength.iter().map(|column| format!("wavelength={column}")));
        for (part, columns) in
            [("channels", &self.channels), ("sigma", &self.sigma), ("ignore", &self.ignore)]
        {
            if !columns.is_empty() {
                parts.push(format!("{part}={}", columns.join(";")));
            }
        }
        f.write_str(&parts.join(","))
    }
}

/// How a text table is laid out, where the user says so.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct TableLayout {
    /// Which columns are what.
    pub columns: ColumnChoice,
    /// What divides the fields; `None` to find out.
    pub separator: Option<Separator>,
    /// What stands before fractions; `None` to find out.
    pub decimal: Option<DecimalMark>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_chosen_by_name() {
        let text = "theta_i=Inc,theta_o=3,wavelength=wl,channels=R;G;B,sigma=S";
        let choice = ColumnChoice::parse(text).unwrap();
        assert_eq!(choice.to_string(), text);
        assert_eq!(choice.channels, ["R", "G", "B"]);
        for wrong in
            ["", "theta_i", "theta=A", "theta_i=A;B", "theta_i=A,theta_i=B", "channels=R;;B", "sigma="]
        {
            assert!(ColumnChoice::parse(wrong).is_err(), "{wrong}");
        }
        assert_eq!(Separator::parse(";").unwrap(), Separator::parse("semicolon").unwrap());
        assert!(Separator::parse("pipe").is_err() && DecimalMark::parse("dot").is_err());
    }
}
