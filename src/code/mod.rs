//! Models as source text in other languages, for shaders, scripts and plugins.
//!
//! Nothing here knows a formula. A [`Program`] is what an expression did to [recorded](crate::math) numbers, step by step; a
//! [`Language`] says how steps are spelled, and what stands around them.
//!
//! To add a language: copy the file of the most similar one, and add one line to [`LANGUAGES`].

mod body;
mod language;
mod languages;
mod program;
mod registry;
mod spelling;

pub(crate) use body::Body;
pub use language::Language;
pub(crate) use languages::text::{comment, flat as python_rows, statements};
pub use program::{Argument, Arguments, NotWritten, Program};
pub use registry::{LANGUAGES, named};
pub(crate) use spelling::{Level, Spelling, axis, double, element, field, ternary};
