//! The values of a fitted model, as the writers of targets ask for them.

use crate::code::{Arguments, Language, NotWritten};
use crate::measurement::red_green_blue;
use crate::model::{Expression, STRENGTH};
use crate::parameters::ParameterTable;
use crate::report::Report;
use std::cell::RefCell;
use std::fmt;

/// Why a target cannot hold a model.
#[derive(Clone, Debug, PartialEq)]
pub enum NotHeld {
    /// The target has no such lobe, or not together with the others.
    Lobe(String),
    /// The target has one value of this parameter, and the fit one per channel.
    PerChannel(String),
    /// Its colours are in linear Rec.709, and others are wanted.
    Primaries(&'static str),
    /// Channels are neither r, g and b nor one.
    Channels(Vec<String>),
    /// The model cannot be written as code in the form that is wanted.
    Code(NotWritten),
}

impl fmt::Display for NotHeld {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lobe(model) => write!(f, "it has no form for {model}"),
            Self::PerChannel(name) => write!(f, "it has one {name} for all channels"),
            Self::Primaries(wanted) => write!(f, "its colours are linear Rec.709, and {wanted} are wanted"),
            Self::Channels(names) => write!(f, "it has the channels r, g and b, not {}", names.join(", ")),
            Self::Code(reason) => reason.fmt(f),
        }
    }
}

/// Where the values of a file come from.
#[derive(Clone, Debug, Default)]
pub struct About<'a> {
    /// Lines for a comment.
    pub lines: Vec<String>,
    /// The target's name for the primaries of the colours; empty if its files cannot state them.
    pub color_space: &'static str,
    /// The report of the model that is written, for targets that can hold it.
    pub report: Option<&'a Report>,
    /// The language that code is written in, and which parameters are its arguments.
    pub code: Option<(&'static Language, Arguments)>,
}

/// A model at its values in red, green and blue, for one channel three times the same.
pub struct Values<'a> {
    expression: &'a Expression,
    table: &'a ParameterTable,
    /// The channel of the table for red, green and blue.
    channels: [usize; 3],
    about: &'a About<'a>,
    clamped: RefCell<Vec<(String, f64, f64)>>,
}

impl<'a> Values<'a> {
    /// Gathers the values.
    ///
    /// # Errors
    /// [`NotHeld::Channels`] unless the channels are r, g and b in any order, or one.
    pub fn new(
        expression: &'a Expression,
        table: &'a ParameterTable,
        about: &'a About<'a>,
    ) -> Result<Self, NotHeld> {
        let names = table.channels();
        let texts: Vec<&str> = names.iter().map(String::as_str).collect();
        let channels = red_green_blue(&texts).ok_or_else(|| NotHeld::Channels(names.to_vec()))?;
        Ok(Self { expression, table, channels, about, clamped: RefCell::default() })
    }

    /// Lines about where the values come from, for a comment.
    pub fn header(&self) -> &[String] {
        &self.about.lines
    }

    /// The target's name for the primaries of the colours.
    pub fn color_space(&self) -> &'static str {
        self.about.color_space
    }

    /// The report of what is written.
    pub fn report(&self) -> Option<&Report> {
        self.about.report
    }

    /// The channel of the table for red, green and blue.
    pub fn channels(&self) -> [usize; 3] {
        self.channels
    }

    /// The lobes that are present.
    pub fn lobes(&self) -> Vec<LobeOf<'_, 'a>> {
        let present = (0..self.expression.lobes().len()).filter(|index| !self.table.is_absent(*index));
        present.map(|index| LobeOf { values: self, index }).collect()
    }

    /// The only lobe.
    ///
    /// # Errors
    /// [`NotHeld::Lobe`] if there are several, or none.
    pub fn only_lobe(&self) -> Result<LobeOf<'_, 'a>, NotHeld> {
        let mut lobes = self.lobes();
        match (lobes.pop(), lobes.is_empty()) {
            (Some(lobe), true) => Ok(lobe),
            _ => Err(self.not_held()),
        }
    }

    /// That the target has no form for the model.
    pub fn not_held(&self) -> NotHeld {
        NotHeld::Lobe(format!("'{}'", self.expression.canonical()))
    }

    /// The values that were moved into a range.
    pub(super) fn clamped(&self) -> Vec<(String, f64, f64)> {
        self.clamped.borrow().clone()
    }
}

/// A lobe of a sum, and its values.
#[derive(Clone, Copy)]
pub struct LobeOf<'v, 'a> {
    values: &'v Values<'a>,
    index: usize,
}

