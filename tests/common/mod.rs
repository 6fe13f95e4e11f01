//! What the integration tests share: running the program, and finding the measured data.

#![allow(clippy::print_stderr)]

pub mod truth;

use brdfit::model::{AnyModel, Choices, ModelEntry, REGISTRY};
use std::collections::BTreeMap;
#[cfg(feature = "cli")]
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
#[cfg(feature = "cli")]
use std::time::Duration;
use tempfile::TempDir;

/// A file of the model's sources.
pub fn model_source(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src/model").join(path)
}

/// The file of a model, whose head is its manual.
pub fn manual_of(model: &str) -> PathBuf {
    let file = format!("{}.rs", model.replace('-', "_"));
    let [zoo, published] = ["zoo", "published"].map(|folder| model_source(folder).join(&file));
    if zoo.exists() { zoo } else { published }
}

/// Every variant of every model.
pub fn every_variant() -> impl Iterator<Item = (&'static ModelEntry, AnyModel, Choices)> {
    let of = |entry: &'static ModelEntry| {
        entry.variants().into_iter().map(move |(model, choices)| (entry, model, choices))
    };
    REGISTRY.iter().flat_map(of)
}

/// Whether a variant differs from the default in more than one choice: it is a product of others' parts.
pub fn is_product(entry: &ModelEntry, choices: &Choices) -> bool {
    entry.options.iter().filter(|o| choices.get(o.key) != o.default).count() > 1
}

/// What one run of the program left behind.
#[derive(Debug)]
pub struct Run {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Run {
    /// The result of a run that must have succeeded, with nothing but warnings on standard error.
    pub fn good(self) -> Self {
        assert_eq!(self.code, Some(0), "{self:?}");
        assert!(only_warnings(&self.stderr), "{self:?}");
        self
    }

    /// Standard output as JSON, which must be all that there is.
    pub fn json(&self) -> serde_json::Value {
        parse(&self.stdout)
    }
}

/// Whether every line of a standard error is a warning: no progress, no error.
pub fn only_warnings(stderr: &str) -> bool {
    stderr.lines().all(|line| line.starts_with("warning: "))
}

pub fn parse(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("not JSON: {e}\n{text}"))
}

/// A temporary folder that the program runs in.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// The relative path of everything in the folder, with the content of small files.
    pub fn listing(&self) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
        fn visit(folder: &Path, root: &Path, found: &mut BTreeMap<PathBuf, Option<Vec<u8>>>) {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                let meta = fs::metadata(&path).unwrap();
                let content = (meta.is_file() && meta.len() < 100_000).then(|| fs::read(&path).unwrap());
                found.insert(path.strip_prefix(root).unwrap().to_owned(), content);
                if meta.is_dir() {
                    visit(&path, root, found);
                }
            }
        }
        let mut found = BTreeMap::new();
        visit(self.0.path(), self.0.path(), &mut found);
        found
    }

    /// Runs `brdfit` with these arguments in this folder.
    #[cfg(feature = "cli")]
    pub fn run<S: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = S>) -> Run {
        let output = assert_cmd::Command::new(env!("CARGO_BIN_EXE_brdfit"))
            .current_dir(self.0.path())
            .args(arguments)
            .env("RUST_BACKTRACE", "0")
            // Killed if it hangs: the exit code is none then. What takes longest needs half a minute, and shares two cores with
            // other tests.
            .timeout(Duration::from_secs(300))
            .output()
            .unwrap();
        Run {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).expect("UTF-8 on stdout"),
            stderr: String::from_utf8(output.stderr).expect("UTF-8 on stderr"),
        }
    }

    /// Runs `brdfit` with arguments as typed: split at blanks, single quotes keep blanks together.
    #[cfg(feature = "cli")]
    pub fn brdfit(&self, line: &str) -> Run {
        self.run(typed(line))
    }
}

/// The arguments of a command line: split at blanks, single quotes keep blanks together.
pub fn typed(line: &str) -> Vec<String> {
    let mut arguments = Vec::new();
    for (index, part) in line.split('\'').enumerate() {
        if index % 2 == 1 {
            arguments.push(part.to_owned());
        } else {
            arguments.extend(part.split_whitespace().map(str::to_owned));
        }
    }
    arguments
}

/// A file of the shared measured data, or none with a visible line where the data are absent.
pub fn shared(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("BRDFIT_SHARED_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let path = root.join(name);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: {} is absent (set BRDFIT_SHARED_DATA)", path.display());
    None
}

/// Number of cells of a MERL table: 90 x 90 x 180.
pub const CELLS: usize = 1_458_000;

/// The header of a binary table with these dimensions.
pub fn merl_header(dimensions: [i32; 3]) -> Vec<u8> {
    dimensions.map(i32::to_le_bytes).concat()
}

/// A whole MERL table whose cells all hold `value`.
pub fn merl_filled(value: f64) -> Vec<u8> {
    let mut bytes = merl_header([90, 90, 180]);
    bytes.extend(value.to_le_bytes().repeat(3 * CELLS));
    bytes
}
