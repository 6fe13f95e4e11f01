//! `brdfit render`: images of a measurement, and of a fit beside it.

use crate::cli::messages::remark;
use crate::cli::options::input::{ReadArguments, measurement_help};
use crate::cli::options::recorded::{check_measurement, measurement_of, report};
use crate::cli::outcome::Outcome;
use crate::cli::output::{Output, json, spares};
use brdfit::Error;
use brdfit::image::{Image, ToRgb, absolute_difference, exr, png, side_by_side};
use brdfit::measurement::checked_max_theta;
use brdfit::scene::Scene;
use brdfit::select::{ModelAt, render};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `brdfit render`.
#[derive(Args)]
pub struct Arguments {
    #[arg(value_name = "INPUT", help = input_help())]
    input: PathBuf,
    /// Read the scene (surface, camera and lights) from this JSON file [default: a ball between three softboxes]
    #[arg(long, value_name = "SCENE")]
    scene: Option<PathBuf>,
    /// Use this measurement instead of the one that the report names
    #[arg(long, value_name = "FILE")]
    measurement: Option<PathBuf>,
    /// Leave black what is seen at theta_i or theta_o above this angle, degrees
    #[arg(long, default_value_t = 90.0, value_name = "DEG")]
    max_theta: f64,
    #[command(flatten)]
    read: ReadArguments,
    /// Write to this file: linear radiance as EXR, or an exposed PNG, by the ending of its name
    #[arg(short, long, value_name = "FILE.exr|FILE.png")]
    output: PathBuf,
}

fn input_help() -> String {
    let measurement = measurement_help("a measurement");
    format!(
        "JSON report of brdfit, which is rendered measured, fitted, and their difference, side by side; or {measurement}"
    )
}

/// Sides of the image of the default scene, pixels.
const SIDE: u32 = 128;

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let Arguments { input, scene, measurement, max_theta, read, output } = arguments;
    let ending = output.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    let is_png = match ending.as_deref() {
        Some("png") => true,
        Some("exr") => false,
        _ => {
            let subject = format!("-o {}", output.display());
            return Err(Error::invalid(subject, "a name that ends in .exr or .png", "another"));
        }
    };
    let max_theta = checked_max_theta(*max_theta)?;
    let recorded = report(input)?;
    check_measurement(recorded.as_ref(), input, measurement.as_deref())?;
    let inputs: Vec<PathBuf> =
        [Some(input), scene.as_ref(), measurement.as_ref()].into_iter().flatten().cloned().collect();
    spares(&inputs, "-o", Some(output))?;
    let file = Output::open(output)?;
    let scene = scene.as_deref().map_or_else(|| Scene::studio(SIDE), Scene::read)?;
    let measured = match &recorded {
        None => read.read(input)?,
        Some(recorded) => measurement_of(read, input, measurement.as_deref(), &recorded.report, "")?,
    };
    let values =
        recorded.as_ref().map(|recorded| recorded.values_in(&measured.channel_names(), input)).transpose()?;
    let model = recorded.as_ref().zip(values.as_ref());
    let model = model.map(|(recorded, values)| ModelAt { expression: &recorded.expression, values });
    let rendered = render(&measured, &scene, model.as_slice(), max_theta)?;
    let fitted = rendered.fitted.first();
    let incomplete = ToRgb::new(&measured.channels).incomplete_in_words(&measured);
    incomplete.iter().for_each(|said| remark(&format!("note: {said}")));
    let apart = fitted.map(|(image, _)| absolute_difference(&rendered.measured, image)).transpose()?;
    let mut panels: Vec<&Image> = vec![&rendered.measured];
    panels.extend(fitted.map(|(image, _)| image));
    panels.extend(&apart);
    let bytes = if is_png {
        let exposed: Vec<Image> = panels.iter().map(|image| image.exposed(rendered.exposure)).collect();
        png(&side_by_side(&exposed.iter().collect::<Vec<_>>())?, 1.0)?
    } else {
        let what = if panels.len() > 1 { "measured, fitted, absolute difference" } else { "measured" };
        let model = recorded.as_ref().map(|recorded| recorded.expression.canonical());
        let scene = scene.path().display().to_string();
        let data = measured.source.path.display().to_string();
        let about = serde_json::json!({ "image": what, "data": data, "scene": scene, "model": model });
        exr(&side_by_side(&panels)?, &json(&about)?)?
    };
    file.commit(&bytes)?;
    if let Some((_, differences)) = fitted {
        let relative =
            differences.relative_rmse.map_or_else(|| "-".to_owned(), |rmse| format!("{:.2} %", 100.0 * rmse));
        let p95 = differences.delta_e_2000.p95;
        remark(&format!(
            "note: {}: measured, fitted, difference; relative RMSE {relative}, 95 % of the pixels within {p95:.2} CIEDE2000",
            output.display()
        ));
    }
    Ok(Outcome::Good)
}
