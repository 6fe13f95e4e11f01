//! The interface between the solver and a problem.

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
        DVector::from_iterator(self.columns.len(), self.columns.iter().map(|column| p[*column]))
    }

    /// J^T r, the share of these rows in half the gradient.
    pub(crate) fn slope(&self) -> DVector<f64> {
        self.jacobian.tr_mul(&self.residual)
    }

    /// The columns of the parameters `wanted`, each divided by its parameter's entry in `units`.
    pub(super) fn scaled(&self, wanted: &[usize], units: &DVector<f64>) -> DMatrix<f64> {
        let place = |j: &usize| self.columns.iter().position(|column| column == j);
        let places: Vec<usize> = wanted.iter().filter_map(place).collect();
        assert_eq!(places.len(), wanted.len(), "each wanted parameter has a column in the block");
        let mut matrix = self.jacobian.select_columns(&places);
        for (mut column, j) in matrix.column_iter_mut().zip(wanted) {
            column /= units[*j];
        }
        matrix
    }

    /// Adds entries that belong to these columns to a vector over all parameters.
    fn scatter(&self, entries: &DVector<f64>, sum: &mut DVector<f64>) {
        for (column, entry) in self.columns.iter().zip(entries.iter()) {
            sum[*column] += entry;
        }
    }
}

/// Whether the slope pushes a value out of its bounds, or does not push it at all.
pub(super) fn held((low, high): (f64, f64), value: f64, slope: f64) -> bool {
    (value <= low && slope >= 0.0) || (value >= high && slope <= 0.0)
}

/// A sum of squares and its linear model at one point.
///
/// The rows need not be those of the Jacobian itself. Any rows with the same J^T J and J^T r describe the same linear
/// model; in particular, so do the triangular factors that a stream of samples is compressed to. Rows that involve the
/// same parameters form a block. A solver may eliminate a parameter that only one block involves before it solves for
/// the parameters that several blocks share.
#[derive(Clone, Debug)]
pub struct Linearisation {
    /// The sum of squared residuals.
    pub cost: f64,
    /// All rows.
    pub blocks: Vec<Rows>,
    /// The share of each block in the cost.
    pub costs: Vec<f64>,
}

impl Linearisation {
    /// A model without structure: every row involves every parameter.
    #[must_use]
    pub fn dense(jacobian: DMatrix<f64>, residual: DVector<f64>) -> Self {
        let columns = (0..jacobian.ncols()).collect();
        let cost = residual.norm_squared();
        Self { cost, blocks: vec![Rows { columns, jacobian, residual }], costs: vec![cost] }
    }

