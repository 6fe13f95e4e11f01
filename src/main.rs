//! The command line of `brdfit`.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
