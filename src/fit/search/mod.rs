//! The search for a start of the fit, and the approach to the minimum on a part of the samples.

// Lengths are checked once, at the head of a function: a wrong index is a mistake in the code, and must not pass for a
// number.
#![allow(clippy::indexing_slicing)]

pub(super) mod absent_lobes;
pub(super) mod best_start;
mod coarse_to_fine;
mod polish;
mod recombine;
pub(super) mod scan;
mod smaller_sums;
