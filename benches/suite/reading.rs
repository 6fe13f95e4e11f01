//! What reading a file costs, beside reading its bytes and hashing them, which a report needs in any case.

use super::{Setup, markdown};
use brdfit::geometry::{Directions, Pair, spherical_degrees};
use brdfit::measurement::formats::{AngleGrid, REGISTRY, ReadOptions, Subject, everywhere, read};
use brdfit::measurement::{Channel, Measurement};
use brdfit::synthetic::scattered_directions;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Pairs of directions in the files of scattered samples, and channels of those that have several.
const PAIRS: usize = 100_000;
const CHANNELS: usize = 16;

/// A BRDF with values of all magnitudes: digits as a measurement has them.
fn f(pair: &Pair, channel: usize) -> f64 {
    let h = (pair.wi + pair.wo).normalize();
    0.1 / (1.0 + super::timing::as_f64(channel)) + 5.0 * (-(1.0 - h.z * h.z) / (0.04 * h.z * h.z)).exp()
}

fn values(pairs: &[Pair], channels: usize) -> Vec<Vec<f64>> {
    (0..channels).map(|channel| pairs.iter().map(|pair| f(pair, channel)).collect()).collect()
}

/// The name of a file in each format, and its content.
fn files(quick: bool) -> Vec<(&'static str, Vec<u8>)> {
    let count = if quick { PAIRS / 20 } else { PAIRS };
    let pairs = scattered_directions(count, 80.0, 1);
    let names: Vec<String> = (0..CHANNELS).map(|k| format!("{}", 400 + 20 * k)).collect();
    let rows = values(&pairs, CHANNELS);
    let measured = Measurement::new(
        Directions::from_vectors(pairs.iter().map(|pair| (pair.wi, pair.wo))).unwrap(),
        names.iter().cloned().zip(rows.clone()),
    )
    .unwrap();
    let mut files = Vec::new();
    let rgb = ["r", "g", "b"].map(Channel::named);
    let one = [Channel::named("f")];
    let text = if quick {
        "theta_i=0:5:80,theta_o=0:5:80,phi=0:5:355"
    } else {
        "theta_i=0:1:80,theta_o=0:1:80,phi=0:2:358"
    };
    let grid = AngleGrid::parse(text).unwrap();
    for format in REGISTRY {
        let Some(write) = format.write else { continue };
        let channels: &[Channel] = match format.name {
            "csv" | "npz" => &measured.channels,
            "zemax" => &one,
            _ => &rgb,
        };
        let at = |pairs: &[Pair]| values(pairs, channels.len());
        let own = channels.len() == CHANNELS;
        let subject = Subject {
            channels,
            at: &at,
            covered: &everywhere,
            measurement: own.then_some(&measured),
            isotropic: true,
            about: "bench",
            grid: (!own && format.name != "merl" && format.name != "rgl").then_some(&grid),
        };
        files.push((format.name, write(&subject).unwrap().bytes));
    }
    // Those that are only read.
    let angles = |pair: &Pair| {
        let ((theta_i, phi_i), (theta_o, phi_o)) = (spherical_degrees(pair.wi), spherical_degrees(pair.wo));
        [theta_i, phi_i, theta_o, phi_o]
    };
    let mut cornell = format!("{CHANNELS}\n{}\n", names.join(" "));
    let mut alta = "#DIM 4 1\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n#PARAM_OUT INV_STERADIAN\n".to_owned();
    let mut nist = "lambda,thetai,phi,thetar,phir,f_r11,f_r12/f_r11\n".to_owned();
    let mut mwir = "material,theta_i_deg,theta_o_deg,brdf_per_sr,L_o\n".to_owned();
    for (index, pair) in pairs.iter().enumerate() {
        let [theta_i, phi_i, theta_o, phi_o] = angles(pair);
        let radians = angles(pair).map(|angle| format!("{:.6}", angle.to_radians())).join(" ");
        let of: Vec<String> = rows.iter().map(|row| format!("{:.6}", row[index])).collect();
        writeln!(cornell, "{radians} {}", of.join(" ")).unwrap();
        writeln!(alta, "{radians} {}", of[0]).unwrap();
        writeln!(nist, "0.633,{theta_i:.4},{phi_i:.4},{theta_o:.4},{phi_o:.4},{},0.0127079", of[0]).unwrap();
        writeln!(mwir, "steel,{theta_i:.4},{theta_o:.4},{},0.0039", of[0]).unwrap();
    }
    for (name, text) in [("cornell", cornell), ("alta", alta), ("nist", nist), ("mwir", mwir)] {
        files.push((name, text.into_bytes()));
    }
    let utia = (0..248_832_u32).flat_map(|k| (0.1 + f64::from(k % 1000) / 3000.0).to_le_bytes());
    files.push(("utia", utia.collect()));
    files
}

