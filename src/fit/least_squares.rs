//! What the solver needs to know of a problem.

use nalgebra::{DMatrix, DVector};

/// A sum of squares and its linear model at one point.
///
/// The matrix need not be the Jacobian itself: any matrix and vector with the same
/// `jacobian^T jacobian` and `jacobian^T residual` describe the same linear model, in particular the
/// triangular factor that a stream of samples is compressed to.
#[derive(Clone, Debug)]
pub struct Linearisation {
    /// The sum of squared residuals.
    pub cost: f64,
    /// d residual/d parameter, or a matrix equivalent to it.
    pub jacobian: DMatrix<f64>,
    /// The residuals, or the vector that goes with the matrix.
    pub residual: DVector<f64>,
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
