//! `brdfit export`: writes a fit as a renderer's material.

use super::fit::listen_for_interrupts;
use crate::cli::messages::{emit, remark};
use crate::cli::options::code::{CodeParameters, not_arguments};
use crate::cli::options::input::{ReadArguments, SampleArguments, measurement_help};
use crate::cli::options::recorded::{check_measurement, measurement_of, report, the_report};
use crate::cli::outcome::Outcome;
use crate::cli::output::{Output, json, spares};
use crate::cli::progress::Bar;
use brdfit::Error;
use brdfit::code::{Arguments as CodeArguments, LANGUAGES, Language, named as language_named};
use brdfit::export::{
    About, Agreement, ExportRecord, Holds, ModelError, NotHeld, SCHEMA, TARGETS, Target, named,
};
use brdfit::fit::{Fit, Options, evaluate, fit};
use brdfit::image::{PRIMARIES, Primaries, REC709, Route, ToRgb};
use brdfit::measurement::Measurement;
use brdfit::model::Expression;
use brdfit::parameters::{ParameterTable, Selector, Setting, Settings};
use brdfit::progress::Progress;
use brdfit::report::{Circumstances, OptionRecord, Recorded, Report, Times};
use clap::Args;
use clap::builder::PossibleValuesParser;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Arguments of `brdfit export`.
#[derive(Args)]
pub struct Arguments {
    #[arg(value_name = "INPUT", help = input_help())]
    input: PathBuf,
    /// Write for this renderer or format
    #[arg(long, value_name = "TARGET", value_parser = PossibleValuesParser::new(TARGETS.iter().map(|t| t.name)))]
    to: String,
    /// Write code in this language
    #[arg(long, value_name = "LANGUAGE", required_if_eq("to", "code"), value_parser = PossibleValuesParser::new(LANGUAGES.iter().map(|l| l.name)))]
    language: Option<String>,
    /// What becomes of the parameters in code [default: fixed]
    #[arg(long, value_name = "HOW")]
    parameters: Option<CodeParameters>,
    /// Write to this file [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Use this measurement instead of the one that the report names
    #[arg(long, value_name = "FILE")]
    measurement: Option<PathBuf>,
    /// State colours in these primaries instead of linear Rec.709, adapted by Bradford's method [default: rec709]
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(PRIMARIES.iter().map(|p| p.name)))]
    primaries: Option<String>,
    /// Print what was written, how close it is to the fit, and both errors as JSON
    #[arg(long, requires = "output")]
    json: bool,
    #[command(flatten)]
    samples: SampleArguments,
    #[command(flatten)]
    read: ReadArguments,
}

fn input_help() -> String {
    let measurement = measurement_help("a measurement, to which the target's own model is fitted");
    format!("JSON report of brdfit, whose model is written; or {measurement}")
}

/// A model that a target holds, at its values.
struct Model {
    expression: Expression,
    table: ParameterTable,
    /// The report of its fit; the values are those in it.
    report: Option<Report>,
    /// Notes about how its colours were found.
    notes: Vec<String>,
    was_refitted: bool,
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let target = named(&arguments.to)?;
    let primaries = arguments.primaries.as_deref().map_or(Ok(&REC709), Primaries::named)?;
    let Some(color_space) = target.name_of_primaries(primaries) else {
        let names: Vec<&str> = target.primaries.iter().map(|(name, _)| *name).collect();
        let expected = format!("primaries that {} has: {}", target.name, names.join(", "));
        return Err(Error::invalid("--primaries", expected, primaries.name));
    };
    let code = code(arguments, target)?;
    let recorded =
        if target.own.is_empty() { Some(the_report(&arguments.input)?) } else { report(&arguments.input)? };
    check_measurement(recorded.as_ref(), &arguments.input, arguments.measurement.as_deref())?;
    let inputs: Vec<PathBuf> =
        [Some(&arguments.input), arguments.measurement.as_ref()].into_iter().flatten().cloned().collect();
    spares(&inputs, "-o", arguments.output.as_deref())?;
    let output = arguments.output.as_deref().map(Output::open).transpose()?;
    let source = Source { arguments, target, primaries, color_space, code, recorded: recorded.as_ref() };
    let model = source.model()?;
    let (text, record) = source.written(model)?;
    match output {
        None => emit(&text)?,
        Some(output) => output.commit(text.as_bytes())?,
    }
    for line in summary(&record, arguments.output.as_deref()) {
        remark(&line);
    }
    if arguments.json {
        emit(&json(&record)?)?;
    }
    let usable = record.report.as_ref().is_none_or(|report| report.termination.usable);
    Ok(if usable { Outcome::Good } else { Outcome::NotUsable })
}

