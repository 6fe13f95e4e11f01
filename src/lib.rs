//! Fits analytic BRDF models to measured reflectance, and says how sure it is.
#![cfg_attr(test, allow(clippy::float_cmp))]

pub mod drawdown;
pub mod error;
pub mod fit;
pub mod geometry;
pub mod health;
pub mod image;
pub mod math;
pub mod measurement;
pub mod model;
pub mod parameters;
pub mod progress;
pub mod report;
pub mod scene;
pub mod select;
pub mod solver;
pub mod synthetic;
pub mod tradeoff;

pub use error::Error;
