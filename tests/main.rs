//! Every integration test, in one program: twenty would each link the whole library. What it is about stands in the head of
//! each module.

// A broken expectation fails its test, which is what a panic is for here; indices are checked by tests.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

mod albedos;
mod calibration;
#[cfg(feature = "cli")]
mod cli;
mod coarse_to_fine;
mod common;
mod correlated;
mod derivatives;
mod doctor;
#[cfg(feature = "cli")]
mod doubt;
mod extremes;
#[cfg(feature = "plot")]
mod figure;
mod formats;
mod health;
mod heightfield;
mod held;
#[cfg(feature = "images")]
mod image;
mod misfit;
mod missing;
mod models;
mod nesting;
mod nist;
mod noise;
mod oracles;
mod physics;
mod profile;
mod properties;
mod recovery;
mod reference;
mod rgl;
#[cfg(feature = "images")]
mod scene;
mod ssdd;
#[cfg(feature = "cli")]
mod trust;
mod utia;
mod zemax;
