//! Options that say where and how a report is written.

use crate::cli::output::spares;
use brdfit::Error;
use clap::Args;
use std::path::{Path, PathBuf};

/// Value of `SEVERAL` for a command with several inputs, each of which can have a report file of its own.
pub const SEVERAL_INPUTS: bool = true;

/// Where and how the report is written.
#[derive(Args)]
pub struct ReportArguments<const SEVERAL: bool = false> {
    #[arg(short, long, value_name = "OUT", help = output_help(SEVERAL))]
    output: Option<PathBuf>,
    /// Print JSON instead of the table
    #[arg(long)]
    json: bool,
    #[arg(short, long, help = quiet_help(SEVERAL))]
    quiet: bool,
}

/// The help text of `-o`.
fn output_help(several: bool) -> &'static str {
    if several {
        "Write the JSON report to this file as well ('-': standard output; a folder: one file per input)"
    } else {
        "Write the JSON report to this file as well ('-': standard output)"
    }
}

/// The help text of `-q`.
fn quiet_help(several: bool) -> &'static str {
    if several {
        "Print neither tables nor warnings nor progress, only how several models rank"
    } else {
        "Print neither table nor warnings nor progress"
    }
}

impl<const SEVERAL: bool> ReportArguments<SEVERAL> {
    /// Whether standard output gets JSON instead of the table.
    pub fn json_alone(&self) -> bool {
        self.json || self.output.as_deref() == Some(Path::new("-"))
    }

    /// Whether tables, warnings and progress are suppressed.
    pub fn quiet(&self) -> bool {
        self.quiet
    }

    /// Fails if the report would overwrite one of the inputs.
    pub fn check_inputs(&self, inputs: &[PathBuf]) -> Result<(), Error> {
        spares(inputs, "-o", self.file())
    }

    /// The file or folder to write to. `None` if `-o` is absent.
    pub fn file(&self) -> Option<&Path> {
        self.output.as_deref().filter(|path| *path != Path::new("-"))
    }
}
