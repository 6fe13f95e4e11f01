//! `brdfit fit`: fits models to measurements.

use super::fit_outputs::Outputs;
use super::read_ahead::{Input, read_ahead};
use crate::cli::messages::{Among, complain, emit, message, remark, say, show};
use crate::cli::options::fitting::FittingArguments;
use crate::cli::options::input::{ReadArguments, SampleArguments, measurement_help};
use crate::cli::options::loss::LossArguments;
use crate::cli::options::report::{ReportArguments, SEVERAL_INPUTS};
use crate::cli::options::settings::{Files, SettingArguments};
use crate::cli::options::threads::{at_least_one, threads};
use crate::cli::outcome::Outcome;
use crate::cli::output::{Output, json, spares};
use crate::cli::progress::Bar;
use brdfit::Error;
use brdfit::error::OptionName;
use brdfit::fit::Options;
use brdfit::model::Expression;
use brdfit::parameters::{Settings, applies};
use brdfit::progress::Progress;
use brdfit::report::{Circumstances, Failure, OptionRecord, Recorded, Report, Reports, Times};
use brdfit::solver::Termination;
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// Arguments of `brdfit fit`.
#[derive(Args)]
pub struct Arguments {
    #[arg(
        value_name = "INPUT",
        help = measurement_help("Measurements to fit"),
        required_unless_present_any = ["fix", "init", "bounds", "tie"]
    )]
    inputs: Vec<PathBuf>,
    /// Fit this model, such as 'lambert + cook-torrance(d=beckmann)'; repeat the option to rank several [default: rank four, from
    /// 'lambert' to two lobes]
    #[arg(short, long = "model", value_name = "EXPR")]
    models: Vec<String>,
    #[command(flatten)]
    report: ReportArguments<SEVERAL_INPUTS>,
    #[command(flatten)]
    samples: SampleArguments,
    #[command(flatten)]
    settings: SettingArguments,
    #[command(flatten)]
    loss: LossArguments,
    #[command(flatten)]
    fitting: FittingArguments,
    #[command(flatten)]
    read: ReadArguments,
    /// Write a CSV file with one line per input, model and parameter
    #[arg(long, value_name = "FILE")]
    summary: Option<PathBuf>,
    /// Stop after S seconds and report the best parameters so far
    #[arg(long, value_name = "S")]
    timeout: Option<f64>,
    /// Use N threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    threads: Option<usize>,
}

/// The models that are fitted if none is named: matte, rough and matte, glossy, and glossy with a haze. `brdfit tradeoff` tries more.
const SHORT_LADDER: [&str; 4] = [
    "lambert",
    "oren-nayar(variant=fujii)",
    "lambert + cook-torrance",
    "lambert + cook-torrance + cook-torrance",
];

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let started = Instant::now();
    let Files { start, mut inputs } = arguments.settings.files()?;
    inputs.extend(arguments.inputs.iter().cloned());
    let start = start.as_ref().map(|(path, recorded)| (path.as_path(), recorded));
    let expressions = expressions(arguments, start.map(|(_, recorded)| recorded))?;
    // A file that does not exist is taken for a constraint, whose error names it.
    let options = options(arguments, started)?;
    if inputs.is_empty() {
        return Err(Error::invalid("INPUT", "a measurement to fit", "none"));
    }
    let files: Vec<PathBuf> = inputs.iter().cloned().chain(start.map(|(path, _)| path.to_owned())).collect();
    arguments.report.check_inputs(&files)?;
    arguments.read.check()?;
    let outputs = Outputs::open(arguments.report.file(), &inputs)?;
    let summary = summary(arguments, &files)?;
    listen_for_interrupts(&options.stop.clone().unwrap_or_default());
    let mut options = options_of_each(&expressions, &options);
    if let Some((path, recorded)) = start {
        start_from(path, recorded, &expressions, &mut options)?;
    }
    let pool = threads(arguments.threads.unwrap_or(0))?;
    // One thread reads and one hashes, in addition to those that fit.
    let reading = threads(pool.current_num_threads().min(2))?;
    let fits = inputs.len() * expressions.len();
    let run = Run {
        arguments,
        inputs: &inputs,
        expressions: &expressions,
        options: &options,
        start: start.map(|(path, _)| path),
        outputs: &outputs,
        bar: Arc::new(Bar::new(fits, arguments.report.quiet())),
    };
    let done = reading.in_place_scope(|scope| {
        let measurements = read_ahead(scope, &arguments.read, &inputs);
        // All inputs run on one thread of the pool, which frees one fit's memory before it allocates the next one's.
        // An allocator with an arena per thread, such as glibc's, would otherwise keep memory in every arena used.
        pool.install(|| run.every_input(measurements))
    });
    run.bar.finish();
    let Done { reports, failed, usable } = done?;
    if reports.is_empty() {
        return Ok(Outcome::NothingDone);
    }
    let good = usable && failed.is_empty();
    let reports = Reports::new(reports, failed);
    let text = match reports.reports.as_slice() {
        [only] if run.single() => json(only)?,
        _ => json(&reports)?,
    };
    if arguments.report.json_alone() {
        emit(&text)?;
    } else {
        run.conclude(&reports)?;
    }
    outputs.all_done(&text)?;
    if let Some(summary) = summary {
        summary.commit(&reports.csv()?)?;
    }
    Ok(if good { Outcome::Good } else { Outcome::NotUsable })
}