/// The language of code, and which parameters are its arguments; `None` for other targets.
fn code(arguments: &Arguments, target: &Target) -> Result<Option<(&'static Language, CodeArguments)>, Error> {
    let Arguments { language, parameters, .. } = arguments;
    let unsuited = |option: &str| {
        Err(Error::invalid(option, "--to code, or no such option", format!("--to {}", target.name)))
    };
    match (language, parameters) {
        (Some(language), parameters) if target.name == "code" => {
            let how = parameters.map_or(CodeArguments::Fixed, CodeArguments::from);
            Ok(Some((language_named("--language", language)?, how)))
        }
        (Some(_), _) => unsuited("--language"),
        (None, Some(_)) => unsuited("--parameters"),
        (None, None) => Ok(None),
    }
}

/// What is exported, and where to.
struct Source<'a> {
    arguments: &'a Arguments,
    target: &'static Target,
    primaries: &'static Primaries,
    /// The target's name for them.
    color_space: &'static str,
    /// The language of code, and which parameters are its arguments.
    code: Option<(&'static Language, CodeArguments)>,
    recorded: Option<&'a Recorded>,
}

impl Source<'_> {
    /// The model to write: that of the report if the target holds it, or else the target's own, fitted.
    fn model(&self) -> Result<Model, Error> {
        let Some(recorded) = self.recorded else {
            let measurement = self.arguments.read.read(&self.arguments.input)?;
            return self.refitted(&measurement, &Expression::parse(self.target.own)?, None);
        };
        let Recorded { expression, table, report, .. } = recorded;
        // A single channel has no colour to convert.
        let converted = !self.primaries.are_rec709() && table.channels().len() > 1;
        let reason = match self.target.write(expression, table, &self.about()) {
            Err(reason @ NotHeld::Code(_)) => return Err(self.not_held(&reason)),
            Ok(_) if converted => NotHeld::Primaries(self.primaries.title),
            Ok(_) => {
                return Ok(Model {
                    expression: expression.clone(),
                    table: table.clone(),
                    report: Some(report.clone()),
                    notes: Vec::new(),
                    was_refitted: false,
                });
            }
            Err(reason) => reason,
        };
        // A model that the target holds in red, green and blue needs no other.
        let own = Expression::parse(self.target.own)?;
        let same = matches!(reason, NotHeld::Channels(_) | NotHeld::Primaries(_))
            && self.target.holds_model(expression);
        let expression = if same { expression } else { &own };
        let measurement = self.measurement(recorded, &reason)?;
        self.refitted(&measurement, expression, Some(&reason))
    }

    /// The measurement of the report, or the one that the user names.
    fn measurement(&self, recorded: &Recorded, reason: &NotHeld) -> Result<Measurement, Error> {
        let Arguments { read, measurement, input, .. } = self.arguments;
        let why = format!(
            "to fit {} again ({} cannot hold the report: {reason}), ",
            self.target.own, self.target.name
        );
        measurement_of(read, input, measurement.as_deref(), &recorded.report, &why)
    }

    /// A model fitted to a measurement in red, green and blue.
    fn refitted(
        &self,
        measurement: &Measurement,
        expression: &Expression,
        reason: Option<&NotHeld>,
    ) -> Result<Model, Error> {
        let Arguments { samples, read, .. } = self.arguments;
        let started = Instant::now();
        let colours = ToRgb::new(&measurement.channels).in_primaries(self.primaries);
        let mut notes = Vec::new();
        notes.extend(reason.map(|reason| match reason {
            NotHeld::Primaries(_) => format!("fitted again: {reason}"),
            _ => format!("{} cannot hold the report: {reason}", self.target.name),
        }));
        notes.extend(colour_note(colours.route, measurement, self.primaries));
        notes.extend(colours.incomplete_in_words(measurement));
        let measurement = colours.measurement(measurement);
        let reported = self.recorded.map(|recorded| &recorded.report);
        let options = samples.options_or_as_in(reported)?.with_stop(Arc::new(AtomicBool::new(false)));
        listen_for_interrupts(&options.stop.clone().unwrap_or_default());
        let bar = Arc::new(Bar::new(1, false));
        bar.begin(&measurement.source.path);
        let progress: Arc<dyn Progress> = Arc::clone(&bar) as Arc<dyn Progress>;
        let fitted = fit(&measurement, expression, &options, &progress);
        bar.finish();
        let fitted = fitted?;
        let report = Report::new(&measurement, &fitted, &circumstances(&options, &fitted, read, started));
        Ok(Model {
            expression: fitted.model.clone(),
            table: fitted.table.clone(),
            report: Some(report),
            notes,
            was_refitted: true,
        })
    }

    /// The file, and what is said about it.
    fn written(&self, model: Model) -> Result<(String, ExportRecord), Error> {
        let not_held = |reason: NotHeld| self.not_held(&reason);
        let draft = self.target.write(&model.expression, &model.table, &self.about()).map_err(not_held)?;
        let own = model.report.as_ref().map(ModelError::from);
        let mut notes = model.notes;
        let agreement = match (draft.clamped.is_empty(), model.was_refitted && self.recorded.is_some()) {
            (false, _) => Agreement::Approximate,
            (true, true) => Agreement::Refitted,
            (true, false) => Agreement::Exact,
        };
        let exported = match self.recorded {
            Some(recorded) if agreement == Agreement::Approximate && !model.was_refitted => {
                self.clamped_errors(recorded, &draft.clamped, &mut notes)
            }
            _ => own,
        };
        if self.color_space.is_empty() && !self.primaries.are_rec709() {
            notes.push(format!(
                "the file cannot state its primaries: render it in a scene whose colours are {}",
                self.primaries.title
            ));
        }
        if !self.target.caveat.is_empty() {
            notes.push(self.target.caveat.to_owned());
        }
        if model.report.as_ref().is_some_and(|report| !report.termination.usable) {
            notes.push("the fit is not usable: see its report".to_owned());
        }
        let reported = self.recorded.map(|recorded| &recorded.report);
        let fitted = reported.map(ModelError::from);
        let measurement =
            reported.or(model.report.as_ref()).map_or_else(String::new, |report| report.data.path.clone());
        let record = ExportRecord {
            schema: SCHEMA,
            target: self.target.name,
            agreement,
            model: model.expression.canonical(),
            fitted,
            exported,
            measurement,
            primaries: self.primaries_of(reported.or(model.report.as_ref())),
            clamped: draft.clamped,
            notes,
            report: model.report,
        };
        let about = About { lines: comment(&record), report: record.report.as_ref(), ..self.about() };
        let text = self.target.write(&model.expression, &model.table, &about).map_err(not_held)?.text;
        Ok((text, record))
    }

    /// The primaries of the colours, in words.
    fn primaries_of(&self, report: Option<&Report>) -> String {
        let channels = report.map_or(&[][..], |report| report.data.channels.as_slice());
        let is_rgb = ["r", "g", "b"].iter().all(|name| channels.iter().any(|channel| channel == name));
        match self.target.holds {
            Holds::Models(_) if channels.len() > 1 && !is_rgb => {
                "none: the channels are those of the measurement".to_owned()
            }
            _ => primaries_of(report, self.primaries),
        }
    }

    /// What is known before the model is.
    fn about(&self) -> About<'_> {
        About { color_space: self.color_space, code: self.code, ..About::default() }
    }

    fn not_held(&self, reason: &NotHeld) -> Error {
        match reason {
            NotHeld::Code(_) => not_arguments(reason),
            _ => {
                Error::invalid("--to", format!("a model that {} holds", self.target.name), reason.to_string())
            }
        }
    }

    /// The errors of the report's model with the values that were written; `None`, with a note, without its measurement.
    fn clamped_errors(
        &self,
        recorded: &Recorded,
        clamped: &[(String, f64, f64)],
        notes: &mut Vec<String>,
    ) -> Option<ModelError> {
        let Arguments { read, measurement, samples, .. } = self.arguments;
        let evaluated = || -> Result<Fit, Error> {
            let set = |(name, _, written): &(String, f64, f64)| {
                Ok((Selector::parse(name)?, Setting::Set(*written)))
            };
            let moved =
                recorded.clone().with(&clamped.iter().map(set).collect::<Result<Settings, Error>>()?)?;
            let path = measurement.as_deref().unwrap_or(Path::new(&recorded.report.data.path));
            let measurement = read.or_as_in(Some(&recorded.report)).read(path)?;
            let settings = moved.settings(&measurement.channel_names())?;
            let options = samples.options_or_as_in(Some(&recorded.report))?.with_settings(settings);
            evaluate(&measurement, &moved.expression, &options)
        };
        match evaluated() {
            Ok(found) => Some(ModelError {
                model: found.model.canonical(),
                unbiased_cbrt: Some(found.errors.all.unbiased_cbrt),
                relative: found.errors.all.relative,
            }),
            Err(error) => {
                notes.push(format!("the error of what was written is unknown: {error}"));
                None
            }
        }
    }
}

