//! What a subcommand ends with, and the exit codes.

use std::process::ExitCode;

/// Exit code of a fit that is not usable, of several inputs some of which failed, or of what breaks physics.
const NOT_USABLE: u8 = 1;
/// Exit code of bad usage or bad input.
pub const BAD_INPUT: u8 = 2;

/// What a subcommand ends with.
pub enum Outcome {
    /// All is well.
    Good,
    /// A fit is not usable, some inputs of several failed, or what was checked breaks physics.
    NotUsable,
    /// Every input of several failed; each has had its line.
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
