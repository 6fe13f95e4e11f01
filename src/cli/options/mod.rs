//! Groups of options: those that several subcommands share, and large groups of a single one.

pub mod channels;
pub mod code;
pub mod fitting;
pub mod heightfield;
pub mod input;
pub mod loss;
pub mod model;
pub mod recorded;
pub mod report;
pub mod settings;
pub mod threads;
