//! The problems that a fit minimises: residuals between a model and samples, or an image, with their derivatives.

// Lengths are checked once, at the head of a function: a wrong index is a mistake in the code, and must not pass for a
// number.
#![allow(clippy::indexing_slicing)]

pub(super) mod formula;
pub(super) mod kernels;
pub(super) mod loss;
pub(super) mod metric;
pub(super) mod observed;
pub(super) mod pixels;
pub(super) mod reflectance;
