//! A parameter after a fit: its value and its uncertainty.

use super::profiled_interval::{OpenEnd, ProfiledInterval};
use super::result::Fit;
use crate::error::Error;
use crate::math::count;
use crate::model::Unit;
use crate::parameters::{ParameterRow, Selector, Status, channel_suffix};
use std::fmt;

/// A parameter after a fit: its value and its uncertainty. Values, errors and bounds are in `unit`.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FittedParameter {
    /// The lobe that it belongs to, such as `cook-torrance` or `cook-torrance#2`.
    pub lobe: String,
    /// Its symbol, such as `m`.
    pub name: &'static str,
    /// Its channel; `None` if the channels share it.
    pub channel: Option<String>,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: Unit,
    /// Its standard error; `None` if it has none that is meaningful, and then `no_std_error` says why.
    pub std_error: Option<f64>,
    /// Why it has no standard error; `None` if it has one.
    pub no_std_error: Option<NoStandardError>,
    /// Its 95 % confidence interval; `None` if it has none. One from a profile of the cost does not need a standard error.
    pub ci95: Option<[f64; 2]>,
    /// Why the interval is open below and above; `None` where it is not. An open end is the last value that was tried.
    pub open: [Option<OpenEnd>; 2],
    /// The smallest and the largest value that the fit allowed.
    pub bounds: (f64, f64),
    /// The value that the fit started from.
    pub initial: f64,
    /// How the fit treated it, and where it ended.
    pub state: ParameterState,
}

/// How a fit treated a parameter, and where the parameter ended.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ParameterState {
    /// It was fitted and ended between its bounds.
    Free,
    /// It was fitted and ended at its lower bound.
    AtLower,
    /// It was fitted and ended at its upper bound.
    AtUpper,
    /// It was kept at its value.
    Fixed,
    /// It was kept equal to another parameter.
    Tied {
        /// The full name of the other parameter.
        to: String,
    },
    /// It has no effect, because its lobe is absent.
    Absent,
}

/// Why a parameter has no standard error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NoStandardError {
    /// It was not fitted.
    Fixed,
    /// It was kept equal to another parameter, which has the error.
    Tied,
    /// It has no effect, because its lobe is absent.
    Absent,
    /// It is at a bound.
    AtBound,
    /// It belongs to a dead channel.
    DeadChannel,
    /// The data do not determine it.
    Undetermined,
    /// It depends on a parameter that is at a bound.
    DependsOnBound,
    /// The loss discards the samples that it depends on.
    Discarded,
    /// A single group of samples decides it, so that the others say nothing of its error.
    DecidedByOneGroup,
    /// Fewer than three samples decide it.
    FewSamples,
    /// The data have no noise from which an error could be estimated.
    NoNoise,
    /// The fit did not reach a minimum, or there are no more residuals than free parameters.
    NoMinimum,
}

impl fmt::Display for NoStandardError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fixed => "not fitted",
            Self::Tied => "tied to another parameter",
            Self::Absent => "its lobe is absent",
            Self::AtBound => "at a bound",
            Self::DeadChannel => "of a dead channel",
            Self::Undetermined => "not determined by the data",
            Self::DependsOnBound => "depends on a parameter at a bound",
            Self::Discarded => "the loss discards the samples that it depends on",
            Self::DecidedByOneGroup => "a single group of samples decides it",
            Self::FewSamples => "fewer than three samples decide it",
            Self::NoNoise => "the data have no noise",
            Self::NoMinimum => "the fit has no minimum or no degrees of freedom",
        })
    }
}

impl FittedParameter {
    /// The full name: `lobe.name`, `lobe.name.channel` or `lobe.name[700]`.
    #[must_use]
    pub fn full_name(&self) -> String {
        let channel = self.channel.as_deref().map(channel_suffix).unwrap_or_default();
        format!("{}.{}{channel}", self.lobe, self.name)
    }
}

/// Writes `cook-torrance.m = 0.18019 +/- 0.00017`, or the reason in parentheses if there is no standard error.
impl fmt::Display for FittedParameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = ", self.full_name())?;
        match (self.std_error, self.no_std_error) {
            // The error to two digits, and the value to the same decimal place.
            (Some(error), _) => match (0..15).find(|places| error * 10_f64.powf(count(*places)) >= 10.0) {
                Some(places) => write!(f, "{:.places$} +/- {error:.places$}", self.value),
                None => write!(f, "{} +/- {error:.1e}", self.value),
            },
            (None, Some(reason)) => write!(f, "{} ({reason})", self.value),
            (None, None) => write!(f, "{}", self.value),
        }
    }
}

impl Fit {
    /// Every parameter, including fixed and tied ones, in the order of lobes, parameters and channels.
    #[must_use]
    pub fn parameters(&self) -> Vec<FittedParameter> {
        self.table.rows().iter().enumerate().map(|(index, row)| self.fitted(index, row)).collect()
    }

