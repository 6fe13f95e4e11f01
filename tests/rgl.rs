//! The reader of RGL tensor files, against the database's own reader and a second implementation (scripts/reference/rgl.py).

#![allow(clippy::print_stdout, clippy::print_stderr)]

use crate::common::shared;
use brdfit::geometry::{Pair, direction};
use brdfit::measurement::formats::{ReadOptions, read};
use brdfit::measurement::{Measurement, Remark};
use std::path::{Path, PathBuf};

const MATERIALS: [&str; 4] = ["cc_iris_purple_gem", "colodur_napoli_4f", "paper_white", "vch_golden_yellow"];

fn own(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/rgl").join(name)
}

fn measurement(path: &Path) -> Measurement {
    let m = read(path, None, &ReadOptions::new()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(m.source.format, "rgl");
    m
}

/// The pairs of a table with angles in radians, and f by pair and channel.
fn table(path: &Path) -> Vec<(Pair, Vec<f64>)> {
    let text = std::fs::read_to_string(path).unwrap();
    let row = |line: &str| -> (Pair, Vec<f64>) {
        let numbers: Vec<f64> = line.split(',').map(|word| word.parse().unwrap()).collect();
        let pair = Pair { wi: direction(numbers[0], numbers[1]), wo: direction(numbers[2], numbers[3]) };
        (pair, numbers[4..].to_vec())
    };
    text.lines().skip(1).map(row).collect()
}

/// The largest difference beyond 1e-6, relative to f, from a table.
fn largest_difference(m: &Measurement, table: &[(Pair, Vec<f64>)]) -> f64 {
    let continuous = m.continuous.as_ref().unwrap();
    let mut values = vec![0.0; m.channels.len()];
    let mut largest = 0.0_f64;
    for (pair, expected) in table {
        continuous.at(pair, &mut values);
        for (value, expected) in values.iter().zip(expected) {
            let difference = (value - expected).abs();
            if difference > 1e-6 {
                largest = largest.max(difference / expected.abs());
            }
        }
    }
    largest
}

/// 300 directions per material, evaluated with the database's reader in single precision; nine digits are given.
#[test]
fn materials_of_the_database_are_evaluated_as_by_their_own_reader() {
    for name in MATERIALS {
        let (Some(file), Some(reference)) =
            (shared(&format!("rgl/{name}_rgb.bsdf")), shared(&format!("rgl/{name}_reference.csv")))
        else {
            continue;
        };
        let m = measurement(&file);
        let table = table(&reference);
        assert_eq!(table.len(), 300);
        let largest = largest_difference(&m, &table);
        println!("{name}: {largest:.1e}");
        assert!(largest < 1e-4, "{name}: {largest:e}");
    }
}

/// Numbers from a random generator with all that the database's files at hand lack: several azimuths of incidence, symmetries,
/// wavelengths, no Jacobian.
#[test]
fn made_up_files_are_evaluated_as_by_the_second_implementation() {
    for (name, channels) in [
        ("whole", vec!["412.1", "462.6"]),
        ("half", vec!["r", "g", "b"]),
        ("quarter", vec!["412.1", "462.6"]),
    ] {
        let m = measurement(&own(&format!("{name}.bsdf")));
        assert_eq!(m.channel_names(), channels);
        assert_eq!(m.instrument.description.as_deref(), Some("Made up, no material"));
        let largest = largest_difference(&m, &table(&own(&format!("{name}.csv"))));
        println!("{name}: {largest:.1e}");
        assert!(largest < 1e-5, "{name}: {largest:e}");
    }
    let m = measurement(&own("isotropic.bsdf"));
    assert!(largest_difference(&m, &table(&own("isotropic.csv"))) < 1e-5);
}

/// The samples are the nodes of the file's tables: the evaluation there gives them back.
#[test]
fn samples_agree_with_the_evaluation() {
    // The other made-up files have jumps at the azimuths of incidence, where rounding decides on which side a sample lies.
    let mut files = vec![own("isotropic.bsdf")];
    files.extend(MATERIALS.iter().filter_map(|name| shared(&format!("rgl/{name}_rgb.bsdf"))));
    for path in files {
        let m = measurement(&path);
        let pairs: Vec<(Pair, Vec<f64>)> = m
            .directions
            .iter()
            .enumerate()
            .map(|(at, g)| {
                let pair = Pair { wi: g.wi.into(), wo: g.wo.into() };
                assert!(pair.wi.z > 1e-5 && pair.wo.z > 1e-5);
                (pair, m.values.iter().map(|row| row[at]).collect())
            })
            .collect();
        println!("{}: {} samples, {:?}", path.display(), pairs.len(), m.dropped);
        assert!(pairs.iter().all(|(_, values)| values.iter().all(|f| f.is_finite())));
        // So it does where the half vector is the normal, or opposite to wi.
        let smooth = |pair: &Pair| {
            let h = (pair.wi + pair.wo).normalize();
            let along = h.x * pair.wi.x + h.y * pair.wi.y;
            h.z < 1.0 - 1e-9 && along / (h.x.hypot(h.y) * pair.wi.x.hypot(pair.wi.y)) > -1.0 + 1e-9
        };
        let made_up = path.starts_with(own(""));
        let pairs: Vec<_> = pairs.into_iter().filter(|(pair, _)| !made_up || smooth(pair)).collect();
        let continuous = m.continuous.as_ref().unwrap();
        let mut values = vec![0.0; m.channels.len()];
        let mut largest = 0.0_f64;
        for (pair, expected) in &pairs {
            continuous.at(pair, &mut values);
            let scale = expected.iter().fold(0.0, |sum: f64, f| sum.max(f.abs()));
            // Distribution functions are kept in single precision.
            values.iter().zip(expected).for_each(|(f, e)| largest = largest.max((f - e).abs() / scale));
        }
        println!("    {largest:.1e}");
        assert!(largest < 1e-3, "{}: {largest:e}", path.display());
        assert!(
            matches!(&m.remarks[..], [Remark::Drawn { grid }] if grid.contains("nodes")),
            "{:?}",
            m.remarks
        );
    }
}
