//! The options of a fit.

use super::problem::loss::{LOSS_SCALES, LossKind};
use super::problem::metric::Metric;
use crate::error::{Error, OptionName, short};
use crate::measurement::{Filters, checked_max_theta};
use crate::parameters::Settings;
use crate::solver::{Limits, Observer, SolverKind, StopSignal};
use std::fmt;
use std::str::FromStr;
use std::time::Instant;

/// Options of a fit. The defaults are those of the command line; each `with_` method changes one of them.
///
/// ```
/// use brdfit::{Filters, Metric, Options};
///
/// let options = Options::default().with_metric(Metric::Log).with_filters(Filters::default().with_max_theta_deg(70.0));
/// assert_eq!((options.metric, options.filters.max_theta_deg), (Metric::Log, 70.0));
/// ```
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Options {
    /// The metric in which the model and the measurement are compared.
    pub metric: Metric,
    /// How strongly residuals that are far larger than the others are down-weighted.
    pub loss: LossKind,
    /// The residual above which the loss down-weights a sample; `None` to estimate it from the residuals.
    pub loss_scale: Option<f64>,
    /// Which samples are fitted.
    pub filters: Filters,
    /// Constraints on parameters.
    pub settings: Settings,
    /// The seed of all random draws.
    pub seed: u64,
    /// Which angles of incidence are left out at a time, to test the model on them; `None` to test it on none.
    pub hold_out: Option<HoldOut>,
    /// Where standard errors come from.
    pub uncertainty: Uncertainty,
    /// What standard deviations mean, where they are the weights.
    pub sigma_scale: SigmaScale,
    /// The error of the measurement's scale, which standard errors include; `None` if it is negligible.
    pub scale_error: Option<ScaleError>,
    /// The optimiser of the final fit; the default is the one to use, the others are for comparison.
    pub solver: SolverKind,
    /// Largest number of iterations of the final fit by Levenberg-Marquardt; other solvers are allowed more.
    pub iterations: u64,
    /// A flag that another thread sets to true to stop the fit with the best parameters so far.
    pub stop: Option<StopSignal>,
    /// The time at which the fit stops with the best parameters so far.
    pub deadline: Option<Instant>,
}

impl Options {
    /// Minimises the differences in this metric; [`Metric::Cbrt`] by default.
    #[must_use]
    pub fn with_metric(self, metric: Metric) -> Self {
        Self { metric, ..self }
    }

    /// Down-weights residuals that are far larger than the others; [`LossKind::None`], least squares, by default.
    #[must_use]
    pub fn with_loss(self, loss: LossKind) -> Self {
        Self { loss, ..self }
    }

    /// Down-weights residuals above this size, from 1e-100 to 1e100 in units of the residual. By default the scale is
    /// estimated from the residuals. It has no effect on least squares.
    #[must_use]
    pub fn with_loss_scale(self, scale: f64) -> Self {
        Self { loss_scale: Some(scale), ..self }
    }

    /// Fits the samples that pass these filters.
    #[must_use]
    pub fn with_filters(self, filters: Filters) -> Self {
        Self { filters, ..self }
    }

    /// Constrains parameters. This replaces any constraints given before.
    #[must_use]
    pub fn with_settings(self, settings: Settings) -> Self {
        Self { settings, ..self }
    }

    /// Sets the seed of all random draws, 0 by default. The same seed gives the same result.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// Fits the model again without some of the angles of incidence, until each has been left out once, and reports the
    /// errors on what was left out. By default there are no such fits.
    #[must_use]
    pub fn with_hold_out(self, hold_out: HoldOut) -> Self {
        Self { hold_out: Some(hold_out), ..self }
    }

    /// Takes standard errors from this source; [`Uncertainty::Clustered`] by default.
    #[must_use]
    pub fn with_uncertainty(self, uncertainty: Uncertainty) -> Self {
        Self { uncertainty, ..self }
    }

    /// Takes standard deviations as the noise itself, the default, or up to a common factor.
    #[must_use]
    pub fn with_sigma_scale(self, sigma_scale: SigmaScale) -> Self {
        Self { sigma_scale, ..self }
    }

