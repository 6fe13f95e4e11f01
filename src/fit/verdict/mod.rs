//! What follows from the parameters found: errors, their covariance, criteria, and what the user should know.

pub(super) mod bootstrap;
pub(super) mod covariance;
pub(super) mod errors;
pub(super) mod hold_out;
mod judge;
pub(super) mod result;
pub(super) mod warning;
mod warnings;
