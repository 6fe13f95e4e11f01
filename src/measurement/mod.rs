//! Measured reflectance: the contents of a file, which samples are usable, and how they are weighted.

mod clusters;
mod continuous;
mod coverage;
mod dead_channels;
mod draws;
pub mod formats;
mod from_arrays;
mod from_file;
mod incidence;
mod instrument;
pub mod interpolant;
mod known;
#[doc(hidden)]
pub mod merl_digests;
mod missing;
mod other_reading;
mod predicted;
pub mod reading;
mod remark;
mod repeated_values;
mod retain;
mod samples;
mod stated;
mod table_fault;

#[doc(hidden)]
pub use clusters::{ClusterKind, Clusters};
pub use continuous::Continuous;
pub use coverage::{ALBEDO_LIMIT_DEG, Coverage, coverage};
pub(crate) use coverage::{invariant_angles, measured_both_ways};
#[doc(hidden)]
pub use dead_channels::{dead_channels, doubts as dead_channel_doubts};
#[doc(hidden)]
pub use draws::Draws;
#[doc(hidden)]
pub use incidence::IncidenceGroups;
pub use instrument::{Instrument, TotalScatter};
pub use interpolant::Interpolant;
pub use known::KnownSamples;
pub(crate) use other_reading::{BRIGHTEST, CALIBRATION, readings_with_albedo};
pub use other_reading::{Evidence, OtherReading};
#[doc(hidden)]
pub use predicted::Predicted;
pub use remark::{Remark, TablePart};
#[doc(hidden)]
pub use samples::checked_max_theta;
pub use samples::{Filters, Samples, Weighting};
pub(crate) use stated::Stated;
pub use table_fault::{TableAxis, TableFault};

use crate::error::{OptionName, excerpt, rounded};
use crate::geometry::Directions;
use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

/// One spectral band.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Channel {
    /// Name in reports; the wavelength in nm for spectral data.
    pub name: String,
    /// Wavelength in nanometres; `None` if the file gives none.
    pub wavelength_nm: Option<f64>,
}

impl Channel {
    /// A channel without a wavelength, unless its name is one.
    ///
    /// A name that is a number, alone or followed by `nm`, is taken as a wavelength in nanometres.
    #[must_use]
    pub fn named(name: &str) -> Self {
        let number = name.strip_suffix("nm").unwrap_or(name).trim();
        let wavelength_nm = number.parse().ok().filter(|nm: &f64| nm.is_finite() && *nm > 0.0);
        match wavelength_nm {
            Some(nm) => Self::at_wavelength(nm),
            None => Self { name: name.to_owned(), wavelength_nm },
        }
    }

    /// A spectral channel.
    #[must_use]
    pub fn at_wavelength(nm: f64) -> Self {
        Self { name: format!("{nm}"), wavelength_nm: Some(nm) }
    }
}

/// The places of red, green and blue among the names of channels, whose case does not matter; the only channel's three times. `None` for
/// any other channels.
pub(crate) fn red_green_blue(names: &[&str]) -> Option<[usize; 3]> {
    let place = |wanted: &str| names.iter().position(|name| name.eq_ignore_ascii_case(wanted));
    match names.len() {
        1 => Some([0; 3]),
        3 => Some([place("r")?, place("g")?, place("b")?]),
        _ => None,
    }
}

/// The origin of a measurement.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Source {
    /// The path of the file as the user wrote it.
    pub path: PathBuf,
    /// Name of its format.
    pub format: &'static str,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
}

/// A reason to doubt that a file means what it says.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Doubt {
    /// A channel has the same value at every sample while others vary. In a fit it has no say in what the channels share.
    DeadChannel {
        /// Its name.
        channel: String,
        /// The value, 1/sr.
        value: f64,
        /// The number of samples.
        samples: usize,
    },
    /// The name of a column says that its values are not f.
    NotReflectance {
        /// The name.
        column: String,
        /// What its values are by that name, in words.
        what: &'static str,
    },
    /// Channels are named like readings of s- and p-polarised light.
    Polarised,
    /// Channels have one value at many samples, far from what their neighbours say: it may mark what was not measured.
    RepeatedValue {
        /// The names of the channels.
        channels: Vec<String>,
        /// The value, as read.
        value: f64,
        /// The number of samples that have it in the first of them.
        samples: usize,
        /// What the neighbours say in the first of them, the median.
        predicted: f64,
    },
    /// A half/difference table seems to have another layout than its format prescribes.
    SuspiciousTable(TableFault),
    /// Physics prefers another way to read the file. No reader says so, but [`crate::doctor::examine`].
    OtherReading(OtherReading),
}

