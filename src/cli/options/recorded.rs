//! Models from reports, and the measurements that they were fitted to.

use super::input::ReadArguments;
use crate::cli::messages::remark;
use brdfit::Error;
use brdfit::error::{Place, excerpt};
use brdfit::measurement::Measurement;
use brdfit::report::{Recorded, Report, is_report, read};
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The model in a report. If the file has several reports, it is that of the first, the best of the ranking, with a remark. `None` if
/// the file is not a report.
pub fn report(path: &Path) -> Result<Option<Recorded>, Error> {
    let Some(recorded) = reports(path)? else { return Ok(None) };
    let several = recorded.len();
    let Some(first) = recorded.into_iter().next() else {
        return Err(Error::malformed(path, Place::File, "a report", "none"));
    };
    if several > 1 {
        remark(&format!(
            "warning: {}: {several} reports; only the first, the best of the ranking, is used: {}, {}",
            path.display(),
            first.report.data.path,
            first.report.model
        ));
    }
    Ok(Some(first))
}

/// The models in a file of one report or several, the best of the ranking first. `None` if the file is not a report.
pub fn reports(path: &Path) -> Result<Option<Vec<Recorded>>, Error> {
    let mut file = File::open(path).map_err(Error::read(path))?;
    // A pipe can be read only once, by the reader of measurements.
    if !file.metadata().is_ok_and(|metadata| metadata.is_file()) {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    file.by_ref().take(4096).read_to_end(&mut bytes).map_err(Error::read(path))?;
    if !is_report(&bytes) {
        return Ok(None);
    }
    file.read_to_end(&mut bytes).map_err(Error::read(path))?;
    read(&bytes, path).map(Some)
}

/// The model in a file that must be a report.
pub fn the_report(path: &Path) -> Result<Recorded, Error> {
    report(path)?.ok_or_else(|| Error::malformed(path, Place::File, "a report of brdfit", "something else"))
}

/// Fails if the user names another measurement for an input that is not a report.
pub fn check_measurement(
    recorded: Option<&Recorded>,
    input: &Path,
    named: Option<&Path>,
) -> Result<(), Error> {
    match (recorded, named) {
        (None, Some(path)) => {
            let found = format!("{} and {}", input.display(), path.display());
            Err(Error::invalid("--measurement", "a report as INPUT, or no such option", found))
        }
        _ => Ok(()),
    }
}

/// The measurement of the report at `path`, or the one that the user names instead. An error says with `why` what it is needed for.
pub fn measurement_of(
    read: &ReadArguments,
    path: &Path,
    named: Option<&Path>,
    reported: &Report,
    why: &str,
) -> Result<Measurement, Error> {
    let read = read.or_as_in(Some(reported));
    match named {
        Some(named) => read.read(named),
        None => {
            let own = Path::new(&reported.data.path);
            own_measurement(&read, path, own, reported, why, "name it with --measurement")
        }
    }
}

/// The measurement that the report at `path` was made from, `input`. An error says with `why` what it is needed for, and with `hint`
/// what to do without it.
pub fn own_measurement(
    read: &ReadArguments,
    path: &Path,
    input: &Path,
    reported: &Report,
    why: &str,
    hint: &str,
) -> Result<Measurement, Error> {
    let expected = || {
        let sha256 = excerpt(&reported.data.sha256);
        format!("{why}its measurement {} (SHA-256 {sha256}); {hint}", input.display())
    };
    if !input.exists() {
        return Err(Error::malformed(path, Place::File, expected(), "no such file"));
    }
    let measurement = read.or_in_format(&reported.data.format).read(input)?;
    if measurement.source.sha256 != reported.data.sha256 {
        let found = format!("a file of SHA-256 {}", measurement.source.sha256);
        return Err(Error::malformed(path, Place::File, expected(), found));
    }
    Ok(measurement)
}

/// The measurements of several reports, each read once.
#[derive(Default)]
pub struct Measurements {
    known: Vec<(Key, Arc<Measurement>)>,
}

/// What makes the measurements of two reports the same: the file, and how it was read.
type Key = (String, Option<String>, String, Vec<String>);

impl Measurements {
    /// The measurement of a report, which `read` reads unless another report had the same.
    pub fn of(
        &mut self,
        report: &Report,
        read: impl FnOnce() -> Result<Measurement, Error>,
    ) -> Result<Arc<Measurement>, Error> {
        let options = &report.options;
        let key = (
            report.data.sha256.clone(),
            options.material.clone(),
            options.merl_bins.name().to_owned(),
            options.reading.clone(),
        );
        if let Some((_, measured)) = self.known.iter().find(|(known, _)| *known == key) {
            return Ok(Arc::clone(measured));
        }
        let measured = Arc::new(read()?);
        self.known.push((key, Arc::clone(&measured)));
        Ok(measured)
    }
}

/// The measurement of the report at `path`, by its SHA-256: the one at the path in the report, or one of the `places` that the user
/// names, files or folders that have a file of the same name.
pub fn measurement_in(
    read: &ReadArguments,
    path: &Path,
    places: &[PathBuf],
    report: &Report,
) -> Result<Measurement, Error> {
    let read = read.or_as_in(Some(report));
    let own = PathBuf::from(&report.data.path);
    let in_folder = |place: &PathBuf| {
        if place.is_dir() { own.file_name().map(|name| place.join(name)) } else { Some(place.clone()) }
    };
    let mut candidates: Vec<PathBuf> = places.iter().filter_map(in_folder).collect();
    // Reading a large file to find that it is another takes long: files of the same name come first.
    candidates.sort_by_key(|candidate| candidate.file_name() != own.file_name());
    for candidate in candidates.iter().filter(|candidate| candidate.exists()) {
        let measurement = read.or_in_format(&report.data.format).read(candidate);
        if let Ok(measurement) = measurement
            && measurement.source.sha256 == report.data.sha256
        {
            return Ok(measurement);
        }
    }
    let hint = "name it, or a folder that has it, with --measurement";
    own_measurement(&read, path, &own, report, "", hint)
}
