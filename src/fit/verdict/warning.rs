//! The warnings of a fit, and their texts.

use super::misfit::Misfit;
use crate::error::{OptionName, Suggestion, listed, rounded};
use crate::fit::problem::metric::Metric;
use crate::geometry::Azimuths;
use crate::measurement::{Doubt, readings_with_albedo};
use crate::model::Isotropy;
use std::fmt;

/// Something that the user should know before relying on the result. Its text says what to do next.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The result must not be used.
    NotUsable(Unusable),
    /// The file may not mean what it says.
    Data(Doubt),
    /// A parameter is at a bound, where it has no standard error.
    AtBound {
        /// The parameter's full name, without a channel.
        parameter: String,
        /// Which bound.
        side: Side,
        /// The bound, in the parameter's unit.
        bound: f64,
        /// The channels in which it is there; empty if all share the parameter.
        channels: Vec<String>,
        /// What that says about the lobe.
        meaning: AtBound,
    },
    /// A lobe that the sum fits better without.
    LobeAbsent {
        /// Full name of the parameter that scales the lobe, without a channel; it is 0.
        parameter: String,
        /// The lobe.
        lobe: String,
    },
    /// A lobe that reflects more than its facets receive.
    StrengthAboveOne {
        /// Full name of the parameter that scales the lobe, without a channel.
        parameter: String,
        /// Its largest value.
        value: f64,
        /// The channels in which it exceeds 1; empty if all share the parameter.
        channels: Vec<String>,
    },
    /// A parameter that is an albedo, and that is larger than that of any surface.
    AlbedoAboveOne {
        /// Its full name, without a channel.
        parameter: String,
        /// Its largest value.
        value: f64,
        /// The channels in which it exceeds 1; empty if all share the parameter.
        channels: Vec<String>,
        /// Whether a larger one was not allowed.
        at_bound: bool,
    },
    /// The fitted sum reflects more light than arrives.
    GainsEnergy {
        /// The channel in which it reflects most.
        channel: String,
        /// The share of light that it reflects there.
        albedo: f64,
        /// The angle of incidence at which it does, degrees.
        theta_i_deg: f64,
    },
    /// Parameters that have no standard error because it would depend on another parameter staying at its bound.
    RestsOnBound {
        /// Full names.
        parameters: Vec<String>,
    },
    /// Parameters that the data do not determine, or do not determine separately.
    NotDetermined {
        /// Full names.
        parameters: Vec<String>,
    },
    /// Two factors of a lobe's strength that the data hardly tell apart.
    NotSeparated {
        /// Full name of the first, without a channel.
        parameter: String,
        /// Names of both, without their lobe.
        factors: [&'static str; 2],
        /// Why.
        reason: NotSeparated,
    },
    /// A lobe that is narrower than the spacing of the samples at its peak.
    UnresolvedLobe {
        /// Full name of its width, without a channel.
        parameter: String,
        /// The lobe.
        lobe: String,
        /// The fitted width, in the parameter's unit.
        value: f64,
        /// The smallest and the largest width that the data do not exclude.
        range: [f64; 2],
        /// Whether each of these is only the end of what was tried: the bound, usually.
        open: [bool; 2],
    },
    /// Parameters that fewer than three samples decide.
    DecidedByFew {
        /// Full names.
        parameters: Vec<String>,
    },
    /// A diffuse base and a lobe that the data hardly tell from it.
    BaseLikeLobe {
        /// The base's parameter.
        parameter: String,
        /// The lobe's parameter.
        other: String,
        /// The lobe.
        lobe: String,
        /// Their correlation, -1..1.
        correlation: f64,
    },
    /// The two most strongly correlated parameters.
    Correlated {
        /// Full name of the first.
        parameter: String,
        /// Full name of the second.
        other: String,
        /// Their correlation, -1..1.
        correlation: f64,
    },
    /// A shape of which many values fit equally well.
    FlatProfile {
        /// Its full name, without a channel.
        parameter: String,
        /// Its lobe.
        lobe: String,
        /// Smallest and largest value that fit equally well, in the parameter's unit.
        range: [f64; 2],
        /// By what fraction the error differs between them.
        within: f64,
    },
    /// A combination of parameters that is known far worse than the others.
    IllConditioned {
        /// Full names of those in it.
        parameters: Vec<String>,
        /// Ratio of the largest to the smallest singular value.
        condition: f64,
    },
    /// Channels whose largest value several directions share, as if the detector had been saturated.
    Saturated {
        /// One entry per channel.
        channels: Vec<Saturated>,
        /// Whether a robust loss makes up for it: none is used, and few samples are cut off.
        loss_helps: bool,
    },
    /// Parameters whose standard errors are not given, since the loss discards the samples that determine them.
    LossDiscards {
        /// Full names.
        parameters: Vec<String>,
    },
    /// Parameters that noise biases, because the metric bends it.
    Bias {
        /// The metric.
        metric: Metric,
        /// The parameters, the most biased first.
        parameters: Vec<Biased>,
    },
    /// The model is farther from the data than their noise explains.
    Misfit(Misfit),
    /// The reduced chi-square is far from 1, so that the given standard deviations do not suit the residuals.
    ChiSquare {
        /// Its value.
        reduced: f64,
    },
    /// Two starts that ended equally well with different shapes.
    TiedStarts {
        /// Full name of a shape that differs.
        parameter: String,
        /// Its values, the better first, in the parameter's unit.
        values: [f64; 2],
        /// By what fraction the second's cost is higher.
        excess: f64,
    },
    /// A parameter that is held where its model is isotropic, because the data cannot tell.
    Isotropic {
        /// Its full name.
        parameter: String,
        /// Where it is held.
        isotropy: Isotropy,
        /// What the data tell about the azimuth of the half vector.
        azimuths: Azimuths,
    },
    /// A parameter, fixed by default, that fits the data better at another value.
    WorthFreeing {
        /// Its full name, without a channel.
        parameter: String,
        /// The value at which it is fixed, in its unit.
        value: f64,
        /// By what fraction the cost falls once it is free.
        gain: f64,
    },
    /// Nothing was resampled, because the fit reached no minimum.
    NotResampled,
    /// Fewer resampled fits were finished than planned.
    ResamplingCutShort {
        /// Fits that were finished.
        finished: usize,
        /// Fits that were planned.
        planned: usize,
        /// Whether they were enough to replace the formula's standard errors.
        enough: bool,
    },
    /// Angles of incidence at the edge of those measured, which a fit without them predicts far worse than one with them.
    Extrapolated {
        /// Smallest and largest `theta_i` of each group at the edge, in degrees, and how many times as large the error there is
        /// when the group is left out.
        edges: Vec<([f64; 2], f64)>,
        /// The same factor for the groups between the edges; `None` if there are none.
        inner: Option<f64>,
    },
    /// Fewer fits without some of the angles were finished than planned.
    HoldOutCutShort {
        /// Fits that were finished.
        finished: usize,
        /// Fits that were planned.
        planned: usize,
    },
    /// No budget reaches the target error.
    TargetMissed {
        /// The metric of the errors.
        metric: Metric,
        /// The error on all samples.
        reached: f64,
        /// The target error.
        target: f64,
    },
    /// Parameters of an evaluation that were given no value.
    DefaultUsed {
        /// Full names.
        parameters: Vec<String>,
    },
}

