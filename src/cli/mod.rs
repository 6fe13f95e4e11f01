//! Subcommands, one file each, and what they share.
//!
//! To add a subcommand: copy the file of the one most like it, and add one line to `subcommands!` below.

mod check;
mod cost;
mod evaluate;
mod fit;
mod heightfield;
mod info;
mod input;
mod kubelka_munk;
mod loss;
mod models;
mod output;
mod progress;
mod read_ahead;
mod select;
mod settings;
mod synth;
mod tradeoff;
mod trust;

use brdfit::Error;
use brdfit::report::{Report, table, warnings};
use clap::error::ErrorKind;
use clap::{CommandFactory as _, Parser, Subcommand};
use std::io::Write as _;
use std::process::ExitCode;

/// Exit code of a fit that is not usable, of several inputs some of which failed, or of what breaks physics.
const NOT_USABLE: u8 = 1;
/// Exit code of bad usage or bad input.
const BAD_INPUT: u8 = 2;

/// Fits analytic BRDF models to measured reflectance, and says how sure it is.
#[derive(Parser)]
#[command(name = "brdfit", version, allow_negative_numbers = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

/// What a subcommand ends with.
enum Outcome {
    /// All is well.
    Good,
    /// A fit is not usable, some inputs of several failed, or what was checked breaks physics.
    NotUsable,
    /// Every input of several failed; each has had its line.
    NothingDone,
}

/// Makes the set of subcommands from one line each: the module's `Arguments` and `run`.
macro_rules! subcommands {
    ($($(#[$doc:meta])* $name:ident: $module:ident),* $(,)?) => {
        #[derive(Subcommand)]
        enum Command { $(
            $(#[$doc])*
            #[command(allow_negative_numbers = true)]
            $name(Box<$module::Arguments>)
        ),* }

        fn run(command: &Command) -> Result<Outcome, Error> {
            match command { $(Command::$name(arguments) => $module::run(arguments)),* }
        }
    };
}

subcommands! {
    /// Fit models to measurements
    Fit: fit,
    /// Score given parameters, without a fit
    Evaluate: evaluate,
    /// List the models: parameters, bounds, units, references
    Models: models,
    /// Show what a file holds
    Info: info,
    /// Check that a model or a measurement obeys physics, and how well a model computes
    Check: check,
    /// Show what accuracy costs: models, approximations and numbers of samples
    Tradeoff: tradeoff,
    /// Choose the cheapest model that a scene cannot tell from the measurement
    Select: select,
    /// Make a synthetic measurement
    Synth: synth,
    /// Find a paint's absorption and scattering from reflectances over known backings
    KubelkaMunk: kubelka_munk,
}

/// Runs the command line; every message of the program is printed here or in a subcommand's own table.
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let names: Vec<String> =
                Arguments::command().get_subcommands().map(|c| c.get_name().to_owned()).collect();
            complain(&format!("expected a subcommand: {} (see brdfit --help)", names.join(", ")));
            return ExitCode::from(BAD_INPUT);
        }
        Err(error) if error.use_stderr() => {
            complain(&one_line(&error.to_string()));
            return ExitCode::from(BAD_INPUT);
        }
        Err(help) => {
            // Help and version, asked for; a closed pipe is nobody's error.
            let _ = write!(std::io::stdout(), "{help}");
            return ExitCode::SUCCESS;
        }
    };
    match run(&arguments.command) {
        Ok(Outcome::Good) => ExitCode::SUCCESS,
        Ok(Outcome::NotUsable) => ExitCode::from(NOT_USABLE),
        Ok(Outcome::NothingDone) => ExitCode::from(BAD_INPUT),
        Err(error) => {
            complain(&error.to_string());
            ExitCode::from(BAD_INPUT)
        }
    }
}

/// The message of an error.
fn complain(message: &str) {
    remark(&format!("error: {}", message.strip_prefix("error: ").unwrap_or(message)));
}

/// One line on standard error.
fn remark(message: &str) {
    // Where standard error is closed there is nobody to tell.
    let _ = writeln!(std::io::stderr(), "{}", message.replace(['\n', '\r'], " "));
}

/// Shows a report: the table, and the warnings on standard error, which say whose they are if there are
/// several reports.
fn show(report: &Report, as_table: bool, quiet: bool, one_of_several: bool) -> Result<(), Error> {
    if quiet {
        return Ok(());
    }
    if as_table {
        say(&table(report))?;
    }
    let whose =
        if one_of_several { format!("{}: {}: ", report.data.path, report.model) } else { String::new() };
    warnings(report).iter().for_each(|text| remark(&format!("warning: {whose}{text}")));
    Ok(())
}

/// Prints to standard output; a closed pipe (`brdfit models | head`) ends quietly.
fn say(text: &str) -> Result<(), Error> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::write("standard output".as_ref())(error))
        }
        _ => Ok(()),
    }
}

/// The parser's message without its usage and hints, in one line.
fn one_line(message: &str) -> String {
    let lines = message
        .lines()
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .map(str::trim)
        .filter(|line| !line.is_empty());
    let joined = lines.collect::<Vec<_>>().join(" ");
    if joined.contains("--help") { joined } else { format!("{joined} (see brdfit --help)") }
}