impl LobeOf<'_, '_> {
    /// Name of the model.
    pub fn model(&self) -> &'static str {
        self.lobe().map_or("", |lobe| lobe.model.name())
    }

    /// The value chosen for an option; empty if the model has no such option.
    pub fn choice(&self, key: &str) -> &'static str {
        self.lobe().map_or("", |lobe| lobe.choice(key))
    }

    /// Whether the model is this one and its choices are these.
    pub fn is(&self, model: &str, choices: &[(&str, &[&str])]) -> bool {
        self.model() == model && choices.iter().all(|(key, values)| values.contains(&self.choice(key)))
    }

    fn lobe(&self) -> Option<&crate::model::Lobe> {
        self.values.expression.lobes().get(self.index)
    }

    /// A parameter in red, green and blue. One that the model does not have is 0.
    pub fn rgb(&self, name: &str) -> [f64; 3] {
        let rows = self.values.table.rows();
        let of = |channel: usize| {
            let mut own = rows.iter().filter(|row| row.lobe == self.index && row.spec.name == name);
            own.find(|row| row.channel.is_none_or(|c| c == channel)).map_or(0.0, |row| row.value)
        };
        self.values.channels.map(of)
    }

    /// A parameter in red, green and blue, moved into `low..=high`.
    pub fn rgb_within(&self, name: &str, low: f64, high: f64) -> [f64; 3] {
        let values = self.rgb(name);
        let moved = values.map(|value| value.clamp(low, high));
        for ((value, moved), channel) in values.into_iter().zip(moved).zip(self.values.channels) {
            self.note_moved(name, Some(channel), value, moved);
        }
        moved
    }

    /// Keeps a value that was moved in mind, by its full name.
    fn note_moved(&self, name: &str, channel: Option<usize>, value: f64, moved: f64) {
        if value == moved {
            return;
        }
        let table = self.values.table;
        let mut rows = table.rows().iter().enumerate();
        let row = rows.find(|(_, row)| {
            row.lobe == self.index
                && row.spec.name == name
                && (channel.is_none() || row.channel.is_none() || row.channel == channel)
        });
        let full = row.map_or_else(|| name.to_owned(), |(index, _)| table.name(index));
        let mut clamped = self.values.clamped.borrow_mut();
        if !clamped.iter().any(|(known, ..)| *known == full) {
            clamped.push((full, value, moved));
        }
    }

    /// A parameter that the channels share.
    ///
    /// # Errors
    /// [`NotHeld::PerChannel`] if they have values of their own that differ.
    pub fn one(&self, name: &str) -> Result<f64, NotHeld> {
        let [r, g, b] = self.rgb(name);
        if r == g && g == b { Ok(r) } else { Err(NotHeld::PerChannel(name.to_owned())) }
    }

    /// A parameter that the channels share, moved into `low..=high`.
    ///
    /// # Errors
    /// Those of [`Self::one`].
    pub fn one_within(&self, name: &str, low: f64, high: f64) -> Result<f64, NotHeld> {
        let value = self.one(name)?;
        let moved = value.clamp(low, high);
        self.note_moved(name, None, value, moved);
        Ok(moved)
    }

    /// The strength that a sum gives to a lobe that has none of its own; 1 for others.
    ///
    /// # Errors
    /// Those of [`Self::one`].
    pub fn strength(&self) -> Result<f64, NotHeld> {
        let has_one =
            self.lobe().is_some_and(|lobe| lobe.parameters().iter().any(|spec| spec.name == STRENGTH));
        if has_one { self.one(STRENGTH) } else { Ok(1.0) }
    }

    /// The roughness along x and along y.
    ///
    /// # Errors
    /// Those of [`Self::one`].
    pub fn roughness(&self) -> Result<[f64; 2], NotHeld> {
        self.roughness_within(f64::NEG_INFINITY, f64::INFINITY)
    }

    /// The roughness along x and along y, moved into `low..=high`.
    ///
    /// # Errors
    /// Those of [`Self::one`].
    pub fn roughness_within(&self, low: f64, high: f64) -> Result<[f64; 2], NotHeld> {
        let two = self.choice("d").ends_with("-anisotropic") || self.choice("shape") == "anisotropic";
        let one = |name| self.one_within(name, low, high);
        Ok(if two { [one("mx")?, one("my")?] } else { [one("m")?; 2] })
    }

    /// Roughness and anisotropy of a target with mx = r^2/aspect and my = r^2 aspect, where the aspect is sqrt(1 - 0.9 anisotropy), from
    /// mx and my in `low..=high`.
    ///
    /// # Errors
    /// Those of [`Self::one`], and [`NotHeld::Lobe`] if my is larger than mx or less than a tenth of it.
    pub fn by_aspect(&self, low: f64, high: f64) -> Result<[f64; 2], NotHeld> {
        let [mx, my] = self.roughness_within(low, high)?;
        let anisotropy = (1.0 - my / mx) / 0.9;
        if !(-1e-12..=1.0).contains(&anisotropy) {
            return Err(self.not_held());
        }
        Ok([(mx * my).sqrt().sqrt(), anisotropy.max(0.0)])
    }

    /// The target's name for the primaries of the colours.
    pub fn color_space(&self) -> &'static str {
        self.values.color_space()
    }

    /// That the target has no form for the lobe.
    pub fn not_held(&self) -> NotHeld {
        NotHeld::Lobe(self.lobe().map_or_else(String::new, |lobe| format!("'{}'", lobe.canonical())))
    }
}

/// Numbers with blanks or other text between them.
pub(super) fn joined(values: &[f64], between: &str) -> String {
    values.iter().map(f64::to_string).collect::<Vec<_>>().join(between)
}

/// Lines as comments that begin with `mark`.
pub(super) fn commented(lines: &[String], mark: &str) -> String {
    lines.iter().map(|line| format!("{mark} {line}\n")).collect()
}

/// Lines as a comment of XML, in which two hyphens may not stand side by side.
pub(super) fn xml_comment(lines: &[String]) -> String {
    // Twice, because of three in a row.
    let line = |line: &String| format!("  {}\n", line.replace("--", "- -").replace("--", "- -"));
    format!("<!--\n{}-->\n", lines.iter().map(line).collect::<String>())
}
