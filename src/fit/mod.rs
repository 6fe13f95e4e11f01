//! Fitting: the least-squares problem, where its minimisation starts, and what can be trusted.

mod bootstrap;
mod budget;
mod errors;
mod hold_out;
mod image;
mod judge;
mod options;
mod problem;
mod run;
mod search;
mod task;
mod uncertainty;
mod warnings;

pub use bootstrap::Resampled;
pub use budget::{checked_target, fit_to_target, fit_within};
pub use errors::{ErrorTable, Errors, score};
pub use hold_out::{HeldOut, checked_fraction};
pub(crate) use image::fit_image;
pub use judge::Selection;
pub use options::{Budget, Options, Uncertainty};
pub use problem::loss::{LossKind, Objective};
pub use problem::metric::Metric;
pub(crate) use problem::pixels::{Shown, Target};
pub use problem::reflectance::ReflectanceProblem;
pub use run::{Fit, evaluate, fit};
pub use search::best_start::Start;
pub use uncertainty::{Covariance, Method};
pub use warnings::Warning;
