//! `brdfit plot`: figures of measurements and fits.

use crate::cli::messages::remark;
use crate::cli::options::input::{ReadArguments, SampleArguments, measurement_help};
use crate::cli::options::recorded::{Measurements, check_measurement, measurement_of, reports};
use crate::cli::outcome::Outcome;
use crate::cli::output::{Output, spares};
use crate::cli::progress::Late;
use brdfit::Error;
use brdfit::figure::{Against, Axes, Drawing, KINDS, Kind, Needs, Scale, Subject, Wanted, Width};
use brdfit::progress::Progress;
use brdfit::report::Recorded;
use brdfit::scene::Scene;
use clap::builder::PossibleValuesParser;
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Arguments of `brdfit plot`.
#[derive(Args)]
pub struct Arguments {
    #[arg(value_name = "REPORT|INPUT", required = true, help = input_help())]
    inputs: Vec<PathBuf>,
    #[arg(long, value_name = "KIND", help = kind_help(), value_parser = PossibleValuesParser::new(KINDS.iter().map(|kind| kind.name)))]
    kind: String,
    /// Write to this file, as the ending of its name says: SVG, or the panels of a map or sphere alone as PNG
    #[arg(short, long, value_name = "FILE.svg|FILE.png")]
    output: PathBuf,
    /// Write every number of the figure to this CSV file as well
    #[arg(long, value_name = "FILE")]
    data: Option<PathBuf>,
    /// Make it as wide as one column of text (85 mm) or two (175 mm)
    #[arg(long, value_enum, default_value = "one")]
    width: Columns,
    /// Leave out the caption
    #[arg(long)]
    no_caption: bool,
    /// Draw a lobe over axes at right angles or as a polar diagram
    #[arg(long, value_enum, default_value = "cartesian")]
    axes: AxesName,
    /// Show f on this scale [default: linear, or log where f spans more than a factor of 30]
    #[arg(long, value_enum)]
    f_scale: Option<ScaleName>,
    /// Show a lobe at this angle of incidence in degrees; repeat the option for several [default: four of those measured]
    #[arg(long, value_name = "DEG")]
    theta_i: Vec<f64>,
    /// Show this channel; repeat the option for several [default: one for one column or a map, three for two columns]
    #[arg(long, value_name = "NAME")]
    channel: Vec<String>,
    /// Show a front against the number of parameters or the cost of an evaluation
    #[arg(long, value_enum, default_value = "parameters")]
    against: AgainstName,
    /// Read the scene of the spheres from this JSON file [default: a ball between three softboxes]
    #[arg(long, value_name = "SCENE")]
    scene: Option<PathBuf>,
    /// Use this measurement instead of the one that the reports name
    #[arg(long, value_name = "FILE")]
    measurement: Option<PathBuf>,
    #[command(flatten)]
    samples: SampleArguments,
    #[command(flatten)]
    read: ReadArguments,
}

#[derive(Clone, Copy, ValueEnum)]
enum Columns {
    One,
    Two,
}

#[derive(Clone, Copy, ValueEnum)]
enum AxesName {
    Cartesian,
    Polar,
}

#[derive(Clone, Copy, ValueEnum)]
enum ScaleName {
    Linear,
    Log,
}

#[derive(Clone, Copy, ValueEnum)]
enum AgainstName {
    Parameters,
    Cost,
}

fn input_help() -> String {
    let measurement = measurement_help("a measurement, which lobe, map and sphere show alone");
    format!("JSON reports of brdfit, which lobe, residuals, fresnel and front compare; or {measurement}")
}

