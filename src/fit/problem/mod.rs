//! What a fit minimises: residuals between a model and samples, or an image, and their derivatives.

pub(super) mod formula;
pub(super) mod kernels;
pub(super) mod loss;
pub(super) mod metric;
pub(super) mod observed;
pub(super) mod pixels;
pub(super) mod reflectance;
