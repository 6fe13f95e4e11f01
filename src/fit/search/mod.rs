//! Where a fit starts, and how it gets near the minimum on a part of the samples.

pub(super) mod absent_lobes;
pub(super) mod best_start;
mod coarse_to_fine;
mod polish;
mod recombine;
pub(super) mod scan;
