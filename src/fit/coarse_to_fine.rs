//! The way to the minimum on all samples, most of it on a part of them.
//!
//! A step on part of the samples costs next to nothing, but leads to the part's own minimum. What separates the
//! two minima is a slope: with the difference of the gradients added, linearly, to the cost on the part, the part
//! has the gradient of the whole where that was computed, and its own curvature, which differs from the whole's
//! only by what the draw of the part left to chance. Its minimum is then far closer to the whole's than one step
//! of the linear model could come, because the part's cost knows the curvature of the residuals too (the idea
//! behind Johnson and Zhang 2013, arXiv:1309.2388, and Shamir, Srebro and Zhang 2014, arXiv:1312.7853). A round
//! costs one look at all samples.
//!
//! Nothing is taken on trust: the solver begins where the rounds end, on all samples, and ends by its own tests.

use super::bounded_step::bounded_step;
use super::least_squares::{LeastSquares, Linearisation};
use super::levenberg_marquardt::minimise;
use super::problem::ReflectanceProblem;
use super::run::Task;
use super::termination::Tolerances;
use crate::error::Error;
use nalgebra::DVector;
use std::cell::RefCell;

/// Samples of the part.
const PART_SAMPLES: usize = 20_000;
/// Fewer than so many times as many samples are not worth the detour.
const LEAST_RATIO: usize = 8;
/// Looks at all samples; the second correction already ends within the tolerance of most fits.
const ROUNDS: usize = 3;
/// The part's minimum is only a step on the way, the corrected one is compared with the whole's.
const FIRST: Tolerances = Tolerances { step: 1e-8, cost: 1e-9, gradient: 1e-9, refinements: 0 };
const CORRECTED: Tolerances = Tolerances { step: 1e-11, cost: 1e-14, gradient: 1e-14, refinements: 0 };
const ITERATIONS: u64 = 60;

impl Task<'_> {
    /// A point close to the minimum on all samples, from one close to the minimum on part of them; or that point,
    /// where there are too few samples to gain anything. Ends when the linear model promises less than `promise`
    /// of the cost. Also says how often all samples were looked at.
    ///
    /// # Errors
    /// Those of [`minimise`].
    pub(super) fn approach(
        &self,
        whole: &Remembered<'_, ReflectanceProblem<'_>>,
        start: DVector<f64>,
        promise: f64,
    ) -> Result<(DVector<f64>, u64), Error> {
        if self.samples.len() < LEAST_RATIO * PART_SAMPLES || start.is_empty() {
            return Ok((start, 0));
        }
        let samples = self.draws.part(PART_SAMPLES, self.options.seed);
        let part =
            self.problem(&self.observe(&samples), whole.problem.table().clone(), whole.problem.objective());
        let limits = self.limits(ITERATIONS, None);
        let mut x = minimise(&part, start, FIRST, limits.clone())?.x;
        let mut model = whole.linearise(&x);
        let mut evaluations = 1;
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
            evaluations += 1;
            if there.cost.is_nan() || there.cost >= model.cost {
                break;
            }
            (x, model) = (next, there);
        }
        Ok((x, evaluations))
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

/// The cost on part of the samples plus a linear function that gives it the gradient of the whole at one point.
struct Corrected<'p, P> {
    part: &'p P,
    /// Half the gradient of the whole less that of the part.
    slope: DVector<f64>,
    /// Where they were computed.
    origin: DVector<f64>,
    /// Lengths of the part's columns there.
    scale: DVector<f64>,
}

/// Rows that carry the correction are so much shorter than the columns: the square is what they falsify the
/// curvature by.
const CORRECTION_SHARE: f64 = 1e-4;

impl<'p, P: LeastSquares> Corrected<'p, P> {
    fn new(part: &'p P, whole: &Linearisation, origin: &DVector<f64>) -> Self {
        let n = origin.len();
        let of_part = part.linearise(origin);
        let nowhere = DVector::zeros(n);
        Self {
            part,
            slope: whole.slope_at(&nowhere) - of_part.slope_at(&nowhere),
            origin: origin.clone(),
            scale: of_part.column_lengths(n),
        }
    }
}

impl<P: LeastSquares> LeastSquares for Corrected<'_, P> {
    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        let mut model = self.part.linearise(x);
        model.cost += 2.0 * self.slope.dot(&(x - &self.origin));
        // A row with the entry e and the residual s/e has the gradient s. It goes to a block that knows the
        // parameter already, so that blocks stay as independent as they were.
        let mut carried = vec![false; x.len()];
        for rows in &mut model.blocks {
            for (local, column) in rows.columns.clone().into_iter().enumerate() {
                let (Some(carried), Some(slope), Some(scale)) =
                    (carried.get_mut(column), self.slope.get(column), self.scale.get(column))
                else {
                    continue;
                };
                let entry = CORRECTION_SHARE * scale;
                if !std::mem::replace(carried, true) && entry > 0.0 {
                    let last = rows.residual.len();
                    rows.jacobian = std::mem::take(&mut rows.jacobian).insert_row(last, 0.0);
                    rows.residual = std::mem::take(&mut rows.residual).insert_row(last, slope / entry);
                    rows.jacobian.get_mut((last, local)).into_iter().for_each(|place| *place = entry);
                }
            }
        }
        model
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.part.bounds()
    }

    fn cost_floor(&self) -> f64 {
        self.part.cost_floor()
    }
}

