//! Fits analytic BRDF models to measured reflectance, and says how sure it is.
#![cfg_attr(test, allow(clippy::float_cmp))]

pub mod error;
pub mod geometry;
pub mod math;
pub mod measurement;
pub mod model;

pub use error::Error;