/// Why a result must not be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unusable {
    /// The model is infinite or NaN at some samples.
    NotFinite,
    /// There are no more values than free parameters.
    TooFewValues {
        /// Number of free parameters.
        free: usize,
    },
    /// The iteration limit was reached before a minimum.
    IterationLimit,
    /// The fit was interrupted before a minimum.
    Interrupted,
    /// The time limit was reached before a minimum.
    Timeout,
    /// No step lowers the error although the slope says that one should.
    Stuck,
}

/// One of two bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The smallest value allowed.
    Lower,
    /// The largest value allowed.
    Upper,
}

/// What a parameter at its bound says about its lobe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AtBound {
    /// A strength of 0: the lobe is absent.
    Absent,
    /// A reflectance of 0 at normal incidence: the lobe only rises towards grazing.
    OnlyAtGrazing,
    /// Nothing beyond the bound itself.
    Limit,
    /// Nothing beyond the bound itself, which is that of the model.
    LimitOfModel,
}

/// Why the data hardly tell two factors apart.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum NotSeparated {
    /// No direction is far enough from the normal, where a Fresnel term rises.
    Reach {
        /// Largest angle of incidence or viewing, degrees.
        largest_deg: f64,
        /// The angle beyond which directions would help, degrees.
        wanted_deg: f64,
    },
    /// The factors are correlated.
    Correlation(
        /// The correlation, -1..1.
        f64,
    ),
}

