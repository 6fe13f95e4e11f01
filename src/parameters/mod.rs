//! The parameters of an expression for given channels, and what a user wants of them.

mod order;
mod row;
mod selector;
mod settings;
mod table;

pub use row::{ParameterValue, Row, Status};
pub use selector::{Selector, Setting, Settings, channel_suffix};
pub use settings::{SettingTexts, ranges, values};
pub use table::{ParameterTable, Product};
pub(crate) use table::{differ, shapes_differ};
