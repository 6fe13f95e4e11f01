//! Printing messages, reports and tables.

use brdfit::Error;
use brdfit::error::OptionName;
use brdfit::report::{Report, WarningRecord, table};
use std::io::Write as _;

/// The message of an error, with options spelled as on the command line.
pub fn message(error: &Error) -> String {
    error.message(typed)
}

/// An option as it is typed, such as `--hold-out`.
pub fn typed(option: OptionName) -> String {
    format!("--{option}")
}

/// Prints the message of an error.
pub fn complain(message: &str) {
    remark(&format!("error: {}", message.strip_prefix("error: ").unwrap_or(message)));
}

/// Prints one line on standard error.
pub fn remark(message: &str) {
    // If standard error is closed, the message is lost.
    let _ = writeln!(std::io::stderr(), "{}", message.replace(['\n', '\r'], " "));
}

/// Prints a report: the table, and the warnings on standard error. With `one_of_several` reports each warning names
/// its input and model.
pub fn show(report: &Report, as_table: bool, quiet: bool, one_of_several: bool) -> Result<(), Error> {
    if quiet {
        return Ok(());
    }
    if as_table {
        say(&table(report))?;
    }
    let whose =
        if one_of_several { format!("{}: {}: ", report.data.path, report.model) } else { String::new() };
    for warning in &report.warnings {
        remark(&format!("warning: {whose}{warning}{}", hint(warning)));
    }
    Ok(())
}

/// The options that a warning suggests, as they are typed, such as ` (--fix cook-torrance.m=V)`.
fn hint(warning: &WarningRecord) -> String {
    let options = warning.options(typed);
    if options.is_empty() { String::new() } else { format!(" ({})", options.join(", ")) }
}

/// Prints to standard output; a closed pipe (`brdfit models | head`) ends quietly.
pub fn say(text: &str) -> Result<(), Error> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::write("standard output".as_ref())(error))
        }
        _ => Ok(()),
    }
}
