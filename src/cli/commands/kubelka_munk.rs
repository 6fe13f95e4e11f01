//! `brdfit kubelka-munk`: absorption and scattering of paint from reflectances over known backings.

use crate::cli::messages::{emit, remark, say};
use crate::cli::options::report::ReportArguments;
use crate::cli::outcome::Outcome;
use crate::cli::output::{Output, json};
use brdfit::Error;
use brdfit::drawdown::{Record, Surface, fit, lines, read};
use brdfit::model::parts::paint_layers::surface_of_index;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `brdfit kubelka-munk`.
#[derive(Args)]
pub struct Arguments {
    /// CSV file of reflectances over black and white, or other known backings (docs/use/kubelka-munk.md)
    #[arg(value_name = "INPUT")]
    input: PathBuf,
    /// Set the thickness of the film, for a file without a thickness column ('inf': opaque paint)
    #[arg(long, value_name = "X", value_parser = positive)]
    thickness: Option<f64>,
    /// Set the shares that the film's surface reflects of light from outside and of diffuse light from inside
    #[arg(long, value_name = "K1,K2", value_parser = surface, conflicts_with = "eta")]
    saunderson: Option<Surface>,
    /// Compute these shares from the refractive index of the film
    #[arg(long, value_name = "N", value_parser = index)]
    eta: Option<f64>,
    #[command(flatten)]
    report: ReportArguments,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(x) if x > 0.0 => Ok(x),
        _ => Err("expected a number above 0, or 'inf'".to_owned()),
    }
}

fn surface(text: &str) -> Result<Surface, String> {
    let share = |text: &str| text.trim().parse().ok().filter(|k: &f64| (0.0..1.0).contains(k));
    let pair = text.split_once(',').and_then(|(k1, k2)| Some(Surface { k1: share(k1)?, k2: share(k2)? }));
    pair.ok_or_else(|| "expected two shares such as 0.04,0.596, each at least 0 and less than 1".to_owned())
}

fn index(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(n) if (1.01..=5.0).contains(&n) => Ok(n),
        _ => Err("expected a refractive index from 1.01 to 5".to_owned()),
    }
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let Arguments { input, thickness, eta, report, .. } = arguments;
    let of_index = eta.map(surface_of_index).map(|[k1, k2]| Surface { k1, k2 });
    let surface = arguments.saunderson.or(of_index).unwrap_or_default();
    report.check_inputs(std::slice::from_ref(input))?;
    let output = report.file().map(Output::open).transpose()?;
    let drawdown = read(input, *thickness)?;
    let fitted = fit(&drawdown, surface)?;
    let record = Record::new(&drawdown, &fitted, surface, *thickness, *eta);
    let written = json(&record)?;
    if report.json_alone() {
        emit(&written)?;
    }
    if !report.quiet() {
        if !report.json_alone() {
            say(&lines(&record, drawdown.thickness_known))?;
        }
        record.warnings().iter().for_each(|text| remark(&format!("warning: {text}")));
    }
    if let Some(output) = output {
        output.commit(written.as_bytes())?;
    }
    Ok(if record.usable { Outcome::Good } else { Outcome::NotUsable })
}
