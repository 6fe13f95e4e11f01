//! Enums whose values have names in reports.

use crate::error::OptionName;
use crate::fit::{
    Budget, LossKind, Method, Metric, NoiseSource, OpenEnd, ParameterState, SigmaScale, Uncertainty,
    WarningKind,
};
use crate::measurement::formats::BinPosition;
use crate::measurement::{ClusterKind, Weighting};
use crate::model::Unit;
use crate::solver::{SolverKind, Termination};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;

/// An enum whose values have names in reports.
pub trait Named: Copy + PartialEq + 'static {
    /// The name of its schema.
    const SCHEMA_NAME: &'static str;
    /// Every value.
    const ALL: &'static [Self];

    /// The value's name.
    fn in_report(self) -> &'static str;
}

/// A value of an enum in a report. The set of names is open: a later version may have more names than this one, and a
/// reader keeps the names that it does not know.
#[derive(Clone, Debug, PartialEq)]
pub enum Open<T> {
    /// A value that this version knows.
    Known(T),
    /// Another name; empty if the report has none.
    Other(String),
}

impl<T> Default for Open<T> {
    fn default() -> Self {
        Self::Other(String::new())
    }
}

impl<T: Named> Open<T> {
    /// The name, as written in the report.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Known(value) => value.in_report(),
            Self::Other(name) => name,
        }
    }

    /// The value; `None` for a name that this version does not know.
    #[must_use]
    pub fn known(&self) -> Option<T> {
        match self {
            Self::Known(value) => Some(*value),
            Self::Other(_) => None,
        }
    }
}

impl<T: Named> PartialEq<T> for Open<T> {
    fn eq(&self, other: &T) -> bool {
        self.known() == Some(*other)
    }
}

impl<T> From<T> for Open<T> {
    fn from(value: T) -> Self {
        Self::Known(value)
    }
}

impl<T: Named> fmt::Display for Open<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl<T: Named> Serialize for Open<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de, T: Named> Deserialize<'de> for Open<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let known = T::ALL.iter().find(|value| value.in_report() == name);
        Ok(known.map_or(Self::Other(name), |value| Self::Known(*value)))
    }
}

impl<T: Named> JsonSchema for Open<T> {
    fn schema_name() -> Cow<'static, str> {
        T::SCHEMA_NAME.into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let names: Vec<&str> = T::ALL.iter().map(|value| value.in_report()).collect();
        json_schema!({
            "description": "One of these names; later versions may add others.",
            "anyOf": [{ "enum": names }, { "type": "string" }]
        })
    }
}

