//! What a file says about how it should be read: `doctor::examine`, and the laws of `health`. The measured materials, and twenty files for each
//! reading, are in scripts/other_readings.py; docs/use/doctor.md has its counts.

use crate::common::shared;
use brdfit::doctor::examine;
use brdfit::error::OptionName;
use brdfit::geometry::Azimuths;
use brdfit::health::{self, Verdict};
use brdfit::measurement::formats::{File, ReadOptions, read, read_file};
use brdfit::measurement::reading::Conventions;
use brdfit::measurement::{Doubt, Measurement};
use brdfit::model::Expression;
use brdfit::parameters::{ParameterTable, Selector, Setting};
use brdfit::progress::{Progress, Quiet};
use brdfit::synthetic::{Noise, measurement, scattered_directions};
use brdfit::{Directions, Options};
use std::f64::consts::PI;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

/// Angles in degrees, and f: theta_i, phi_i, theta_o, phi_o, f.
type Row = [f64; 5];

const PAINT: (&str, &[(&str, f64)]) = ("lambert + cook-torrance", &[("kd", 0.4), ("m", 0.25), ("f0", 0.05)]);
const METAL: (&str, &[(&str, f64)]) = ("cook-torrance", &[("m", 0.35), ("f0", 0.8)]);

/// A measurement of a model on a grid, with 1 % of noise.
fn rows((model, values): (&str, &[(&str, f64)])) -> Vec<Row> {
    let expression = Expression::parse(model).unwrap();
    let settings = values.iter().map(|(name, value)| (Selector::parse(name).unwrap(), Setting::Set(*value)));
    let settings: Vec<_> = settings.collect();
    let table = ParameterTable::new(&expression, &["f".to_owned()], Azimuths::Several, &settings).unwrap();
    let theta_i = [10.0, 25.0, 40.0, 55.0, 70.0];
    let mut angles = Vec::new();
    for theta_i in theta_i {
        for theta_o in (0..16).map(|k| 5.0 * f64::from(k)) {
            angles.extend((0..13).map(|k| [theta_i, 0.0, theta_o, 15.0 * f64::from(k)]));
        }
    }
    let directions = Directions::from_degrees(angles.clone()).unwrap();
    let noise = Noise { relative: 0.01, ..Noise::default() };
    let data = measurement(&expression, &table, directions, noise, 3);
    angles.iter().zip(&data.values[0]).map(|([a, b, c, d], f)| [*a, *b, *c, *d, *f]).collect()
}

fn text(rows: &[Row], change: impl Fn(Row) -> Row) -> String {
    let mut text = "theta_i,phi_i,theta_o,phi_o,f\n".to_owned();
    for row in rows {
        let fields = change(*row).map(|value| format!("{value:.7}"));
        writeln!(text, "{}", fields.join(",")).unwrap();
    }
    text
}

fn parsed(text: &str, conventions: &Conventions) -> Measurement {
    let options = ReadOptions::new().with_conventions(conventions.clone());
    read_file(File::new(Path::new("x.csv"), text.as_bytes()).unwrap(), Some("csv"), &options).unwrap()
}

/// The options that are named for a file that was read with some.
fn named(text: &str, conventions: &Conventions) -> Vec<(OptionName, String)> {
    let measured = parsed(text, conventions);
    examine(&measured, conventions).iter().flat_map(Doubt::suggestions).collect()
}

fn cos(degrees: f64) -> f64 {
    degrees.to_radians().cos()
}

type Change = fn(Row) -> Row;

