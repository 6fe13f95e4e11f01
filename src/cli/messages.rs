//! Printing messages, reports and tables.

use super::terminal::{Terminal, write_shown};
use brdfit::Error;
use brdfit::error::OptionName;
use brdfit::fit::WarningKind;
use brdfit::lines::Lines;
use brdfit::measurement::Doubt;
use brdfit::report::{Report, WarningRecord, lines};
use std::io::{self, Write as _};

/// The message of an error, with options spelled as on the command line.
pub fn message(error: &Error) -> String {
    error.message(typed)
}

/// An option as it is typed, such as `--hold-out`.
pub fn typed(option: OptionName) -> String {
    format!("--{option}")
}

/// A doubt, and the options that would read the file otherwise.
pub fn doubted(doubt: &Doubt) -> String {
    let option =
        |(option, value): (OptionName, String)| format!("{} {value}", typed(option)).trim_end().to_owned();
    let options: Vec<String> = doubt.suggestions().into_iter().map(option).collect();
    if options.is_empty() { doubt.to_string() } else { format!("{doubt} ({})", options.join(" or ")) }
}

/// Prints the message of an error.
pub fn complain(message: &str) {
    remark(&format!("error: {}", message.strip_prefix("error: ").unwrap_or(message)));
}

/// Prints one line on standard error, several on a terminal that is narrower.
pub fn remark(message: &str) {
    let shown = Terminal::error().message(&message.replace(['\n', '\r'], " "));
    // If standard error is closed, the message is lost.
    let _ = write_shown(io::stderr(), &shown);
}

/// The place of a report among those that are printed.
#[derive(Clone, Copy)]
pub enum Among {
    /// It is the only one.
    Alone,
    /// It is the first one about its input: warnings name input and model.
    First,
    /// Warnings about how its input was read were printed with the first one.
    Further,
}

/// Prints a report: the table, and the warnings on standard error.
pub fn show(report: &Report, as_table: bool, quiet: bool, among: Among) -> Result<(), Error> {
    if quiet {
        return Ok(());
    }
    if as_table {
        say(&lines(report))?;
    }
    for warning in &report.warnings {
        let of_reading = warning.kind.known().is_some_and(WarningKind::is_of_reading);
        let whose = match among {
            Among::Alone => String::new(),
            Among::Further if of_reading => continue,
            Among::First if of_reading => format!("{}: ", report.data.path),
            Among::First | Among::Further => format!("{}: {}: ", report.data.path, report.model),
        };
        remark(&format!("warning: {whose}{warning}{}", hint(warning)));
    }
    Ok(())
}

/// The options that a warning suggests, as they are typed, such as ` (--fix cook-torrance.m=V)`.
fn hint(warning: &WarningRecord) -> String {
    let options = warning.options(typed);
    if options.is_empty() { String::new() } else { format!(" ({})", options.join(", ")) }
}

/// Prints text for people to standard output: folded and with colour if that is a terminal. A closed pipe
/// (`brdfit models | head`) ends quietly.
pub fn say(text: &Lines) -> Result<(), Error> {
    printed(write_shown(io::stdout(), &Terminal::output().shown(text)))
}

/// Prints data for programs, such as JSON and CSV, to standard output as they are. A closed pipe ends quietly.
pub fn emit(text: &str) -> Result<(), Error> {
    let mut stdout = io::stdout().lock();
    printed(stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()))
}

/// What became of printing to standard output.
fn printed(result: io::Result<()>) -> Result<(), Error> {
    match result {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::write("standard output".as_ref())(error))
        }
        _ => Ok(()),
    }
}
