//! UTIA's tables, on files made by an independent writer.

#![allow(clippy::float_cmp, clippy::cast_precision_loss, clippy::cast_possible_truncation)]

use crate::common::Folder;
use approx::assert_relative_eq;
use brdfit::Error;
use brdfit::geometry::{Pair, direction};
use brdfit::measurement::formats::{File, ReadOptions, named, read, read_file};
use brdfit::measurement::{Channel, Measurement, Remark};
use brdfit::{Brdf, Expression, Fit};
use std::path::Path;

/// A file in the order of the array `data[colour][theta_i][phi_i][theta_v][phi_v]`, angles in degrees.
fn table(f: impl Fn([f64; 4]) -> [f64; 3]) -> Vec<u8> {
    let mut data = vec![0.0_f64; 3 * 6 * 48 * 6 * 48];
    for theta_i in 0..6 {
        for phi_i in 0..48 {
            for theta_v in 0..6 {
                for phi_v in 0..48 {
                    let angles = [
                        15.0 * theta_i as f64,
                        7.5 * phi_i as f64,
                        15.0 * theta_v as f64,
                        7.5 * phi_v as f64,
                    ];
                    for (colour, value) in f(angles).into_iter().enumerate() {
                        data[(((colour * 6 + theta_i) * 48 + phi_i) * 6 + theta_v) * 48 + phi_v] = value;
                    }
                }
            }
        }
    }
    data.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn pair([theta_i, phi_i, theta_v, phi_v]: [f64; 4]) -> Pair {
    let [theta_i, phi_i, theta_v, phi_v] = [theta_i, phi_i, theta_v, phi_v].map(f64::to_radians);
    Pair { wi: direction(theta_i, phi_i), wo: direction(theta_v, phi_v) }
}

/// A function without symmetry, negative at some directions.
fn lopsided(pair: &Pair) -> [f64; 3] {
    let [a, b] = [pair.wi, pair.wo];
    let f = (0.9 * a.x + 0.4 * a.y + 0.3 * b.x - 0.8 * b.y + a.x * b.y + 0.2 * b.z).exp() - 0.4;
    [f, 2.0 * f, 0.1]
}

fn parse(bytes: &[u8]) -> Result<Measurement, Error> {
    let file = File::new(Path::new("x.bin"), bytes).unwrap();
    read_file(file, None, &ReadOptions::new())
}

#[test]
fn values_are_where_they_belong() {
    let bytes = table(|angles| lopsided(&pair(angles)));
    assert_eq!(bytes.len(), 1_990_656);
    // From a path, and from memory, where the length is not known beforehand.
    let folder = Folder::new();
    folder.write("table.dat", &bytes);
    for m in [read(&folder.path("table.dat"), None, &ReadOptions::new()).unwrap(), parse(&bytes).unwrap()] {
        assert_eq!(m.source.format, "utia");
        assert_eq!(m.channels, ["r", "g", "b"].map(Channel::named));
        assert_eq!(m.total(), 288 * 288);
        // At the normal all 48 azimuths are one: of 6 x 48 directions 1 + 5 x 48 differ.
        assert_eq!(m.directions.len(), 241 * 241);
        assert_eq!(m.dropped["repeated"], 288 * 288 - 241 * 241);
        assert!(matches!(m.remarks.as_slice(), [Remark::Assumed { .. }]));
        assert!(m.values[0].iter().any(|f| *f < 0.0), "negative values are kept");
        for (index, g) in m.directions.iter().enumerate() {
            let expected = lopsided(&Pair { wi: g.wi.into(), wo: g.wo.into() });
            for (row, expected) in m.values.iter().zip(expected) {
                assert!((row[index] - expected).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn a_model_is_found_again() {
    let model: Expression = "lambert + cook-torrance".parse().unwrap();
    let truth =
        [("lambert.kd.r", 0.3), ("lambert.kd.g", 0.1), ("lambert.kd.b", 0.5), ("m", 0.3), ("f0", 0.06)];
    let brdf = Brdf::new(&model, &["r", "g", "b"], &truth).unwrap();
    let bytes = table(|angles| {
        let pair = pair(angles);
        let f = brdf.value(pair.wi, pair.wo);
        [f[0], f[1], f[2]]
    });
    let m = parse(&bytes).unwrap();
    let fit = Fit::of(&model, &m).samples(6000).run().unwrap();
    for (name, value) in [("lambert.kd.r", 0.3), ("lambert.kd.b", 0.5), ("m", 0.3)] {
        assert_relative_eq!(fit.parameter(name).unwrap().value, value, max_relative = 0.01);
    }
}

#[test]
fn damaged_tables_are_refused() {
    let whole = table(|_| [0.25, 0.5, 0.75]);
    let message = |bytes: &[u8]| parse(bytes).unwrap_err().to_string();
    assert_eq!(message(&whole[..1_990_655]), "x.bin: expected a UTIA table of 1990656 bytes, found 1990655");
    let longer = [whole.as_slice(), &[0]].concat();
    assert!(message(&longer).ends_with("found 1990657 or more"), "{}", message(&longer));
    for odd in [f64::NAN, f64::INFINITY] {
        let mut bytes = whole.clone();
        bytes[800_000..800_008].copy_from_slice(&odd.to_le_bytes());
        assert_eq!(message(&bytes), "x.bin: byte 800000: expected a finite number, found NaN or infinity");
    }
    // Other binary data is not taken for a table, whatever its name.
    let noise: Vec<u8> = (0..1_990_656_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    assert!(message(&noise).contains("other binary data"), "{}", message(&noise));
    let format = named("utia").unwrap();
    assert!(format.write.is_none());
}
