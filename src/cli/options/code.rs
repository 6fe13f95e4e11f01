//! How models are written as code.

use brdfit::Error;
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

/// That a model cannot take its parameters as arguments.
pub fn not_arguments(reason: &impl ToString) -> Error {
    let found = format!("{}; use --parameters fixed", reason.to_string());
    Error::invalid("--parameters free", "a model whose parameters can be arguments", found)
}