fn kind_help() -> String {
    let lines: Vec<String> = KINDS.iter().map(|kind| format!("{}: {}", kind.name, kind.summary)).collect();
    format!("Choose what to draw. {}", lines.join("; "))
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let Arguments { inputs, output, data, scene, measurement, .. } = arguments;
    let Some(kind) = KINDS.iter().find(|kind| kind.name == arguments.kind) else {
        return Err(Error::invalid("--kind", "a kind of figure", arguments.kind.clone()));
    };
    let is_png = is_png(output, kind)?;
    for theta_i in &arguments.theta_i {
        if !(0.0..90.0).contains(theta_i) {
            return Err(Error::invalid(
                "--theta-i",
                "at least 0 and less than 90 degrees",
                theta_i.to_string(),
            ));
        }
    }
    let recorded = recorded(inputs)?;
    for (path, recorded) in &recorded {
        check_measurement(recorded.as_ref(), path, measurement.as_deref())?;
    }
    let mut read: Vec<PathBuf> = inputs.clone();
    read.extend([scene, measurement].into_iter().flatten().cloned());
    spares(&read, "-o", Some(output))?;
    spares(&read, "--data", data.as_deref())?;
    let file = Output::open(output)?;
    let table = data.as_deref().map(Output::open).transpose()?;

    let subjects = subjects(arguments, kind, recorded)?;
    let late = Arc::new(Late::new(output));
    let figure = (kind.compute)(&subjects, &wanted(arguments, Arc::clone(&late) as Arc<dyn Progress>)?);
    late.finish();
    let figure = figure?;
    let width = match arguments.width {
        Columns::One => Width::One,
        Columns::Two => Width::Two,
    };
    let bytes = if is_png {
        figure.png()?
    } else {
        figure.svg(Drawing { width, caption: !arguments.no_caption, ..Drawing::default() })?.into_bytes()
    };
    let numbers = table.is_some().then(|| figure.csv()).transpose()?;
    file.commit(&bytes)?;
    if let (Some(table), Some(numbers)) = (table, numbers) {
        table.commit(&numbers)?;
    }
    if arguments.no_caption || is_png {
        remark(&format!("note: {}: {}", output.display(), figure.caption));
    }
    Ok(Outcome::Good)
}

/// Whether the name of the output asks for a PNG.
fn is_png(output: &Path, kind: &Kind) -> Result<bool, Error> {
    let ending = output.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    match ending.as_deref() {
        Some("svg") => Ok(false),
        Some("png") if kind.raster => Ok(true),
        other => {
            let raster: Vec<&str> = KINDS.iter().filter(|kind| kind.raster).map(|kind| kind.name).collect();
            let expected = format!("a name that ends in .svg (.png: {} only)", raster.join(" and "));
            let subject = format!("-o {}", output.display());
            Err(Error::invalid(subject, expected, if other.is_some() { "another" } else { "none" }))
        }
    }
}

/// Every report of the inputs, and inputs that are none, each with its file.
fn recorded(inputs: &[PathBuf]) -> Result<Vec<(PathBuf, Option<Recorded>)>, Error> {
    let mut all = Vec::new();
    for path in inputs {
        match reports(path)? {
            None => all.push((path.clone(), None)),
            Some(several) => all.extend(several.into_iter().map(|recorded| (path.clone(), Some(recorded)))),
        }
    }
    Ok(all)
}

/// What the figure is about, with the measurements read as far as it needs them, each once.
fn subjects(
    arguments: &Arguments,
    kind: &Kind,
    recorded: Vec<(PathBuf, Option<Recorded>)>,
) -> Result<Vec<Subject>, Error> {
    let Arguments { read, measurement, samples, .. } = arguments;
    let mut measurements = Measurements::default();
    let mut subjects = Vec::new();
    for (path, recorded) in recorded {
        let report = recorded.as_ref().map(|recorded| &recorded.report);
        let measured = match (report, kind.needs) {
            (_, Needs::Report) | (None, Needs::Both) => None,
            (None, Needs::Measurement) => Some(Arc::new(read.read(&path)?)),
            (Some(report), _) => Some(
                measurements
                    .of(report, || measurement_of(read, &path, measurement.as_deref(), report, ""))?,
            ),
        };
        let options = samples.options_or_as_in(report)?;
        subjects.push(Subject { path, recorded, measurement: measured, options });
    }
    Ok(subjects)
}

fn wanted(arguments: &Arguments, progress: Arc<dyn Progress>) -> Result<Wanted, Error> {
    Ok(Wanted {
        most_channels: match arguments.width {
            Columns::One => 1,
            Columns::Two => 3,
        },
        channels: arguments.channel.clone(),
        axes: Some(match arguments.axes {
            AxesName::Cartesian => Axes::Cartesian,
            AxesName::Polar => Axes::Polar,
        }),
        scale: arguments.f_scale.map(|scale| match scale {
            ScaleName::Linear => Scale::Linear,
            ScaleName::Log => Scale::Log,
        }),
        theta_i_deg: arguments.theta_i.clone(),
        against: match arguments.against {
            AgainstName::Parameters => Against::Parameters,
            AgainstName::Cost => Against::Cost,
        },
        scene: arguments.scene.as_deref().map(Scene::read).transpose()?,
        progress,
    })
}