/// The readings, how a file is written in each, and the options of which one must be named. What else is named must be as good.
const READINGS: [(&str, Change, OptionName, &[&str]); 15] = [
    ("elevations", |[a, b, c, d, f]| [90.0 - a, b, 90.0 - c, d, f], OptionName::Angles, &["elevation"]),
    (
        "theta_i as elevation",
        |[a, b, c, d, f]| [90.0 - a, b, c, d, f],
        OptionName::Angles,
        &["theta_i=elevation"],
    ),
    (
        "theta_o as elevation",
        |[a, b, c, d, f]| [a, b, 90.0 - c, d, f],
        OptionName::Angles,
        &["theta_o=elevation"],
    ),
    ("cosines", |[a, b, c, d, f]| [cos(a), b, cos(c), d, f], OptionName::Angles, &["cosine"]),
    ("cosine of theta_o", |[a, b, c, d, f]| [a, b, cos(c), d, f], OptionName::Angles, &["theta_o=cosine"]),
    (
        "radians",
        |[a, b, c, d, f]| [a.to_radians(), b, c.to_radians(), d.to_radians(), f],
        OptionName::Angles,
        &["radians"],
    ),
    (
        "azimuths in radians",
        |[a, b, c, d, f]| [a, b, c, d.to_radians(), f],
        OptionName::Angles,
        &["phi_o=radians"],
    ),
    ("gradians", |[a, b, c, d, f]| [a / 0.9, b, c / 0.9, d / 0.9, f], OptionName::Angles, &["gradians"]),
    (
        "azimuths from the mirror direction",
        |[a, b, c, d, f]| [a, b, c, 180.0 - d, f],
        OptionName::Azimuth,
        &["from-mirror"],
    ),
    (
        "light as it travels",
        |[a, b, c, d, f]| [a, b + 180.0, c, d, f],
        OptionName::LightDirection,
        &["as-it-travels"],
    ),
    ("f cos(theta_i)", |[a, b, c, d, f]| [a, b, c, d, f * cos(a)], OptionName::Quantity, &["f-cos-i"]),
    ("f cos(theta_o)", |[a, b, c, d, f]| [a, b, c, d, f * cos(c)], OptionName::Quantity, &["f-cos-o"]),
    ("per cent", |[a, b, c, d, f]| [a, b, c, d, 100.0 * f], OptionName::Quantity, &["percent"]),
    (
        "decibels",
        |[a, b, c, d, f]| [a, b, c, d, 10.0 * f.max(1e-6).log10()],
        OptionName::Quantity,
        &["decibel"],
    ),
    (
        "per square degree",
        |[a, b, c, d, f]| [a, b, c, d, f * (PI / 180.0).powi(2)],
        OptionName::Quantity,
        &["per-square-degree"],
    ),
];

/// The right reading is named; who obeys is told nothing more about it, and has the file as it should be.
#[test]
fn the_right_reading_is_named() {
    for (material, rows) in [("paint", rows(PAINT)), ("metal", rows(METAL))] {
        let right = parsed(&text(&rows, |row| row), &Conventions::default());
        for (what, change, option, values) in READINGS {
            // The smallest values of the metal are within the blackest coatings, or its largest are not.
            let text = text(&rows, change);
            let named = named(&text, &Conventions::default());
            let wanted = (option, values[0].to_owned());
            if what == "per square degree" && material == "metal" {
                assert!(named.iter().all(|named| *named == wanted), "{what}, {material}: {named:?}");
                continue;
            }
            assert!(named.contains(&wanted), "{what}, {material}: {named:?}");
            let conventions = Conventions::default().with(option, values[0]).unwrap();
            let mended = parsed(&text, &conventions);
            assert_eq!(examine(&mended, &conventions), [], "{what}, {material}, as it should be");
            for (a, b) in mended.directions.iter().zip(right.directions.iter()) {
                let turn = |g: &brdfit::geometry::Geometry<f64>| g.h[2];
                assert!((turn(&a) - turn(&b)).abs() < 1e-5, "{what}, {material}");
            }
        }
    }
}

