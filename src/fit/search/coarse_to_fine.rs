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
use crate::solver::bounded_step::bounded_step;
use crate::solver::corrected::Corrected;
use crate::solver::remembered::Remembered;
use crate::solver::{LeastSquares, Linearisation, Tolerances, minimise};
use nalgebra::DVector;

/// Number of samples of the part.
const PART_SAMPLES: usize = 20_000;
/// The detour is taken only if there are at least this many times as many samples as in the part.
const LEAST_RATIO: usize = 8;
/// Largest number of passes over all samples. For most fits the second correction already ends within the tolerance.
const ROUNDS: usize = 3;
/// Tolerances on the part, whose minimum is only an intermediate step.
const FIRST: Tolerances = Tolerances { step: 1e-8, cost: 1e-9, gradient: 1e-9, refinements: 0 };
/// Tolerances on the corrected part, whose minimum is compared with that of the whole.
const CORRECTED: Tolerances = Tolerances { step: 1e-11, cost: 1e-14, gradient: 1e-14, refinements: 0 };
/// Largest number of iterations on the part.
const ITERATIONS: u64 = 60;

impl Task<'_> {
    /// Moves from a point close to the minimum on part of the samples to one close to the minimum on all of them.
    /// Returns the point given if there are too few samples to gain anything. Ends when the linear model predicts a
    /// decrease of less than `promise` of the cost. Also returns the number of passes over all samples.
    ///
    /// # Errors
    /// The errors of [`minimise`].
    pub(in crate::fit) fn coarse_to_fine(
        &self,
        whole: &Remembered<'_, ReflectanceProblem<'_>>,
        start: DVector<f64>,
        promise: f64,
    ) -> Result<(DVector<f64>, u64), Error> {
        if self.samples.len() < LEAST_RATIO * PART_SAMPLES || start.is_empty() {
            return Ok((start, 0));
        }

        // Minimise on the part alone.
        let samples = self.draws.part(PART_SAMPLES, self.options.seed);
        let (table, objective) = (whole.problem().table().clone(), whole.problem().objective());
        let part = self.problem(&self.observe(&samples), table, objective);
        let limits = self.limits(ITERATIONS, None);
        let mut x = minimise(&part, start, FIRST, limits.clone())?.x;
        let mut model = whole.linearise(&x);
        let mut passes = 1;

        // Minimise on the part with the gradient of the whole, as long as that leads closer to the minimum of the
        // whole.
        for _ in 1..ROUNDS {
            if limits.reason(0).is_some()
                || model.cost <= whole.cost_floor()
                || !worthwhile(&model, &x, whole, promise)
            {
                break;
            }
            let correction = Corrected::new(&part, &model, &x);
            let next = minimise(&correction, x.clone(), CORRECTED, limits.clone())?.x;
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

/// Whether the linear model predicts a decrease of more than `promise` of the cost.
fn worthwhile(model: &Linearisation, x: &DVector<f64>, problem: &impl LeastSquares, promise: f64) -> bool {
    let scale = model.column_lengths(x.len()).map(|s| if s > 0.0 { s } else { 1.0 });
    let bounds = problem.bounds();
    let room: Vec<(f64, f64)> =
        bounds.iter().zip(x.iter()).map(|((low, high), x)| (low - x, high - x)).collect();
    model.is_finite() && model.decrease(&bounded_step(model, &scale, 0.0, &room)) > promise * model.cost
}
