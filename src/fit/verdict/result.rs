//! The result of a fit.

use super::bootstrap::Resampled;
use super::covariance::Covariance;
use super::errors::{ErrorTable, Errors};
use super::hold_out::HeldOut;
use super::misfit::Misfit;
use super::profiled_interval::ProfiledInterval;
use super::warning::{Unusable, Warning};
use crate::brdf::Brdf;
use crate::fit::options::Budget;
use crate::fit::search::best_start::Start;
use crate::math::count;
use crate::measurement::Weighting;
use crate::model::Expression;
use crate::parameters::ParameterTable;
use crate::solver::Termination;
use std::collections::BTreeMap;

/// The result of a fit. [`Fit::of`] sets a fit up; [`Fit::parameters`] returns the values and their standard errors.
///
/// A fit that did not converge is also a result: [`Fit::is_usable`] says whether to use it, and `unusable` and
/// `warnings` say why not.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Fit {
    /// The model that was fitted.
    pub model: Expression,
    /// All parameters at their final values.
    pub table: ParameterTable,
    /// How the samples were weighted.
    pub weighting: Weighting,
    /// Number of samples used.
    pub used: usize,
    /// Number of samples left out, by reason.
    pub dropped: BTreeMap<&'static str, usize>,
    /// Number of values of the samples used that were not measured, by channel.
    pub missing: Vec<usize>,
    /// Every error between model and measurement.
    pub errors: ErrorTable,
    /// The budget of the fit; `None` if it had none.
    pub budget: Option<Budget>,
    /// Every error on all samples that pass the filters; `None` unless there was a budget.
    pub errors_on_all: Option<Errors>,
    /// The covariance of the free parameters; `None` if the fit was cut short or has no degrees of freedom.
    pub covariance: Option<Covariance>,
    /// The fits repeated on resampled angles of incidence; `None` unless the covariance comes from them.
    pub resampled: Option<Resampled>,
    /// The intervals by profiles of the cost; `None` unless they were asked for.
    pub profiled: Option<Vec<ProfiledInterval>>,
    /// The sum of squares that was minimised.
    pub cost: f64,
    /// Number of residuals: of values that were measured, in all channels that are not dead.
    pub n: usize,
    /// Degrees of freedom: number of residuals less number of free parameters.
    pub dof: i64,
    /// chi^2/dof; `None` unless standard deviations were given.
    pub reduced_chi2: Option<f64>,
    /// How far the model is from the data, beside their noise; `None` if there are too few samples to tell.
    pub misfit: Option<Misfit>,
    /// Whether the file gives standard deviations that the fit did not use.
    pub sigma_unused: bool,
    /// Criteria for choosing between models.
    pub selection: Selection,
    /// The scale of the loss; `None` for least squares.
    pub loss_scale: Option<f64>,
    /// Errors on the samples held out; `None` if none were.
    pub held_out: Option<HeldOut>,
    /// The starts that were polished.
    pub starts: Vec<Start>,
    /// Why the fit stopped.
    pub termination: Termination,
    /// Why the result is not usable; `None` if it is.
    pub unusable: Option<Unusable>,
    /// Number of iterations of the final fit.
    pub iterations: u64,
    /// Number of evaluations of the final fit.
    pub evaluations: u64,
    /// What the user should know before relying on the result.
    pub warnings: Vec<Warning>,
}

impl Fit {
    /// Whether the result is a minimum that can be used; if not, `unusable` says why.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.unusable.is_none()
    }

    /// The fitted BRDF: the model at the values of its parameters.
    #[must_use]
    pub fn brdf(&self) -> Brdf {
        Brdf::of_table(&self.model, &self.table)
    }
}

/// Criteria that weigh the error against the number of parameters; `None` if the cost is not a likelihood.
#[derive(Clone, Copy, Debug, Default)]
pub struct Selection {
    /// Akaike's information criterion, corrected for small samples.
    pub aicc: Option<f64>,
    /// Bayesian information criterion.
    pub bic: Option<f64>,
}

/// The criteria at a minimum with this `cost`, for `n` residuals and `free` parameters; `absolute` says that the
/// residuals are in standard deviations.
pub(super) fn selection(cost: f64, n: usize, free: usize, absolute: bool) -> Selection {
    let (n, k) = (count(n), count(free));
    // If the noise is unknown, its variance is one more estimated parameter.
    let (deviance, k) = if absolute { (cost, k) } else { (n * cost.ln(), k + 1.0) };
    let finite = |value: f64| value.is_finite().then_some(value);
    let correction = 2.0 * k * (k + 1.0) / (n - k - 1.0);
    Selection {
        aicc: if n > k + 1.0 { finite(deviance + 2.0 * k + correction) } else { None },
        bic: finite(deviance + k * n.ln()),
    }
}