/// How far noise biases a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Biased {
    /// Its full name.
    pub parameter: String,
    /// The bias in per cent of its value.
    pub percent: f64,
    /// The bias in standard errors; `None` if it has none because noise has driven it to a bound.
    pub errors: Option<f64>,
}

/// Samples of a channel that share its largest value.
#[derive(Clone, Debug, PartialEq)]
pub struct Saturated {
    /// The channel.
    pub channel: String,
    /// Number of samples.
    pub samples: usize,
    /// The value, 1/sr.
    pub value: f64,
}

impl Warning {
    /// The kind, as reports name it.
    #[must_use]
    pub fn kind(&self) -> WarningKind {
        match self {
            Self::NotUsable(_) => WarningKind::NotUsable,
            Self::Data(Doubt::OtherReading(other)) if other.is_of_angles() => WarningKind::SuspiciousAngles,
            Self::Data(Doubt::OtherReading(_)) => WarningKind::SuspiciousValues,
            Self::Data(Doubt::NotReflectance { .. }) => WarningKind::NotReflectance,
            Self::Data(Doubt::Polarised) => WarningKind::Polarised,
            Self::Data(Doubt::RepeatedValue { .. }) => WarningKind::RepeatedValue,
            Self::Data(Doubt::DeadChannel { .. }) => WarningKind::DeadChannel,
            Self::Data(Doubt::SuspiciousTable(_)) => WarningKind::SuspiciousTable,
            Self::AtBound { .. } | Self::RestsOnBound { .. } => WarningKind::AtBound,
            Self::LobeAbsent { .. } => WarningKind::LobeAbsent,
            Self::StrengthAboveOne { .. } => WarningKind::StrengthAboveOne,
            Self::AlbedoAboveOne { .. } => WarningKind::AlbedoAboveOne,
            Self::GainsEnergy { .. } => WarningKind::GainsEnergy,
            Self::NotDetermined { .. } | Self::NotSeparated { .. } => WarningKind::NotIdentifiable,
            Self::UnresolvedLobe { .. } | Self::DecidedByFew { .. } => WarningKind::UnresolvedLobe,
            Self::BaseLikeLobe { .. } | Self::Correlated { .. } => WarningKind::Correlated,
            Self::FlatProfile { .. } => WarningKind::FlatProfile,
            Self::IllConditioned { .. } => WarningKind::IllConditioned,
            Self::Saturated { .. } => WarningKind::Saturated,
            Self::LossDiscards { .. } => WarningKind::LossDiscards,
            Self::TiedStarts { .. } => WarningKind::TiedStarts,
            Self::Isotropic { .. } => WarningKind::Isotropic,
            Self::WorthFreeing { .. } => WarningKind::WorthFreeing,
            Self::NotResampled | Self::ResamplingCutShort { .. } => WarningKind::Resampling,
            Self::Extrapolated { .. } => WarningKind::Extrapolated,
            Self::HoldOutCutShort { .. } => WarningKind::HoldOut,
            Self::TargetMissed { .. } => WarningKind::TargetMissed,
            Self::DefaultUsed { .. } => WarningKind::DefaultUsed,
            Self::Bias { .. } => WarningKind::Bias,
            Self::Misfit(_) => WarningKind::Misfit,
            Self::ChiSquare { .. } => WarningKind::ChiSquare,
        }
    }

