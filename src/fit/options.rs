//! What a user may choose about a fit.

use super::problem::loss::LossKind;
use super::problem::metric::Metric;
use crate::measurement::Filters;
use crate::parameters::Settings;
use crate::solver::{Limits, Observer, SolverKind, StopSignal};
use std::time::Instant;

/// What to fit and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// What the residuals are differences of.
    pub metric: Metric,
    /// How strongly residuals that are far larger than the others are down-weighted.
    pub loss: LossKind,
    /// The residual from which on the loss down-weights a sample; `None` to estimate it from the residuals.
    pub loss_scale: Option<f64>,
    /// Which samples count.
    pub filters: Filters,
    /// Constraints on parameters.
    pub settings: Settings,
    /// The seed of all random draws.
    pub seed: u64,
    /// The fraction of the angles of incidence that is left out of the fit, to judge it by; `None` to fit all.
    pub hold_out: Option<f64>,
    /// Where standard errors come from.
    pub uncertainty: Uncertainty,
    /// The optimiser of the final fit; the others serve comparison.
    pub solver: SolverKind,
    /// Most iterations of the final fit by Levenberg-Marquardt; other solvers make more of them.
    pub iterations: u64,
    /// Set to true by another thread to stop with the best so far.
    pub stop: Option<StopSignal>,
    /// The moment to stop at.
    pub deadline: Option<Instant>,
}

impl Options {
    /// When a minimisation under these options ends besides by convergence.
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
            solver: SolverKind::default(),
            iterations: 300,
            stop: None,
            deadline: None,
        }
    }
}

/// Where standard errors come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Uncertainty {
    /// From the linear model at the optimum, for independent samples.
    #[default]
    Formula,
    /// From fits repeated on resampled angles of incidence.
    BlockBootstrap,
}

impl Uncertainty {
    /// Name on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Formula => "formula",
            Self::BlockBootstrap => "block-bootstrap",
        }
    }
}

/// How many samples a fit may use and how many iterations it may take. docs/use/tradeoff.md has what each costs and leaves in
/// error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Budget {
    /// 2000 samples, 60 iterations.
    Fast,
    /// 20 000 samples, 120 iterations.
    Balanced,
    /// All samples, 300 iterations.
    Full,
}

impl Budget {
    /// All budgets, from the cheapest up.
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

    /// The most iterations of the final fit.
    #[must_use]
    pub fn iterations(self) -> u64 {
        match self {
            Self::Fast => 60,
            Self::Balanced => 120,
            Self::Full => 300,
        }
    }

    /// The options of a fit within this budget.
    #[must_use]
    pub fn apply(self, options: &Options) -> Options {
        Options {
            filters: Filters { samples: self.samples(), ..options.filters.clone() },
            iterations: self.iterations(),
            ..options.clone()
        }
    }
}
