//! The curvature of a sum of squares beyond that of its linear model.

use crate::solver::least_squares::{LeastSquares, Linearisation};
use nalgebra::{DMatrix, DVector};

/// Step of the differences, relative to the coordinate.
const STEP: f64 = 1e-4;
/// Least size of a coordinate in that.
const LEAST_SIZE: f64 = 1e-2;

/// The sum of r times the second derivatives of r at `x`, in the columns of each block of the linear model: what half the Hessian of the
/// sum of squares has beside J^T J. It vanishes where the residuals do; where a model misses its data, it may take most of the curvature
/// away. It is found from differences of the gradient, two for each parameter; parameters of different blocks are moved at once.
pub(crate) fn beyond_linear(problem: &impl LeastSquares, x: &DVector<f64>) -> Vec<DMatrix<f64>> {
    let model = problem.linearise(x);
    let bounds = problem.bounds();
    let uses = model.uses(x.len());
    let mut result: Vec<DMatrix<f64>> =
        model.blocks.iter().map(|rows| DMatrix::zeros(rows.columns.len(), rows.columns.len())).collect();
    for moved in moved_at_once(&model, &uses) {
        let (mut below, mut above) = (x.clone(), x.clone());
        for column in &moved {
            let step = STEP * x[*column].abs().max(LEAST_SIZE);
            let (low, high) = bounds[*column];
            below[*column] = (x[*column] - step).max(low);
            above[*column] = (x[*column] + step).min(high);
        }
        let (at_below, at_above) = (problem.linearise(&below), problem.linearise(&above));
        for (block, rows) in model.blocks.iter().enumerate() {
            let Some(place) = rows.columns.iter().position(|column| moved.contains(column)) else { continue };
            let column = rows.columns[place];
            let change = at_above.blocks[block].slope() - at_below.blocks[block].slope();
            let difference = change / (above[column] - below[column]);
            result[block].set_column(place, &difference);
        }
    }
    for (matrix, rows) in result.iter_mut().zip(&model.blocks) {
        let symmetric = (&*matrix + matrix.transpose()) * 0.5;
        *matrix = symmetric - rows.jacobian.tr_mul(&rows.jacobian);
    }
    result
}

/// Sets of columns that can be moved at once, because no block involves two of them.
fn moved_at_once(model: &Linearisation, uses: &[usize]) -> Vec<Vec<usize>> {
    let of_one_block =
        |rows: &[usize]| -> Vec<usize> { rows.iter().copied().filter(|column| uses[*column] == 1).collect() };
    let own: Vec<Vec<usize>> = model.blocks.iter().map(|rows| of_one_block(&rows.columns)).collect();
    let most = own.iter().map(Vec::len).max().unwrap_or(0);
    let kth = |k: usize| own.iter().filter_map(|columns| columns.get(k).copied()).collect();
    let shared = (0..uses.len()).filter(|column| uses[*column] > 1).map(|column| vec![column]);
    (0..most).map(kth).chain(shared).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::least_squares::Rows;
    use approx::assert_relative_eq;

    /// Two blocks of two residuals: y_k - exp(a_k t) - b t^2 b, with a_k of the block's own and b shared.
    struct Curved;

    const TIMES: [f64; 2] = [0.5, 1.5];

    impl LeastSquares for Curved {
        fn linearise(&self, x: &DVector<f64>) -> Linearisation {
            let block = |k: usize| {
                let jacobian = DMatrix::from_fn(2, 2, |row, column| {
                    let t = TIMES[row];
                    if column == 0 { 2.0 * x[2] * t * t } else { t * (x[k] * t).exp() }
                });
                let residual = DVector::from_fn(2, |row, _| {
                    let t = TIMES[row];
                    (x[k] * t).exp() + x[2] * x[2] * t * t - 3.0
                });
                Rows { columns: vec![2, k], jacobian, residual }
            };
            Linearisation { cost: 0.0, blocks: vec![block(0), block(1)], costs: Vec::new() }
        }

        fn bounds(&self) -> Vec<(f64, f64)> {
            vec![(-5.0, 0.3), (-5.0, 5.0), (-5.0, 5.0)]
        }
    }

    #[test]
    fn second_derivatives_times_residuals() {
        // The first parameter is at its bound.
        let x = DVector::from_column_slice(&[0.3, -0.7, 0.4]);
        let found = beyond_linear(&Curved, &x);
        for (k, matrix) in found.iter().enumerate() {
            let residual = &Curved.linearise(&x).blocks[k].residual;
            let of_shared: f64 = TIMES.iter().zip(residual.iter()).map(|(t, r)| r * 2.0 * t * t).sum();
            let of_own: f64 =
                TIMES.iter().zip(residual.iter()).map(|(t, r)| r * t * t * (x[k] * t).exp()).sum();
            assert_relative_eq!(matrix[(0, 0)], of_shared, max_relative = 1e-4);
            assert_relative_eq!(matrix[(1, 1)], of_own, max_relative = 1e-3);
            assert_relative_eq!(matrix[(0, 1)], 0.0, epsilon = 1e-3);
        }
    }
}
