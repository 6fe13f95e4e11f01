//! The reader and the writer of RGL tensor files, against the database's own reader and a second implementation (scripts/reference/rgl.py).

#![allow(clippy::print_stdout, clippy::print_stderr)]

use crate::common::shared;
use brdfit::geometry::{Azimuths, Directions, Pair, direction};
use brdfit::measurement::formats::{
    AngleGrid, File, ReadOptions, Subject, Written, everywhere, named, read, read_file,
};
use brdfit::measurement::{Channel, Measurement, Remark};
use brdfit::model::Expression;
use brdfit::parameters::{ParameterTable, Selector, Setting};
use brdfit::synthetic::{Noise, measurement as synthetic, scattered_directions};
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
        // So it does where the half vector is the normal, at which every row of a table has a node of its own, or opposite to wi.
        let smooth = |pair: &Pair| {
            let h = (pair.wi + pair.wo).normalize();
            let along = h.x * pair.wi.x + h.y * pair.wi.y;
            let opposite = along / (h.x.hypot(h.y) * pair.wi.x.hypot(pair.wi.y)) < -1.0 + 1e-9;
            h.z < 1.0 - 1e-9 && !(opposite && path.starts_with(own("")))
        };
        let pairs: Vec<_> = pairs.into_iter().filter(|(pair, _)| smooth(pair)).collect();
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

/// A model in channels r, g and b at these values, as a function of directions.
struct Model(Expression, ParameterTable);

const CHANNELS: [&str; 3] = ["r", "g", "b"];

impl Model {
    fn new(model: &str, values: &str) -> Self {
        let expression = Expression::parse(model).unwrap();
        let setting = |word: &str| {
            let (name, value) = word.split_once('=').unwrap();
            (Selector::parse(name).unwrap(), Setting::Set(value.parse().unwrap()))
        };
        let settings: Vec<(Selector, Setting)> = values.split(' ').map(setting).collect();
        let channels = CHANNELS.map(str::to_owned);
        let table = ParameterTable::new(&expression, &channels, Azimuths::Several, &settings).unwrap();
        Self(expression, table)
    }

    fn at(&self, pairs: &[Pair]) -> Vec<Vec<f64>> {
        let noise = Noise { relative: 0.0, absolute: 0.0 };
        synthetic(&self.0, &self.1, Directions::Scattered(pairs.to_vec()), noise, 0).values
    }

    /// The file of the model, and what it lost.
    fn written(&self, isotropic: bool, grid: Option<&AngleGrid>) -> Written {
        let channels = CHANNELS.map(Channel::named);
        let at = |pairs: &[Pair]| self.at(pairs);
        let subject = Subject {
            channels: &channels,
            at: &at,
            covered: &everywhere,
            measurement: None,
            isotropic,
            about: "a model",
            grid,
        };
        (named("rgl").unwrap().write.unwrap())(&subject).unwrap()
    }
}

fn read_bytes(bytes: &[u8]) -> Measurement {
    let file = File::new(Path::new("written.bsdf"), bytes).unwrap();
    read_file(file, None, &ReadOptions::new()).unwrap_or_else(|e| panic!("{e}"))
}

/// What is written of a model is read again: its samples are the model's values, to single precision, and f anywhere is the model's to
/// 1 %, root mean square, with f cos(theta_i) cos(theta_o) for error.
#[test]
fn models_are_written_and_read_again() {
    // Coarse, so that the test does not take long; the gloss of a plastic needs the angles of incidence that the format chooses.
    let grid = AngleGrid::parse("theta_i=0:5:85").unwrap();
    let aniso = AngleGrid::parse("theta_i=0:15:75,phi_i=-180:15:180").unwrap();
    for (name, model, values, isotropic, grid, most) in [
        ("metal", "cook-torrance(d=ggx, f=conductor)", "m=0.1 eta=0.2 k=3.0", true, Some(&grid), 0.01),
        ("plastic", "lambert + cook-torrance(d=ggx)", "kd.r=0.4 kd.g=0.2 m=0.1 f0=0.05", true, None, 0.01),
        ("brushed", "cook-torrance(d=ggx-anisotropic)", "mx=0.1 my=0.3 f0=0.9", false, Some(&aniso), 0.02),
    ] {
        let model = Model::new(model, values);
        let written = model.written(isotropic, grid);
        let m = read_bytes(&written.bytes);
        assert_eq!(m.channel_names(), CHANNELS);
        assert_eq!(m.instrument.description.as_deref(), Some("a model"));
        assert!(written.losses.iter().any(|loss| loss.contains("single precision")), "{:?}", written.losses);
        let pairs: Vec<Pair> =
            m.directions.iter().map(|g| Pair { wi: g.wi.into(), wo: g.wo.into() }).collect();
        let truth = model.at(&pairs);
        for (n, pair) in pairs.iter().enumerate().filter(|(_, pair)| pair.wo.z > 1e-3) {
            for (found, expected) in m.values.iter().zip(&truth) {
                let difference = (found[n] - expected[n]).abs() / expected[n];
                assert!(difference < 1e-5, "{name} {pair:?}: {} {}", found[n], expected[n]);
            }
        }
        let pairs = scattered_directions(2000, 75.0, 3);
        let truth = model.at(&pairs);
        let (mut error, mut whole, mut values) = (0.0, 0.0, vec![0.0; 3]);
        for (n, pair) in pairs.iter().enumerate() {
            m.continuous.as_ref().unwrap().at(pair, &mut values);
            let cosines = pair.wi.z * pair.wo.z;
            for (found, expected) in values.iter().zip(&truth) {
                error += (cosines * (found - expected[n])).powi(2);
                whole += (cosines * expected[n]).powi(2);
            }
        }
        let error = (error / whole).sqrt();
        println!(
            "{name}: {} bytes, {} samples, {:.2} %",
            written.bytes.len(),
            m.directions.len(),
            100.0 * error
        );
        assert!(error < most, "{name}: {error}");
    }
}

/// Wavelengths are sorted, one channel becomes three, and two unnamed ones are refused.
#[test]
fn channels_are_written_as_the_format_has_them() {
    let grid = AngleGrid::parse("theta_i=0:45:45,theta_o=0:10:80").unwrap();
    let write = |names: &[&str]| {
        let channels: Vec<Channel> = names.iter().map(|name| Channel::named(name)).collect();
        let at = |pairs: &[Pair]| -> Vec<Vec<f64>> {
            (1..=channels.len())
                .map(|k| vec![0.1 * f64::from(u32::try_from(k).unwrap()); pairs.len()])
                .collect()
        };
        let subject = Subject {
            channels: &channels,
            at: &at,
            covered: &everywhere,
            measurement: None,
            isotropic: true,
            about: "",
            grid: Some(&grid),
        };
        (named("rgl").unwrap().write.unwrap())(&subject)
    };
    let m = read_bytes(&write(&["600.5", "450"]).unwrap().bytes);
    assert_eq!(m.channel_names(), ["450", "600.5"]);
    assert!(
        m.values[0].iter().all(|f| (f - 0.2).abs() < 1e-6)
            && m.values[1].iter().all(|f| (f - 0.1).abs() < 1e-6)
    );
    let written = write(&["f"]).unwrap();
    assert_eq!(read_bytes(&written.bytes).channel_names(), CHANNELS);
    assert!(written.losses.iter().any(|loss| loss.contains("one channel")), "{:?}", written.losses);
    assert!(written.losses.iter().any(|loss| loss.contains("viewing angles")), "{:?}", written.losses);
    let error = write(&["left", "right"]).unwrap_err().to_string();
    assert!(error.contains("left, right"), "{error}");
}
