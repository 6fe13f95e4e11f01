//! What the solver needs to know of a problem.

use crate::math::count;
use nalgebra::{DMatrix, DVector};

/// Rows of a linear model that involve only some of the parameters.
#[derive(Clone, Debug)]
pub struct Rows {
    /// The parameter of each column.
    pub columns: Vec<usize>,
    /// d residual/d parameter, one column per entry of `columns`.
    pub jacobian: DMatrix<f64>,
    /// The residuals.
    pub residual: DVector<f64>,
}

impl Rows {
    /// The entries of a vector over all parameters that belong to these columns.
    fn gather(&self, p: &DVector<f64>) -> DVector<f64> {
        DVector::from_iterator(
            self.columns.len(),
            self.columns.iter().map(|column| p.get(*column).copied().unwrap_or(0.0)),
        )
    }

    /// Adds entries that belong to these columns to a vector over all parameters.
    fn scatter(&self, entries: &DVector<f64>, sum: &mut DVector<f64>) {
        for (column, entry) in self.columns.iter().zip(entries.iter()) {
            sum.get_mut(*column).into_iter().for_each(|place| *place += entry);
        }
    }
}

/// A sum of squares and its linear model at one point.
///
/// The rows need not be those of the Jacobian itself: any with the same J^T J and J^T r describe the same
/// linear model, in particular the triangular factors that a stream of samples is compressed to. Rows
/// that involve the same parameters form a block; a solver may eliminate a parameter that only one
/// block knows before it turns to those that several share.
#[derive(Clone, Debug)]
pub struct Linearisation {
    /// The sum of squared residuals.
    pub cost: f64,
    /// All rows.
    pub blocks: Vec<Rows>,
}

impl Linearisation {
    /// A model without structure: every row involves every parameter.
    #[must_use]
    pub fn dense(jacobian: DMatrix<f64>, residual: DVector<f64>) -> Self {
        let columns = (0..jacobian.ncols()).collect();
        Self { cost: residual.norm_squared(), blocks: vec![Rows { columns, jacobian, residual }] }
    }

    /// Whether the cost and every row are finite numbers.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let finite = |rows: &Rows| rows.jacobian.iter().chain(rows.residual.iter()).all(|v| v.is_finite());
        self.cost.is_finite() && self.blocks.iter().all(finite)
    }

    /// J^T (J p + r): half the slope of the model's sum of squares at step `p`.
    #[must_use]
    pub fn slope_at(&self, p: &DVector<f64>) -> DVector<f64> {
        let mut slope = DVector::zeros(p.len());
        for rows in &self.blocks {
            let moved = &rows.jacobian * rows.gather(p) + &rows.residual;
            rows.scatter(&rows.jacobian.tr_mul(&moved), &mut slope);
        }
        slope
    }

    /// By how much the model's sum of squares falls with step `p`.
    #[must_use]
    pub fn decrease(&self, p: &DVector<f64>) -> f64 {
        let of_block = |rows: &Rows| {
            let effect = &rows.jacobian * rows.gather(p);
            -(2.0 * effect.dot(&rows.residual) + effect.norm_squared())
        };
        self.blocks.iter().map(of_block).sum()
    }

    /// Length of the Jacobian's column of each of `n` parameters.
    #[must_use]
    pub fn column_lengths(&self, n: usize) -> DVector<f64> {
        let mut squares = DVector::zeros(n);
        for rows in &self.blocks {
            let lengths = rows.jacobian.column_iter().map(|column| column.norm_squared());
            let lengths = DVector::from_iterator(rows.columns.len(), lengths);
            rows.scatter(&lengths, &mut squares);
        }
        squares.map(f64::sqrt)
    }

    /// The standard deviation of each of `n` parameters, none of them at a bound:
    /// sqrt(diag((J^T J)^-1) cost / dof), for independent residuals of equal variance. Correct at the minimum
    /// only. None without degrees of freedom, or where the rows do not determine every parameter.
    #[must_use]
    pub fn standard_deviations(&self, n: usize, dof: usize) -> Option<DVector<f64>> {
        let lengths = self.column_lengths(n);
        let mut design = self.matrix(n);
        if dof == 0 || design.nrows() < n {
            return None;
        }
        // Columns of unit length: the condition number does not depend on the parameters' units.
        for (mut column, length) in design.column_iter_mut().zip(lengths.iter()) {
            column /= *length;
        }
        // (J^T J)^-1 = R^-1 R^-T, so that a row of R^-1 is as long as the parameter is uncertain.
        let inverse = design.qr().r().solve_upper_triangular(&DMatrix::identity(n, n))?;
        let deviation = (self.cost / count(dof)).sqrt();
        let entries =
            inverse.row_iter().zip(lengths.iter()).map(|(row, length)| deviation * row.norm() / length);
        let deviations = DVector::from_iterator(n, entries);
        deviations.iter().all(|d| d.is_finite()).then_some(deviations)
    }

    /// All rows over all of `n` parameters.
    #[must_use]
    pub fn matrix(&self, n: usize) -> DMatrix<f64> {
        let height = self.blocks.iter().map(|rows| rows.jacobian.nrows()).sum();
        let mut matrix = DMatrix::zeros(height, n);
        let mut first = 0;
        for rows in &self.blocks {
            let part = &rows.jacobian;
            for (column, entries) in rows.columns.iter().zip(part.column_iter()) {
                matrix.view_mut((first, *column), (part.nrows(), 1)).copy_from(&entries);
            }
            first += part.nrows();
        }
        matrix
    }
}

/// A problem of the form: minimise the sum of squared residuals within bounds.
pub trait LeastSquares {
    /// The sum of squares and its linear model at `x`, which lies within the bounds. A cost that is not
    /// finite tells the solver to stay away.
    fn linearise(&self, x: &DVector<f64>) -> Linearisation;

    /// Smallest and largest value of each parameter; infinite where there is no bound.
    fn bounds(&self) -> Vec<(f64, f64)>;

    /// The cost below which there is nothing but rounding.
    fn cost_floor(&self) -> f64 {
        0.0
    }
}
