//! What everything costs: one evaluation, one pass over the samples, a whole fit, a database.
//!
//! ```text
//! cargo bench --bench suite -- --quick                        under a minute, to see that it works
//! cargo bench --bench suite -- FILE...                        the tables of docs/inside/performance.md, printed
//! cargo bench --bench suite -- FILE... --baseline python3     the same beside scripts/baseline_scipy.py
//! cargo bench --bench suite -- FILE... --update-docs          writes the tables into docs/inside/performance.md
//! cargo bench --bench suite -- --only yardstick               one section
//! ```
//!
//! FILEs are full MERL-format tables and measurements in any other format that the program reads. Without a
//! table one of a satin material is made, and likewise a measurement of 31 wavelengths. All times are wall-clock
//! medians and depend on the machine; nothing fails on them. Run it on an idle machine.
//!
//! To add a section: write a [`Section`], add a line to [`SECTIONS`], and its two marker
//! comments to docs/inside/performance.md.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::unreachable,
    clippy::indexing_slicing,
    clippy::print_stdout,
    clippy::print_stderr
)]

mod code;
mod course;
mod database;
mod evaluation;
mod fits;
mod inputs;
mod machine;
mod passes;
mod process;
mod reading;
mod scaling;
mod stages;
mod timing;
mod yardstick;
mod zoo;

use clap::Parser;
use inputs::Inputs;
use std::path::{Path, PathBuf};
use timing::Effort;

/// Measures something; Markdown.
type Section = fn(&Setup) -> String;

/// The sections in the order in which they are run and stand in the document.
const SECTIONS: [(&str, Section); 16] = [
    ("machine", machine::describe),
    ("whole fits", fits::whole_fits),
    ("baseline", fits::baseline),
    ("course", course::table),
    ("stages", stages::table),
    ("passes", passes::table),
    ("evaluation", evaluation::table),
    ("yardstick", yardstick::table),
    ("zoo", zoo::table),
    ("code", code::table),
    ("scaling", scaling::table),
    ("threads", scaling::threads),
    ("spectral", fits::spectral),
    ("database", database::table),
    ("reading", reading::table),
    ("table-of-text", reading::table_of_text),
];

/// Measures what everything costs.
#[derive(Parser)]
pub struct Arguments {
    /// Full MERL-format tables, and measurements in other formats
    files: Vec<PathBuf>,
    /// A Python with numpy and scipy: times scripts/baseline_scipy.py and scripts/baseline_numpy_ggx.py beside the program
    #[arg(long, value_name = "PYTHON")]
    baseline: Option<PathBuf>,
    /// The script that --baseline runs
    #[arg(long, value_name = "FILE", default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/baseline_scipy.py"))]
    baseline_script: PathBuf,
    /// Writes the tables into docs/inside/performance.md
    #[arg(long, conflicts_with_all = ["quick", "only"])]
    update_docs: bool,
    /// What to call this state of the program in the document, beside the machine
    #[arg(long, value_name = "TEXT")]
    label: Option<String>,
    /// Less of everything, measured for a shorter time
    #[arg(long)]
    quick: bool,
    /// Only the sections whose name contains this text
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
    /// Cargo adds this
    #[arg(long, hide = true)]
    bench: bool,
}

/// What every section works with.
pub struct Setup {
    arguments: Arguments,
    effort: Effort,
    inputs: Inputs,
    /// For files that a section makes; removed at the end.
    folder: tempfile::TempDir,
}

impl Setup {
    fn quick(&self) -> bool {
        self.arguments.quick
    }

    fn folder(&self) -> &Path {
        self.folder.path()
    }
}

fn main() {
    let arguments = Arguments::parse();
    let effort = if arguments.quick { Effort::QUICK } else { Effort::FULL };
    let folder = tempfile::tempdir().unwrap();
    let inputs = Inputs::new(&arguments.files, folder.path());
    let setup = Setup { arguments, effort, inputs, folder };

    let document = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/inside/performance.md");
    let mut written = setup.arguments.update_docs.then(|| std::fs::read_to_string(&document).unwrap());
    for (name, section) in SECTIONS.iter().filter(|(name, _)| name.contains(&setup.arguments.only)) {
        eprintln!("{name} ...");
        let text = section(&setup);
        println!("## {name}\n\n{text}");
        written = written.map(|written| replace(&written, name, &text));
    }
    if let Some(written) = written {
        std::fs::write(&document, written).unwrap();
    }
}

/// The document with what stands between the markers of a section replaced.
fn replace(document: &str, name: &str, text: &str) -> String {
    let (begin, end) = (format!("<!-- benches/suite: {name} -->"), format!("<!-- end of {name} -->"));
    let missing = |marker: &str| panic!("docs/inside/performance.md: expected the line {marker}");
    let (before, rest) = document.split_once(&begin).unwrap_or_else(|| missing(&begin));
    let (_, after) = rest.split_once(&end).unwrap_or_else(|| missing(&end));
    format!("{before}{begin}\n\n{text}\n{end}{after}")
}

/// A table in Markdown.
fn markdown(head: &[&str], rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let head: Vec<String> = head.iter().map(|cell| (*cell).to_owned()).collect();
    let rule = format!("|{}\n", "---|".repeat(head.len()));
    [line(&head), rule].into_iter().chain(rows.iter().map(|row| line(row))).collect()
}
