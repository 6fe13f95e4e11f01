//! `brdfit man`: writes manual pages, one for the program and one for each subcommand.

use crate::cli::outcome::Outcome;
use crate::cli::output::Output;
use brdfit::Error;
use clap::{Args, Command};
use clap_mangen::Man;
use std::path::PathBuf;

/// Arguments of `brdfit man`.
#[derive(Args)]
pub struct Arguments {
    /// Write into this folder, which is made if it is missing: brdfit.1, brdfit-fit.1 and so on
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Runs the subcommand: describes the `whole` command line.
pub fn run(arguments: &Arguments, whole: Command) -> Result<Outcome, Error> {
    let folder = &arguments.folder;
    std::fs::create_dir_all(folder).map_err(Error::write(folder))?;
    let mut whole = whole.disable_help_subcommand(true);
    // Gives the subcommands their full names.
    whole.build();
    let subcommands: Vec<Command> = whole.get_subcommands().cloned().collect();
    for command in subcommands.into_iter().chain([whole]) {
        let man = Man::new(command);
        let path = folder.join(man.get_filename());
        let output = Output::open(&path)?;
        let mut page = Vec::new();
        man.render(&mut page).map_err(Error::write(&path))?;
        output.commit(&page)?;
    }
    Ok(Outcome::Good)
}
