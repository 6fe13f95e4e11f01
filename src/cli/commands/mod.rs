//! Subcommands, one file each.
//!
//! To add a subcommand: copy the file of the one most like it, and add its `mod` and one line to `subcommands!` below.

mod check;
mod completions;
mod convert;
mod evaluate;
mod export;
mod fit;
mod fit_outputs;
mod info;
mod kubelka_munk;
mod man;
mod models;
mod plot;
mod read_ahead;
mod render;
mod report;
mod select;
mod synth;
mod tradeoff;

use crate::cli::outcome::Outcome;
use brdfit::Error;
use clap::Subcommand;

/// Makes the set of subcommands from one line each: the module's `Arguments` and `run`. The `run` of those that describe the
/// whole command line gets it as well.
macro_rules! subcommands {
    ($whole:ident; $($(#[$doc:meta])* $name:ident: $module:ident $(of $all:ident)?),* $(,)?) => {
        // No doc comment here: clap would take it for the program's.
        #[derive(Subcommand)]
        pub enum Command { $(
            $(#[$doc])*
            #[command(allow_negative_numbers = true)]
            $name(Box<$module::Arguments>)
        ),* }

        /// Runs a subcommand of the `whole` command line.
        pub fn run(command: &Command, $whole: fn() -> clap::Command) -> Result<Outcome, Error> {
            match command { $(Command::$name(arguments) => $module::run(arguments $(, $all())?)),* }
        }
    };
}

subcommands! {
    whole;
    /// Fit models to measurements
    Fit: fit,
    /// Evaluate a model at given parameters and report its errors
    Evaluate: evaluate,
    /// Write a fit as a renderer's material
    Export: export,
    /// List the models with their parameters, bounds, units and references
    Models: models,
    /// Show what a measurement file contains
    Info: info,
    /// Write a measurement or a fit in another format, or its values at given directions
    Convert: convert,
    /// Check that a model or a measurement obeys physics, and how many digits a model keeps
    Check: check,
    /// Show what accuracy costs: models, approximations and numbers of samples
    Tradeoff: tradeoff,
    /// Render a measurement, and a fit beside it
    Render: render,
    /// Draw a figure of a measurement and its fits for a publication
    Plot: plot,
    /// Make a web page about fits, with every figure in it
    Report: report,
    /// Find the cheapest model that a scene cannot tell from the measurement
    Select: select,
    /// Make a synthetic measurement
    Synth: synth,
    /// Find a paint's absorption and scattering from reflectances over known backings
    KubelkaMunk: kubelka_munk,
    /// Write a script that completes commands in a shell
    Completions: completions of whole,
    /// Write manual pages
    Man: man of whole,
}
