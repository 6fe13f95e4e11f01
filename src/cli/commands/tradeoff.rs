//! `brdfit tradeoff`: shows what accuracy costs.

use crate::cli::messages::{emit, remark, say};
use crate::cli::options::input::{ReadArguments, SampleArguments, measurement_help};
use crate::cli::options::report::ReportArguments;
use crate::cli::options::threads::{at_least_one, threads};
use crate::cli::outcome::Outcome;
use crate::cli::output::{Output, json, spares};
use crate::cli::progress::Bar;
use brdfit::Error;
use brdfit::figure::{Drawing, Width, of_tradeoff};
use brdfit::fit::Options;
use brdfit::model::Expression;
use brdfit::tradeoff::{FIT_SAMPLES, Request, compare, csv, lines};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `brdfit tradeoff`.
#[derive(Args)]
pub struct Arguments {
    #[arg(value_name = "INPUT", help = measurement_help("Measurement to fit"))]
    input: PathBuf,
    /// Compare this model; repeat the option for several [default: fourteen models, and approximations inside one]
    #[arg(short, long = "model", value_name = "EXPR")]
    models: Vec<String>,
    #[command(flatten)]
    report: ReportArguments,
    /// Write a CSV file with one line per model
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write a plot of error against cost
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    // --samples limits the samples that are fitted, by default to 20000. Errors are always computed on all samples.
    #[command(flatten)]
    samples: SampleArguments,
    #[command(flatten)]
    read: ReadArguments,
    /// Use N threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    threads: Option<usize>,
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let expressions: Vec<Expression> =
        arguments.models.iter().map(|text| Expression::parse(text)).collect::<Result<_, _>>()?;
    let mut filters = arguments.samples.filters()?;
    filters.samples = arguments.samples.samples_or(Some(FIT_SAMPLES));
    let options = Options::default()
        .with_metric(arguments.samples.metric())
        .with_filters(filters)
        .with_seed(arguments.samples.seed());
    let open = |path: &Option<PathBuf>| path.as_deref().map(Output::open).transpose();
    let input = std::slice::from_ref(&arguments.input);
    arguments.report.check_inputs(input)?;
    spares(input, "--csv", arguments.csv.as_deref())?;
    spares(input, "--svg", arguments.svg.as_deref())?;
    let report = arguments.report.file().map(Output::open).transpose()?;
    let (as_csv, plot) = (open(&arguments.csv)?, open(&arguments.svg)?);
    let measurement = arguments.read.read(&arguments.input)?;

    let bar = Bar::new(1, arguments.report.quiet());
    bar.begin(&arguments.input);
    let request = Request { expressions: &expressions, options: &options };
    let found = threads(arguments.threads.unwrap_or(0))?.install(|| compare(&measurement, &request, &bar));
    bar.finish();
    let found = found?;

    let text = json(&found)?;
    if arguments.report.json_alone() {
        emit(&text)?;
    } else if !arguments.report.quiet() {
        say(&lines(&found))?;
    }
    for failure in &found.failed {
        remark(&format!("warning: {}: {}", failure.path, failure.error));
    }
    if let Some(output) = report {
        output.commit(text.as_bytes())?;
    }
    if let Some(output) = as_csv {
        output.commit(&csv(&found)?)?;
    }
    if let Some(output) = plot {
        output.commit(
            of_tradeoff(&found)?.svg(Drawing { width: Width::Two, ..Drawing::default() })?.as_bytes(),
        )?;
    }
    // Usually some models of the ladder have no usable fit; the table marks them.
    let usable = found.models.iter().any(|entry| entry.usable);
    Ok(if usable { Outcome::Good } else { Outcome::NotUsable })
}
