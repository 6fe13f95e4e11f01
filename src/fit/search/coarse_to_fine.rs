//! Approaches the minimum on all samples, mostly by working on a part of them.
//!
//! A step on part of the samples costs next to nothing, but leads to the part's own minimum. The two minima lie apart
//! because the gradients of the two costs differ. If the difference of the gradients at a point is added to the cost
//! of the part as a linear term, the part has the gradient of the whole at that point, and a curvature of its own that
//! differs from the whole's only because the part is a random draw. Its minimum is then far closer to the whole's than
//! one step of the linear model could get, because the part's cost also contains the curvature of the residuals (the
//! idea behind Johnson and Zhang 2013, arXiv:1309.2388, and Shamir, Srebro and Zhang 2014, arXiv:1312.7853). A round
//! costs one pass over all samples.
//!
//! No result relies on this: the solver starts on all samples where the rounds end, and stops by its own tests.

use crate::error::Error;
use crate::fit::problem::reflectance::ReflectanceProblem;
use crate::fit::task::Task;
use crate::solver::bounded_step::{bounded_step, room, within};
use crate::solver::corrected::Corrected;
use crate::solver::extrapolation::Extrapolation;
use crate::solver::in_parts::InParts;
use crate::solver::{LeastSquares, Linearisation, Tolerances, minimise};
use nalgebra::DVector;

/// Number of samples of the part.
const PART_SAMPLES: usize = 20_000;
/// The detour is taken only if there are at least this many times as many samples as in the part.
const LEAST_RATIO: usize = 8;
/// Largest number of passes over all samples. With one lobe the second correction already ends within the tolerance; with several
/// it takes about four.
const ROUNDS: usize = 6;
/// Tolerances on the part, whose minimum is only an intermediate step.
const FIRST: Tolerances = Tolerances { step: 1e-8, cost: 1e-9, gradient: 1e-9, refinements: 0 };
/// Tolerances on the corrected part, whose minimum is compared with that of the whole. The cost's grows with what is still to be
/// gained: see [`CORRECTED_SHARE`].
const CORRECTED: Tolerances = Tolerances { step: 1e-11, cost: 1e-14, gradient: 1e-14, refinements: 0 };
/// Tolerance on the corrected part relative to the decrease that the whole promises, which one round lowers by a factor of 1e2 to
/// 1e4.
const CORRECTED_SHARE: f64 = 1e-4;
/// Largest number of iterations on the part.
const ITERATIONS: u64 = 60;

impl Task<'_> {
    /// Moves from a point close to the minimum on part of the samples to one close to the minimum on all of them. `whole` is
    /// `problem` in parts, as are the points. Returns the point given if there are too few samples to gain anything. Ends when
    /// the linear model predicts a decrease of less than `promise` of the cost. Also returns the number of passes over all
    /// samples.
    ///
    /// # Errors
    /// The errors of [`minimise`].
    pub(in crate::fit) fn coarse_to_fine(
        &self,
        problem: &ReflectanceProblem<'_>,
        whole: &impl LeastSquares,
        start: DVector<f64>,
        promise: f64,
    ) -> Result<(DVector<f64>, u64), Error> {
        if self.samples.len() < LEAST_RATIO * PART_SAMPLES || start.is_empty() {
            return Ok((start, 0));
        }

        // Minimise on the part alone.
        let samples = self.draws.part(PART_SAMPLES, self.options.seed);
        let (table, objective) = (problem.table().clone(), problem.objective());
        let part = self.problem(&self.observe(&samples), table, objective);
        let part = InParts::new(&part, &problem.table().free_products());
        let limits = self.limits(ITERATIONS, None);
        let mut x = minimise(&part, start, FIRST, limits.clone())?.x;
        let mut model = whole.linearise(&x);
        let mut passes = 1;
        let scale = model.column_lengths(x.len());
        let mut sequence = Extrapolation::default();

        // Minimise on the part with the gradient of the whole, as long as that leads closer to the minimum of the
        // whole.
        for _ in 1..ROUNDS {
            let promised = promise_of(&model, &x, whole);
            let is_worthwhile = model.is_finite() && promised > promise;
            if limits.reason(0).is_some() || model.cost <= whole.cost_floor() || !is_worthwhile {
                break;
            }
            let correction = Corrected::new(&part, &model, &x);
            let tolerances = Tolerances { cost: CORRECTED.cost.max(CORRECTED_SHARE * promised), ..CORRECTED };
            let next = minimise(&correction, x.clone(), tolerances, limits.clone())?.x;
            // The rounds shrink the distance by the same factors again and again: try the end of their sequence.
            let step = &next - &x;
            let end = sequence.end(&x, &step, &scale).map(|step| within(&x + step, &whole.bounds()));
            let next = end.unwrap_or(next);
            let there = whole.linearise(&next);
            passes += 1;
            if there.cost.is_nan() || there.cost >= model.cost {
                break;
            }
            (x, model) = (next, there);
        }
        Ok((x, passes))
    }
}

/// The decrease that the linear model predicts, relative to the cost.
fn promise_of(model: &Linearisation, x: &DVector<f64>, problem: &impl LeastSquares) -> f64 {
    let scale = model.column_lengths(x.len()).map(|s| if s > 0.0 { s } else { 1.0 });
    model.decrease(&bounded_step(model, &scale, 0.0, &room(x, &problem.bounds()))) / model.cost
}
