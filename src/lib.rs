//! Fits analytic BRDF models to measured reflectance, and says how well each parameter is known.
//!
//! A [`Measurement`] comes from arrays or from a file, an [`Expression`] says which model to fit, and [`Fit::of`] fits it: the
//! [`Fit`] holds every parameter with its standard error, the errors of the model in six metrics, why the fit stopped, and
//! warnings about what not to trust.
//!
//! # From arrays
//!
//! A measurement of one channel, with directions in degrees and values in 1/sr:
//!
//! ```
//! use brdfit::{Directions, Error, Expression, Fit, Measurement};
//!
//! fn main() -> Result<(), Error> {
//!     // theta_i, phi_i, theta_o, phi_o: a scan in the plane of incidence, at three angles of incidence.
//!     let angles = [10.0, 30.0, 50.0].into_iter().flat_map(|i| (-7..=7).map(move |o| [i, 0.0, 10.0 * f64::from(o), 0.0]));
//!     let directions = Directions::from_degrees(angles)?;
//!     # let noise = (0..directions.len()).map(|k| 1.0 + 0.01 * ((k * 7 % 11) as f64 - 5.0) / 3.0);
//!     # let truth = brdfit::Brdf::new(&"oren-nayar".parse()?, &["grey"], &[("albedo", 0.4), ("sigma", 20.0)])?;
//!     # let values = truth.values(&directions).concat().into_iter().zip(noise).map(|(f, noise)| f * noise).collect();
//!     // `values` is a Vec<f64> with one entry per pair of directions.
//!     let measurement = Measurement::new(directions, [("grey", values)])?;
//!     let model: Expression = "oren-nayar".parse()?;
//!     let fit = Fit::of(&model, &measurement).run()?;
//!     for parameter in fit.parameters() {
//!         println!("{parameter}"); // oren-nayar.sigma = 20.05 +/- 0.29
//!     }
//!     # let sigma = fit.parameter("sigma")?;
//!     # assert!((sigma.value - 20.0).abs() < 4.0 * sigma.std_error.unwrap() && sigma.std_error.unwrap() < 1.0);
//!     # assert!(fit.is_usable());
//!     Ok(())
//! }
//! ```
//!
//! # From a file
//!
//! MERL tables, text tables of the Cornell gonioreflectometer and CSV are recognised by their content. Two lobes are fitted, one
//! parameter is fixed, a fifth of the angles of incidence is held out to judge the model by, and the report is what the
//! command line writes:
//!
//! ```
//! use brdfit::{Error, Expression, Fit, HoldOut, Measurement, Metric};
//!
//! fn main() -> Result<(), Error> {
//!     # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/satin-red-paint.csv");
//!     # let _ = r#"
//!     let path = "satin-red-paint.csv";
//!     # "#;
//!     let measurement = Measurement::read(path)?;
//!     let model: Expression = "lambert + cook-torrance(d=ggx)".parse()?;
//!     let (fit, report) = Fit::of(&model, &measurement)
//!         .metric(Metric::UnbiasedCbrt)
//!         .fix("f0", 0.05)?
//!         .hold_out(HoldOut::fraction(0.2)?)
//!         .run_with_report()?;
//!
//!     let roughness = fit.parameter("m")?;
//!     println!("{roughness}"); // cook-torrance.m = 0.18014 +/- 0.00013
//!     println!("error on angles that were not fitted: {:?}", fit.held_out.map(|held_out| held_out.errors.cbrt));
//!     println!("{}", report.to_json()?);
//!     # assert!((roughness.value - 0.18).abs() < 0.002 && roughness.std_error.is_some());
//!     Ok(())
//! }
//! ```
//!
//! # The types that matter
//!
//! | | |
//! |---|---|
//! | [`Measurement`] | measured reflectance: [`Directions`], and values per [`Channel`] |
//! | [`Expression`] | a sum of models, such as `lambert + cook-torrance(d=beckmann)` |
//! | [`Fit`] | the result; [`Fit::of`] begins a [`FitBuilder`], on which everything about a fit is set |
//! | [`FittedParameter`] | a value with its standard error, or with the reason why it has none |
//! | [`Brdf`] | a model at given values, to be evaluated at any directions; [`Fit::brdf`] is the one found |
//! | [`Report`] | everything about a fit as the command line writes it |
//! | [`Error`] | what can go wrong, one line each |
//!
//! A fit that should not be trusted is not an error: [`Fit::is_usable`] and [`Fit::warnings`] tell. Nothing here prints, exits, or
//! panics on data. [`Options`] is the plain form of what the builder sets, for [`fit::fit`]. The [`solver`] is of use by itself,
//! for any least-squares problem within bounds. Which models there are: `brdfit models`, or [`model::REGISTRY`].
//!
//! # Features
//!
//! `cli`, on by default, makes the program and turns on `images`, `plot` and `solvers`. A library user needs none of them:
//!
//! ```toml
//! brdfit = { version = "0.1", default-features = false }
//! ```
//!
//! | feature | what it adds |
//! |---|---|
//! | `cli` | the program `brdfit` |
//! | `images` | images as EXR and PNG, environment maps in scenes |
//! | `page` | reports as web pages with figures; turns on `plot` |
//! | `plot` | figures as SVG and PNG; turns on `images` |
//! | `solvers` | L-BFGS, Nelder-Mead and a particle swarm beside Levenberg-Marquardt |
#![cfg_attr(test, allow(clippy::float_cmp))]

mod brdf;
mod builder;
pub mod doctor;
pub mod error;
pub mod fit;
pub mod geometry;
pub mod measurement;
pub mod model;
pub mod parameters;
pub mod progress;
pub mod report;
pub mod solver;
pub mod synthetic;

// What the program, the tests and the benchmarks are made of besides. Not an interface: it changes without notice.
#[doc(hidden)]
pub mod code;
#[doc(hidden)]
pub mod drawdown;
#[doc(hidden)]
pub mod export;
#[cfg(feature = "plot")]
#[doc(hidden)]
pub mod figure;
#[doc(hidden)]
pub mod health;
#[doc(hidden)]
pub mod image;
#[doc(hidden)]
pub mod lines;
#[doc(hidden)]
pub mod math;
#[cfg(feature = "page")]
#[doc(hidden)]
pub mod page;
#[doc(hidden)]
pub mod scene;
#[doc(hidden)]
pub mod select;
#[doc(hidden)]
pub mod tradeoff;

pub use brdf::Brdf;
pub use builder::FitBuilder;
pub use error::Error;
pub use fit::{Fit, FittedParameter, HoldOut, LossKind, Metric, Options, Warning};
pub use geometry::Directions;
pub use measurement::{Channel, Filters, Measurement, Weighting};
pub use model::Expression;
pub use report::Report;

/// Vectors of [`geometry`], of the version that this crate is built with.
pub use glam;
/// Matrices of the [`solver`], of the version that this crate is built with.
pub use nalgebra;

/// The example in the README is compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
