//! The interface of a format: how it recognises a file, and how it reads one.

use super::file::File;
use super::writing::Write;
use crate::error::{Error, OptionName};
use crate::geometry::Pair;
use crate::measurement::Measurement;
use crate::measurement::reading::Conventions;

/// How certain a format is that a file is in this format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Confidence {
    /// The file is in another format.
    No,
    /// The file looks like an attempt at this format; reading it will show what is wrong.
    Maybe,
    /// The file is certainly in this format.
    Yes,
}

/// The directions that the cells of a half/difference table stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum BinPosition {
    /// The centre of the bin.
    #[default]
    Center,
    /// The lower edge of the bin.
    Edge,
}

impl BinPosition {
    /// Name on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Center => "center",
            Self::Edge => "edge",
        }
    }
}

/// Options of a reader.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct ReadOptions {
    /// The directions that the cells of a MERL table stand for.
    pub merl_bins: BinPosition,
    /// The material to read from a file that holds several; `None` for the first.
    pub material: Option<String>,
    /// How the numbers of the file are to be understood.
    pub conventions: Conventions,
}

impl ReadOptions {
    /// The default options, those of the command line.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes the values of a MERL table to be those at this position in their bins.
    #[must_use]
    pub fn with_merl_bins(self, merl_bins: BinPosition) -> Self {
        Self { merl_bins, ..self }
    }

    /// Reads this material from a file that holds several.
    #[must_use]
    pub fn with_material(self, material: &str) -> Self {
        Self { material: Some(material.to_owned()), ..self }
    }

    /// Understands the numbers of the file in this way.
    #[must_use]
    pub fn with_conventions(self, conventions: Conventions) -> Self {
        Self { conventions, ..self }
    }
}

/// A function that reads the directions of a file.
pub type ReadDirections = fn(&mut File<'_>, &ReadOptions) -> Result<Vec<Pair>, Error>;

/// A reader of one format.
pub struct Format {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// A description of the format in one line.
    pub summary: &'static str,
    /// Decides whether a file is in this format.
    pub sniff: fn(&File<'_>) -> Confidence,
    /// Reads a file. The caller fills in the source.
    pub read: fn(&mut File<'_>, &ReadOptions) -> Result<Measurement, Error>,
    /// Reads only the directions, from a file that need not contain anything else. `None` if the format has no such
    /// files: the directions are then those of the measurement.
    pub directions: Option<ReadDirections>,
    /// Whether a file may hold several materials, of which [`ReadOptions::material`] names one.
    pub several_materials: bool,
    /// The options of [`Conventions`] that not every format has and this one does.
    pub own_options: &'static [OptionName],
    /// Whether its reader makes directions by [`Conventions::angles`] itself, and knows their units.
    pub knows_angles: bool,
    /// The usual endings of the names of its files, without the dot, which choose it when a file is written.
    pub extensions: &'static [&'static str],
    /// Writes a file; `None` if the format is only read.
    pub write: Option<Write>,
}
