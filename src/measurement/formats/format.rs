//! What a format is: how it recognises a file, and how it reads one.

use super::file::File;
use crate::error::Error;
use crate::geometry::Pair;
use crate::measurement::Measurement;

/// How sure a format is that a file is its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Confidence {
    /// Some other format's.
    No,
    /// It looks like an attempt at this format; reading it will say what is wrong.
    Maybe,
    /// This format's beyond doubt.
    Yes,
}

/// Which directions the cells of a half/difference table stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum BinPosition {
    /// The centre of the bin.
    #[default]
    Center,
    /// Its lower edge.
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

/// What a reader may be told.
#[derive(Clone, Copy, Debug, Default)]
#[non_exhaustive]
pub struct ReadOptions {
    /// Which directions the cells of a MERL table stand for.
    pub merl_bins: BinPosition,
}

impl ReadOptions {
    /// The options of the command line unless it is told others.
    #[must_use]
    pub const fn new() -> Self {
        Self { merl_bins: BinPosition::Center }
    }

    /// Takes the values of a MERL table for those at this position in their bins.
    #[must_use]
    pub const fn with_merl_bins(self, merl_bins: BinPosition) -> Self {
        Self { merl_bins }
    }
}

/// Reads the directions of a file.
pub type ReadDirections = fn(&mut File<'_>) -> Result<Vec<Pair>, Error>;

/// A reader of one format.
pub struct Format {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// What it is, in one line.
    pub summary: &'static str,
    /// Whether a file is of this format.
    pub sniff: fn(&File<'_>) -> Confidence,
    /// Reads it. The caller fills in the source.
    pub read: fn(&mut File<'_>, &ReadOptions) -> Result<Measurement, Error>,
    /// Reads the directions alone, from a file that need not have anything else. `None` means that there is no such
    /// file of this format: the directions are those of the measurement.
    pub directions: Option<ReadDirections>,
}
