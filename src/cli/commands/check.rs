//! `brdfit check`: checks that a model or a measurement obeys physics, and how many digits a model keeps.

use crate::cli::messages::{doubted, emit, remark, say};
use crate::cli::options::input::ReadArguments;
use crate::cli::options::model::ModelArguments;
use crate::cli::options::recorded::report;
use crate::cli::outcome::Outcome;
use crate::cli::output::json;
use crate::cli::progress::Bar;
use brdfit::Error;
use brdfit::health::{Effort, Finding, measurement, measurement_lines, model, model_lines};
use brdfit::model::Expression;
use brdfit::parameters::ParameterTable;
use clap::Args;
use std::path::{Path, PathBuf};

/// Arguments of `brdfit check`.
#[derive(Args)]
pub struct Arguments {
    /// Check this file: a JSON report of brdfit, whose model is checked, or a measurement
    #[arg(value_name = "FILE", required_unless_present = "model", conflicts_with = "model")]
    input: Option<PathBuf>,
    #[command(flatten)]
    model: ModelArguments,
    /// Print JSON instead of the table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    read: ReadArguments,
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let recorded = arguments.input.as_deref().map(report).transpose()?.flatten();
    match (recorded, &arguments.input) {
        (None, Some(path)) => {
            arguments.model.check_absent()?;
            of_measurement(arguments, path)
        }
        (recorded, path) => {
            let (expression, table) = arguments.model.with_values(recorded, false)?;
            let title = path.clone().unwrap_or_else(|| PathBuf::from(expression.canonical()));
            of_model(arguments, &expression, &table, path.as_deref(), &title)
        }
    }
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
    if arguments.json {
        emit(&json(&health)?)?
    } else {
        say(&model_lines(&health))?
    }
    Ok(outcome(health.sound, &health.findings))
}

fn of_measurement(arguments: &Arguments, path: &Path) -> Result<Outcome, Error> {
    let mut measured = arguments.read.read(path)?;
    arguments.read.examine(&mut measured)?;
    if measured.directions.is_empty() {
        return Err(Error::no_samples(path, &measured.dropped));
    }
    let health = measurement(&measured);
    if arguments.json {
        emit(&json(&health)?)?
    } else {
        say(&measurement_lines(&health))?
    }
    measured.doubts.iter().for_each(|doubt| remark(&format!("warning: {}", doubted(doubt))));
    Ok(outcome(health.sound != Some(false), &health.findings))
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
