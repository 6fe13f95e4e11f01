//! Options that say where a report goes.

use crate::cli::output::spares;
use brdfit::Error;
use clap::Args;
use std::path::{Path, PathBuf};

/// `SEVERAL` where a command takes several inputs, which may have a report each.
pub const SEVERAL_INPUTS: bool = true;

/// Where the report goes.
#[derive(Args)]
pub struct ReportArguments<const SEVERAL: bool = false> {
    #[arg(short, long, value_name = "OUT", help = output_help(SEVERAL))]
    output: Option<PathBuf>,
    /// Print JSON instead of the table
    #[arg(long)]
    json: bool,
    /// Print neither table nor warnings nor progress
    #[arg(short, long)]
    quiet: bool,
}

/// The help of `-o`.
fn output_help(several: bool) -> &'static str {
    if several {
        "Write the JSON report to this file as well ('-': standard output; a folder: one file per input)"
    } else {
        "Write the JSON report to this file as well ('-': standard output)"
    }
}

impl<const SEVERAL: bool> ReportArguments<SEVERAL> {
    /// Whether JSON goes to standard output, alone.
    pub fn json_alone(&self) -> bool {
        self.json || self.output.as_deref() == Some(Path::new("-"))
    }

    /// Whether nothing but the result is wanted.
    pub fn quiet(&self) -> bool {
        self.quiet
    }

    /// Refuses to replace a measurement by its report.
    pub fn check_inputs(&self, inputs: &[PathBuf]) -> Result<(), Error> {
        spares(inputs, "-o", self.file())
    }

    /// The file to write.
    pub fn file(&self) -> Option<&Path> {
        self.output.as_deref().filter(|path| *path != Path::new("-"))
    }
}