/// Files as they should be, of ten models with four amounts of noise on scattered directions and on a grid: nothing is said of their reading.
#[test]
fn nothing_is_said_of_a_file_as_it_should_be() {
    let models: [(&str, &[(&str, f64)]); 10] = [
        ("lambert", &[("kd", 0.8)]),
        ("oren-nayar", &[("albedo", 0.5), ("sigma", 30.0)]),
        PAINT,
        METAL,
        ("cook-torrance", &[("m", 0.05), ("f0", 0.9)]),
        ("lambert + cook-torrance(d=gtr)", &[("kd", 0.1), ("m", 0.1), ("f0", 0.05), ("gamma", 1.5)]),
        ("ashikhmin-shirley", &[("rd", 0.3), ("rs", 0.05), ("nu", 10.0), ("nv", 1000.0)]),
        ("lambert + ward", &[("kd", 0.3), ("ks", 0.1), ("m", 0.15)]),
        ("lambert + phong", &[("kd", 0.3), ("ks", 0.1), ("n", 20.0)]),
        ("cook-torrance(d=ggx-anisotropic)", &[("mx", 0.3), ("my", 0.08), ("f0", 0.6)]),
    ];
    for (model, values) in models {
        let expression = Expression::parse(model).unwrap();
        let settings =
            values.iter().map(|(name, value)| (Selector::parse(name).unwrap(), Setting::Set(*value)));
        let settings: Vec<_> = settings.collect();
        let table =
            ParameterTable::new(&expression, &["f".to_owned()], Azimuths::Several, &settings).unwrap();
        for (seed, relative) in [(1, 0.0), (2, 0.01), (3, 0.05), (4, 0.1)] {
            let noise = Noise { relative, ..Noise::default() };
            for directions in [Directions::Scattered(scattered_directions(700, 80.0, seed)), grid()] {
                let data = measurement(&expression, &table, directions, noise, seed);
                let found = examine(&data, &Conventions::default());
                assert!(found.is_empty(), "{model}, noise {relative}: {found:?}");
            }
        }
    }
}

fn grid() -> Directions {
    let mut angles = Vec::new();
    for theta_i in [0.0, 20.0, 40.0, 60.0] {
        for theta_o in (0..17).map(|k| 5.0 * f64::from(k)) {
            angles.extend((0..18).map(|k| [theta_i, 0.0, theta_o, 20.0 * f64::from(k)]));
        }
    }
    Directions::from_degrees(angles).unwrap()
}

/// Where physics cannot tell, nothing is claimed: pi f of a dark surface, f cos(theta_i) cos(theta_o), which is reciprocal, elevations in a plane,
/// noise about a dark mean.
#[test]
fn nothing_is_claimed_where_physics_cannot_tell() {
    let default = Conventions::default();
    let rows = rows(PAINT);
    let dark = text(&rows, |[a, b, c, d, f]| [a, b, c, d, 0.2 * PI * f]);
    assert_eq!(named(&dark, &default), []);
    let both = text(&rows, |[a, b, c, d, f]| [a, b, c, d, f * cos(a) * cos(c)]);
    assert_eq!(named(&both, &default), []);
    let plane: Vec<Row> = rows.iter().copied().filter(|row| row[3] == 0.0 || row[3] == 180.0).collect();
    let elevations = text(&plane, |[a, b, c, d, f]| [90.0 - a, b, 90.0 - c, d, f]);
    assert_eq!(named(&elevations, &default), []);
    let mut wave = 0.0_f64;
    let noisy: Vec<Row> = rows
        .iter()
        .map(|[a, b, c, d, _]| {
            wave += 2.4;
            [*a, *b, *c, *d, 0.002 + 0.006 * wave.sin()]
        })
        .collect();
    assert_eq!(named(&text(&noisy, |row| row), &default), []);
}

/// A retro-reflector is bright towards the light, and less so the more slanting it is: no azimuth is wrong.
#[test]
fn a_retro_reflector_is_believed() {
    let mut angles = Vec::new();
    for theta_i in [5.0, 20.0, 40.0, 60.0] {
        for theta_o in (0..17).map(|k| 5.0 * f64::from(k)) {
            angles.extend((0..13).map(|k| [theta_i, 0.0, theta_o, 15.0 * f64::from(k)]));
        }
    }
    let sheet = |[theta_i, phi_i, theta_o, phi_o]: [f64; 4]| {
        let [i, o] = [theta_i, theta_o].map(f64::to_radians);
        let along = i.cos() * o.cos() + i.sin() * o.sin() * cos(phi_o - phi_i);
        0.02 + 0.5 * cos(theta_i).powi(3) * (-(1.0 - along) / 0.01).exp()
    };
    let rows: Vec<Row> = angles.iter().map(|a| [a[0], a[1], a[2], a[3], sheet(*a)]).collect();
    assert_eq!(named(&text(&rows, |row| row), &Conventions::default()), []);
}

