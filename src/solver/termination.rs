//! When and why a minimisation ends, and its result.

use super::least_squares::Linearisation;
use nalgebra::DVector;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Why a fit stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Termination {
    /// The last step changed no parameter noticeably.
    ConvergedStep,
    /// The linear model predicts no noticeable decrease of the cost.
    ConvergedCost,
    /// The residuals are orthogonal to every free parameter's effect.
    ConvergedGradient,
    /// No step, however short, lowers the cost, though the linear model says that one should.
    Stalled,
    /// The allowed number of iterations was used up.
    IterationLimit,
    /// The user asked to stop.
    Interrupted,
    /// The allowed time was used up.
    Timeout,
    /// The cost is not finite at the start.
    Invalid,
}

impl Termination {
    /// Name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ConvergedStep => "converged-step",
            Self::ConvergedCost => "converged-cost",
            Self::ConvergedGradient => "converged-gradient",
            Self::Stalled => "stalled",
            Self::IterationLimit => "iteration-limit",
            Self::Interrupted => "interrupted",
            Self::Timeout => "timeout",
            Self::Invalid => "invalid",
        }
    }

    /// Whether a minimum was reached.
    #[must_use]
    pub fn converged(self) -> bool {
        matches!(self, Self::ConvergedStep | Self::ConvergedCost | Self::ConvergedGradient)
    }
}

/// Tolerances at which a minimum counts as reached. All are relative and dimensionless.
#[derive(Clone, Copy, Debug)]
pub struct Tolerances {
    /// Length of the step relative to the length of the parameter vector, in units of D.
    pub step: f64,
    /// Decrease predicted by the linear model, relative to the cost.
    pub cost: f64,
    /// Largest cosine between the residuals and a column of the Jacobian.
    pub gradient: f64,
    /// Largest number of undamped steps after the search has ended. They are taken as long as each is shorter than the
    /// last, until one is as short as `step`; each evaluates the problem once. They gain the digits that the cost
    /// cannot resolve. They do not change why the search ended, except that a search that stalled may turn out to have
    /// converged.
    pub refinements: u32,
}

impl Default for Tolerances {
    fn default() -> Self {
        Self { step: 1e-12, cost: 1e-14, gradient: 1e-11, refinements: 50 }
    }
}

/// A flag that a signal handler or another thread sets to stop a minimisation.
pub type StopSignal = Arc<AtomicBool>;

/// A function that is called with the number of each iteration and its cost.
pub type Observer = Arc<dyn Fn(u64, f64) + Send + Sync>;

/// The limits that end a minimisation before it has converged, and a function to call on the way.
#[derive(Clone)]
pub struct Limits {
    /// Largest number of iterations.
    pub iterations: u64,
    /// A flag that is set to true to stop.
    pub stop: Option<StopSignal>,
    /// The time at which to stop.
    pub deadline: Option<Instant>,
    /// The function to call after each iteration.
    pub observer: Option<Observer>,
}

impl Limits {
    /// Limits the number of iterations only.
    #[must_use]
    pub fn iterations(iterations: u64) -> Self {
        Self { iterations, stop: None, deadline: None, observer: None }
    }

    /// Why to end after `iterations` iterations; `None` to continue.
    pub(crate) fn reason(&self, iterations: u64) -> Option<Termination> {
        if self.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed)) {
            Some(Termination::Interrupted)
        } else if self.deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            Some(Termination::Timeout)
        } else if iterations >= self.iterations {
            Some(Termination::IterationLimit)
        } else {
            None
        }
    }
}

impl Default for Limits {
    /// 2000 iterations, three times as many as the slowest of the NIST problems takes (docs/trust/nist.md).
    fn default() -> Self {
        Self::iterations(2000)
    }
}

/// The result of a minimisation.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The best parameters found.
    pub x: DVector<f64>,
    /// The sum of squares at these parameters.
    pub cost: f64,
    /// The linear model at these parameters.
    pub linearisation: Linearisation,
    /// Why the minimisation stopped.
    pub termination: Termination,
    /// Number of iterations, including undamped steps after the search.
    pub iterations: u64,
    /// Number of evaluations of the problem.
    pub evaluations: u64,
}
