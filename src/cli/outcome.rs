//! The result of a subcommand, and the exit codes.

use std::process::ExitCode;

/// Exit code if a fit is not usable, if some of several inputs failed, or if what was checked breaks physics.
const NOT_USABLE: u8 = 1;
/// Exit code for bad usage or bad input.
pub const BAD_INPUT: u8 = 2;

/// The result of a subcommand that ran without an error of its own.
pub enum Outcome {
    /// Everything succeeded.
    Good,
    /// A fit is not usable, some of several inputs failed, or what was checked breaks physics.
    NotUsable,
    /// All of several inputs failed; their errors have been printed.
    NothingDone,
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Good => Self::SUCCESS,
            Outcome::NotUsable => Self::from(NOT_USABLE),
            Outcome::NothingDone => Self::from(BAD_INPUT),
        }
    }
}