    /// Includes an error of the measurement's scale in standard errors, such as that of the reflectance standard it was calibrated with.
    #[must_use]
    pub fn with_scale_error(self, scale_error: ScaleError) -> Self {
        Self { scale_error: Some(scale_error), ..self }
    }

    /// Makes the final fit with this optimiser. The default is the one to use.
    #[must_use]
    pub fn with_solver(self, solver: SolverKind) -> Self {
        Self { solver, ..self }
    }

    /// Ends the final fit after this many iterations, 300 by default. Few fits take more than 20.
    #[must_use]
    pub fn with_iterations(self, iterations: u64) -> Self {
        Self { iterations, ..self }
    }

    /// Stops with the best parameters so far once another thread sets this signal to true.
    #[must_use]
    pub fn with_stop(self, stop: StopSignal) -> Self {
        Self { stop: Some(stop), ..self }
    }

    /// Stops with the best parameters so far at this time.
    #[must_use]
    pub fn with_deadline(self, deadline: Instant) -> Self {
        Self { deadline: Some(deadline), ..self }
    }

    /// Checks the options that must lie in a range.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the option that is out of range.
    pub(crate) fn check(&self) -> Result<(), Error> {
        checked_max_theta(self.filters.max_theta_deg)?;
        if let Some(HoldOut::Fraction(fraction)) = self.hold_out {
            HoldOut::fraction(fraction)?;
        }
        match self.loss_scale {
            Some(scale) if !LOSS_SCALES.contains(&scale) => {
                Err(Error::invalid(OptionName::LossScale, "1e-100 to 1e100", scale.to_string()))
            }
            _ => Ok(()),
        }
    }

    /// The limits that end a minimisation under these options if it has not converged.
    pub(super) fn limits(&self, iterations: u64, observer: Option<Observer>) -> Limits {
        Limits { iterations, stop: self.stop.clone(), deadline: self.deadline, observer }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            metric: Metric::default(),
            loss: LossKind::default(),
            loss_scale: None,
            filters: Filters::default(),
            settings: Vec::new(),
            seed: 0,
            hold_out: None,
            uncertainty: Uncertainty::default(),
            sigma_scale: SigmaScale::default(),
            scale_error: None,
            solver: SolverKind::default(),
            iterations: 300,
            stop: None,
            deadline: None,
        }
    }
}

/// Which angles of incidence are left out at a time, to test a model on them. Each is left out exactly once.
///
/// ```
/// use brdfit::HoldOut;
///
/// assert_eq!("each".parse::<HoldOut>()?, HoldOut::Each);
/// assert_eq!("0.2".parse::<HoldOut>()?, HoldOut::fraction(0.2)?);
/// # Ok::<(), brdfit::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum HoldOut {
    /// This fraction of them, above 0 and below 1: 0.2 makes five folds.
    Fraction(f64),
    /// A single one.
    Each,
}

impl HoldOut {
    /// A fraction of the angles at a time.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless it is above 0 and below 1.
    pub fn fraction(fraction: f64) -> Result<Self, Error> {
        if fraction > 0.0 && fraction < 1.0 {
            return Ok(Self::Fraction(fraction));
        }
        Err(Self::invalid(&fraction.to_string()))
    }

    fn invalid(found: &str) -> Error {
        Error::invalid(OptionName::HoldOut, "a fraction above 0 and below 1, or 'each'", short(found))
    }
}

impl FromStr for HoldOut {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        match text.parse() {
            _ if text == EACH => Ok(Self::Each),
            Ok(fraction) => Self::fraction(fraction).map_err(|_| Self::invalid(text)),
            Err(_) => Err(Self::invalid(text)),
        }
    }
}

impl fmt::Display for HoldOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fraction(fraction) => fraction.fmt(f),
            Self::Each => f.write_str(EACH),
        }
    }
}

/// The word for one angle at a time, on the command line and in reports.
const EACH: &str = "each";

