//! Drawing: figures as SVG and PNG.

mod cartesian;
mod curves;
mod legend;
mod map;
mod page;
mod polar;
mod scale;
mod style;
mod svg;
mod typeset;

pub use page::{Drawing, Width};
pub use style::IN_THE_DARK;
pub use typeset::{Run, runs};
