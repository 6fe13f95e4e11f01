//! Measurements as functions of any pair of directions, against the models that they were made from and against
//! themselves; from there to the bytes of an image.
#![allow(clippy::print_stdout)]

use crate::common::shared;
use brdfit::geometry::{Directions, HalfDifferenceGrid, Pair};
use brdfit::image::{Image, Route, ToRgb, differences, exr, png};
use brdfit::math::count;
use brdfit::measurement::formats::{ReadOptions, read};
use brdfit::measurement::interpolant::{LeftOut, Symmetry};
use brdfit::measurement::{Interpolant, Measurement};
use brdfit::model::Expression;
use brdfit::parameters::{ParameterTable, Selector, Setting};
use brdfit::synthetic::{Noise, measurement, scattered_directions};
use std::sync::Arc;

const MODEL: &str = "lambert + cook-torrance(d=ggx, g=smith)";

/// A satin paint, its roughness given, without noise.
fn satin(m: f64, directions: Directions) -> Measurement {
    let expression = Expression::parse(MODEL).unwrap();
    let set = [("kd", 0.2), ("m", m), ("f0", 0.05)];
    let set = set.map(|(name, value)| (Selector::parse(name).unwrap(), Setting::Fix(value)));
    let channels = ["r", "g", "b"].map(str::to_owned);
    let table = ParameterTable::new(&expression, &channels, directions.azimuths(), &set.to_vec()).unwrap();
    measurement(&expression, &table, directions, Noise::default(), 1)
}

fn grid() -> Directions {
    let grid = HalfDifferenceGrid::merl_centers();
    let above = grid.above_horizon().iter().zip(0..).filter(|(above, _)| **above);
    Directions::Grid { cells: above.map(|(_, cell)| cell).collect(), grid: Arc::clone(&grid) }
}

/// Median, 95th percentile and largest of the relative errors of what is covered; the share that is.
fn errors(found: &Interpolant, asked: &[Pair], exact: &Measurement) -> ([f64; 3], f64) {
    let answer = found.at(asked);
    let mut errors: Vec<f64> = answer.values[0]
        .iter()
        .zip(&exact.values[0])
        .zip(&answer.covered)
        .filter(|(_, covered)| **covered)
        .map(|((found, exact), _)| (found / exact - 1.0).abs())
        .collect();
    errors.sort_by(f64::total_cmp);
    let last = errors.len() - 1;
    ([errors[last / 2], errors[last * 95 / 100], errors[last]], count(errors.len()) / count(asked.len()))
}

/// A table between its cells against the model that filled it, at pairs half of which are gathered about the mirror direction.
#[test]
fn a_table_between_its_cells() {
    let asked = scattered_directions(40_000, 80.0, 11);
    for (m, limits) in [(0.3, [3e-4, 5e-3, 0.01]), (0.1, [5e-4, 0.01, 0.03]), (0.02, [2e-4, 0.04, 0.08])] {
        let table = Interpolant::new(&satin(m, grid()));
        let exact = satin(m, Directions::Scattered(asked.clone()));
        let (found, covered) = errors(&table, &asked, &exact);
        let left_out = table.leave_out_error(LeftOut::Sample).unwrap();
        println!(
            "m={m}: {found:.5?}, covered {covered:.4}, left out {:.5} {:.5}",
            left_out.median, left_out.p95
        );
        assert!(found.iter().zip(limits).all(|(found, limit)| *found < limit), "m={m}: {found:?}");
        assert!(covered > 0.999);
        assert_eq!(table.symmetry(), None);
    }
}

/// Scattered samples against the model that they are from, at others.
#[test]
fn a_cloud_between_its_samples() {
    let asked = scattered_directions(20_000, 79.0, 12);
    let cases = [(2000, 0.3, [2e-3, 0.04]), (2000, 0.1, [3e-3, 0.06]), (50_000, 0.1, [4e-4, 0.01])];
    for (n, m, limits) in cases {
        let cloud = Interpolant::new(&satin(m, Directions::Scattered(scattered_directions(n, 80.0, 13))));
        let exact = satin(m, Directions::Scattered(asked.clone()));
        let (found, covered) = errors(&cloud, &asked, &exact);
        let left_out = cloud.leave_out_error(LeftOut::Sample).unwrap();
        println!(
            "{n} samples, m={m}: {found:.5?}, covered {covered:.4}, left out {:.5} {:.5}",
            left_out.median, left_out.p95
        );
        assert_eq!(cloud.symmetry(), Some(Symmetry { isotropic: true, reciprocal: true }));
        assert!(found.iter().zip(limits).all(|(found, limit)| *found < limit), "{n}, m={m}: {found:?}");
        assert!(covered > 0.98);
        // The estimate without the model is of the size of the error.
        assert!((0.3..3.0).contains(&(left_out.median / found[0])));
    }
}

/// Cornell's paints: what docs/use/image.md says of them.
#[test]
fn measured_paints() {
    let limits = [("cayman", 0.04, 0.09), ("garnet_red", 0.02, 0.045), ("krylon_blue", 0.02, 0.05)];
    for (name, sample, light) in limits {
        let Some(path) = shared(&format!("cornell/{name}.brdf")) else { continue };
        let data = read(&path, None, &ReadOptions::default()).unwrap();
        let Directions::Scattered(pairs) = &data.directions else { panic!("a grid") };
        let cloud = Interpolant::new(&data);
        let of = |out: LeftOut| cloud.leave_out_error(out).unwrap();
        println!("{name}: {:?} {:?} {:?}", cloud.symmetry(), of(LeftOut::Sample), of(LeftOut::Light));
        // All light is at one azimuth, and exchanged pairs differ by far more than their neighbours.
        assert_eq!(cloud.symmetry(), Some(Symmetry { isotropic: true, reciprocal: false }));
        assert!(of(LeftOut::Sample).median < sample && of(LeftOut::Light).median < light);
        let answer = cloud.at(pairs);
        assert!(answer.covered.iter().all(|covered| *covered));
        for (found, row) in answer.values.iter().zip(&data.values) {
            assert!(found.iter().zip(row).all(|(a, b)| (a - b).abs() <= 1e-13 * b.abs()));
        }
        assert_eq!(ToRgb::new(&data.channels).route, Route::Spectrum);
    }
}

/// From answers to images to bytes, which are the same at any number of threads.
#[test]
fn the_same_bytes_at_any_number_of_threads() {
    let data = satin(0.2, Directions::Scattered(scattered_directions(3000, 80.0, 14)));
    let other = satin(0.25, Directions::Scattered(scattered_directions(3000, 80.0, 14)));
    let asked = scattered_directions(64 * 48, 85.0, 15);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let images = [&data, &other].map(|data| {
                let f = Interpolant::new(data).at(&asked).values;
                let to_rgb = ToRgb::new(&data.channels);
                let pixels = (0..asked.len()).map(|k| to_rgb.apply(f.iter().map(|row| row[k]))).collect();
                Image::new(64, 48, pixels).unwrap()
            });
            let [measured, other] = &images;
            let found = differences(measured, other, &vec![true; 64 * 48]).unwrap();
            let json = serde_json::to_string(&found).unwrap();
            (exr(measured, &json).unwrap(), png(other, found.exposure).unwrap(), json)
        })
    };
    let one = run(1);
    assert!(one.2.contains("\"delta_e_2000\":{\"mean\":"), "{}", one.2);
    assert_eq!(one, run(3));
}
