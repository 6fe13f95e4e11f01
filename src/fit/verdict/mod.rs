//! What follows from the parameters found: errors, covariance, criteria and warnings.

// Lengths are checked once, at the head of a function: a wrong index is a mistake in the code, and must not pass for a
// number.
#![allow(clippy::indexing_slicing)]

mod bias;
pub(super) mod bootstrap;
pub(super) mod covariance;
pub(super) mod errors;
pub(super) mod fitted_parameter;
pub(super) mod hold_out;
mod judge;
pub(super) mod misfit;
pub(super) mod profile;
pub(super) mod profiled_interval;
mod refits;
pub(super) mod result;
mod saturation;
mod unresolved;
pub(super) mod warning;
mod warnings;
