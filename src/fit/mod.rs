//! Fitting: the least-squares problem, the search for a start, the minimisation, and how far the result can be
//! trusted.

mod budget;
mod image;
mod options;
mod problem;
mod run;
mod search;
mod task;
mod verdict;

pub use crate::error::Suggestion;
#[doc(hidden)]
pub use budget::checked_target;
pub use budget::{fit_to_target, fit_within};
pub(crate) use image::fit_image;
pub use options::{Budget, HoldOut, Options, ScaleError, SigmaScale, Uncertainty};
pub use problem::loss::LossKind;
#[doc(hidden)]
pub use problem::loss::{LOSS_SCALES, Objective};
pub use problem::metric::Metric;
pub(crate) use problem::pixels::{Shown, Target};
#[doc(hidden)]
pub use problem::reflectance::ReflectanceProblem;
pub(crate) use run::held_out;
pub use run::{evaluate, fit};
pub use search::best_start::Start;
pub use verdict::bootstrap::Resampled;
pub use verdict::covariance::{Covariance, Grouping, Method};
#[doc(hidden)]
pub use verdict::errors::score;
pub use verdict::errors::{ErrorTable, Errors};
pub use verdict::fitted_parameter::{FittedParameter, NoStandardError, ParameterState};
pub use verdict::hold_out::{Fold, HeldOut};
pub use verdict::misfit::{Misfit, NoiseSource, Worst};
pub use verdict::profiled_interval::{OpenEnd, ProfiledInterval};
pub use verdict::result::{Fit, Selection};
pub use verdict::warning::{AtBound, NotSeparated, Saturated, Side, Unusable, Warning, WarningKind};
