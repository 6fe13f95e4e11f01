//! Models from reports.

use super::input::ReadArguments;
use crate::cli::messages::remark;
use brdfit::Error;
use brdfit::error::{Place, excerpt};
use brdfit::measurement::Measurement;
use brdfit::report::{Recorded, Report, is_report, read};
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

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