/// No measured file gives rise to a doubt about its reading.
#[test]
fn measured_files_are_believed() {
    let Some(folder) = shared("data") else { return };
    for name in [
        "cornell/garnet_red.brdf",
        "cornell/cayman.brdf",
        "cornell/krylon_blue.brdf",
        "rgl/paper_white_rgb.bsdf",
        "nist-ptfe/PTFE.data.csv",
        "cea-retro/retro-3M-yellow.dat",
        "merl-slices/pink-felt-1d.alta",
        "merl-slices/red-fabric-slice.exr",
        "more/ansys-optical-automation/planesymmetric_brdf_zemax.bsdf",
        "more/ansys-optical-automation/in_plane_spectral_2D.csv",
    ] {
        let measured = read(&folder.join(name), None, &ReadOptions::default()).unwrap();
        assert_eq!(examine(&measured, &Conventions::default()), [], "{name}");
    }
}

/// The integral of f over scattered samples: a white of 0.9 keeps the law, one of 1.2 breaks it, by bounds that contain the true albedo. A plane
/// is not judged.
#[test]
fn energy_of_scattered_samples() {
    for (kd, verdict) in [(0.9, Verdict::Holds), (1.2, Verdict::Broken)] {
        let expression = Expression::parse("lambert").unwrap();
        let settings = vec![(Selector::parse("kd").unwrap(), Setting::Set(kd))];
        let table =
            ParameterTable::new(&expression, &["f".to_owned()], Azimuths::Several, &settings).unwrap();
        let data = measurement(&expression, &table, grid(), Noise::default(), 0);
        let health = health::measurement(&data);
        let energy = health.laws.iter().find(|law| law.law == "energy").unwrap();
        assert_eq!(energy.verdict, verdict, "{energy:?}");
        for albedo in health.channels[0].albedo.as_ref().unwrap() {
            assert!(albedo.at_least <= kd && kd <= albedo.at_most + 1e-9, "{albedo:?}");
            assert!(albedo.unmeasured < 0.1, "{albedo:?}");
        }
        assert_eq!(health.sound, Some(verdict == Verdict::Holds));
    }
    let plane: Vec<Row> = rows(PAINT).into_iter().filter(|row| row[3] == 0.0 || row[3] == 180.0).collect();
    let health = health::measurement(&parsed(&text(&plane, |row| row), &Conventions::default()));
    let energy = health.laws.iter().find(|law| law.law == "energy").unwrap();
    assert_eq!(energy.verdict, Verdict::NotJudged, "{energy:?}");
    assert_eq!(health.sound, None);
}

/// The cosine that mends reciprocity is named.
#[test]
fn a_cosine_breaks_reciprocity() {
    let text = text(&rows(PAINT), |[a, b, c, d, f]| [a, b, c, d, f * cos(c)]);
    let health = health::measurement(&parsed(&text, &Conventions::default()));
    assert_eq!(health.sound, Some(false));
    let finding = health.findings.iter().find(|finding| finding.kind == "not-reciprocal").unwrap();
    assert!(finding.text.contains("cos(theta_o)"), "{finding:?}");
    assert_eq!(finding.suggestion.as_ref().unwrap().value, "f-cos-o");
}

/// A fit says of an albedo above 1 which readings would explain it.
#[test]
fn a_fit_names_an_albedo_that_no_surface_has() {
    let rows = rows(("lambert", &[("kd", 0.8)]));
    for (factor, quantity) in [(PI, Some("reflectance-factor")), (1.3, None), (1.0, None)] {
        let data = parsed(&text(&rows, |[a, b, c, d, f]| [a, b, c, d, factor * f]), &Conventions::default());
        let progress: Arc<dyn Progress> = Arc::new(Quiet);
        let model = Expression::parse("lambert").unwrap();
        let fit = brdfit::fit::fit(&data, &model, &Options::default(), &progress).unwrap();
        let above = fit.warnings.iter().find(|warning| warning.kind().name() == "albedo-above-one");
        assert_eq!(above.is_some(), factor * 0.8 > 1.0, "{factor}: {:?}", fit.warnings);
        let energy = fit.energy_warning();
        assert_eq!(energy.is_some(), factor * 0.8 > 1.0, "{factor}: {energy:?}");
        if let Some(quantity) = quantity {
            let values = |warning: &brdfit::Warning| -> Vec<String> {
                warning.suggestions().into_iter().map(|suggestion| suggestion.value).collect()
            };
            assert!(values(energy.as_ref().unwrap()).contains(&quantity.to_owned()), "{energy:?}");
        }
    }
}
