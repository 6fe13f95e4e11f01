//! Options about parameters: `P=V`, `P=LO..HI`, `P=Q`, `P`.

use super::recorded::report;
use crate::cli::messages::typed;
use brdfit::Error;
use brdfit::error::OptionName;
use brdfit::parameters::SettingTexts;
use brdfit::report::Recorded;
use clap::Args;
use std::path::{Path, PathBuf};

/// The options that fix, start, bound, free, tie and share parameters.
#[derive(Args)]
pub struct SettingArguments {
    /// Fix parameters at values
    #[arg(long, value_name = "P=V", num_args = 1..)]
    fix: Vec<String>,
    /// Start parameters from values, or from those in a JSON report of brdfit, whose model is fitted unless -m names one
    #[arg(long, value_name = "P=V|REPORT", num_args = 1..)]
    init: Vec<String>,
    /// Bound parameters by two values each
    #[arg(long, value_name = "P=LO..HI", num_args = 1..)]
    bounds: Vec<String>,
    /// Fit a parameter that is fixed by default
    #[arg(long, value_name = "P")]
    free: Vec<String>,
    /// Make parameters equal to others
    #[arg(long, value_name = "P=Q", num_args = 1..)]
    tie: Vec<String>,
    /// Give a parameter one value per channel
    #[arg(long, value_name = "P")]
    per_channel: Vec<String>,
    /// Give a parameter one value for all channels
    #[arg(long, value_name = "P")]
    shared: Vec<String>,
}

impl SettingArguments {
    /// The options as the user typed them, for the report. `start` is the report that the fit starts from.
    pub fn as_given(&self, start: Option<&Path>) -> Vec<String> {
        let texts = self.texts();
        let texts = texts.as_given().into_iter().map(|(option, text)| format!("{} {text}", typed(option)));
        let start = start.map(|path| format!("{} {}", typed(OptionName::Init), path.display()));
        texts.chain(start).collect()
    }

    /// Files that stand behind these options: in `--fix m=0.2 FILE` the parser takes FILE for another value. A report behind
    /// `--init` is a start.
    pub fn files(&self) -> Result<Files, Error> {
        let mut files = Files { start: None, inputs: Vec::new() };
        for path in self.init.iter().filter(|text| is_file(text)).map(PathBuf::from) {
            match report(&path)? {
                None => files.inputs.push(path),
                Some(recorded) if files.start.is_none() => files.start = Some((path, recorded)),
                Some(_) => return Err(Error::invalid(OptionName::Init, "one report at most", "two")),
            }
        }
        let others = [&self.fix, &self.bounds, &self.tie].into_iter().flatten();
        files.inputs.extend(others.filter(|text| is_file(text)).map(PathBuf::from));
        Ok(files)
    }

    /// The options as given.
    pub fn texts(&self) -> SettingTexts {
        let settings = |texts: &[String]| texts.iter().filter(|text| !is_file(text)).cloned().collect();
        SettingTexts {
            fix: settings(&self.fix),
            init: settings(&self.init),
            bounds: settings(&self.bounds),
            free: self.free.clone(),
            tie: settings(&self.tie),
            per_channel: self.per_channel.clone(),
            shared: self.shared.clone(),
        }
    }
}

/// The files among the values of options about parameters.
pub struct Files {
    /// A report whose values the fit starts from, with its path.
    pub start: Option<(PathBuf, Recorded)>,
    /// Measurements to fit.
    pub inputs: Vec<PathBuf>,
}

/// Whether a value of an option about parameters is a file: it names a folder before any `=`, as in `./a=b.csv`, or it has
/// no `=` and exists.
pub fn is_file(text: &str) -> bool {
    let (before, rest) = text.split_once('=').map_or((text, None), |(before, rest)| (before, Some(rest)));
    before.contains(std::path::is_separator) || (rest.is_none() && Path::new(text).exists())
}
