//! Options that several subcommands share, and those of one that belong together.

pub mod channels;
pub mod fitting;
pub mod heightfield;
pub mod input;
pub mod loss;
pub mod report;
pub mod settings;
pub mod threads;