impl Doubt {
    /// The options that would read the file in the other way, any one of them, each with a value, or an empty one if it has none.
    #[must_use]
    pub fn suggestions(&self) -> Vec<(OptionName, String)> {
        let only = match self {
            Self::DeadChannel { .. } | Self::SuspiciousTable(_) => return Vec::new(),
            Self::OtherReading(other) => return other.options.clone(),
            Self::NotReflectance { what, .. } => {
                let value = match *what {
                    "per cent" => "percent",
                    "decibels" => "decibel",
                    "a reflectance factor" => "reflectance-factor",
                    _ => "f-cos-o",
                };
                (OptionName::Quantity, value.to_owned())
            }
            Self::Polarised => (OptionName::MeanOfSAndP, String::new()),
            Self::RepeatedValue { value, .. } => (OptionName::Missing, value.to_string()),
        };
        vec![only]
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotReflectance { column, what } => {
                write!(f, "column {} is called like {what}, and was read as f in 1/sr", excerpt(column))
            }
            Self::Polarised => write!(
                f,
                "the channels are called like readings of s- and p-polarised light, and each is fitted by itself: f for \
                 unpolarised light is their mean"
            ),
            Self::RepeatedValue { channels, value, samples, predicted } => {
                let others = match channels.len() {
                    0 | 1 => String::new(),
                    several => format!(", and so are {} other channels", several - 1),
                };
                write!(
                    f,
                    "channel {} is exactly {value} at {samples} samples whose neighbours say {}{others}: if the \
                     value marks what was not measured, leave it out",
                    channels.first().map(String::as_str).unwrap_or_default(),
                    rounded(*predicted, 4)
                )
            }
            Self::DeadChannel { channel, value, samples } => write!(
                f,
                "channel {channel} is {} at all {samples} samples while others vary, as if its detector were dead: in a \
                 fit it has no say in what the channels share, and its own parameters have no standard errors",
                rounded(*value, 6)
            ),
            Self::SuspiciousTable(fault) => fault.fmt(f),
            Self::OtherReading(other) => other.fmt(f),
        }
    }
}

/// A measured BRDF, created from arrays by [`Measurement::new`] or from a file by [`Measurement::read`].
///
/// Values are f in 1/sr, by channel and sample. A value that was not measured is NaN, and [`Measurement::missing`] counts these; the other
/// channels of its sample stay. Samples that have no value in any channel, and cells that a table marks as invalid, are counted in
/// `dropped` and left out.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Measurement {
    /// Where the measurement came from.
    pub source: Source,
    /// The channels, at least one.
    pub channels: Vec<Channel>,
    /// The directions of each sample.
    pub directions: Directions,
    /// f in 1/sr, by channel and sample; NaN where it was not measured, and never infinite.
    pub values: Vec<Vec<f64>>,
    /// Standard deviation of f in 1/sr, by channel and sample; `None` if the file gives none. That of a value that was not measured says
    /// nothing, and may be NaN.
    pub sigma: Option<Vec<Vec<f64>>>,
    /// Number of samples left out when reading, by reason.
    pub dropped: BTreeMap<&'static str, usize>,
    /// Reasons of the reader to doubt the file.
    pub doubts: Vec<Doubt>,
    /// What the reader did that a user should know.
    pub remarks: Vec<Remark>,
    /// What the file says about the instrument and the sample.
    pub instrument: Instrument,
    /// The BRDF from which the samples were drawn, if the file defines one everywhere.
    pub continuous: Option<Arc<dyn Continuous>>,
    /// How the reader understood the angles of a file that states them.
    pub(crate) stated: Option<Stated>,
    /// Where those samples stood in the arrays of [`Measurement::new`] that it left out because they have no value.
    pub(crate) empty: Vec<usize>,
}

impl Measurement {
    /// A measurement that has nothing but channels, directions and values.
    pub(crate) fn of(channels: Vec<Channel>, directions: Directions, values: Vec<Vec<f64>>) -> Self {
        Self {
            source: Source::default(),
            channels,
            directions,
            values,
            sigma: None,
            dropped: BTreeMap::new(),
            doubts: Vec::new(),
            remarks: Vec::new(),
            instrument: Instrument::default(),
            continuous: None,
            stated: None,
            empty: Vec::new(),
        }
    }

    /// The names of the channels.
    #[must_use]
    pub fn channel_names(&self) -> Vec<String> {
        self.channels.iter().map(|channel| channel.name.clone()).collect()
    }

    /// The number of samples in the file, usable or not.
    #[must_use]
    pub fn total(&self) -> usize {
        self.directions.len() + self.dropped.values().sum::<usize>()
    }
}
