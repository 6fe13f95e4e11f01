//! The way to the minimum on all samples, most of it on a part of them.
//!
//! A step on part of the samples costs next to nothing, but leads to the part's own minimum. What separates the
//! two minima is a slope: with the difference of the gradients added, linearly, to the cost on the part, the part
//! has the gradient of the whole where that was computed, and its own curvature, which differs from the whole's
//! only by what the draw of the part left to chance. Its minimum is then far closer to the whole's than one step
//! of the linear model could come, because the part's cost knows the curvature of the residuals too (the idea
//! behind Johnson and Zhang 2013, arXiv:1309.2388, and Shamir, Srebro and Zhang 2014, arXiv:1312.7853). A round
//! costs one pass over all samples.
//!
//! Nothing is taken on trust: the solver begins where the rounds end, on all samples, and ends by its own tests.

use crate::error::Error;
use crate::fit::problem::reflectance::ReflectanceProblem;
use crate::fit::task::Task;
use crate::solver::bounded_step::bounded_step;
use crate::solver::corrected::Corrected;
use crate::solver::remembered::Remembered;
use crate::solver::{LeastSquares, Linearisation, Tolerances, minimise};
use nalgebra::DVector;

/// Samples of the part.
const PART_SAMPLES: usize = 20_000;
/// The detour is worth taking only where there are this many times as many samples.
const LEAST_RATIO: usize = 8;
/// Passes over all samples; the second correction already ends within the tolerance of most fits.
const ROUNDS: usize = 3;
/// The end on the part: its minimum is only a step on the way.
const FIRST: Tolerances = Tolerances { step: 1e-8, cost: 1e-9, gradient: 1e-9, refinements: 0 };
/// The end on the corrected part, whose minimum is compared with that of the whole.
const CORRECTED: Tolerances = Tolerances { step: 1e-11, cost: 1e-14, gradient: 1e-14, refinements: 0 };
/// Most iterations on the part.
const ITERATIONS: u64 = 60;

impl Task<'_> {
    /// A point close to the minimum on all samples, from one close to the minimum on part of them; or that point,
    /// where there are too few samples to gain anything. Ends when the linear model promises less than `promise`
    /// of the cost. Also yields the number of passes over all samples.
    ///
    /// # Errors
    /// Those of [`minimise`].
    pub(in crate::fit) fn coarse_to_fine(
        &self,
        whole: &Remembered<'_, ReflectanceProblem<'_>>,
        start: DVector<f64>,
        promise: f64,
    ) -> Result<(DVector<f64>, u64), Error> {
        if self.samples.len() < LEAST_RATIO * PART_SAMPLES || start.is_empty() {
            return Ok((start, 0));
        }

        // The part's own minimum.
        let samples = self.draws.part(PART_SAMPLES, self.options.seed);
        let (table, objective) = (whole.problem().table().clone(), whole.problem().objective());
        let part = self.problem(&self.observe(&samples), table, objective);
        let limits = self.limits(ITERATIONS, None);
        let mut x = minimise(&part, start, FIRST, limits.clone())?.x;
        let mut model = whole.linearise(&x);
        let mut passes = 1;

        // The minimum of the part with the gradient of the whole, as long as that is closer to the whole's.
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

/// Whether the linear model promises more than a share of the cost.
fn worthwhile(model: &Linearisation, x: &DVector<f64>, problem: &impl LeastSquares, promise: f64) -> bool {
    let scale = model.column_lengths(x.len()).map(|s| if s > 0.0 { s } else { 1.0 });
    let bounds = problem.bounds();
    let room: Vec<(f64, f64)> =
        bounds.iter().zip(x.iter()).map(|((low, high), x)| (low - x, high - x)).collect();
    model.is_finite() && model.decrease(&bounded_step(model, &scale, 0.0, &room)) > promise * model.cost
}
