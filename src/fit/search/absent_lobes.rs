//! Escapes from false minima at which a lobe has no strength.
//!
//! The strength of a lobe is a product: ks f0 in the middle and ks (1 - f0) towards grazing. At ks = 0 and f0 = 0,
//! suppose that only the middle of the lobe would lower the cost. Raising ks alone adds only the rise towards grazing,
//! and raising f0 alone adds nothing, so both derivatives say that this is a minimum; yet raising both would lower the
//! cost.

use crate::error::Error;
use crate::fit::problem::metric::Metric;
use crate::fit::problem::reflectance::ReflectanceProblem;
use crate::fit::task::{POLISH_SAMPLES, Task};
use crate::model::Role;
use crate::parameters::{ParameterTable, Status};
use crate::solver::{LeastSquares, Solution};
use nalgebra::DVector;

/// Largest number of rounds. Each brings back lobes that were absent; no fit has been seen to need more.
const ROUNDS: usize = 4;
/// An amplitude whose whole effect is below this share of the data is only rounding error.
const NEGLIGIBLE_EFFECT: f64 = 1e-9;

/// Minimises over the free parameters of `table` from `start`, and again whenever another value of the second factor
/// of an absent lobe's strength opens a way to a lower cost.
///
/// # Errors
/// The errors of `minimise`.
pub(in crate::fit) fn minimise_escaping_absent_lobes(
    problem: &impl LeastSquares,
    table: &ParameterTable,
    start: DVector<f64>,
    mut minimise: impl FnMut(DVector<f64>) -> Result<Solution, Error>,
) -> Result<Solution, Error> {
    let mut solution = minimise(start)?;
    for _ in 0..ROUNDS {
        if !solution.termination.converged() {
            break;
        }
        let Some(start) = way_down(problem, table, &solution) else { break };
        let next = minimise(start)?;
        if next.cost.is_nan() || next.cost >= solution.cost {
            break;
        }
        let (iterations, evaluations) = (solution.iterations, solution.evaluations);
        solution = Solution {
            iterations: iterations + next.iterations,
            evaluations: evaluations + next.evaluations,
            ..next
        };
    }
    Ok(solution)
}

/// The same point with the second factor of each absent product moved to its farther bound, if increasing the first
/// factor then lowers the cost; `None` if that holds for no product.
fn way_down(
    problem: &impl LeastSquares,
    table: &ParameterTable,
    solution: &Solution,
) -> Option<DVector<f64>> {
    let mut table = table.clone();
    table.set_coordinates(solution.x.as_slice());
    let absent = absent_products(&table);
    if absent.is_empty() {
        return None;
    }
    let mut moved = table.clone();
    for (_, second) in &absent {
        let row = &table.rows()[*second];
        let (lower, upper) = row.bounds;
        moved.set_value(*second, if row.value < 0.5 * (lower + upper) { upper } else { lower });
    }
    let x = DVector::from_vec(moved.coordinates());
    let slope = problem.linearise(&x).slope_at(&DVector::zeros(x.len()));
    let place = |row: usize| table.free().binary_search(&row).ok();
    let mut helps = false;
    let mut start = table.clone();
    for (first, second) in absent {
        if place(first).is_some_and(|at| slope[at] < 0.0) {
            start.set_value(second, moved.rows()[second].value);
            helps = true;
        }
    }
    helps.then(|| DVector::from_vec(start.coordinates()))
}

/// The rows of the products whose factors are both free and whose first factor is at a lower bound of 0.
fn absent_products(table: &ParameterTable) -> Vec<(usize, usize)> {
    let is_free = |row: usize| table.rows()[row].status == Status::Free;
    let mut absent = Vec::new();
    for product in table.products() {
        for channel in 0..table.channels().len() {
            let place = |parameter: usize| table.place(product.lobe, parameter, channel);
            let (first, second) = (place(product.first), place(product.second));
            let at_zero = table.rows()[first].at_lower() && table.rows()[first].bounds.0 == 0.0;
            if at_zero && is_free(first) && is_free(second) && !absent.contains(&(first, second)) {
                absent.push((first, second));
            }
        }
    }
    absent
}

impl Task<'_> {
    /// Sets amplitudes without any effect to their bound and returns whether there were any.
    pub(in crate::fit) fn drop_negligible(&self, table: &mut ParameterTable) -> bool {
        let samples = self.draws.part(POLISH_SAMPLES, self.options.seed);
        let problem = ReflectanceProblem::new(self.expression, &samples, table.clone(), Metric::L2);
        let x = DVector::from_vec(table.coordinates());
        let lengths = problem.linearise(&x).column_lengths(x.len());
        let data = problem.plausible_magnitude();
        let free = table.free().to_vec();
        let mut any = false;
        for (column, index) in free.into_iter().enumerate() {
            let row = &table.rows()[index];
            let may_vanish = row.spec.role == Role::Amplitude && row.bounds.0 == 0.0 && row.value > 0.0;
            let effect = row.value.abs() * lengths[column];
            if may_vanish && effect < NEGLIGIBLE_EFFECT * data {
                table.set_value(index, 0.0);
                any = true;
            }
        }
        any
    }
}
