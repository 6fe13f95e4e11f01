//! `brdfit report`: a web page about fits.

use crate::cli::messages::typed;
use crate::cli::options::input::{ReadArguments, SampleArguments};
use crate::cli::options::recorded::{Measurements, measurement_in, reports};
use crate::cli::outcome::Outcome;
use crate::cli::output::{Output, spares};
use crate::cli::progress::Late;
use brdfit::Error;
use brdfit::error::Place;
use brdfit::figure::Subject;
use brdfit::page::Page;
use brdfit::progress::Progress;
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Arguments of `brdfit report`.
#[derive(Args)]
pub struct Arguments {
    /// JSON reports of brdfit; those of one measurement are compared
    #[arg(value_name = "REPORT", required = true)]
    reports: Vec<PathBuf>,
    /// Write the page to this file
    #[arg(short, long, value_name = "FILE.html")]
    output: PathBuf,
    /// Give the page this title [default: the name of the material, or the number of materials]
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// Look for measurements here as well: a file, or a folder that has a file of the name in the report; repeat the option for more
    #[arg(long, value_name = "FILE|FOLDER")]
    measurement: Vec<PathBuf>,
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let Arguments { output, title, measurement: places, .. } = arguments;
    check_ending(output)?;
    for place in places {
        std::fs::metadata(place).map_err(Error::read(place))?;
    }
    let inputs = [arguments.reports.as_slice(), places].concat();
    spares(&inputs, "-o", Some(output))?;
    let late = Arc::new(Late::new(output));
    let subjects = subjects(arguments)?;
    let read: Vec<PathBuf> = subjects
        .iter()
        .filter_map(|subject| Some(subject.measurement.as_ref()?.source.path.clone()))
        .collect();
    spares(&read, "-o", Some(output))?;
    let file = Output::open(output)?;
    let page = Page::new(&subjects, title.as_deref(), typed, &(Arc::clone(&late) as Arc<dyn Progress>));
    late.finish();
    file.commit(page?.html()?.as_bytes())?;
    Ok(Outcome::Good)
}

/// Fails unless the name of the output is that of a web page, so that a slip does not replace a report.
fn check_ending(output: &Path) -> Result<(), Error> {
    let ending = output.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    match ending.as_deref() {
        Some("html" | "htm") => Ok(()),
        other => {
            let found = if other.is_some() { "another" } else { "none" };
            Err(Error::invalid(format!("-o {}", output.display()), "a name that ends in .html", found))
        }
    }
}

/// Every report with its measurement, each measurement read once.
fn subjects(arguments: &Arguments) -> Result<Vec<Subject>, Error> {
    // Each report says how its measurement was read, and which samples were fitted.
    let (samples, read) = (SampleArguments::default(), ReadArguments::default());
    let places = &arguments.measurement;
    let mut measurements = Measurements::default();
    let mut subjects = Vec::new();
    for path in &arguments.reports {
        let Some(several) = reports(path)? else {
            return Err(Error::malformed(path, Place::File, "a report of brdfit", "something else"));
        };
        for recorded in several {
            let report = &recorded.report;
            let measured = measurements.of(report, || measurement_in(&read, path, places, report))?;
            let options = samples.options_or_as_in(Some(report))?;
            let (path, measurement) = (path.clone(), Some(measured));
            subjects.push(Subject { path, recorded: Some(recorded), measurement, options });
        }
    }
    Ok(subjects)
}
