//! The command line: `commands`, one file per subcommand, and what they share.

mod commands;
mod messages;
mod options;
mod outcome;
mod output;
mod progress;
mod terminal;

use clap::error::ErrorKind;
use clap::{CommandFactory as _, FromArgMatches as _, Parser};
use commands::{Command, run};
use messages::{complain, message};
use outcome::BAD_INPUT;
use std::process::ExitCode;
use terminal::Terminal;

/// Help is wrapped at this width at most: longer lines are hard to read.
const WIDEST_HELP: usize = 100;

/// Fits analytic BRDF models to measured reflectance, and says how sure it is.
#[derive(Parser)]
#[command(name = "brdfit", version, allow_negative_numbers = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

/// Runs the program. Errors that end it are printed here.
pub fn main() -> ExitCode {
    let words: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    if let Some(model) = unquoted_sum(&words) {
        complain(&format!(
            "-m: expected one model, found several words: put it in quotes, as in -m '{model}'"
        ));
        return ExitCode::from(BAD_INPUT);
    }
    let arguments = match parse() {
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
            // The user requested help or the version; a closed pipe is not an error.
            let _ = help.print();
            return ExitCode::SUCCESS;
        }
    };
    match run(&arguments.command, Arguments::command) {
        Ok(outcome) => outcome.into(),
        Err(error) => {
            complain(&message(&error));
            ExitCode::from(BAD_INPUT)
        }
    }
}

/// Parses the command line. Help is wrapped at the width of the terminal; a pipe gets it as it is.
fn parse() -> Result<Arguments, clap::Error> {
    // For clap 0 is no width at all.
    let width = Terminal::output().width().map_or(0, |width| width.min(WIDEST_HELP));
    let matches = Arguments::command().term_width(width).try_get_matches()?;
    Arguments::from_arg_matches(&matches)
}

/// The sum of models that follows `-m` without quotes, such as `-m lambert + cook-torrance`; `None` if there is none.
fn unquoted_sum(words: &[String]) -> Option<String> {
    let first = words.iter().position(|word| word == "-m" || word == "--model")? + 1;
    let words = words.get(first..)?;
    let mut end = 1;
    while words.get(end).is_some_and(|word| word == "+") {
        end += 2;
    }
    let is_sum = end > 1 && words.len() >= end;
    is_sum.then(|| words.iter().take(end).map(String::as_str).collect::<Vec<_>>().join(" "))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Names of options occur once per subcommand, defaults are values that are accepted, and more that clap tests.
    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}