/// Gives enums their names in reports. Leaving out a variant is a compile error.
macro_rules! named {
    ($($type:ident ($name:ident): $($(#[$attribute:meta])* $variant:ident)*;)*) => {
        $(impl Named for $type {
            const SCHEMA_NAME: &'static str = stringify!($type);
            const ALL: &'static [Self] = {
                const fn complete(value: $type) -> $type {
                    match value {
                        $($(#[$attribute])* $type::$variant => value,)*
                    }
                }
                &[$($(#[$attribute])* complete($type::$variant),)*]
            };

            fn in_report(self) -> &'static str {
                self.$name()
            }
        })*
    };
}

named! {
    BinPosition (name): Center Edge;
    Budget (name): Fast Balanced Full;
    ClusterKind (name): Incidence IncidenceRange Neighbourhood Direction;
    LossKind (name): None Huber Cauchy;
    Method (name): Absolute Clustered Sandwich BlockBootstrap;
    Metric (name): L2 Log Cbrt UnbiasedCbrt;
    OpenEnd (name): AtBound Unfinished;
    OptionName (name): Angles Azimuth Bounds Columns Decimal Fix Format Free HoldOut Init LeaveOut LightDirection Loss LossScale MaxTheta
        MeanOfSAndP Metric Missing PerChannel Quantity Scale ScaleError Separator Set Shared SigmaScale Svg TargetError Thickness Tie Timeout Tolerance
        Uncertainty Weights;
    NoiseSource (name): Sigma Repeats ReciprocalPairs Neighbours;
    SigmaScale (name): Absolute Auto;
    SolverKind (name): LevenbergMarquardt #[cfg(feature = "solvers")] LBfgs #[cfg(feature = "solvers")] NelderMead
        #[cfg(feature = "solvers")] ParticleSwarm;
    ParameterStatus (name): Free Fixed Tied AtLower AtUpper Absent;
    Termination (name): ConvergedStep ConvergedCost ConvergedGradient Stalled IterationLimit Interrupted Timeout Invalid;
    Uncertainty (name): Clustered Formula BlockBootstrap Profile;
    Unit (symbol): One Degrees UnscaledMerl;
    WarningKind (name): AlbedoAboveOne AtBound Bias ChiSquare Correlated DeadChannel DefaultUsed Extrapolated FlatProfile GainsEnergy HoldOut IllConditioned
        Isotropic LobeAbsent LossDiscards Misfit NotIdentifiable NotReflectance NotUsable Polarised RepeatedValue Resampling Saturated StrengthAboveOne
        SuspiciousAngles SuspiciousTable SuspiciousValues TargetMissed TiedStarts UnresolvedLobe WorthFreeing;
    Weighting (name): SolidAngle Uniform Sigma;
}

/// Whether a parameter was fitted, and where it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterStatus {
    /// Fitted, and between its bounds.
    Free,
    /// Kept at a value.
    Fixed,
    /// Equal to another parameter.
    Tied,
    /// Fitted, and at its lower bound.
    AtLower,
    /// Fitted, and at its upper bound.
    AtUpper,
    /// Without effect, because its lobe is absent.
    Absent,
}

impl From<&ParameterState> for ParameterStatus {
    fn from(state: &ParameterState) -> Self {
        match state {
            ParameterState::Free => Self::Free,
            ParameterState::Fixed => Self::Fixed,
            ParameterState::Tied { .. } => Self::Tied,
            ParameterState::AtLower => Self::AtLower,
            ParameterState::AtUpper => Self::AtUpper,
            ParameterState::Absent => Self::Absent,
        }
    }
}

impl ParameterStatus {
    /// Name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Fixed => "fixed",
            Self::Tied => "tied",
            Self::AtLower => "at-lower",
            Self::AtUpper => "at-upper",
            Self::Absent => "absent",
        }
    }
}

/// Why a fit stopped, or that nothing was fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// Nothing was fitted: the given parameters were evaluated.
    Evaluated,
    /// A fit stopped for this reason.
    Stopped(Termination),
}

impl From<Termination> for StopReason {
    fn from(termination: Termination) -> Self {
        Self::Stopped(termination)
    }
}

impl Named for StopReason {
    const SCHEMA_NAME: &'static str = "StopReason";
    const ALL: &'static [Self] = &{
        let mut all = [Self::Evaluated; Termination::ALL.len() + 1];
        let mut index = 0;
        while index < Termination::ALL.len() {
            all[index + 1] = Self::Stopped(Termination::ALL[index]);
            index += 1;
        }
        all
    };

    fn in_report(self) -> &'static str {
        match self {
            Self::Evaluated => "evaluated",
            Self::Stopped(termination) => termination.name(),
        }
    }
}

/// What a ranking compares: the error in a metric, on the samples that were fitted or on those held out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// On the samples that were fitted.
    Fitted(Metric),
    /// On the samples that were held out.
    HeldOut(Metric),
}

impl Named for Criterion {
    const SCHEMA_NAME: &'static str = "Criterion";
    const ALL: &'static [Self] = &[
        Self::Fitted(Metric::L2),
        Self::Fitted(Metric::Log),
        Self::Fitted(Metric::Cbrt),
        Self::Fitted(Metric::UnbiasedCbrt),
        Self::HeldOut(Metric::L2),
        Self::HeldOut(Metric::Log),
        Self::HeldOut(Metric::Cbrt),
        Self::HeldOut(Metric::UnbiasedCbrt),
    ];

    fn in_report(self) -> &'static str {
        match self {
            Self::Fitted(metric) => metric.name(),
            Self::HeldOut(Metric::L2) => "held-out l2",
            Self::HeldOut(Metric::Log) => "held-out log",
            Self::HeldOut(Metric::Cbrt) => "held-out cbrt",
            Self::HeldOut(Metric::UnbiasedCbrt) => "held-out unbiased-cbrt",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_read_back_and_unknown_ones_are_kept() {
        fn round<T: Named + fmt::Debug>() {
            for value in T::ALL {
                let text = serde_json::to_string(&Open::Known(*value)).unwrap();
                assert_eq!(serde_json::from_str::<Open<T>>(&text).unwrap(), *value, "{text}");
            }
            let later: Open<T> = serde_json::from_str("\"of a later version\"").unwrap();
            assert_eq!(serde_json::to_string(&later).unwrap(), "\"of a later version\"");
        }
        round::<Metric>();
        round::<StopReason>();
        round::<OptionName>();
        round::<WarningKind>();
        round::<Unit>();
        round::<Criterion>();
    }
}