    /// The full name of the parameter that it is about, or of the first of several; `None` if it is about the whole fit.
    #[must_use]
    pub fn parameter(&self) -> Option<&str> {
        match self {
            Self::AtBound { parameter, .. }
            | Self::LobeAbsent { parameter, .. }
            | Self::StrengthAboveOne { parameter, .. }
            | Self::AlbedoAboveOne { parameter, .. }
            | Self::NotSeparated { parameter, .. }
            | Self::BaseLikeLobe { parameter, .. }
            | Self::UnresolvedLobe { parameter, .. }
            | Self::Correlated { parameter, .. }
            | Self::FlatProfile { parameter, .. }
            | Self::TiedStarts { parameter, .. }
            | Self::Isotropic { parameter, .. }
            | Self::WorthFreeing { parameter, .. } => Some(parameter),
            Self::RestsOnBound { parameters }
            | Self::NotDetermined { parameters }
            | Self::DecidedByFew { parameters }
            | Self::IllConditioned { parameters, .. }
            | Self::LossDiscards { parameters }
            | Self::DefaultUsed { parameters } => parameters.first().map(String::as_str),
            Self::Bias { parameters, .. } => parameters.first().map(|biased| biased.parameter.as_str()),
            Self::NotUsable(_)
            | Self::Data(_)
            | Self::Saturated { .. }
            | Self::GainsEnergy { .. }
            | Self::Misfit(_)
            | Self::ChiSquare { .. }
            | Self::NotResampled
            | Self::ResamplingCutShort { .. }
            | Self::Extrapolated { .. }
            | Self::HoldOutCutShort { .. }
            | Self::TargetMissed { .. } => None,
        }
    }

    /// The options that help.
    #[must_use]
    pub fn suggestions(&self) -> Vec<Suggestion> {
        let suggestion = |option, value: String| Suggestion { option, value };
        let of =
            |option, form: &str| suggestion(option, format!("{}{form}", self.parameter().unwrap_or("P")));
        match self {
            Self::Data(doubt) => {
                doubt.suggestions().into_iter().map(|(option, value)| suggestion(option, value)).collect()
            }
            Self::AtBound { meaning: AtBound::Limit, .. } => vec![of(OptionName::Bounds, "=LO..HI")],
            Self::NotDetermined { .. }
            | Self::BaseLikeLobe { .. }
            | Self::Correlated { .. }
            | Self::FlatProfile { .. } => vec![of(OptionName::Fix, "=V")],
            Self::NotSeparated { .. } | Self::LobeAbsent { .. } => vec![of(OptionName::Fix, "=1")],
            Self::StrengthAboveOne { .. } => vec![of(OptionName::Bounds, "=0..1")],
            Self::AlbedoAboveOne { value, at_bound, .. } => {
                // Where a larger value was not allowed, any of these may be right.
                explained_by(if *at_bound { f64::INFINITY } else { *value })
            }
            Self::GainsEnergy { albedo, .. } => explained_by(*albedo),
            Self::IllConditioned { .. } => vec![of(OptionName::Fix, "=V"), of(OptionName::Tie, "=Q")],
            Self::LossDiscards { .. } => vec![
                suggestion(OptionName::Metric, "cbrt".to_owned()),
                suggestion(OptionName::LossScale, String::new()),
            ],
            Self::TiedStarts { .. } => vec![of(OptionName::Init, "=V")],
            Self::WorthFreeing { .. }
            | Self::Isotropic { azimuths: Azimuths::OnePlane | Azimuths::Several, .. } => {
                vec![of(OptionName::Free, "")]
            }
            Self::Isotropic { azimuths: Azimuths::Lost, .. } => Vec::new(),
            Self::DefaultUsed { .. } => vec![of(OptionName::Set, "=V")],
            Self::RestsOnBound { .. } | Self::NotUsable(Unusable::TooFewValues { .. }) => {
                vec![suggestion(OptionName::Fix, "P=V".to_owned())]
            }
            Self::NotUsable(Unusable::IterationLimit) => vec![suggestion(OptionName::Init, "P=V".to_owned())],
            Self::NotUsable(Unusable::Timeout)
            | Self::ResamplingCutShort { .. }
            | Self::HoldOutCutShort { .. } => {
                vec![suggestion(OptionName::Timeout, String::new())]
            }
            Self::Bias { .. } => vec![suggestion(OptionName::Metric, Metric::UnbiasedCbrt.name().to_owned())],
            Self::Saturated { loss_helps: true, .. } => {
                vec![suggestion(OptionName::Loss, "cauchy".to_owned())]
            }
            Self::ChiSquare { .. } => vec![suggestion(OptionName::SigmaScale, "auto".to_owned())],
            Self::AtBound { .. }
            | Self::UnresolvedLobe { .. }
            | Self::DecidedByFew { .. }
            | Self::Misfit(_)
            | Self::NotUsable(_)
            | Self::Saturated { .. }
            | Self::NotResampled
            | Self::Extrapolated { .. }
            | Self::TargetMissed { .. } => Vec::new(),
        }
    }
}