    /// Whether the cost and every row are finite numbers.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let finite = |rows: &Rows| rows.jacobian.iter().chain(rows.residual.iter()).all(|v| v.is_finite());
        self.cost.is_finite() && self.blocks.iter().all(finite)
    }

    /// Panics unless each block has one column per parameter that it names, all of them below `n`, and one residual
    /// per row.
    fn check(&self, n: usize) {
        for Rows { columns, jacobian, residual } in &self.blocks {
            assert_eq!(jacobian.shape(), (residual.len(), columns.len()), "shape of a block of the Jacobian");
            assert!(columns.iter().all(|column| *column < n), "columns {columns:?} of {n} parameters");
        }
    }

    /// J^T (J p + r), half the gradient of the model's sum of squares at step `p`.
    #[must_use]
    pub fn slope_at(&self, p: &DVector<f64>) -> DVector<f64> {
        self.check(p.len());
        let mut slope = DVector::zeros(p.len());
        for rows in &self.blocks {
            let moved = &rows.jacobian * rows.gather(p) + &rows.residual;
            rows.scatter(&rows.jacobian.tr_mul(&moved), &mut slope);
        }
        slope
    }

    /// The decrease of the model's sum of squares by step `p`.
    #[must_use]
    pub fn decrease(&self, p: &DVector<f64>) -> f64 {
        self.check(p.len());
        let of_block = |rows: &Rows| {
            let effect = &rows.jacobian * rows.gather(p);
            -(2.0 * effect.dot(&rows.residual) + effect.norm_squared())
        };
        self.blocks.iter().map(of_block).sum()
    }

    /// The largest cosine between the residuals and the column of any parameter that can move from `x` within its
    /// bounds.
    pub(super) fn largest_cosine(&self, x: &DVector<f64>, bounds: &[(f64, f64)]) -> f64 {
        let gradient = self.slope_at(&DVector::zeros(x.len()));
        let lengths = self.column_lengths(x.len()) * self.cost.sqrt();
        let entries = gradient.iter().zip(lengths.iter()).zip(x.iter()).zip(bounds);
        entries
            .filter(|(((g, _), x), bounds)| !held(**bounds, **x, **g))
            .map(|(((g, length), _), _)| if *length > 0.0 { g.abs() / length } else { 0.0 })
            .fold(0.0, f64::max)
    }

    /// The number of blocks that involve each of `n` parameters. A parameter that only one block involves can be
    /// eliminated there.
    pub(super) fn uses(&self, n: usize) -> Vec<usize> {
        self.check(n);
        let mut uses = vec![0_usize; n];
        for column in self.blocks.iter().flat_map(|rows| &rows.columns) {
            uses[*column] += 1;
        }
        uses
    }

    /// The length of the Jacobian's column for each of `n` parameters.
    #[must_use]
    pub fn column_lengths(&self, n: usize) -> DVector<f64> {
        self.check(n);
        let mut squares = DVector::zeros(n);
        for rows in &self.blocks {
            let lengths = rows.jacobian.column_iter().map(|column| column.norm_squared());
            let lengths = DVector::from_iterator(rows.columns.len(), lengths);
            rows.scatter(&lengths, &mut squares);
        }
        squares.map(f64::sqrt)
    }

    /// The standard deviation of each of `n` parameters if none of them is at a bound: sqrt(diag((J^T J)^-1) cost /
    /// dof), for independent residuals of equal variance. It is correct only at the minimum. `None` without degrees of
    /// freedom, or if the rows do not determine every parameter.
    #[must_use]
    pub fn standard_deviations(&self, n: usize, dof: usize) -> Option<DVector<f64>> {
        let lengths = self.column_lengths(n);
        let mut design = self.matrix(n);
        if dof == 0 || design.nrows() < n {
            return None;
        }
        // With columns of unit length, the condition number does not depend on the parameters' units.
        for (mut column, length) in design.column_iter_mut().zip(lengths.iter()) {
            column /= *length;
        }
        // (J^T J)^-1 = R^-1 R^-T, so the length of a row of R^-1 is the uncertainty of its parameter.
        let inverse = design.qr().r().solve_upper_triangular(&DMatrix::identity(n, n))?;
        let amplification = DVector::from_iterator(n, inverse.row_iter().map(|row| row.norm()));
        // The inverse of the distance of a column from the span of the others. Beyond this limit the distance is only
        // rounding error.
        if !amplification.iter().all(|a| *a < 0.1 / f64::EPSILON) {
            return None;
        }
        Some(amplification.component_div(&lengths) * (self.cost / count(dof)).sqrt())
    }

    /// All rows as a dense matrix over all `n` parameters.
    #[must_use]
    pub fn matrix(&self, n: usize) -> DMatrix<f64> {
        self.check(n);
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

/// A problem that consists of minimising a sum of squared residuals within bounds.
///
/// Problems need not be about reflectance. This one is an exponential decay y = a e^(-k t) with k at least 0:
///
/// ```
/// use brdfit::solver::{LeastSquares, Limits, Linearisation, Tolerances, minimise};
/// use nalgebra::{DMatrix, DVector};
///
/// struct Decay {
///     times: Vec<f64>,
///     measured: Vec<f64>,
/// }
///
/// impl LeastSquares for Decay {
///     fn linearise(&self, x: &DVector<f64>) -> Linearisation {
///         let (a, k) = (x[0], x[1]);
///         let n = self.times.len();
///         let shape = |i: usize| (-k * self.times[i]).exp();
///         let residual = DVector::from_fn(n, |i, _| a * shape(i) - self.measured[i]);
///         let jacobian = DMatrix::from_fn(n, 2, |i, column| match column {
///             0 => shape(i),
///             _ => -a * self.times[i] * shape(i),
///         });
///         Linearisation::dense(jacobian, residual)
///     }
///
///     fn bounds(&self) -> Vec<(f64, f64)> {
///         vec![(f64::NEG_INFINITY, f64::INFINITY), (0.0, f64::INFINITY)]
///     }
/// }
///
/// let times = vec![0.0, 1.0, 2.0, 3.0];
/// let measured = times.iter().map(|t| 5.0 * f64::exp(-0.7 * t)).collect();
/// let problem = Decay { times, measured };
/// let start = DVector::from_vec(vec![1.0, 0.1]);
/// let solution = minimise(&problem, start, Tolerances::default(), Limits::default())?;
///
/// assert!(solution.termination.converged());
/// assert!((solution.x[0] - 5.0).abs() < 1e-12 && (solution.x[1] - 0.7).abs() < 1e-12);
/// // Two degrees of freedom; without noise there is next to no deviation.
/// let deviations = solution.linearisation.standard_deviations(2, 2).unwrap();
/// assert!(deviations.max() < 1e-12);
/// # Ok::<(), brdfit::Error>(())
/// ```
pub trait LeastSquares {
    /// The sum of squares and its linear model at `x`, which lies within the bounds. If the cost or a row is not
    /// finite, the solver stays away from `x`. The derivatives must be those of the residuals, because for the last
    /// digits the solver trusts them more than the cost.
    fn linearise(&self, x: &DVector<f64>) -> Linearisation;

    /// The smallest and the largest value of each parameter; infinite if it has no bound.
    fn bounds(&self) -> Vec<(f64, f64)>;

    /// The cost below which only rounding errors are left.
    fn cost_floor(&self) -> f64 {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn standard_deviations_of_a_straight_line() {
        // y = a + b x: var b = s^2/Sxx and var a = s^2 (1/n + mean^2/Sxx), in any textbook on regression.
        let x = [1.0, 2.0, 4.0, 9.0];
        let residual = DVector::from_vec(vec![0.3, -0.2, 0.1, -0.4]);
        let jacobian = DMatrix::from_fn(4, 2, |i, column| if column == 0 { 1.0 } else { 1e6 * x[i] });
        let variance = residual.norm_squared() / 2.0;
        let (mean, sxx) = (4.0, 9.0 + 4.0 + 0.0 + 25.0);
        let found =
            Linearisation::dense(jacobian.clone(), residual.clone()).standard_deviations(2, 2).unwrap();
        assert_relative_eq!(found[0], (variance * (0.25 + mean * mean / sxx)).sqrt(), max_relative = 1e-14);
        assert_relative_eq!(found[1], (variance / sxx).sqrt() * 1e-6, max_relative = 1e-14);

        // Two equal columns, a column of zeros, and no degrees of freedom.
        let twice = DMatrix::from_columns(&[jacobian.column(1), jacobian.column(1)]);
        assert!(Linearisation::dense(twice, residual.clone()).standard_deviations(2, 2).is_none());
        let nothing = DMatrix::from_fn(4, 2, |i, column| if column == 0 { x[i] } else { 0.0 });
        assert!(Linearisation::dense(nothing, residual.clone()).standard_deviations(2, 2).is_none());
        assert!(Linearisation::dense(jacobian, residual).standard_deviations(2, 0).is_none());
    }
}
