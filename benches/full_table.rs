//! Reading and fitting a full MERL table, the whole process: `cargo bench --bench full_table [FILE...]`.
//!
//! Without files it makes one of a satin material. Prints a table of medians over repeated runs; the last
//! recorded one is in docs/performance.md. Times are wall-clock and depend on the machine; nothing fails
//! on them.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::print_stdout
)]

use brdfit::fit::ParameterTable;
use brdfit::geometry::{Directions, HalfDifferenceGrid};
use brdfit::measurement::formats::merl;
use brdfit::model::Expression;
use brdfit::synthetic::{Noise, measurement};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;

const RUNS: usize = 5;
const MODEL: &str = "lambert + cook-torrance(d=ggx)";

fn main() {
    let files: Vec<PathBuf> =
        std::env::args().skip(1).filter(|a| !a.starts_with("--")).map(PathBuf::from).collect();
    let folder = tempfile::tempdir().unwrap();
    let files = if files.is_empty() { vec![synthetic_table(folder.path())] } else { files };
    println!("| table | metric | read s | fit s | whole process s | peak MB | cost |");
    println!("|---|---|---|---|---|---|---|");
    for file in &files {
        for metric in ["cbrt", "log", "l2"] {
            println!("{}", row(file, metric));
        }
    }
}

/// The program's own report of one run after another.
fn row(file: &Path, metric: &str) -> String {
    let mut read = Vec::new();
    let mut fit = Vec::new();
    let mut whole = Vec::new();
    let mut peak: f64 = 0.0;
    let mut cost = 0.0;
    for _ in 0..RUNS {
        let started = std::time::Instant::now();
        let child = Command::new(env!("CARGO_BIN_EXE_brdfit"))
            .args(["fit", "-m", MODEL, "--metric", metric, "--json"])
            .arg(file)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let id = child.id();
        let watcher = std::thread::spawn(move || peak_megabytes(id));
        let output = child.wait_with_output().unwrap();
        whole.push(started.elapsed().as_secs_f64());
        peak = peak.max(watcher.join().unwrap());
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        read.push(report["time_s"]["read"].as_f64().unwrap());
        fit.push(report["time_s"]["fit"].as_f64().unwrap());
        cost = report["fit"]["cost"].as_f64().unwrap();
    }
    let name = file.file_name().unwrap().to_string_lossy();
    format!(
        "| {name} | {metric} | {:.2} | {:.2} | {:.2} | {peak:.0} | {cost:.9e} |",
        median(read),
        median(fit),
        median(whole)
    )
}

/// The largest resident size seen of a process, where the system tells; sampled until it ends.
fn peak_megabytes(id: u32) -> f64 {
    let mut peak: f64 = 0.0;
    while let Ok(status) = std::fs::read_to_string(format!("/proc/{id}/status")) {
        let kilobytes = status
            .lines()
            .find_map(|line| line.strip_prefix("VmHWM:"))
            .and_then(|rest| rest.split_whitespace().next()?.parse::<f64>().ok());
        // A process that has ended but was not waited for has no size any more.
        let Some(kilobytes) = kilobytes else { break };
        peak = peak.max(kilobytes / 1024.0);
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    peak
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn synthetic_table(folder: &Path) -> PathBuf {
    let expression = Expression::parse(MODEL).unwrap();
    let channels = ["r", "g", "b"].map(str::to_owned);
    let table = ParameterTable::new(&expression, &channels, true, &Vec::new()).unwrap();
    let grid = Arc::new(HalfDifferenceGrid::merl(0.5));
    let cells: Vec<u32> = (0..u32::try_from(HalfDifferenceGrid::CELLS).unwrap())
        .filter(|cell| {
            let g = grid.geometry(*cell);
            g.cos_i() > 0.0 && g.cos_o() > 0.0
        })
        .collect();
    let directions = Directions::Grid { grid, cells: cells.clone() };
    let noise = Noise { relative: 0.05, absolute: 1e-3 };
    let data = measurement(&expression, &table, directions, noise, 1);
    let path = folder.join("satin.binary");
    let bytes = merl::encode(&path, |cell| {
        let index = cells.binary_search(&cell).ok()?;
        // Negative cells mean "not measured" in this format.
        Some(
            [0, 1, 2]
                .map(|c: usize| data.values.get(c).and_then(|v| v.get(index)).map_or(0.0, |v| v.max(0.0))),
        )
    });
    std::fs::write(&path, bytes.unwrap()).unwrap();
    path
}