/// What the report of a fit says about how it was made.
fn circumstances(options: &Options, fitted: &Fit, read: &ReadArguments, started: Instant) -> Circumstances {
    let total = started.elapsed().as_secs_f64();
    Circumstances {
        metric: options.metric,
        max_theta_deg: options.filters.max_theta_deg,
        options: read.recorded_in(OptionRecord::new(options, fitted)),
        times: Times { read: 0.0, fit: total, total, threads: rayon::current_num_threads() },
        fitted: true,
    }
}

/// How red, green and blue came from the channels of a measurement, if that needs a word.
fn colour_note(route: Route, measurement: &Measurement, primaries: &Primaries) -> Option<String> {
    let note = match route {
        Route::Spectrum => {
            let title = primaries.title;
            return Some(format!(
                "spectra were turned into {title} (CIE 1931 observer, light D65) before the fit"
            ));
        }
        Route::Rgb => return None,
        Route::Grey if measurement.channels.len() == 1 => return None,
        Route::Grey => "the channels are neither RGB nor spectral: their mean was fitted",
        Route::GreyFewWavelengths => "the wavelengths are too few for a colour: their mean was fitted",
        Route::GreyInvisible => "no wavelength is visible: their mean was fitted",
    };
    Some(note.to_owned())
}

/// The primaries of the colours of a report of red, green and blue or one channel, in words.
fn primaries_of(report: Option<&Report>, wanted: &Primaries) -> String {
    let converted = if wanted.are_rec709() {
        String::new()
    } else {
        format!(", converted to {} with Bradford adaptation", wanted.title)
    };
    match report.map(|report| (report.data.format.as_ref(), report.data.channels.len())) {
        Some((_, 1)) => "none: a single channel".to_owned(),
        Some(("merl", _)) => format!("those of the MERL camera, taken as linear Rec.709{converted}"),
        _ if converted.is_empty() => wanted.title.to_owned(),
        _ => format!("linear Rec.709{converted}"),
    }
}

