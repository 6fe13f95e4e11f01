//! Nonlinear least squares within bounds, for any problem.
//!
//! A problem computes its sum of squares and its linear model at a point ([`LeastSquares`], with an example), and
//! [`minimise`] searches for the minimum by the method of Levenberg and Marquardt. The rows of the Jacobian come in
//! blocks, and parameters that only one block involves are eliminated there, so that problems with many channels stay
//! cheap.

// Lengths are checked once, at the head of a function: a wrong index is a mistake in the code, and must not pass for a
// number.
#![allow(clippy::indexing_slicing)]

#[cfg(feature = "solvers")]
mod argmin_solvers;
pub(crate) mod bounded_step;
mod chosen;
pub(crate) mod corrected;
pub(crate) mod extrapolation;
pub(crate) mod in_parts;
pub(crate) mod inverse;
mod least_squares;
mod levenberg_marquardt;
pub(crate) mod remembered;
mod termination;
#[cfg(test)]
mod test_problems;
pub(crate) mod triangle;

pub use chosen::{SolverKind, minimise_with};
pub use least_squares::{LeastSquares, Linearisation, Rows};
pub use levenberg_marquardt::{LevenbergMarquardt, minimise};
pub use termination::{Limits, Observer, Solution, StopSignal, Termination, Tolerances};