/// The options that would explain an albedo above 1.
fn explained_by(albedo: f64) -> Vec<Suggestion> {
    let words = readings_with_albedo(albedo).into_iter();
    let read = words.map(|word| Suggestion { option: OptionName::Quantity, value: word.to_owned() });
    read.chain([Suggestion { option: OptionName::Scale, value: String::new() }]).collect()
}

/// Largest number of biased parameters that a warning names.
const LISTED: usize = 3;

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotUsable(reason) => reason.fmt(f),
            Self::Data(doubt) => doubt.fmt(f),
            Self::AtBound { side, bound, channels, meaning, .. } => {
                let side = if *side == Side::Upper { "upper" } else { "lower" };
                write!(f, "at its {side} bound {bound}{}: {meaning}", for_channels(channels))
            }
            Self::LobeAbsent { lobe, .. } => write!(
                f,
                "the data are fitted better without '{lobe}': it is absent here, and its other parameters mean nothing; \
                 leave it out of the model, or fix its strength at 1"
            ),
            Self::StrengthAboveOne { value, channels, .. } => write!(
                f,
                "{}{}: the lobe reflects more than its facets receive; check the scale of the measurement, try \
                 another Fresnel term, or bound it",
                rounded(*value, 4),
                for_channels(channels)
            ),
            Self::AlbedoAboveOne { value, channels, at_bound, .. } => write!(
                f,
                "{}{}{}: no surface reflects more light than it receives; the values are not f in 1/sr, or their scale is too large",
                if *at_bound { "at its bound " } else { "" },
                rounded(*value, 4),
                for_channels(channels)
            ),
            Self::GainsEnergy { channel, albedo, theta_i_deg } => write!(
                f,
                "the fitted model reflects {} of the light that arrives at {theta_i_deg:.0} degrees in channel \
                 {channel}: check the scale of the measurement, or bound the strengths",
                rounded(*albedo, 4)
            ),
            Self::Bias { metric, parameters } => {
                write!(f, "noise biases fits in {} here, this parameter by about ", metric.name())?;
                for (index, Biased { parameter, percent, errors }) in
                    parameters.iter().take(LISTED).enumerate()
                {
                    if index > 0 {
                        write!(f, ", {parameter} by ")?;
                    }
                    write!(f, "{percent:+.2} % ")?;
                    match errors {
                        Some(errors) => write!(f, "({errors:+.1} standard errors)")?,
                        None => f.write_str("(to its bound)")?,
                    }
                }
                if let Some(more) = parameters.len().checked_sub(LISTED).filter(|more| *more > 0) {
                    write!(f, ", and {more} more")?;
                }
                f.write_str(": fit in a metric that noise does not bias")
            }
            Self::Misfit(misfit) => {
                let what = match (misfit.ratio, misfit.source) {
                    (Some(ratio), Some(source)) => {
                        format!(
                            "the model is {ratio:.1} times farther from the data than their noise ({source})"
                        )
                    }
                    _ => format!(
                        "the model is {:.1} % away from the data, and no noise is visible beside that",
                        100.0 * misfit.relative
                    ),
                };
                let worst = misfit.worst.map_or_else(String::new, |worst| format!("; worst at {worst}"));
                write!(f, "{what}{worst}: compare other models, or add a lobe")
            }
            Self::ChiSquare { reduced } => {
                let what = if *reduced > 1.0 {
                    "the residuals are larger than the given standard deviations explain, so that the errors of the parameters are \
                     too small: compare other models, check the standard deviations, or scale them"
                } else {
                    "the residuals are smaller than the given standard deviations say, so that the errors of the parameters are too \
                     large: check the standard deviations, or scale them"
                };
                write!(f, "reduced chi-square {reduced:.3}: {what}")
            }
            Self::RestsOnBound { parameters } => write!(
                f,
                "no standard error for {}, which {} on a parameter that is at its bound: use the products under \
                 'derived', or fix the parameter at its bound if it belongs there",
                this_and(parameters),
                if parameters.len() > 1 { "depend" } else { "depends" }
            ),
            Self::NotDetermined { parameters } => match parameters.as_slice() {
                [] | [_] => f.write_str("the data do not determine it: fix it, or use a model without it"),
                several => write!(
                    f,
                    "the data do not determine {} separately: fix one of them, or use a model without it",
                    several.join(", ")
                ),
            },
            Self::NotSeparated { parameter, factors: [first, second], reason } => match reason {
                NotSeparated::Reach { largest_deg, wanted_deg } => write!(
                    f,
                    "directions up to {largest_deg:.0} degrees hardly tell {first} and {second} apart: use their \
                     product under 'derived', fix {parameter} at 1, or measure beyond {wanted_deg} degrees"
                ),
                NotSeparated::Correlation(correlation) => write!(
                    f,
                    "these data hardly tell {first} and {second} apart (correlation {correlation:.4}): use their \
                     product under 'derived', or fix {parameter} at 1"
                ),
            },
            Self::UnresolvedLobe { lobe, value, range: [low, high], open, .. } => {
                let bound = |open: bool| if open { " (its bound)" } else { "" };
                write!(
                    f,
                    "fewer than three samples see the peak of '{lobe}', which is narrower than their spacing: {value:.3e} fits best, but the samples \
                     beside the peak exclude nothing from {low:.3e}{} to {high:.3e}{}; measure in finer steps about it",
                    bound(open[0]),
                    bound(open[1])
                )
            }
            Self::DecidedByFew { parameters } => write!(
                f,
                "no standard error for {}: fewer than three samples decide {}",
                listed(parameters),
                if parameters.len() == 1 { "it" } else { "each" }
            ),
            Self::BaseLikeLobe { other, lobe, correlation, .. } => write!(
                f,
                "correlation {correlation:.4} with {other}: the data hardly tell '{lobe}' from a diffuse base; fit without \
                 it and compare, or fix one of the two"
            ),
            Self::Correlated { other, correlation, .. } => write!(
                f,
                "correlation {correlation:.4} with {other}: the data hardly tell them apart; fix one of them, or \
                 measure closer to grazing"
            ),
            Self::FlatProfile { lobe, range: [low, high], within, .. } => write!(
                f,
                "any value from {low:.3} to {high:.3} fits equally well (error within {:.2} %): the data do not \
                 determine it; fix it, or fit without '{lobe}'",
                100.0 * within
            ),
            Self::IllConditioned { parameters, condition } => write!(
                f,
                "condition number {condition:.0e}: a combination of {} is known far worse than the rest; fix or tie \
                 one of them",
                parameters.join(", ")
            ),
            Self::Saturated { channels, loss_helps } => {
                let listed: Vec<String> = channels.iter().map(ToString::to_string).collect();
                write!(
                    f,
                    "{}, the largest value of all, as if the detector had been saturated: a peak that is cut off looks \
                     wider than it is; leave these samples out, or measure them with less light{}",
                    listed.join(", "),
                    if *loss_helps { ", or fit with a loss that takes them for outliers" } else { "" }
                )
            }
            Self::LossDiscards { parameters } => write!(
                f,
                "no standard error for {}, because the loss takes the samples that determine {} for outliers: compare \
                 with the metric cbrt or log, or raise the scale of the loss",
                this_and(parameters),
                if parameters.len() > 1 { "them" } else { "it" }
            ),
            Self::TiedStarts { values: [best, rival], excess, .. } => write!(
                f,
                "one start led to {best:.4}, another to {rival:.4} at a cost only {:.3} % higher: the data do not choose \
                 between the two; compare them on other data, or choose one by its initial value",
                100.0 * excess
            ),
            Self::Isotropic { isotropy, azimuths, .. } => {
                match isotropy {
                    Isotropy::As(other) => write!(f, "tied to {other}: ")?,
                    Isotropy::At(value) => write!(f, "held at {value}: ")?,
                }
                f.write_str(match azimuths {
                    Azimuths::Lost => {
                        "a half/difference grid does not contain the half vector's azimuth; measure with several phi_i to \
                         see whether the material is anisotropic"
                    }
                    Azimuths::OnePlane | Azimuths::Several => {
                        "light or viewing from a single azimuth hardly shows whether the material is anisotropic; measure \
                         with several phi_i, or fit it nevertheless"
                    }
                })
            }
            Self::WorthFreeing { value, gain, .. } => {
                write!(
                    f,
                    "fixed at {value}, but the cost falls by {:.0} % once it is free: fit it",
                    100.0 * gain
                )
            }
            Self::NotResampled => f.write_str("nothing was resampled, because the fit reached no minimum"),
            Self::ResamplingCutShort { finished, planned, enough } => {
                let end = if *enough {
                    "the standard errors are coarser than they could be"
                } else {
                    "the standard errors are the formula's"
                };
                write!(f, "{finished} of {planned} resampled fits were finished: {end}; allow more time")
            }
            Self::Extrapolated { edges, inner } => {
                let listed: Vec<String> = edges.iter().map(|edge| at_edge(*edge)).collect();
                let inner = inner.map_or_else(String::new, |inner| {
                    format!(" (angles between the edges: {inner:.1} times)")
                });
                write!(
                    f,
                    "left out of the fit, theta_i {}{inner}: at the edge of the measured angles the model is extrapolated, and the \
                     held-out error says mostly how well that goes; to rank models for use between the measured angles, compare \
                     the folds without the edge, otherwise measure beyond it",
                    listed.join(", and ")
                )
            }
            Self::HoldOutCutShort { finished, planned } => write!(
                f,
                "{finished} of {planned} fits without some of the angles were finished: no held-out error is given, because it \
                 could not be compared with that of another model; allow more time"
            ),
            Self::TargetMissed { metric, reached, target } => write!(
                f,
                "the {} error on all samples is {reached:.4e}, above the target of {target}: no budget reaches it; try a \
                 model with another lobe",
                metric.name()
            ),
            Self::DefaultUsed { parameters } => match parameters.as_slice() {
                [only] => write!(f, "no value was given for {only}: its default was used"),
                several => {
                    write!(f, "no values were given for {}: their defaults were used", several.join(", "))
                }
            },
        }
    }
}

