//! When a minimisation ends, and what it ends with.

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
    /// The linear model promises no noticeable decrease of the cost.
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

/// When to call a minimum reached. All are relative and dimensionless.
#[derive(Clone, Copy, Debug)]
pub struct Tolerances {
    /// Step length against the length of the parameter vector, in units of D.
    pub step: f64,
    /// Decrease that the linear model promises against the cost.
    pub cost: f64,
    /// Cosine between the residuals and each column of the Jacobian.
    pub gradient: f64,
    /// The most undamped steps after the search has ended, taken while each is shorter than the last, until one
    /// is as short as `step`; each evaluates the problem once. They win the digits that the cost cannot
    /// tell. They do not change why the search ended, except that one that stalled may turn out to have
    /// converged.
    pub refinements: u32,
}

impl Default for Tolerances {
    fn default() -> Self {
        Self { step: 1e-12, cost: 1e-14, gradient: 1e-11, refinements: 50 }
    }
}

/// A request to stop that may come from a signal handler or another thread.
pub type StopSignal = Arc<AtomicBool>;

/// Called with the number of the iteration and its cost.
pub type Observer = Arc<dyn Fn(u64, f64) + Send + Sync>;

/// What ends a minimisation before it has converged, and what is called on the way.
#[derive(Clone)]
pub struct Limits {
    /// The most iterations.
    pub iterations: u64,
    /// Set to true to stop.
    pub stop: Option<StopSignal>,
    /// The moment to stop at.
    pub deadline: Option<Instant>,
    /// Called after each iteration.
    pub observer: Option<Observer>,
}

impl Limits {
    /// Limits the number of iterations alone.
    #[must_use]
    pub fn iterations(iterations: u64) -> Self {
        Self { iterations, stop: None, deadline: None, observer: None }
    }

    /// Why to end after `iterations` iterations; `None` to go on.
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
    /// Two thousand iterations, three times what the slowest of the NIST problems takes (docs/trust/nist.md).
    fn default() -> Self {
        Self::iterations(2000)
    }
}

/// The end of a minimisation.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The best parameters.
    pub x: DVector<f64>,
    /// Their sum of squares.
    pub cost: f64,
    /// The linear model there.
    pub linearisation: Linearisation,
    /// Why it stopped.
    pub termination: Termination,
    /// Iterations, undamped steps after the search included.
    pub iterations: u64,
    /// Evaluations of the problem.
    pub evaluations: u64,
}
