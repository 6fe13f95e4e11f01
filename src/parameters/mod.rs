//! The parameters of an expression for given channels, and the user's constraints on them.

// Lengths are checked once, at the head of a function: a wrong index is a mistake in the code and must not go
// unnoticed. What users write is read by `selector` and `settings`, which never index.
#![allow(clippy::indexing_slicing)]

mod absence;
mod constraints;
mod dead_channels;
pub(crate) mod in_expression;
mod order;
mod row;
mod selector;
mod settings;
mod table;

pub(crate) use absence::Smaller;
pub use constraints::applies;
pub(crate) use constraints::written_inside;
pub use row::{ParameterRow, ParameterValue, Status};
pub use selector::{Selector, Setting, Settings, channel_suffix};
pub use settings::{SettingTexts, ranges, values};
pub use table::ParameterTable;
#[doc(hidden)]
pub use table::Product;
pub(crate) use table::{differ, shapes_differ};