/// A relative error in words.
fn percent(error: Option<&ModelError>) -> Option<String> {
    error.and_then(|error| error.relative).map(|relative| format!("{:.2} %", 100.0 * relative))
}

/// The lines of the comment in the file.
fn comment(record: &ExportRecord) -> Vec<String> {
    let mut lines = vec![format!("brdfit {}: {}", env!("CARGO_PKG_VERSION"), agreement(record))];
    lines.push(format!("model: {}", record.model));
    let name = Path::new(&record.measurement).file_name().map(|name| name.to_string_lossy().into_owned());
    lines.extend(name.map(|name| format!("measurement: {name}")));
    lines.push(format!("colours: {}", record.primaries));
    for (name, value, written) in &record.clamped {
        lines.push(format!("{name}: {value:.4} is outside the target's range; written: {written:.4}"));
    }
    lines.extend(record.notes.iter().map(|note| format!("note: {note}")));
    lines.into_iter().map(|line| line.replace(char::is_control, " ")).collect()
}

/// How close the file is to the fit, with both errors.
fn agreement(record: &ExportRecord) -> String {
    let how = match record.agreement {
        Agreement::Exact => "exact, in the formula of the fit",
        Agreement::Refitted => "refitted in the target's formula",
        Agreement::Approximate => "approximate, since values were moved into the target's range",
    };
    match (percent(record.exported.as_ref()), percent(record.fitted.as_ref())) {
        (Some(exported), Some(fitted)) if record.agreement != Agreement::Exact => {
            format!("{how}; relative error {exported}, of the fit {fitted}")
        }
        (Some(error), _) => format!("{how}; relative error {error}"),
        _ => how.to_owned(),
    }
}

/// What is said on standard error.
fn summary(record: &ExportRecord, output: Option<&Path>) -> Vec<String> {
    let name = output.map_or_else(|| record.target.to_owned(), |path| path.display().to_string());
    let mut lines = vec![format!("note: {name}: {}", agreement(record))];
    for (parameter, value, written) in &record.clamped {
        lines.push(format!(
            "warning: {parameter} = {value:.4} is outside the target's range; {written:.4} was written"
        ));
    }
    lines.extend(record.notes.iter().map(|note| format!("note: {note}")));
    lines
}