/// Seconds of the fastest of several runs of `work`: what else the machine does only adds, and would add to one side of a ratio.
fn seconds<T>(runs: usize, mut work: impl FnMut() -> T) -> f64 {
    let run = |work: &mut dyn FnMut() -> T| {
        let started = Instant::now();
        black_box(work());
        started.elapsed().as_secs_f64()
    };
    run(&mut work);
    (0..runs).map(|_| run(&mut work)).fold(f64::INFINITY, f64::min)
}

/// The time of each reader as a multiple of that of a plain read and a hash.
pub fn table(setup: &Setup) -> String {
    let runs = if setup.quick() { 3 } else { 45 };
    let rows: Vec<Vec<String>> = files(setup.quick())
        .into_iter()
        .map(|(name, bytes)| {
            let path: PathBuf = setup.folder().join(format!("reading.{name}"));
            fs::write(&path, &bytes).unwrap();
            let plain = seconds(runs, || Sha256::digest(fs::read(&path).unwrap()));
            let whole = seconds(runs, || measurement(&path, name));
            let samples = measurement(&path, name).directions.len();
            let megabytes = super::timing::as_f64(bytes.len()) / 1e6;
            vec![
                format!("`{name}`"),
                format!("{megabytes:.1}"),
                samples.to_string(),
                format!("{:.1}", 1e3 * plain),
                format!("{:.1}", 1e3 * whole),
                format!("{:.1}", whole / plain),
            ]
        })
        .collect();
    markdown(&["format", "MB", "samples", "bytes and hash, ms", "read, ms", "ratio"], &rows)
}

/// The time of reading a large table of text as a multiple of a plain pass of the `csv` crate over its records.
pub fn table_of_text(setup: &Setup) -> String {
    let (rows, runs) = if setup.quick() { (PAIRS / 2, 3) } else { (10 * PAIRS, 15) };
    let pairs = scattered_directions(rows, 80.0, 1);
    let mut text = "theta_i,phi_i,theta_o,phi_o,r,g,b\n".to_owned();
    for pair in &pairs {
        let ((theta_i, phi_i), (theta_o, phi_o)) = (spherical_degrees(pair.wi), spherical_degrees(pair.wo));
        let [r, g, b] = [0, 1, 2].map(|channel| f(pair, channel));
        writeln!(text, "{theta_i:.4},{phi_i:.4},{theta_o:.4},{phi_o:.4},{r:.6},{g:.6},{b:.6}").unwrap();
    }
    let path: PathBuf = setup.folder().join("large.csv");
    fs::write(&path, &text).unwrap();
    let pass = || {
        let mut reader = csv::Reader::from_path(&path).unwrap();
        let (mut record, mut fields) = (csv::StringRecord::new(), 0);
        while reader.read_record(&mut record).unwrap() {
            fields += record.len();
        }
        fields
    };
    let (plain, whole) = (seconds(runs, pass), seconds(runs, || measurement(&path, "csv")));
    let row = vec![
        rows.to_string(),
        format!("{:.0}", 1e3 * plain),
        format!("{:.0}", 1e3 * whole),
        format!("{:.1}", whole / plain),
    ];
    markdown(&["rows", "a pass of the `csv` crate, ms", "read, ms", "ratio"], &[row])
}

fn measurement(path: &Path, format: &str) -> Measurement {
    read(path, Some(format), &ReadOptions::new()).unwrap_or_else(|error| panic!("{error}"))
}
