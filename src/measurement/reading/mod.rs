//! How the numbers of a file are to be understood, where the file does not say so or says something else.

mod angles;
mod apply;
mod leave_out;
mod polarised;
mod quantity;
mod table;

pub use angles::{Angle, AngleConventions, AngleUnit, AngleUnits, AzimuthOrigin, LightDirection};
pub use leave_out::Rule;
pub use quantity::Quantity;
pub use table::{ColumnChoice, DecimalMark, Separator, TableLayout};

use crate::error::{Error, OptionName, excerpt};

/// How the numbers of a file are to be understood. The default changes nothing: what the file says, or f in 1/sr and angles in degrees.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Conventions {
    /// How directions are stated.
    pub angles: AngleConventions,
    /// What the values are.
    pub quantity: Quantity,
    /// A factor for all values; `None` for 1.
    pub scale: Option<f64>,
    /// Values that mark what was not measured.
    pub missing: Vec<f64>,
    /// Rules by which samples are left out.
    pub leave_out: Vec<Rule>,
    /// Whether channels for s- and p-polarised light are averaged.
    pub mean_of_s_and_p: bool,
    /// How a text table is laid out.
    pub table: TableLayout,
    /// What was said, by option, for a report.
    given: Vec<(OptionName, String)>,
}

/// The options that say how a file is to be understood, in the order in which they are described.
pub const OPTIONS: [OptionName; 11] = [
    OptionName::Columns,
    OptionName::Separator,
    OptionName::Decimal,
    OptionName::Angles,
    OptionName::Azimuth,
    OptionName::LightDirection,
    OptionName::Quantity,
    OptionName::Scale,
    OptionName::Missing,
    OptionName::LeaveOut,
    OptionName::MeanOfSAndP,
];

/// The options that only tables of text have.
pub(crate) const OF_TABLES: [OptionName; 3] =
    [OptionName::Columns, OptionName::Separator, OptionName::Decimal];

impl Conventions {
    /// These conventions with one more, as it is written on the command line and in reports. `leave-out` may be given several times, and
    /// `mean-of-s-and-p` is `true` or `false`.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the text is no value of the option, or the option is none of [`OPTIONS`].
    pub fn with(mut self, option: OptionName, text: &str) -> Result<Self, Error> {
        let invalid = |expected: &str| Err(Error::invalid(option, expected, excerpt(text)));
        let number = |text: &str| text.trim().parse().ok().filter(|number: &f64| number.is_finite());
        match option {
            OptionName::Columns => self.table.columns = ColumnChoice::parse(text)?,
            OptionName::Separator => self.table.separator = Some(Separator::parse(text)?),
            OptionName::Decimal => self.table.decimal = Some(DecimalMark::parse(text)?),
            OptionName::Angles => self.angles.units = AngleUnits::parse(text)?,
            OptionName::Azimuth => self.angles.azimuth = Some(AzimuthOrigin::parse(text)?),
            OptionName::LightDirection => self.angles.light = LightDirection::parse(text)?,
            OptionName::Quantity => self.quantity = Quantity::parse(text)?,
            OptionName::Scale => match number(text).filter(|factor| *factor > 0.0) {
                Some(factor) => self.scale = Some(factor),
                None => return invalid("a factor above 0"),
            },
            OptionName::Missing => match text.split(',').map(number).collect::<Option<Vec<f64>>>() {
                Some(markers) => self.missing = markers,
                None => return invalid("numbers with commas between, such as -999"),
            },
            OptionName::LeaveOut => self.leave_out.push(Rule::parse(text)?),
            OptionName::MeanOfSAndP => match text {
                "true" => self.mean_of_s_and_p = true,
                "false" => self.mean_of_s_and_p = false,
                _ => return invalid("true or false"),
            },
            _ => return invalid("an option that says how a file is read"),
        }
        if option != OptionName::LeaveOut {
            self.given.retain(|(known, _)| *known != option);
        }
        self.given.push((option, text.to_owned()));
        Ok(self)
    }

    /// What was said, by option, in the order in which it was said.
    #[must_use]
    pub fn given(&self) -> &[(OptionName, String)] {
        &self.given
    }
}
