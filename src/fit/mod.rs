//! Fitting: the least-squares problem, where its minimisation starts, and what can be trusted.

mod absent;
mod bootstrap;
mod budget;
mod coarse;
mod coarse_to_fine;
mod errors;
mod formula;
mod hold_out;
mod judge;
mod kernels;
mod loss;
mod metric;
mod observed;
mod pixels;
mod problem;
mod recombine;
mod run;
mod search;
mod uncertainty;
mod warnings;

pub use bootstrap::{Resampled, Uncertainty};
pub use budget::{Budget, checked_target, fit_to_target, fit_within};
pub use errors::{ErrorTable, Errors, score};
pub use hold_out::{HeldOut, checked_fraction};
pub use judge::Selection;
pub use loss::{LossKind, Objective};
pub use metric::Metric;
pub(crate) use pixels::{Shown, Target, fit_image};
pub use problem::ReflectanceProblem;
pub use run::{Fit, Options, evaluate, fit};
pub use search::Start;
pub use uncertainty::{Covariance, Method};
pub use warnings::Warning;
