//! The inverse of J^T J at the minimum, and the directions that the rows do not determine.

pub(crate) mod arrow;
pub(crate) mod block_matrix;
mod lanczos;
pub(super) mod svd;
