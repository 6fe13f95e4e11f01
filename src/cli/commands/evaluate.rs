//! `brdfit evaluate`: evaluates a model at given parameters and reports its errors, without a fit.

use crate::cli::messages::{say, show};
use crate::cli::options::input::{ReadArguments, SampleArguments, measurement_help};
use crate::cli::options::report::ReportArguments;
use crate::cli::options::settings::is_file;
use crate::cli::outcome::Outcome;
use crate::cli::output::{Output, json};
use brdfit::Error;
use brdfit::error::OptionName;
use brdfit::fit::{Options, evaluate};
use brdfit::model::Expression;
use brdfit::parameters::{Setting, ranges, values};
use brdfit::report::{Circumstances, OptionRecord, Report, Times};
use clap::Args;
use std::path::PathBuf;
use std::time::Instant;

/// Arguments of `brdfit evaluate`.
#[derive(Args)]
pub struct Arguments {
    #[arg(value_name = "INPUT", help = measurement_help("Measurement to compare with"))]
    input: Option<PathBuf>,
    /// Evaluate this model, such as 'lambert + cook-torrance(d=beckmann)'
    #[arg(short, long = "model", value_name = "EXPR")]
    model: String,
    /// Set parameters to values; the others keep their defaults
    #[arg(long, value_name = "P=V", num_args = 1..)]
    set: Vec<String>,
    /// Accept values of a parameter between these two
    #[arg(long, value_name = "P=LO..HI")]
    bounds: Vec<String>,
    #[command(flatten)]
    report: ReportArguments,
    #[command(flatten)]
    samples: SampleArguments,
    #[command(flatten)]
    read: ReadArguments,
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let expression = Expression::parse(&arguments.model)?;
    let (input, set) = input_and_settings(arguments)?;
    arguments.report.check_inputs(std::slice::from_ref(&input))?;
    let options = Options::default()
        .with_metric(arguments.samples.metric())
        .with_filters(arguments.samples.filters()?)
        .with_settings([ranges(&arguments.bounds)?, values(OptionName::Set, set, Setting::Set)?].concat())
        .with_seed(arguments.samples.seed());
    let output = arguments.report.file().map(Output::open).transpose()?;
    let started = Instant::now();
    let measurement = arguments.read.read(&input)?;
    let read = started.elapsed().as_secs_f64();
    let result = evaluate(&measurement, &expression, &options)?;
    let total = started.elapsed().as_secs_f64();
    let circumstances = Circumstances {
        metric: options.metric,
        max_theta_deg: options.filters.max_theta_deg,
        options: OptionRecord {
            solver: None,
            uncertainty: None,
            merl_bins: arguments.read.merl_bins().into(),
            parameters: options_as_given(&arguments.bounds, set),
            ..OptionRecord::new(&options, &result)
        },
        times: Times { read, fit: total - read, total, threads: rayon::current_num_threads() },
        fitted: false,
    };
    let report = Report::new(&measurement, &result, &circumstances);
    let text = json(&report)?;
    if arguments.report.json_alone() {
        say(&text)?;
    }
    show(&report, !arguments.report.json_alone(), arguments.report.quiet(), false)?;
    if let Some(output) = output {
        output.commit(text.as_bytes())?;
    }
    Ok(if report.termination.usable { Outcome::Good } else { Outcome::NotUsable })
}

/// The options about parameters as the user typed them, for the report.
fn options_as_given(bounds: &[String], set: &[String]) -> Vec<String> {
    let bounds = bounds.iter().map(|text| format!("--bounds {text}"));
    bounds.chain(set.iter().map(|text| format!("--set {text}"))).collect()
}

/// The input and the settings. In `--set kd=0.5 FILE` the parser takes FILE for a setting; it is the input.
fn input_and_settings(arguments: &Arguments) -> Result<(PathBuf, &[String]), Error> {
    match (&arguments.input, arguments.set.split_last()) {
        (Some(input), _) => Ok((input.clone(), &arguments.set)),
        (None, Some((last, rest))) if is_file(last) || !last.contains('=') => Ok((PathBuf::from(last), rest)),
        _ => Err(Error::invalid("INPUT", "a measurement to evaluate", "none")),
    }
}