impl fmt::Display for Unusable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => f.write_str("the model is infinite or NaN at some samples"),
            Self::TooFewValues { free } => {
                write!(f, "no more values than the {free} free parameters: measure more directions, or fix some parameters")
            }
            Self::IterationLimit => f.write_str(
                "the iteration limit was reached before a minimum: start closer to it, or fit fewer parameters",
            ),
            Self::Interrupted => f.write_str("interrupted before a minimum was reached"),
            Self::Timeout => f.write_str("the time limit was reached before a minimum: allow more time"),
            Self::Stuck => f.write_str(
                "no step lowers the error although the slope says that one should: the model may be too flat here, or \
                 not smooth",
            ),
        }
    }
}

impl fmt::Display for AtBound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Absent => {
                "the data show no trace of this lobe; fit without it, or check the measurement's dark level"
            }
            Self::OnlyAtGrazing => "its lobe only rises towards grazing; fit without that lobe and compare",
            Self::Limit => "it has no standard error there; widen its bounds if that makes sense",
            Self::LimitOfModel => "it has no standard error there, and the model is not meant for values beyond; compare other models",
        })
    }
}

impl fmt::Display for Saturated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { channel, samples, value } = self;
        write!(f, "{samples} values of {channel} are {}", rounded(*value, 6))
    }
}