/// The models to fit: those that `-m` names, or else that of the report that the fit starts from, or else the short ladder.
fn expressions(arguments: &Arguments, start: Option<&Recorded>) -> Result<Vec<Expression>, Error> {
    let named: Vec<&str> = arguments.models.iter().map(String::as_str).collect();
    let texts: &[&str] = match (named.is_empty(), start) {
        (false, _) => &named,
        (true, Some(recorded)) => return Ok(vec![recorded.expression.clone()]),
        (true, None) => &SHORT_LADDER,
    };
    texts.iter().map(|text| Expression::parse(text)).collect()
}

/// Starts the fit of each expression from the values in the report at `path`, where it has them, with a remark about those
/// for which it has none.
fn start_from(
    path: &Path,
    recorded: &Recorded,
    expressions: &[Expression],
    options: &mut [Options],
) -> Result<(), Error> {
    for (expression, options) in expressions.iter().zip(options) {
        let starts = recorded.starts(expression, &options.settings)?;
        if starts.is_empty() {
            let (model, path) = (expression.canonical(), path.display());
            remark(&format!("note: {path} has no value to start '{model}' from"));
        }
        options.settings.extend(starts);
    }
    Ok(())
}

/// The file of `--summary`. `None` if there is none.
fn summary(arguments: &Arguments, files: &[PathBuf]) -> Result<Option<Output>, Error> {
    let Some(path) = arguments.summary.as_deref() else { return Ok(None) };
    spares(files, "--summary", Some(path))?;
    if arguments.report.file() == Some(path) {
        let (subject, found) = (format!("--summary {}", path.display()), "that file");
        return Err(Error::invalid(subject, "a file other than that of -o", found));
    }
    Output::open(path).map(Some)
}

fn options(arguments: &Arguments, started: Instant) -> Result<Options, Error> {
    let deadline = arguments
        .timeout
        .map(|seconds| {
            if !(seconds > 0.0 && seconds.is_finite()) {
                return Err(Error::invalid(OptionName::Timeout, "seconds above 0", seconds.to_string()));
            }
            // A deadline that the clock cannot represent means no deadline.
            Ok(Duration::try_from_secs_f64(seconds).ok().and_then(|limit| started.checked_add(limit)))
        })
        .transpose()?
        .flatten();
    let mut options = Options::default()
        .with_metric(arguments.samples.metric())
        .with_filters(arguments.samples.filters()?)
        .with_settings(arguments.settings.texts().settings()?)
        .with_seed(arguments.samples.seed())
        .with_stop(Arc::new(AtomicBool::new(false)));
    options.deadline = deadline;
    arguments.fitting.apply(arguments.loss.apply(options)?)
}

/// The options for each expression. A constraint that only some of the models have is for those, with a remark.
fn options_of_each(expressions: &[Expression], options: &Options) -> Vec<Options> {
    let mut settings = vec![Settings::new(); expressions.len()];
    for constraint in &options.settings {
        let has = |expression: &Expression| applies(expression, constraint);
        let nowhere = !expressions.iter().any(has);
        let mut without: Vec<String> = Vec::new();
        for (expression, settings) in expressions.iter().zip(&mut settings) {
            // What no model has is a mistake, which the fit names.
            if nowhere || has(expression) {
                settings.push(constraint.clone());
            } else {
                without.push(format!("'{}'", expression.canonical()));
            }
        }
        if !without.is_empty() {
            remark(&format!("note: '{}' is not a parameter of {}", constraint.0, without.join(" or ")));
        }
    }
    settings.into_iter().map(|settings| options.clone().with_settings(settings)).collect()
}

