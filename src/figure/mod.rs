//! Figures: what a measurement and its fits look like.
//!
//! A figure is first computed as plain data ([`FigureData`]: series with names and units), then drawn. Each kind is a file in `kinds/`
//! that computes it, and one line in [`KINDS`]; nothing in `draw/` knows about kinds.
//!
//! To add a kind: copy the file of the most similar one, and add one line to [`KINDS`], and its `mod`.

mod data;
mod draw;
mod in_plane;
mod kind;
mod kinds;
mod refit;
mod registry;
mod table;
mod text;

pub use data::{
    Axes, Axis, Body, Colour, Curves, Dash, FigureData, Look, Map, Mark, MarkForm, Marker, Panel, Picture,
    Scale, Series,
};
pub use draw::{Drawing, IN_THE_DARK, Run, Width, runs};
pub use kind::{Against, Kind, Needs, Several, Subject, Wanted, letter};
pub use kinds::front::of_tradeoff;
pub use registry::KINDS;
pub use text::{Piece, Text};
