//! How models are written as code.

use brdfit::code::Arguments;
use clap::ValueEnum;

/// What becomes of a model's parameters in code.
#[derive(Clone, Copy, ValueEnum)]
pub enum CodeParameters {
    /// Written into the code
    Fixed,
    /// Arguments of the function
    Free,
}

impl From<CodeParameters> for Arguments {
    fn from(parameters: CodeParameters) -> Self {
        match parameters {
            CodeParameters::Fixed => Self::Fixed,
            CodeParameters::Free => Self::Free,
        }
    }
}
