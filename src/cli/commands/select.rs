//! `brdfit select`: the cheapest model that a scene cannot tell from the measurement.

use crate::cli::messages::{emit, remark, say};
use crate::cli::options::input::{ReadArguments, SampleArguments, WITH_SCENE, measurement_help};
use crate::cli::options::report::ReportArguments;
use crate::cli::options::threads::{at_least_one, threads};
use crate::cli::outcome::Outcome;
use crate::cli::output::{Output, json};
use crate::cli::progress::Bar;
use brdfit::Error;
use brdfit::fit::Options;
use brdfit::image::{ToRgb, absolute_difference, delta_e_2000, exr, false_colour, png, side_by_side};
use brdfit::lines::Lines;
use brdfit::model::Expression;
use brdfit::scene::Scene;
use brdfit::select::{self, DRAWN, JUST_NOTICEABLE, Request, Selected, checked_tolerance, lines, name};
use clap::Args;
use std::path::{Path, PathBuf};

/// Arguments of `brdfit select`.
#[derive(Args)]
pub struct Arguments {
    #[arg(value_name = "INPUT", help = measurement_help("Measurement to render and fit"))]
    input: PathBuf,
    /// Read the scene (surface, camera and lights) from this JSON file
    #[arg(long, value_name = "SCENE")]
    scene: PathBuf,
    /// Largest accepted colour difference: 95th percentile of CIEDE2000 over the image
    #[arg(long, default_value_t = JUST_NOTICEABLE, value_name = "T")]
    tolerance: f64,
    /// Try this model; repeat the option for several [default: the fourteen models of tradeoff]
    #[arg(short, long = "model", value_name = "EXPR")]
    models: Vec<String>,
    /// Write images into this folder: measured.exr, fitted.exr, comparison.exr and .png, and delta-e.png
    #[arg(long, value_name = "FOLDER")]
    images: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArguments,
    // By default the image of the scene is fitted. With any other --weights the samples are fitted, which shows by
    // comparison what fitting the image gains.
    #[command(flatten)]
    samples: SampleArguments<WITH_SCENE>,
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
    let mut filters = arguments.samples.filters_up_to(90.0)?;
    let wanted = arguments.samples.samples_or(Some(DRAWN));
    // A scene has millions of pairs of directions, so their number is limited; that of a measurement's samples is not.
    filters.samples = if filters.weighting.is_none() { wanted.or(Some(DRAWN)) } else { wanted };
    let options = Options::default()
        .with_metric(arguments.samples.metric())
        .with_filters(filters)
        .with_seed(arguments.samples.seed());
    let tolerance = checked_tolerance(arguments.tolerance)?;
    arguments.report.check_inputs(&[arguments.input.clone(), arguments.scene.clone()])?;
    let report = arguments.report.file().map(Output::open).transpose()?;
    let scene = Scene::read(&arguments.scene)?;
    let measurement = arguments.read.read(&arguments.input)?;
    let incomplete = ToRgb::new(&measurement.channels).incomplete_in_words(&measurement);
    incomplete.iter().for_each(|said| remark(&format!("note: {said}")));
    let images = arguments.images.as_deref().map(Images::open).transpose()?;

    let bar = Bar::new(1, arguments.report.quiet());
    bar.begin(&arguments.input);
    let request = Request { expressions: &expressions, options: &options, tolerance };
    let pool = threads(arguments.threads.unwrap_or(0))?;
    let found = pool.install(|| select::select(&measurement, &scene, &request, &bar));
    bar.finish();
    let found = found?;

    let text = json(&found.selected)?;
    if arguments.report.json_alone() {
        emit(&text)?;
    } else if !arguments.report.quiet() {
        say(&lines(&found.selected))?;
    }
    if let Some(output) = report {
        output.commit(text.as_bytes())?;
    }
    if let (Some(images), Some(folder)) = (images, &arguments.images) {
        images.write(&found)?;
        if !arguments.report.json_alone() && !arguments.report.quiet() {
            let (shown, folder) = (found.selected.shown(), folder.display());
            let said = format!("the images in {folder} show {} in {}\n", name(shown), shown.precision);
            say(&Lines::from(&*said))?;
        }
    }
    Ok(if found.selected.answer.is_some() { Outcome::Good } else { Outcome::NotUsable })
}

/// The files that `--images` writes.
struct Images {
    measured: Output,
    fitted: Output,
    side_by_side: Output,
    comparison: Output,
    delta_e: Output,
}

impl Images {
    fn open(folder: &Path) -> Result<Self, Error> {
        std::fs::create_dir_all(folder).map_err(Error::write(folder))?;
        let open = |name: &str| Output::open(&folder.join(name));
        Ok(Self {
            measured: open("measured.exr")?,
            fitted: open("fitted.exr")?,
            side_by_side: open("comparison.exr")?,
            comparison: open("comparison.png")?,
            delta_e: open("delta-e.png")?,
        })
    }

    fn write(self, found: &select::Outcome) -> Result<(), Error> {
        let select::Outcome { selected, measured, fitted, compared } = found;
        let exposure = selected.shown().differences.exposure;
        let note = |what: &str| -> Result<String, Error> { json(&about(what, selected)) };
        let apart = absolute_difference(measured, fitted)?;
        let panels = [measured, fitted, &apart];
        let linear = side_by_side(&panels)?;
        let comparison = side_by_side(&panels.map(|image| image.exposed(exposure)).each_ref())?;
        let delta_e = delta_e_2000(measured, fitted, compared, exposure)?;
        let top = 2.0 * selected.tolerance;
        let map = false_colour(measured.width, measured.height, &delta_e, compared, top)?;
        self.measured.commit(&exr(measured, &note("measured")?)?)?;
        self.fitted.commit(&exr(fitted, &note("fitted")?)?)?;
        self.side_by_side.commit(&exr(&linear, &note("measured, fitted, absolute difference")?)?)?;
        self.comparison.commit(&png(&comparison, 1.0)?)?;
        self.delta_e.commit(&png(&map, 1.0)?)
    }
}

/// The description that is stored in an EXR image.
fn about(what: &str, selected: &Selected) -> serde_json::Value {
    let shown = selected.shown();
    serde_json::json!({
        "image": what,
        "data": selected.data.path,
        "scene": selected.scene.path,
        "model": shown.model,
        "precision": shown.precision,
    })
}
