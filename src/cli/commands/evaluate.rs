//! `brdfit evaluate`: evaluates a model without a fit. It reports the model's errors on a measurement, or writes its values at given
//! directions.

use crate::cli::messages::{Among, emit, show};
use crate::cli::options::input::{ReadArguments, SampleArguments, measurement_help};
use crate::cli::options::model::ModelArguments;
use crate::cli::options::recorded::{own_measurement, report};
use crate::cli::options::report::ReportArguments;
use crate::cli::outcome::Outcome;
use crate::cli::output::{Output, json};
use brdfit::Error;
use brdfit::fit::evaluate;
use brdfit::geometry::Directions;
use brdfit::measurement::Measurement;
use brdfit::measurement::formats::{csv, read_directions};
use brdfit::model::Expression;
use brdfit::report::{Circumstances, OptionRecord, Recorded, Report, Spread, Times};
use brdfit::synthetic::{Noise, measurement};
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Arguments of `brdfit evaluate`.
#[derive(Args)]
pub struct Arguments {
    #[arg(value_name = "INPUT", num_args = 0..=2, help = inputs_help())]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    model: ModelArguments,
    /// Write f, and its standard error if a report has any, at the directions of this CSV file or measurement, instead of a report
    #[arg(long, value_name = "FILE", conflicts_with = "json")]
    at: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArguments,
    #[command(flatten)]
    samples: SampleArguments,
    #[command(flatten)]
    read: ReadArguments,
}

fn inputs_help() -> String {
    let measurement = measurement_help("Measurement to compare with");
    format!(
        "{measurement}; or a JSON report of brdfit, whose model is evaluated [default: the measurement of the report]"
    )
}

/// The files of the command line, told apart by their content.
struct Inputs {
    /// A report, with its path.
    recorded: Option<(PathBuf, Recorded)>,
    measurement: Option<PathBuf>,
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let inputs = inputs(arguments)?;
    match &arguments.at {
        Some(at) => values_at(arguments, inputs, at),
        None => errors(arguments, inputs),
    }
}

/// Sorts the inputs into report and measurement.
fn inputs(arguments: &Arguments) -> Result<Inputs, Error> {
    let mut inputs = Inputs { recorded: None, measurement: None };
    let files: Vec<PathBuf> = arguments.model.files().chain(arguments.inputs.iter().cloned()).collect();
    for path in &files {
        let (first, expected) = match report(path)? {
            Some(recorded) => {
                let first = inputs.recorded.replace((path.clone(), recorded));
                (first.map(|(path, _)| path), "one report at most")
            }
            None => (inputs.measurement.replace(path.clone()), "one measurement at most, and one report"),
        };
        if let Some(first) = first {
            let found = format!("{} and {}", first.display(), path.display());
            return Err(Error::invalid("INPUT", expected, found));
        }
    }
    if arguments.model.is_named() && inputs.recorded.is_some() {
        return Err(Error::invalid("model", "a report or -m EXPR", "both"));
    }
    // In `--set kd=0.5 FILE` the parser takes FILE for a value even if it does not exist.
    if let (None, None, Some(path)) = (&inputs.measurement, &arguments.at, arguments.model.missing_file()) {
        report(path)?;
    }
    Ok(inputs)
}

/// Writes f at the directions in the file `at`.
fn values_at(arguments: &Arguments, inputs: Inputs, at: &Path) -> Result<Outcome, Error> {
    if let Some(path) = inputs.measurement {
        let expected = "no measurement to compare with, since the directions are those of --at";
        return Err(Error::invalid("INPUT", expected, path.display().to_string()));
    }
    let (path, recorded) = inputs.recorded.unzip();
    let files: Vec<PathBuf> = path.into_iter().chain([at.to_owned()]).collect();
    arguments.report.check_inputs(&files)?;
    let is_as_fitted = arguments.model.settings()?.is_empty();
    let fitted = recorded.clone().filter(|_| is_as_fitted);
    let (expression, table) = arguments.model.with_values(recorded, false)?;
    let output = arguments.report.file().map(Output::open).transpose()?;
    let pairs = read_directions(at, &arguments.read.options()?)?;
    let directions = Directions::Scattered(pairs);
    let mut comments = vec![
        format!("brdfit evaluate {}", expression.canonical()),
        "angles in degrees, values in 1/sr".to_owned(),
    ];
    let mut there = measurement(&expression, &table, directions, Noise::default(), 0);
    there.check_finite()?;
    if let Some(spread) = fitted.as_ref().and_then(Spread::of) {
        there.sigma = Some(standard_errors(&spread, &expression, &there));
        let of_what = if spread.complete { "" } else { ", without parameters that have none" };
        comments.push(format!(
            "sigma: standard error of f from those of the parameters{of_what}; 95 % band: f +/- {:.2} sigma",
            spread.half_interval()
        ));
    }
    let text = csv::write(&there, &comments)?;
    match output {
        None => emit(&text)?,
        Some(output) => output.commit(text.as_bytes())?,
    }
    Ok(Outcome::Good)
}

