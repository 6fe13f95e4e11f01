//! Fits as renderers' own material files.
//!
//! Every [`Target`] lists the forms that it can hold: expressions whose formula is the renderer's own, each with a function that writes
//! it. A fit of one of them is exported exactly. Any other fit is made again in the target's [`Target::own`] form. Source
//! [code](crate::code) holds every model.
//!
//! To add a target: copy the file of the most similar one, and add one line to [`TARGETS`].

mod blender;
mod code;
mod gltf;
mod materialx;
mod mitsuba;
mod mitsuba_plugin;
mod pbrt;
mod radiance;
mod record;
mod registry;
mod sphere;
mod target;
mod usd;
mod values;

pub use record::{Agreement, ExportRecord, ModelError, SCHEMA};
pub use registry::{TARGETS, named};
pub use target::{Holds, Target, Written};
pub use values::{About, NotHeld, Values};
