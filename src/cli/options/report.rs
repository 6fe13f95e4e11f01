//! Options that say where a report goes.

use crate::cli::output::spares;
use brdfit::Error;
use clap::Args;
use std::path::{Path, PathBuf};

/// Where the report goes.
#[derive(Args)]
pub struct ReportArguments {
    /// Write the JSON report here too; '-' for standard output, a folder for one file per input
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// JSON on standard output instead of the table
    #[arg(long)]
    json: bool,
    /// No table, no progress
    #[arg(short, long)]
    quiet: bool,
}

impl ReportArguments {
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
