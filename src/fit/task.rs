//! A fit in progress: the data that all of its stages share.

use super::options::Options;
use super::problem::loss::Objective;
use super::problem::observed::Observed;
use super::problem::reflectance::ReflectanceProblem;
use crate::math::count;
use crate::measurement::{Draws, Samples};
use crate::model::Expression;
use crate::parameters::ParameterTable;
use crate::solver::{Limits, Observer};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Number of samples on which starts are polished.
pub(super) const POLISH_SAMPLES: usize = 6000;

/// Largest number of samples with which several fits of them run at once. With more samples each fit divides its samples among the
/// threads, so that only one copy of them is needed.
pub(super) const SMALL: usize = 50_000;

/// A fit in progress.
pub(super) struct Task<'a> {
    pub(super) expression: &'a Expression,
    pub(super) samples: &'a Samples,
    /// Draws of part of those samples.
    pub(super) draws: Arc<Draws<'a>>,
    pub(super) options: &'a Options,
    /// The same samples with the standard deviations of the file, if it gives any that the fit does not use.
    pub(super) with_sigma: Option<&'a Samples>,
}

impl<'a> Task<'a> {
    pub(super) fn new(expression: &'a Expression, samples: &'a Samples, options: &'a Options) -> Self {
        Self { expression, samples, draws: Arc::new(Draws::new(samples)), options, with_sigma: None }
    }

    /// The same fit of another expression.
    pub(super) fn of<'b>(&self, expression: &'b Expression) -> Task<'b>
    where
        'a: 'b,
    {
        Task { expression, draws: Arc::clone(&self.draws), ..*self }
    }

    pub(super) fn limits(&self, iterations: u64, observer: Option<Observer>) -> Limits {
        self.options.limits(iterations, observer)
    }

    /// Whether the fit was told to stop, or its time is over.
    pub(super) fn is_stopped(&self) -> bool {
        let Options { stop, deadline, .. } = self.options;
        let told = stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed));
        told || deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }

    /// The cost on some of the samples over that on all: weights are normalised, but those by sigma are not.
    pub(super) fn share_of_cost(&self, some: &Samples) -> f64 {
        if some.sigma.is_some() { count(some.len()) / count(self.samples.len()) } else { 1.0 }
    }

    /// Prepares samples for the metric of the fit.
    pub(super) fn observe<'s>(&self, samples: &'s Samples) -> Arc<Observed<'s>> {
        Arc::new(Observed::new(samples, self.options.metric))
    }

    pub(super) fn problem<'s>(
        &'s self,
        samples: &Arc<Observed<'s>>,
        table: ParameterTable,
        objective: Objective,
    ) -> ReflectanceProblem<'s> {
        ReflectanceProblem::of(self.expression, Arc::clone(samples), table, objective)
    }
}
