//! `brdfit synth`: makes a synthetic measurement.

use crate::cli::messages::emit;
use crate::cli::options::heightfield::{HeightfieldArguments, Surface, traced_table};
use crate::cli::options::input::ReadArguments;
use crate::cli::options::model::ModelArguments;
use crate::cli::options::recorded::the_report;
use crate::cli::outcome::Outcome;
use crate::cli::output::{Output, spares};
use brdfit::Error;
use brdfit::geometry::{Directions, HalfDifferenceGrid, Pair};
use brdfit::measurement::checked_max_theta;
use brdfit::measurement::formats::{csv, merl, read_directions};
use brdfit::model::Expression;
use brdfit::parameters::ParameterTable;
use brdfit::synthetic::{Noise, measurement, scattered_directions};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Arguments of `brdfit synth`.
#[derive(Args)]
pub struct Arguments {
    /// Evaluate the model in this JSON report of brdfit, at its values
    #[arg(value_name = "REPORT", conflicts_with_all = ["model", "from_heightfield"])]
    report: Option<PathBuf>,
    #[command(flatten)]
    model: ModelArguments,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    heightfield: HeightfieldArguments,
    /// Limit theta_i and theta_o of --directions, or theta_o of --from-heightfield, to this angle, degrees
    #[arg(long, default_value_t = 80.0, value_name = "DEG")]
    max_theta: f64,
    /// Add noise with this standard deviation, relative to the value
    #[arg(long, default_value_t = 0.0, value_name = "REL", conflicts_with = "from_heightfield")]
    noise: f64,
    /// Add noise with this standard deviation, 1/sr
    #[arg(long, default_value_t = 0.0, value_name = "S", conflicts_with = "from_heightfield")]
    noise_abs: f64,
    /// Set the seed of directions, noise, surfaces and rays
    #[arg(long, default_value_t = 0, value_name = "N")]
    seed: u64,
    #[command(flatten)]
    read: ReadArguments,
    /// Write to this file: CSV, or a MERL table with --grid merl ('-': standard output)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

/// Where to evaluate.
#[derive(Args)]
#[group(required = true, multiple = false)]
struct Place {
    /// Evaluate at every cell of a full table
    #[arg(long, value_enum)]
    grid: Option<Grid>,
    /// Evaluate at N random pairs of directions, half of them near the mirror direction
    #[arg(long, value_name = "N", value_parser = direction_count)]
    directions: Option<usize>,
    /// Evaluate at the directions of a CSV file or another measurement
    #[arg(long, value_name = "FILE")]
    at: Option<PathBuf>,
    /// Trace rays over a rough surface of perfect mirrors instead of evaluating a model
    #[arg(long, value_enum, value_name = "SURFACE", conflicts_with = "model")]
    from_heightfield: Option<Surface>,
}

/// Largest number of directions, such that they fit in the memory of an ordinary machine.
const MOST_DIRECTIONS: usize = 100_000_000;

fn direction_count(text: &str) -> Result<usize, String> {
    let wrong = || format!("expected a whole number from 1 to {MOST_DIRECTIONS}");
    text.parse().ok().filter(|n| (1..=MOST_DIRECTIONS).contains(n)).ok_or_else(wrong)
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Grid {
    Merl,
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    if let Some(surface) = arguments.place.from_heightfield {
        let max_theta = checked_max_theta(arguments.max_theta)?;
        let traced =
            arguments.heightfield.simulation(surface, &arguments.model.texts(), max_theta, arguments.seed)?;
        return write(&arguments.output, || traced_table(&traced, &arguments.output));
    }
    arguments.heightfield.check_absent()?;
    for (option, value) in [("--noise", arguments.noise), ("--noise-abs", arguments.noise_abs)] {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(Error::invalid(option, "0 or more", value.to_string()));
        }
    }
    let max_theta = checked_max_theta(arguments.max_theta)?;
    let noise = Noise { relative: arguments.noise, absolute: arguments.noise_abs };
    let on_grid = arguments.place.grid == Some(Grid::Merl);
    let file = arguments.report.clone().or_else(|| arguments.model.files().next());
    let recorded = file.as_deref().map(the_report).transpose()?;
    let (expression, table) = arguments.model.with_values(recorded, on_grid)?;

    if on_grid && to_stdout(&arguments.output) {
        return Err(Error::invalid("--grid merl", "-o FILE, since a MERL table is binary", "'-'"));
    }
    let inputs: Vec<PathBuf> = file.iter().chain(&arguments.place.at).cloned().collect();
    spares(&inputs, "-o", Some(&arguments.output))?;
    write(&arguments.output, || {
        if on_grid {
            return merl_table(arguments, &expression, &table, noise);
        }
        let pairs = match (&arguments.place.at, arguments.place.directions) {
            (Some(path), _) => read_directions(path, &arguments.read.options()?)?,
            (None, n) => scattered_directions(n.unwrap_or(0), max_theta, arguments.seed),
        };
        Ok(scattered_table(arguments, &expression, &table, noise, pairs)?.into_bytes())
    })
}

fn to_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Writes the bytes that `make` returns to a file, which is opened before `make` runs.
fn write(path: &Path, make: impl FnOnce() -> Result<Vec<u8>, Error>) -> Result<Outcome, Error> {
    if to_stdout(path) {
        emit(&String::from_utf8_lossy(&make()?))?;
    } else {
        let output = Output::open(path)?;
        output.commit(&make()?)?;
    }
    Ok(Outcome::Good)
}

fn merl_table(
    arguments: &Arguments,
    expression: &Expression,
    table: &ParameterTable,
    noise: Noise,
) -> Result<Vec<u8>, Error> {
    let grid = Arc::new(HalfDifferenceGrid::merl(0.5));
    let cells: Vec<u32> = (0_u32..)
        .take(HalfDifferenceGrid::CELLS)
        .filter(|cell| {
            let geometry = grid.geometry(*cell);
            geometry.cos_i() > 0.0 && geometry.cos_o() > 0.0
        })
        .collect();
    let directions = Directions::Grid { grid, cells: cells.clone() };
    let synthetic = measurement(expression, table, directions, noise, arguments.seed);
    let [red, green, blue] = synthetic.values.as_slice() else {
        return Err(Error::invalid("--grid merl", "three channels", "others"));
    };
    merl::encode(&arguments.output, |cell| {
        let index = cells.binary_search(&cell).ok()?;
        Some([*red.get(index)?, *green.get(index)?, *blue.get(index)?])
    })
}

fn scattered_table(
    arguments: &Arguments,
    expression: &Expression,
    table: &ParameterTable,
    noise: Noise,
    pairs: Vec<Pair>,
) -> Result<String, Error> {
    let synthetic = measurement(expression, table, Directions::Scattered(pairs), noise, arguments.seed);
    synthetic.check_finite()?;
    let mut comments = vec![format!("brdfit synth {}", expression.canonical())];
    let set = if arguments.model.is_named() { arguments.model.texts() } else { assignments(table) };
    if !set.is_empty() {
        comments.push(format!("set {}", set.join(" ")));
    }
    if noise.any() {
        let (relative, absolute) = (noise.relative, noise.absolute);
        comments
            .push(format!("noise {relative} relative, {absolute} 1/sr absolute, seed {}", arguments.seed));
    }
    comments.push("angles in degrees, values in 1/sr".to_owned());
    csv::write(&synthetic, &comments)
}

/// Every parameter with its value, as `--set` takes them.
fn assignments(table: &ParameterTable) -> Vec<String> {
    table.parameter_values().iter().map(|p| format!("{}={}", p.name, p.value)).collect()
}
