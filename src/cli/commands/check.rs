//! `brdfit check`: checks that a model or a measurement obeys physics, and how many digits a model keeps.

use crate::cli::messages::{remark, say};
use crate::cli::options::channels::channels;
use crate::cli::options::input::ReadArguments;
use crate::cli::outcome::Outcome;
use crate::cli::output::json;
use crate::cli::progress::Bar;
use brdfit::Error;
use brdfit::error::{OptionName, Place};
use brdfit::health::{Effort, Finding, measurement, measurement_table, model, model_table};
use brdfit::model::Expression;
use brdfit::parameters::{ParameterTable, Setting, ranges, values};
use brdfit::report::{Recorded, is_report, read};
use clap::Args;
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// Arguments of `brdfit check`.
#[derive(Args)]
pub struct Arguments {
    /// Check this file: a JSON report of brdfit, whose model is checked, or a measurement
    #[arg(value_name = "FILE", required_unless_present = "model", conflicts_with = "model")]
    input: Option<PathBuf>,
    /// Check this model, such as 'lambert + cook-torrance(d=beckmann)'
    #[arg(short, long = "model", value_name = "EXPR")]
    model: Option<String>,
    /// Set parameters to values, per channel as P.r=V; the others keep their defaults
    #[arg(long, value_name = "P=V", num_args = 1..)]
    set: Vec<String>,
    /// Accept values of a parameter between these two
    #[arg(long, value_name = "P=LO..HI")]
    bounds: Vec<String>,
    /// Print JSON instead of the table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    read: ReadArguments,
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    match (&arguments.model, &arguments.input) {
        (Some(text), _) => {
            let expression = Expression::parse(text)?;
            let set = values(OptionName::Set, &arguments.set, Setting::Set)?;
            let settings = [ranges(&arguments.bounds)?, set].concat();
            let channels = channels(&[expression.settings()?, settings.clone()].concat(), false)?;
            let table = ParameterTable::new(&expression, &channels, false, &settings)?;
            let path = PathBuf::from(expression.canonical());
            of_model(arguments, &expression, &table, None, &path)
        }
        (None, _) if !(arguments.set.is_empty() && arguments.bounds.is_empty()) => {
            Err(Error::invalid("--set, --bounds", "-m EXPR, the model that has the parameters", "a file"))
        }
        (None, Some(path)) if starts_as_report(path)? => {
            let bytes = std::fs::read(path).map_err(Error::read(path))?;
            let recorded = read(&bytes, path)?;
            let several = recorded.len();
            let Some(Recorded { expression, table, data_path }) = recorded.into_iter().next() else {
                return Err(Error::malformed(path, Place::File, "a report", "none"));
            };
            if several > 1 {
                let model = expression.canonical();
                remark(&format!(
                    "warning: {}: {several} reports; only the first, the best of the ranking, is checked: {data_path}, {model}",
                    path.display()
                ));
            }
            of_model(arguments, &expression, &table, Some(path), path)
        }
        (None, path) => of_measurement(arguments, path.as_deref().unwrap_or(Path::new(""))),
    }
}

fn starts_as_report(path: &Path) -> Result<bool, Error> {
    let mut head = Vec::new();
    let file = File::open(path).map_err(Error::read(path))?;
    file.take(4096).read_to_end(&mut head).map_err(Error::read(path))?;
    Ok(is_report(&head))
}

fn of_model(
    arguments: &Arguments,
    expression: &Expression,
    table: &ParameterTable,
    report: Option<&Path>,
    title: &Path,
) -> Result<Outcome, Error> {
    let bar = Bar::new(1, false);
    bar.begin(title);
    let mut health = model(expression, table, &Effort::default(), &bar);
    bar.finish();
    health.path = report.map(|path| path.display().to_string());
    say(&if arguments.json { json(&health)? } else { model_table(&health) })?;
    Ok(outcome(health.sound, &health.findings))
}

fn of_measurement(arguments: &Arguments, path: &Path) -> Result<Outcome, Error> {
    let measured = arguments.read.read(path)?;
    if measured.directions.is_empty() {
        return Err(Error::no_samples(path, &measured.dropped));
    }
    let health = measurement(&measured);
    say(&if arguments.json { json(&health)? } else { measurement_table(&health) })?;
    Ok(outcome(health.sound, &health.findings))
}

/// Prints the findings that do not break physics as warnings, and returns whether any finding does.
fn outcome(sound: bool, findings: &[Finding]) -> Outcome {
    for finding in findings.iter().filter(|finding| !finding.breaks) {
        let channel =
            finding.channel.as_ref().map_or_else(String::new, |channel| format!("channel {channel}: "));
        remark(&format!("warning: {channel}{}", finding.text));
    }
    if sound { Outcome::Good } else { Outcome::NotUsable }
}