/// An angle at the edge, or a range of them, with the factor by which its error grows.
fn at_edge(([low, high], factor): ([f64; 2], f64)) -> String {
    let angle = if low < high { format!("{low}..{high}") } else { low.to_string() };
    format!("{angle} deg is predicted with {factor:.1} times the error that it has when it is fitted")
}

/// ` for r, g`; empty if there are no channels.
fn for_channels(channels: &[String]) -> String {
    if channels.is_empty() { String::new() } else { format!(" for {}", channels.join(", ")) }
}

/// "This parameter", which the line already names, and all others by name.
fn this_and(parameters: &[String]) -> String {
    match parameters {
        [] | [_] => "this parameter".to_owned(),
        [_, others @ ..] => format!("this parameter and {}", others.join(", ")),
    }
}

/// The kind of a warning, as reports name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "docs/use/report.md has what each means and what to do")]
pub enum WarningKind {
    AlbedoAboveOne,
    AtBound,
    Bias,
    ChiSquare,
    Correlated,
    DeadChannel,
    DefaultUsed,
    Extrapolated,
    FlatProfile,
    GainsEnergy,
    HoldOut,
    IllConditioned,
    Isotropic,
    LobeAbsent,
    LossDiscards,
    Misfit,
    NotIdentifiable,
    NotReflectance,
    NotUsable,
    Polarised,
    RepeatedValue,
    Resampling,
    Saturated,
    StrengthAboveOne,
    SuspiciousAngles,
    SuspiciousTable,
    SuspiciousValues,
    TargetMissed,
    TiedStarts,
    UnresolvedLobe,
    WorthFreeing,
}

