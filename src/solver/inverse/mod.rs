//! The inverse of J^T J at the minimum, and the directions that the rows do not determine.

pub(crate) mod arrow;
pub(crate) mod block_matrix;
pub(crate) mod curvature;
pub(crate) mod group_sums;
pub(crate) mod jackknife;
mod lanczos;
pub(super) mod svd;