    /// The parameter called `name`: `m`, or with its lobe or channel if `m` is ambiguous, as in `cook-torrance.f0.r`
    /// or `f0[700]`.
    ///
    /// # Errors
    /// [`Error::UnknownName`] if the model has no such parameter, [`Error::AmbiguousParameter`] if several parameters
    /// have the name.
    pub fn parameter(&self, name: &str) -> Result<FittedParameter, Error> {
        match self.table.rows_named(&Selector::parse(name)?)?.as_slice() {
            [(index, row)] => Ok(self.fitted(*index, row)),
            several => {
                let names: Vec<String> = several.iter().map(|(index, _)| self.table.name(*index)).collect();
                Err(Error::AmbiguousParameter { name: name.to_owned(), candidates: names })
            }
        }
    }

    fn fitted(&self, index: usize, row: &ParameterRow) -> FittedParameter {
        let std_error = self.std_error(index);
        FittedParameter {
            lobe: self.table.lobe_name(row).to_owned(),
            name: row.spec.name,
            channel: self.table.channel_name(row).map(str::to_owned),
            value: row.value,
            unit: row.spec.unit,
            std_error,
            no_std_error: if std_error.is_none() { Some(self.no_std_error(index, row)) } else { None },
            ci95: self.ci95(index),
            open: self.profile(index).map_or([None; 2], |profile| profile.open),
            bounds: row.bounds,
            initial: row.initial,
            state: match row.status {
                Status::Fixed => ParameterState::Fixed,
                Status::Tied(other) => ParameterState::Tied { to: self.table.name(other) },
                Status::Absent => ParameterState::Absent,
                Status::Free | Status::Apart if row.at_lower() => ParameterState::AtLower,
                Status::Free | Status::Apart if row.at_upper() => ParameterState::AtUpper,
                Status::Free | Status::Apart => ParameterState::Free,
            },
        }
    }

    /// The standard error of the parameter in a row of the table; `None` if it has none that is meaningful.
    pub(crate) fn std_error(&self, index: usize) -> Option<f64> {
        self.covariance.as_ref()?.std_error(index)
    }

    /// The interval by the profile of a row of the table.
    fn profile(&self, index: usize) -> Option<&ProfiledInterval> {
        self.profiled.iter().flatten().find(|profile| profile.row == index)
    }

    /// The 95 % confidence interval of the parameter in a row of the table; `None` without a standard error or profile.
    pub(crate) fn ci95(&self, index: usize) -> Option<[f64; 2]> {
        if let Some(profile) = self.profile(index) {
            return Some(profile.ends);
        }
        let std_error = self.std_error(index)?;
        if let Some(resampled) = &self.resampled {
            return resampled.interval(index);
        }
        let value = self.table.rows().get(index)?.value;
        let half = self.covariance.as_ref()?.half_interval(index)? * std_error;
        Some([value - half, value + half])
    }

    fn no_std_error(&self, index: usize, row: &ParameterRow) -> NoStandardError {
        match row.status {
            Status::Fixed => return NoStandardError::Fixed,
            Status::Tied(_) => return NoStandardError::Tied,
            Status::Absent => return NoStandardError::Absent,
            Status::Apart => return NoStandardError::DeadChannel,
            Status::Free => {}
        }
        let Some(covariance) = &self.covariance else { return NoStandardError::NoMinimum };
        if !covariance.rows.contains(&index) {
            NoStandardError::AtBound
        } else if covariance.undetermined.contains(&index) {
            NoStandardError::Undetermined
        } else if covariance.dependent.contains(&index) {
            NoStandardError::DependsOnBound
        } else if covariance.discarded.contains(&index) {
            NoStandardError::Discarded
        } else if covariance.decided_by_one.contains(&index) {
            NoStandardError::DecidedByOneGroup
        } else if covariance.decided_by_few.contains(&index) {
            NoStandardError::FewSamples
        } else {
            NoStandardError::NoNoise
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_written_to_two_digits_of_their_error() {
        let parameter = |value, std_error: Option<f64>| FittedParameter {
            lobe: "ward".to_owned(),
            name: "ks",
            channel: Some("700".to_owned()),
            value,
            unit: Unit::One,
            std_error,
            no_std_error: if std_error.is_none() { Some(NoStandardError::AtBound) } else { None },
            ci95: None,
            open: [None; 2],
            bounds: (0.0, 1.0),
            initial: 0.5,
            state: ParameterState::Free,
        };
        for (value, std_error, text) in [
            (0.180_190_3, Some(0.000_170_7), "ward.ks[700] = 0.18019 +/- 0.00017"),
            (123.456, Some(3.21), "ward.ks[700] = 123.5 +/- 3.2"),
            (123.456, Some(32.1), "ward.ks[700] = 123 +/- 32"),
            (0.5, Some(1.5e-18), "ward.ks[700] = 0.5 +/- 1.5e-18"),
            (1.0, None, "ward.ks[700] = 1 (at a bound)"),
        ] {
            assert_eq!(parameter(value, std_error).to_string(), text);
        }
    }
}
