//! `brdfit completions`: writes a script with which a shell completes subcommands and options.

use crate::cli::messages::emit;
use crate::cli::outcome::Outcome;
use brdfit::Error;
use clap::{Args, Command};
use clap_complete::{Shell, generate};

/// Arguments of `brdfit completions`.
#[derive(Args)]
pub struct Arguments {
    /// Write for this shell, to standard output
    #[arg(value_name = "SHELL", value_enum)]
    shell: Shell,
}

/// Runs the subcommand: describes the `whole` command line to the shell.
pub fn run(arguments: &Arguments, mut whole: Command) -> Result<Outcome, Error> {
    let name = whole.get_name().to_owned();
    let mut script = Vec::new();
    generate(arguments.shell, &mut whole, name, &mut script);
    emit(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Good)
}