/// Where standard errors come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Uncertainty {
    /// From the linear model at the optimum and the scatter of groups of samples that err together; from the standard deviations that are
    /// the weights, if there are any and the residuals are no larger.
    #[default]
    Clustered,
    /// From the linear model at the optimum, for independent samples.
    Formula,
    /// From fits repeated on resampled angles of incidence.
    BlockBootstrap,
    /// As `Clustered`, with intervals from profiles of the cost.
    Profile,
}

impl Uncertainty {
    /// Name on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Clustered => "clustered",
            Self::Formula => "formula",
            Self::BlockBootstrap => "block-bootstrap",
            Self::Profile => "profile",
        }
    }
}

/// What the standard deviations of a file mean, where they are the weights of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum SigmaScale {
    /// The noise itself.
    #[default]
    Absolute,
    /// The noise up to a common factor, which the reduced chi-square gives.
    Auto,
}

impl SigmaScale {
    /// Name on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Absolute => "absolute",
            Self::Auto => "auto",
        }
    }
}

/// The error of a measurement's scale: an unknown factor that all samples have in common, as the calibration leaves it.
///
/// As text it is `2%` or `0.02`, and after a comma `shared` (the default) or `per-channel`.
///
/// ```
/// use brdfit::fit::ScaleError;
///
/// let scale_error: ScaleError = "2%,per-channel".parse()?;
/// assert_eq!((scale_error.relative, scale_error.per_channel), (0.02, true));
/// assert!("200%".parse::<ScaleError>().is_err());
/// # Ok::<(), brdfit::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ScaleError {
    /// Standard deviation of the factor, relative to 1.
    pub relative: f64,
    /// Whether each channel has a factor of its own, rather than one for all.
    pub per_channel: bool,
}

impl ScaleError {
    /// The text after the size if each channel has a factor of its own, or not.
    const KINDS: [(&'static str, bool); 2] = [("shared", false), ("per-channel", true)];
}

impl FromStr for ScaleError {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let invalid = || {
            let expected = "a size such as 2% or 0.02, above 0 and at most 100%, and after a comma shared or per-channel";
            Error::invalid(OptionName::ScaleError, expected, short(text))
        };
        let (size, kind) = text.split_once(',').unwrap_or((text, "shared"));
        let (digits, unit) = size.trim().strip_suffix('%').map_or((size, 1.0), |digits| (digits, 0.01));
        let relative = digits.trim().parse::<f64>().map_err(|_| invalid())? * unit;
        let kind = Self::KINDS.iter().find(|(name, _)| *name == kind.trim()).ok_or_else(invalid)?;
        if relative > 0.0 && relative <= 1.0 {
            Ok(Self { relative, per_channel: kind.1 })
        } else {
            Err(invalid())
        }
    }
}

impl fmt::Display for ScaleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.per_channel { "per-channel" } else { "shared" };
        write!(f, "{},{kind}", self.relative)
    }
}

/// A limit on how many samples a fit uses and how many iterations it takes. docs/use/tradeoff.md lists what each
/// budget costs and how large an error it leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Budget {
    /// 2000 samples, 60 iterations.
    Fast,
    /// 20 000 samples, 120 iterations.
    Balanced,
    /// All samples, 300 iterations.
    Full,
}

impl Budget {
    /// All budgets, the cheapest first.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Balanced, Self::Full];

    /// Name on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Balanced => "balanced",
            Self::Full => "full",
        }
    }

    /// The number of samples that the fit uses; `None` for all.
    #[must_use]
    pub fn samples(self) -> Option<usize> {
        match self {
            Self::Fast => Some(2000),
            Self::Balanced => Some(20_000),
            Self::Full => None,
        }
    }

    /// The largest number of iterations of the final fit.
    #[must_use]
    pub fn iterations(self) -> u64 {
        match self {
            Self::Fast => 60,
            Self::Balanced => 120,
            Self::Full => 300,
        }
    }

    /// `options` with the limits of this budget.
    #[must_use]
    pub fn apply(self, options: &Options) -> Options {
        Options {
            filters: Filters { samples: self.samples(), ..options.filters.clone() },
            iterations: self.iterations(),
            ..options.clone()
        }
    }
}
