//! SSDD: the examples of its specification, files written by hand in every parameterisation, and what is written and read again.

#![allow(
    clippy::print_stdout,
    clippy::float_cmp,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation
)]

use crate::common::shared;
use approx::{assert_abs_diff_eq, assert_relative_eq};
use brdfit::geometry::{Directions, Pair, direction, spherical_degrees};
use brdfit::measurement::formats::{
    AngleGrid, File, ReadOptions, Subject, Written, everywhere, named, read_file,
};
use brdfit::measurement::{Channel, Interpolant, Measurement, Remark};
use brdfit::{Brdf, Expression, Fit};
use std::f64::consts::{FRAC_1_PI, PI};
use std::fmt::Write as _;
use std::path::Path;

fn parsed(bytes: &[u8]) -> Measurement {
    let file = File::new(Path::new("x.ssdd"), bytes).unwrap();
    let m = read_file(file, None, &ReadOptions::new()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(m.source.format, "ssdd");
    m
}

fn written(subject: &Subject<'_>) -> Written {
    named("ssdd").unwrap().write.unwrap()(subject).unwrap_or_else(|error| panic!("{error}"))
}

fn channels(names: &[&str]) -> Vec<Channel> {
    names.iter().map(|name| Channel::named(name)).collect()
}

fn pairs(m: &Measurement) -> Vec<Pair> {
    m.directions.iter().map(|g| Pair { wi: g.wi.into(), wo: g.wo.into() }).collect()
}

/// Both examples of the specification, with comments in the tables.
#[test]
#[allow(clippy::approx_constant, reason = "the example has four digits of 1/pi")]
fn examples_of_the_specification() {
    let lambert = "VERSION 0.2\n\nDATA_TYPE brdf\nCOLOR_MODEL monochrome\nPARAM_TYPE spherical_coordinate_system\n\
                   PARAM0_LIST 0\nPARAM2_LIST 0\nPARAM3_LIST 0\nDATA ascii\n0.3183\n";
    let m = parsed(lambert.as_bytes());
    assert_eq!(m.values, [vec![0.3183]]);
    assert_eq!(pairs(&m)[0].wo.z, 1.0);

    let rows = |row: &str, lines: &str| lines.replace('*', row);
    let table = "# PARAM3: 0\n# PARAM2: 0\n*\n*\n# PARAM2: 90\n*\n*\n# PARAM3: 90\n# PARAM2: 0\n*\n*\n# PARAM2: 90\n*\n*\n";
    let several = format!(
        "VERSION 0.2\n\n# Bluish diffuse BRDF\nDATA_TYPE brdf\nCOLOR_MODEL rgb\nPARAM_TYPE half_difference_coordinate_system\n\
         REDUCTION_TYPE bilateral_symmetry reciprocity\nPARAM0_LIST 0 90\nPARAM2_LIST 0 90\nPARAM3_LIST 0 90\nNAME blue # 2\n\
         DEVICE GCMS-4\nDATA ascii\n{}\n# Orange\nDATA_TYPE btdf\nCOLOR_MODEL xyz\nPARAM_TYPE specular_coordinate_system\n\
         REDUCTION_TYPE bilateral_symmetry\nPARAM0_LIST 0 90\nPARAM2_LIST 0 180\nPARAM3_LIST 0 180\nPARAM4_LIST 0 -48.2\n\
         DATA ascii\n{}\n# Simple specular reflectance\nDATA_TYPE specular_reflectance\nCOLOR_MODEL spectrum\n\
         WAVELENGTH_LIST 400 450 500\nPARAM0_LIST 0 90\nDATA ascii\n0.05 0.05 0.05\n0.05 0.05 0.05\n\n\
         DATA_TYPE specular_transmittance\nCOLOR_MODEL monochrome\nPARAM0_LIST 0 90\nDATA ascii\n0.05\n0.05\n",
        rows("0 0.0524275\t0.159779", table),
        rows("0.106 0.082 0.011", table)
    );
    for text in [several.clone(), several.replace('\n', "\r\n")] {
        let m = parsed(text.as_bytes());
        assert_eq!(m.channels, channels(&["r", "g", "b"]));
        assert_eq!(m.remarks, [Remark::TransmissionLeftOut, Remark::MirrorLeftOut]);
        assert_eq!(m.instrument.description.as_deref(), Some("blue # 2; GCMS-4"));
        // Of the eight places the normal remains, twice; elsewhere light or viewer is in the horizon or below.
        assert_eq!((m.total(), m.directions.len()), (8, 1));
        assert_eq!(m.dropped["repeated"], 1);
        assert_eq!(m.values, [vec![0.0], vec![0.0524275], vec![0.159779]]);
    }
}

/// A function without symmetry.
fn lopsided(pair: &Pair) -> f64 {
    let [a, b] = [pair.wi, pair.wo];
    (0.9 * a.x + 0.4 * a.y + 0.3 * b.x - 0.8 * b.y + a.x * b.y + 0.2 * b.z).exp()
}

/// Directions by other formulas than the reader's: rotations by quaternions, and geometry.
fn independent(system: &str, [a, b, c, d]: [f64; 4]) -> Pair {
    use brdfit::glam::{DQuat, DVec3};
    let [a, b, c, d] = [a, b, c, d].map(f64::to_radians);
    let turn =
        |theta: f64, phi: f64, v: DVec3| DQuat::from_rotation_z(phi) * (DQuat::from_rotation_y(theta) * v);
    match system {
        "spherical" => Pair { wi: turn(a, b, DVec3::Z), wo: turn(c, d, DVec3::Z) },
        // Tilted to the mirror direction, which is at -theta_i in the plane of incidence.
        "specular" => Pair { wi: turn(a, b, DVec3::Z), wo: turn(-a, b, turn(c, d, DVec3::Z)) },
        "half_difference" => {
            let wi = turn(a, b, turn(c, d, DVec3::Z));
            let wo = turn(a, b, turn(c, d + PI, DVec3::Z));
            Pair { wi, wo }
        }
        // On the line from the mirror direction to a point of the horizon, all azimuthally equidistant.
        "distorted_spherical" => {
            let wi = turn(a, b, DVec3::Z);
            let from = DVec3::new(-a * b.cos(), -a * b.sin(), 0.0);
            let to = DVec3::new(d.cos(), d.sin(), 0.0) * (PI / 2.0);
            let at = from.lerp(to, c / (PI / 2.0));
            Pair { wi, wo: turn(at.length(), at.y.atan2(at.x), DVec3::Z) }
        }
        _ => panic!("{system}"),
    }
}

#[test]
fn every_parameterisation_as_text_and_binary() {
    let lists = [
        vec![0.0, 20.0, 65.0],
        vec![0.0, 100.0, 250.0],
        vec![0.0, 15.0, 60.0],
        vec![10.0, 120.0, 200.0, 330.0],
    ];
    for system in ["spherical", "specular", "half_difference", "distorted_spherical"] {
        let mut head = format!(
            "VERSION 0.3\nAPI test\nDATA_TYPE brdf\nCOLOR_MODEL spectrum\nWAVELENGTH_LIST 450 550\nPARAM_TYPE {system}_coordinate_system\n"
        );
        for (number, list) in lists.iter().enumerate() {
            let words: Vec<String> = list.iter().map(ToString::to_string).collect();
            writeln!(head, "PARAM{number}_LIST {}", words.join(" ")).unwrap();
        }
        let (mut text, mut binary) =
            (format!("{head}DATA ascii\n"), format!("{head}DATA binary\n").into_bytes());
        let mut above = 0;
        for d in &lists[3] {
            for c in &lists[2] {
                for b in &lists[1] {
                    for a in &lists[0] {
                        let pair = independent(system, [*a, *b, *c, *d]);
                        above += usize::from(pair.wi.z > 1e-9 && pair.wo.z > 1e-9);
                        let f = lopsided(&pair);
                        writeln!(text, "{f} {}", 2.0 * f).unwrap();
                        for value in [f, 2.0 * f] {
                            binary.extend((value as f32).to_le_bytes());
                        }
                    }
                }
            }
        }
        for bytes in [text.into_bytes(), binary] {
            let m = parsed(&bytes);
            assert_eq!(m.channels, channels(&["450", "550"]));
            assert_eq!(m.total(), 3 * 3 * 3 * 4);
            let repeated = m.dropped.get("repeated").copied().unwrap_or_default();
            assert_eq!(m.directions.len() + repeated, above, "{system}");
            assert!(above > 60, "{system} {above}");
            for (index, pair) in pairs(&m).iter().enumerate() {
                assert_relative_eq!(m.values[0][index], lopsided(pair), max_relative = 2e-7);
                assert_relative_eq!(m.values[1][index], 2.0 * lopsided(pair), max_relative = 2e-7);
            }
        }
    }
}

/// An offset moves the direction from which a table counts: here to the normal.
#[test]
fn offsets_of_the_mirror_direction() {
    let text = "VERSION 0.3\nDATA_TYPE brdf\nCOLOR_MODEL xyz\nPARAM_TYPE specular_coordinate_system\nPARAM0_LIST 0 40\n\
                PARAM2_LIST 20\nPARAM3_LIST 30\nPARAM4_LIST 0 -40\nDATA ascii\n1 2 3\n4 5 6\n";
    let m = parsed(text.as_bytes());
    let all = pairs(&m);
    for pair in &all {
        assert_abs_diff_eq!(
            (pair.wo - direction(20_f64.to_radians(), 30_f64.to_radians())).length(),
            0.0,
            epsilon = 1e-14
        );
    }
    assert_abs_diff_eq!(spherical_degrees(all[1].wi).0, 40.0, epsilon = 1e-12);
    assert_eq!(m.values[2], [3.0, 6.0]);
}

#[test]
fn what_is_written_is_read_again() {
    for (names, expected) in [
        (vec!["f"], vec!["f"]),
        (vec!["r", "g", "b"], vec!["r", "g", "b"]),
        (vec!["X", "Y", "Z"], vec!["X", "Y", "Z"]),
        // Wavelengths are in ascending order in a file.
        (vec!["650", "450", "550.5"], vec!["450", "550.5", "650"]),
    ] {
        let given = channels(&names);
        let scale = |name: &str| 1.0 + f64::from(name.bytes().map(u32::from).sum::<u32>());
        let at = |pairs: &[Pair]| {
            names.iter().map(|name| pairs.iter().map(|pair| scale(name) * lopsided(pair)).collect()).collect()
        };
        let small = AngleGrid::parse("theta_i=10:30:70,phi_i=0:60:300,theta_o=0:5:60,phi=0:45:315").unwrap();
        for grid in [None, Some(&small)] {
            let subject = Subject {
                channels: &given,
                at: &at,
                covered: &everywhere,
                measurement: None,
                isotropic: false,
                about: "lopsided\nfunction",
                grid,
            };
            let file = written(&subject);
            assert!(file.losses.is_empty());
            let m = parsed(&file.bytes);
            assert_eq!(m.channels, channels(&expected));
            assert_eq!(m.instrument.description.as_deref(), Some("lopsided function"));
            assert!(m.directions.len() > 1000);
            for (index, pair) in pairs(&m).iter().enumerate().step_by(7) {
                for (row, name) in m.values.iter().zip(&expected) {
                    assert_relative_eq!(row[index], scale(name) * lopsided(pair), max_relative = 1e-5);
                }
            }
        }
    }
    let given = channels(&["r", "g", "550"]);
    let at = |pairs: &[Pair]| vec![vec![1.0; pairs.len()]; 3];
    let subject = Subject {
        channels: &given,
        at: &at,
        covered: &everywhere,
        measurement: None,
        isotropic: true,
        about: "",
        grid: None,
    };
    let error = named("ssdd").unwrap().write.unwrap()(&subject).unwrap_err().to_string();
    assert!(error.contains("wavelengths") && error.contains("r, g, 550"), "{error}");
}

#[test]
fn a_model_is_found_again() {
    let model: Expression = "lambert + cook-torrance".parse().unwrap();
    let truth = [("lambert.kd", 0.3), ("m", 0.2), ("f0", 0.06)];
    let brdf = Brdf::new(&model, &["f"], &truth).unwrap();
    let one = channels(&["f"]);
    let at = |pairs: &[Pair]| brdf.values(&Directions::Scattered(pairs.to_vec()));
    let subject = Subject {
        channels: &one,
        at: &at,
        covered: &everywhere,
        measurement: None,
        isotropic: true,
        about: "a model",
        grid: None,
    };
    let m = parsed(&written(&subject).bytes);
    let fit = Fit::of(&model, &m).run().unwrap();
    for (name, value) in truth {
        let found = fit.parameter(name).unwrap().value;
        println!("{name}: {found} of {value}");
        assert_relative_eq!(found, value, max_relative = 0.01);
    }
}

/// A measurement whose samples are a table about the mirror direction keeps them.
#[test]
fn a_measurement_keeps_its_values() {
    let Some(path) = shared("more/ansys-optical-automation/planesymmetric_brdf_zemax.bsdf") else { return };
    let m = brdfit::measurement::formats::read(&path, None, &ReadOptions::new()).unwrap();
    let f = Interpolant::new(&m);
    let samples = pairs(&m);
    let at = |pairs: &[Pair]| {
        let mut values = f.at(pairs).values;
        for (pair, value) in pairs.iter().zip(&mut values[0]) {
            let near = |other: &Pair| (other.wi - pair.wi).length() + (other.wo - pair.wo).length() < 1e-7;
            *value = samples.iter().position(near).map_or(*value, |place| m.values[0][place]);
        }
        values
    };
    let subject = Subject {
        channels: &m.channels,
        at: &at,
        covered: &everywhere,
        measurement: Some(&m),
        isotropic: true,
        about: "measured",
        grid: None,
    };
    let again = parsed(&written(&subject).bytes);
    assert_eq!(again.total(), m.total());
    let said = pairs(&again);
    for (index, pair) in samples.iter().enumerate() {
        let near = |other: &Pair| (other.wi - pair.wi).length() + (other.wo - pair.wo).length() < 1e-7;
        let place = said.iter().position(near).expect("each sample is read again");
        assert_relative_eq!(again.values[0][place], m.values[0][index], max_relative = 1e-7);
    }
}

/// So does one whose samples are a table about the normal, with or without a grain.
#[test]
fn a_table_about_the_normal_keeps_its_values() {
    for isotropic in [true, false] {
        let azimuths = if isotropic { vec![40.0] } else { vec![0.0, 40.0, 100.0] };
        let mut angles = Vec::new();
        for theta_i in [0.0, 20.0, 65.0] {
            for phi_i in &azimuths {
                for theta_o in [0.0, 30.0, 77.5] {
                    for phi in [0.0, 15.0, 90.0, 180.0] {
                        angles.push([theta_i, *phi_i, theta_o, if isotropic { phi + phi_i } else { phi }]);
                    }
                }
            }
        }
        let directions = Directions::from_degrees(angles).unwrap();
        let f = |pair: &Pair| {
            if isotropic { (pair.wi + pair.wo).z + pair.wi.dot(pair.wo) } else { lopsided(pair) }
        };
        let values: Vec<f64> =
            directions.iter().map(|g| f(&Pair { wi: g.wi.into(), wo: g.wo.into() })).collect();
        let m = Measurement::new(directions, [("f", values)]).unwrap();
        let at = |pairs: &[Pair]| vec![pairs.iter().map(f).collect()];
        let subject = Subject {
            channels: &m.channels,
            at: &at,
            covered: &everywhere,
            measurement: Some(&m),
            isotropic,
            about: "",
            grid: None,
        };
        let file = written(&subject);
        let text = String::from_utf8(file.bytes.clone()).unwrap();
        assert!(text.contains("PARAM_TYPE spherical_coordinate_system\n"), "{text}");
        assert!(text.contains("PARAM0_LIST 0 20 65\n") && text.contains("PARAM2_LIST 0 30 77.5\n"));
        assert!(text.contains("PARAM3_LIST 0 15 90 180\n"), "{text}");
        let again = parsed(&file.bytes);
        for (index, pair) in pairs(&again).iter().enumerate() {
            assert_relative_eq!(again.values[0][index], f(pair), max_relative = 1e-7);
        }
        assert_eq!(again.total(), m.total());
    }
}

/// Lambert in a table that is too large for text.
#[test]
fn large_tables_are_binary() {
    let one = channels(&["f"]);
    let at = |pairs: &[Pair]| vec![vec![FRAC_1_PI; pairs.len()]];
    let subject = Subject {
        channels: &one,
        at: &at,
        covered: &everywhere,
        measurement: None,
        isotropic: false,
        about: "",
        grid: None,
    };
    let file = written(&subject);
    let end = b"DATA binary\n";
    let at = file.bytes.windows(end.len()).position(|part| part == end).unwrap() + end.len();
    // 18 incidences, 13 azimuths of the light, 47 radial angles, 37 azimuths.
    assert_eq!(file.bytes.len() - at, 4 * 18 * 13 * 47 * 37);
    let m = parsed(&file.bytes);
    assert!(m.values[0].iter().all(|f| (f - FRAC_1_PI).abs() < 1e-7));
}
