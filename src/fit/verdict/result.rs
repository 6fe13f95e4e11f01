//! The result of a fit.

use super::bootstrap::Resampled;
use super::covariance::Covariance;
use super::errors::{ErrorTable, Errors};
use super::hold_out::HeldOut;
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

/// The result of a fit, which [`Fit::of`] begins. [`Fit::parameters`] has the values and their standard errors.
///
/// A fit that did not converge is a result, too: [`Fit::is_usable`] tells whether to use it, `unusable` and `warnings` why not.
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
    /// Every error.
    pub errors: ErrorTable,
    /// The budget that it was made within, where there was one.
    pub budget: Option<Budget>,
    /// Every error on all samples that pass the filters, where there was a budget.
    pub errors_on_all: Option<Errors>,
    /// Covariance of the free parameters; `None` where the fit was cut short or has no degrees of freedom.
    pub covariance: Option<Covariance>,
    /// The fits repeated on resampled angles of incidence, where the covariance is theirs.
    pub resampled: Option<Resampled>,
    /// The sum of squares that was minimised.
    pub cost: f64,
    /// Number of residuals.
    pub n: usize,
    /// Number of residuals less that of free parameters.
    pub dof: i64,
    /// chi^2/dof where the standard deviations were given.
    pub reduced_chi2: Option<f64>,
    /// Model selection.
    pub selection: Selection,
    /// The scale of the loss; `None` for least squares.
    pub loss_scale: Option<f64>,
    /// Errors on the samples held out, where some were.
    pub held_out: Option<HeldOut>,
    /// The starts tried.
    pub starts: Vec<Start>,
    /// Why it stopped.
    pub termination: Termination,
    /// Why the result is not usable; `None` if it is.
    pub unusable: Option<Unusable>,
    /// Iterations of the final fit.
    pub iterations: u64,
    /// Evaluations of the final fit.
    pub evaluations: u64,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

impl Fit {
    /// Whether the result is a minimum that can be used. `unusable` says why it is not.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.unusable.is_none()
    }

    /// The BRDF that was found: the model at the values of its parameters.
    #[must_use]
    pub fn brdf(&self) -> Brdf {
        Brdf::of_table(&self.model, &self.table)
    }
}

/// Criteria that weigh the error against the number of parameters; `None` where the cost is no likelihood.
#[derive(Clone, Copy, Debug, Default)]
pub struct Selection {
    /// Akaike's information criterion, corrected for small samples.
    pub aicc: Option<f64>,
    /// Bayesian information criterion.
    pub bic: Option<f64>,
}

/// The criteria at a minimum of this `cost`, of `n` residuals and `free` parameters; `absolute` where residuals are in
/// standard deviations.
pub(super) fn selection(cost: f64, n: usize, free: usize, absolute: bool) -> Selection {
    let (n, k) = (count(n), count(free));
    // With unknown noise its variance is estimated too.
    let (deviance, k) = if absolute { (cost, k) } else { (n * cost.ln(), k + 1.0) };
    let finite = |value: f64| value.is_finite().then_some(value);
    let correction = 2.0 * k * (k + 1.0) / (n - k - 1.0);
    Selection {
        aicc: if n > k + 1.0 { finite(deviance + 2.0 * k + correction) } else { None },
        bic: finite(deviance + k * n.ln()),
    }
}