impl WarningKind {
    /// Whether it is about how the file was read, the same whatever model is fitted.
    #[must_use]
    pub fn is_of_reading(self) -> bool {
        matches!(
            self,
            Self::NotReflectance
                | Self::Polarised
                | Self::RepeatedValue
                | Self::SuspiciousAngles
                | Self::SuspiciousTable
                | Self::SuspiciousValues
        )
    }

    /// Its name in a report.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::AlbedoAboveOne => "albedo-above-one",
            Self::AtBound => "at-bound",
            Self::Bias => "bias",
            Self::ChiSquare => "chi-square",
            Self::Correlated => "correlated",
            Self::DeadChannel => "dead-channel",
            Self::DefaultUsed => "default-used",
            Self::Extrapolated => "extrapolated",
            Self::FlatProfile => "flat-profile",
            Self::GainsEnergy => "gains-energy",
            Self::HoldOut => "hold-out",
            Self::IllConditioned => "ill-conditioned",
            Self::Isotropic => "isotropic",
            Self::LobeAbsent => "lobe-absent",
            Self::LossDiscards => "loss-discards",
            Self::Misfit => "misfit",
            Self::NotIdentifiable => "not-identifiable",
            Self::NotReflectance => "not-reflectance",
            Self::NotUsable => "not-usable",
            Self::Polarised => "polarised",
            Self::RepeatedValue => "repeated-value",
            Self::Resampling => "resampling",
            Self::Saturated => "saturated",
            Self::StrengthAboveOne => "strength-above-one",
            Self::SuspiciousAngles => "suspicious-angles",
            Self::SuspiciousTable => "suspicious-table",
            Self::SuspiciousValues => "suspicious-values",
            Self::TargetMissed => "target-missed",
            Self::TiedStarts => "tied-starts",
            Self::UnresolvedLobe => "unresolved-lobe",
            Self::WorthFreeing => "worth-freeing",
        }
    }
}