/// Makes the first Ctrl-C stop the fit with the best parameters so far, and the second end the program.
pub(super) fn listen_for_interrupts(stop: &Arc<AtomicBool>) {
    let stop = Arc::clone(stop);
    // Without a handler Ctrl-C simply ends the program.
    let _ = ctrlc::set_handler(move || {
        if stop.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
}

/// The fits of one command.
struct Run<'a> {
    arguments: &'a Arguments,
    inputs: &'a [PathBuf],
    expressions: &'a [Expression],
    /// The options of each expression.
    options: &'a [Options],
    /// The report that the fits start from.
    start: Option<&'a Path>,
    outputs: &'a Outputs,
    bar: Arc<Bar>,
}

/// The results of all fits of one command.
#[derive(Default)]
struct Done {
    reports: Vec<Report>,
    failed: Vec<Failure>,
    /// Whether every fit that was reported is usable.
    usable: bool,
}

impl Run<'_> {
    /// Whether there is one input and one expression.
    fn single(&self) -> bool {
        self.inputs.len() == 1 && self.expressions.len() == 1
    }

    /// Why no further input may be started. `None` if one may.
    fn over(&self) -> Option<Termination> {
        let options = self.options.first()?;
        let stopped = options.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed));
        let late = options.deadline.is_some_and(|deadline| Instant::now() >= deadline);
        stopped.then_some(Termination::Interrupted).or(late.then_some(Termination::Timeout))
    }

    /// Fits every expression to every input, and continues after an input that fails. The first input is always
    /// fitted, as well as the time allows.
    fn every_input(&self, measurements: Receiver<Result<Input, Error>>) -> Result<Done, Error> {
        let mut done = Done { usable: true, ..Done::default() };
        let (inputs, arguments) = (self.inputs, self.arguments);
        let failure =
            |path: &Path, error: &str| Failure { path: path.display().to_string(), error: error.to_owned() };
        for (index, path) in inputs.iter().enumerate() {
            if let Some(reason) = self.over().filter(|_| index > 0) {
                let rest = inputs.get(index..).unwrap_or_default();
                let (why, left_out) = (reason.name(), rest.len());
                self.bar
                    .aside(|| complain(&format!("{why}: {left_out} of {} inputs not started", inputs.len())));
                done.failed.extend(rest.iter().map(|path| failure(path, why)));
                break;
            }
            self.bar.begin(path);
            // The reader sends one measurement per input.
            let Ok(input) = measurements.recv() else { break };
            match input.and_then(|input| self.one_input(&input)) {
                Ok(reports) => {
                    // Of models that nobody named, the best must be usable.
                    done.usable &= if arguments.models.is_empty() {
                        best(&reports).is_some_and(|report| report.termination.usable)
                    } else {
                        reports.iter().all(|report| report.termination.usable)
                    };
                    self.bar.aside(|| self.show(&reports, done.reports.is_empty()))?;
                    self.outputs.input_done(index, &reports)?;
                    done.reports.extend(reports);
                }
                // With a single input, its error is the error of the command.
                Err(error) if inputs.len() == 1 => return Err(error),
                Err(error) => {
                    let error = message(&error);
                    // A mistake in the options gives the same error for every input; it is printed once.
                    if done.failed.iter().all(|failure| failure.error != error) {
                        self.bar.aside(|| complain(&error));
                    }
                    done.failed.push(failure(path, &error));
                }
            }
            self.bar.passed((index + 1) * self.expressions.len());
        }
        Ok(done)
    }

    /// Fits every expression to one input.
    fn one_input(&self, input: &Input) -> Result<Vec<Report>, Error> {
        let Self { arguments, .. } = self;
        let Input { measurement, seconds: read } = input;
        let fit_one = |(expression, options): (&Expression, &Options)| {
            let fitting = Instant::now();
            let progress: Arc<dyn Progress> = Arc::clone(&self.bar) as Arc<dyn Progress>;
            let fitted = arguments.fitting.fit(measurement, expression, options, &progress)?;
            let fit = fitting.elapsed().as_secs_f64();
            let threads = rayon::current_num_threads();
            let circumstances = Circumstances {
                metric: options.metric,
                max_theta_deg: options.filters.max_theta_deg,
                options: arguments.read.recorded_in(OptionRecord {
                    target_error: arguments.fitting.target_error(),
                    timeout_s: arguments.timeout,
                    parameters: arguments.settings.as_given(self.start),
                    ..OptionRecord::new(options, &fitted)
                }),
                times: Times { read: *read, fit, total: read + fit, threads },
                fitted: true,
            };
            self.bar.fitted();
            Ok(Report::new(measurement, &fitted, &circumstances))
        };
        self.expressions.iter().zip(self.options).map(fit_one).collect()
    }

    /// Shows the reports of one input.
    fn show(&self, reports: &[Report], first: bool) -> Result<(), Error> {
        let (quiet, as_table) = (self.arguments.report.quiet(), !self.arguments.report.json_alone());
        for (index, report) in reports.iter().enumerate() {
            if as_table && !quiet && (index > 0 || !first) {
                say(&"\n".into())?;
            }
            let among = match index {
                _ if self.single() => Among::Alone,
                0 => Among::First,
                _ => Among::Further,
            };
            show(report, as_table, quiet, among)?;
        }
        Ok(())
    }

    /// Says how the models rank, if there are several, and then how the inputs fared, if there are several.
    fn conclude(&self, reports: &Reports) -> Result<(), Error> {
        let quiet = self.arguments.report.quiet();
        let several = |n: usize| n > 1;
        let mut parts = Vec::new();
        parts.extend(several(self.expressions.len()).then(|| reports.ranking_lines()));
        parts.extend((several(self.inputs.len()) && !quiet).then(|| reports.summary_lines()));
        for (index, part) in parts.into_iter().enumerate() {
            // The ranking alone needs no distance from what is not printed.
            if index > 0 || !quiet {
                say(&"\n".into())?;
            }
            say(&part)?;
        }
        Ok(())
    }
}

/// The best report of one input.
fn best(reports: &[Report]) -> Option<&Report> {
    let ranked = Reports::new(reports.to_vec(), Vec::new());
    reports.get(ranked.ranking.first()?.index)
}