/// The standard errors of f at the directions of a measurement, by channel and direction.
fn standard_errors(spread: &Spread<'_>, expression: &Expression, there: &Measurement) -> Vec<Vec<f64>> {
    let of_channel = |channel: usize| {
        spread.std_errors(|table| {
            expression.values(&there.directions, &[table.formula_values(channel)]).concat()
        })
    };
    (0..there.channels.len()).map(of_channel).collect()
}

/// Reports the errors of the model on a measurement.
fn errors(arguments: &Arguments, inputs: Inputs) -> Result<Outcome, Error> {
    let Inputs { recorded, measurement } = inputs;
    let expression = match &recorded {
        Some((_, recorded)) => recorded.expression.clone(),
        None => arguments.model.expression()?,
    };
    // A report without a measurement is evaluated on its own, whose file must not have changed.
    let is_own = measurement.is_none();
    let input = match (measurement, &recorded) {
        (Some(input), _) => input,
        (None, Some((_, recorded))) => PathBuf::from(&recorded.report.data.path),
        (None, None) => return Err(Error::invalid("INPUT", "a measurement to evaluate", "none")),
    };
    let files: Vec<PathBuf> = recorded.iter().map(|(path, _)| path.clone()).chain([input.clone()]).collect();
    arguments.report.check_inputs(&files)?;
    let set = arguments.model.settings()?;
    let recorded = recorded.map(|(path, recorded)| Ok((path, recorded.with(&set)?)));
    let recorded: Option<(PathBuf, Recorded)> = recorded.transpose()?;
    let reported = recorded.as_ref().map(|(_, recorded)| &recorded.report);
    let read = arguments.read.or_as_in(reported);
    let options = arguments.samples.options_or_as_in(reported)?;
    let output = arguments.report.file().map(Output::open).transpose()?;

    let started = Instant::now();
    let measurement = match &recorded {
        Some((path, recorded)) if is_own => own_measurement(
            &read,
            path,
            &input,
            &recorded.report,
            "",
            "name another to compare with as a second input",
        )?,
        _ => read.read(&input)?,
    };
    let reading = started.elapsed().as_secs_f64();
    let settings = match &recorded {
        Some((_, recorded)) => recorded.settings(&measurement.channel_names())?,
        None => set,
    };
    let options = options.with_settings(settings);
    let result = evaluate(&measurement, &expression, &options)?;
    let total = started.elapsed().as_secs_f64();
    let circumstances = Circumstances {
        metric: options.metric,
        max_theta_deg: options.filters.max_theta_deg,
        options: read.recorded_in(OptionRecord {
            solver: None,
            uncertainty: None,
            parameters: arguments.model.as_given(),
            ..OptionRecord::new(&options, &result)
        }),
        times: Times { read: reading, fit: total - reading, total, threads: rayon::current_num_threads() },
        fitted: false,
    };
    let report = Report::new(&measurement, &result, &circumstances);
    let text = json(&report)?;
    if arguments.report.json_alone() {
        emit(&text)?;
    }
    show(&report, !arguments.report.json_alone(), arguments.report.quiet(), Among::Alone)?;
    if let Some(output) = output {
        output.commit(text.as_bytes())?;
    }
    Ok(if report.termination.usable { Outcome::Good } else { Outcome::NotUsable })
}
