//! The files that `brdfit fit` writes its reports to.

use crate::cli::output::{Output, json};
use brdfit::Error;
use brdfit::report::{Report, Reports};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// The files that reports are written to.
pub enum Outputs {
    /// Reports are not written to a file.
    None,
    /// All reports go to one file.
    One(Output),
    /// Each input has its own file in a folder.
    Folder(PathBuf, Vec<PathBuf>),
}

impl Outputs {
    /// Prepares to write the reports of `inputs` to `path`: a file, or a folder for one file per input.
    pub fn open(path: Option<&Path>, inputs: &[PathBuf]) -> Result<Self, Error> {
        let Some(path) = path else { return Ok(Self::None) };
        let asked_for_folder = path.as_os_str().to_string_lossy().ends_with(std::path::MAIN_SEPARATOR);
        if !path.is_dir() && !asked_for_folder {
            return Ok(Self::One(Output::open(path)?));
        }
        if let Some(parent) = path.parent().filter(|p| !p.as_os_str().is_empty() && !p.is_dir()) {
            let error = std::io::Error::from(std::io::ErrorKind::NotFound);
            return Err(Error::write(parent)(error));
        }
        let as_file = path.to_string_lossy();
        if Path::new(as_file.trim_end_matches(std::path::MAIN_SEPARATOR)).is_file() {
            return Err(Error::invalid(format!("-o {as_file}"), "a folder", "a file"));
        }
        let mut taken = HashSet::new();
        let mut paths = Vec::new();
        for input in inputs {
            let stem =
                input.file_stem().map_or_else(|| "report".into(), |s| s.to_string_lossy().into_owned());
            // A number distinguishes inputs of the same name from different folders.
            let name = (1..)
                .map(|n| if n == 1 { stem.clone() } else { format!("{stem}-{n}") })
                .find(|name| taken.insert(name.clone()))
                .unwrap_or(stem);
            paths.push(path.join(format!("{name}.json")));
        }
        // An existing folder is tested for writing now; a missing one is created with the first report.
        if path.is_dir() {
            paths.iter().try_for_each(|path| Output::open(path).map(drop))?;
        }
        Ok(Self::Folder(path.to_owned(), paths))
    }

    /// Writes the reports of one input, if each input has its own file.
    pub fn input_done(&self, index: usize, reports: &[Report]) -> Result<(), Error> {
        let Self::Folder(folder, paths) = self else { return Ok(()) };
        let Some(path) = paths.get(index) else { return Ok(()) };
        std::fs::create_dir_all(folder).map_err(Error::write(folder))?;
        let text = match reports {
            [only] => json(only)?,
            several => json(&Reports::new(several.to_vec(), Vec::new()))?,
        };
        Output::open(path)?.commit(text.as_bytes())
    }

    /// Writes all reports, if they go to one file.
    pub fn all_done(self, text: &str) -> Result<(), Error> {
        match self {
            Self::One(output) => output.commit(text.as_bytes()),
            _ => Ok(()),
        }
    }
}