/// A problem that does not evaluate its best point a second time.
pub(super) struct Remembered<'p, P> {
    problem: &'p P,
    best: RefCell<Option<(DVector<f64>, Linearisation)>>,
}

impl<'p, P: LeastSquares> Remembered<'p, P> {
    pub(super) fn new(problem: &'p P) -> Self {
        Self { problem, best: RefCell::new(None) }
    }
}

impl<P: LeastSquares> LeastSquares for Remembered<'_, P> {
    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        let mut best = self.best.borrow_mut();
        if let Some((_, model)) = best.as_ref().filter(|(at, _)| at == x) {
            return model.clone();
        }
        let model = self.problem.linearise(x);
        if best.as_ref().is_none_or(|(_, known)| model.cost < known.cost) {
            *best = Some((x.clone(), model.clone()));
        }
        model
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.problem.bounds()
    }

    fn cost_floor(&self) -> f64 {
        self.problem.cost_floor()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Limits;
    use approx::assert_relative_eq;
    use nalgebra::DMatrix;
    use std::cell::Cell;

    /// y = a e^(-k t) against measured values at some times, each with the same weight; counts its evaluations.
    struct Decay {
        data: Vec<(f64, f64)>,
        weight: f64,
        evaluations: Cell<usize>,
    }

    impl LeastSquares for Decay {
        fn linearise(&self, x: &DVector<f64>) -> Linearisation {
            self.evaluations.set(self.evaluations.get() + 1);
            let (a, k) = (x[0], x[1]);
            let n = self.data.len();
            let residual = DVector::from_fn(n, |i, _| a * (-k * self.data[i].0).exp() - self.data[i].1);
            let jacobian = DMatrix::from_fn(n, 2, |i, column| {
                let (t, shape) = (self.data[i].0, (-k * self.data[i].0).exp());
                if column == 0 { shape } else { -a * t * shape }
            });
            Linearisation::dense(self.weight.sqrt() * jacobian, self.weight.sqrt() * residual)
        }

        fn bounds(&self) -> Vec<(f64, f64)> {
            vec![(0.0, 100.0), (0.0, 100.0)]
        }
    }

    /// Values that no exponential decay fits, so that residuals stay; one of every `step`, standing for all.
    fn decays(step: usize) -> Decay {
        let at =
            |i: usize| (0.01 * crate::math::count(i), 5.0 / (1.0 + 0.02 * crate::math::count(i)).powi(2));
        Decay {
            data: (0..300).step_by(step).map(at).collect(),
            weight: crate::math::count(step),
            evaluations: Cell::new(0),
        }
    }

    #[test]
    fn a_correction_carries_the_gradient_of_the_whole() {
        let (whole, part) = (decays(1), decays(7));
        let x = DVector::from_vec(vec![4.0, 1.3]);
        let model = whole.linearise(&x);
        let corrected = Corrected::new(&part, &model, &x);
        let (wanted, found) =
            (model.slope_at(&DVector::zeros(2)), corrected.linearise(&x).slope_at(&DVector::zeros(2)));
        assert_relative_eq!(wanted, found, max_relative = 1e-10);
        // The cost has the same gradient as the rows, elsewhere too.
        let (there, step) = (DVector::from_vec(vec![4.2, 1.2]), 1e-5);
        let slope = corrected.linearise(&there).slope_at(&DVector::zeros(2));
        for axis in 0..2 {
            let cost = |shift: f64| {
                let mut moved = there.clone();
                moved[axis] += shift;
                corrected.linearise(&moved).cost
            };
            assert_relative_eq!(
                (cost(step) - cost(-step)) / (2.0 * step),
                2.0 * slope[axis],
                max_relative = 1e-6
            );
        }
    }

    #[test]
    fn corrections_lead_from_the_minimum_of_a_part_to_that_of_the_whole() {
        let (whole, part) = (decays(1), decays(3));
        let start = DVector::from_vec(vec![1.0, 1.0]);
        let solve = |problem: &Decay| {
            minimise(problem, start.clone(), Tolerances::default(), Limits::default()).unwrap().x
        };
        let (wanted, mut x) = (solve(&whole), solve(&part));
        let mut distance = (&x - &wanted).norm();
        assert!(distance > 1e-3);
        for _ in 0..3 {
            let corrected = Corrected::new(&part, &whole.linearise(&x), &x);
            x = minimise(&corrected, x.clone(), CORRECTED, Limits::default()).unwrap().x;
            let closer = (&x - &wanted).norm();
            assert!(closer < 0.1 * distance, "{closer:e} after {distance:e}");
            distance = closer;
        }
    }

    #[test]
    fn the_best_point_is_evaluated_once() {
        let whole = decays(1);
        let remembered = Remembered::new(&whole);
        let (good, bad) = (DVector::from_vec(vec![5.0, 1.5]), DVector::from_vec(vec![50.0, 0.1]));
        let first = remembered.linearise(&good);
        remembered.linearise(&bad);
        assert_eq!(remembered.linearise(&good).cost.to_bits(), first.cost.to_bits());
        assert_eq!(whole.evaluations.get(), 2);
    }
}
