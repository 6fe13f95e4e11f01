//! The options that say how a file is read: a paint that was written in other conventions fits to its own values, and the report says how
//! it was read.

use super::{assert_refused, refused, with_notes};
use crate::common::{Folder, shared};
use serde_json::Value;
use std::f64::consts::PI;
use std::fmt::Write as _;
use std::path::Path;

const MODEL: &str = "lambert + cook-torrance";

/// The samples of a paint, theta_i, phi_i, theta_o, phi_o in degrees and f, on a grid like that of a goniophotometer.
fn paint(folder: &Folder) -> Vec<[f64; 5]> {
    let mut at = "theta_i,phi_i,theta_o,phi_o\n".to_owned();
    for theta_i in [10, 30, 50, 70] {
        for theta_o in (0..=80).step_by(10) {
            for phi_o in (0..=180).step_by(20) {
                writeln!(at, "{theta_i},0,{theta_o},{phi_o}").unwrap();
            }
        }
    }
    folder.write("at.csv", &at);
    let set = "kd=0.4 m=0.25 f0=0.05";
    let line = format!("synth -m '{MODEL}' --set {set} --at at.csv --noise 0.01 --seed 3 -o paint.csv");
    folder.brdfit(&line).good();
    let text = std::fs::read_to_string(folder.path("paint.csv")).unwrap();
    let rows = text.lines().filter(|line| !line.starts_with(['#', 't']));
    rows.map(|row| {
        let fields: Vec<f64> = row.split(',').filter_map(|field| field.parse().ok()).collect();
        let [theta_i, phi_i, theta_o, phi_o] = fields[..4] else { panic!("{row}") };
        let f = fields[4];
        [theta_i, phi_i, theta_o, phi_o, f]
    })
    .collect()
}

/// Writes the samples as `change` makes them.
fn write(folder: &Folder, name: &str, samples: &[[f64; 5]], change: impl Fn([f64; 5]) -> [f64; 5]) {
    let mut text = "theta_i,phi_i,theta_o,phi_o,f\n".to_owned();
    for sample in samples {
        let fields = change(*sample).map(|value| value.to_string());
        writeln!(text, "{}", fields.join(",")).unwrap();
    }
    folder.write(name, text);
}

/// Whether a report has the paint's parameters, within 2 %.
fn is_paint(report: &Value) -> bool {
    let value = |name: &str| {
        let parameters = report["parameters"].as_array().unwrap();
        parameters.iter().find(|p| p["name"] == name).and_then(|p| p["value"].as_f64()).unwrap()
    };
    [("kd", 0.4), ("m", 0.25), ("f0", 0.05)]
        .iter()
        .all(|(name, truth)| (value(name) / truth - 1.0).abs() < 0.02)
}

#[test]
fn a_paint_in_other_conventions_is_the_paint() {
    type Change = fn([f64; 5]) -> [f64; 5];
    let cases: [(&str, Change, &str); 15] = [
        ("plain", |s| s, ""),
        ("from the mirror", |[a, b, c, d, f]| [a, b, c, 180.0 - d, f], "--azimuth from-mirror"),
        ("relative", |[a, _, c, d, f]| [a, 125.0, c, d, f], "--azimuth relative"),
        ("elevation", |[a, b, c, d, f]| [90.0 - a, b, 90.0 - c, d, f], "--angles elevation"),
        ("cosine of one", |[a, b, c, d, f]| [a.to_radians().cos(), b, c, d, f], "--angles theta_i=cosine"),
        (
            "radians",
            |s| [s[0].to_radians(), s[1].to_radians(), s[2].to_radians(), s[3].to_radians(), s[4]],
            "--angles radians",
        ),
        ("gradians", |s| [s[0] / 0.9, s[1] / 0.9, s[2] / 0.9, s[3] / 0.9, s[4]], "--angles gradians"),
        (
            "travelling light",
            |[a, b, c, d, f]| [180.0 - a, b + 180.0, c, d, f],
            "--light-direction as-it-travels",
        ),
        ("f cos(theta_i)", |[a, b, c, d, f]| [a, b, c, d, f * a.to_radians().cos()], "--quantity f-cos-i"),
        ("f cos(theta_o)", |[a, b, c, d, f]| [a, b, c, d, f * c.to_radians().cos()], "--quantity f-cos-o"),
        ("pi f", |[a, b, c, d, f]| [a, b, c, d, PI * f], "--quantity reflectance-factor"),
        ("per cent", |[a, b, c, d, f]| [a, b, c, d, 100.0 * PI * f], "--quantity reflectance-factor,percent"),
        ("decibels", |[a, b, c, d, f]| [a, b, c, d, 10.0 * f.log10()], "--quantity decibel"),
        (
            "per square degree",
            |[a, b, c, d, f]| [a, b, c, d, f * (PI / 180.0).powi(2)],
            "--quantity per-square-degree",
        ),
        ("a bright reference", |[a, b, c, d, f]| [a, b, c, d, 1.25 * f], "--scale 0.8"),
    ];
    let folder = Folder::new();
    let samples = paint(&folder);
    for (what, change, options) in cases {
        write(&folder, "changed.csv", &samples, change);
        let fitted = folder.brdfit(&format!("fit changed.csv -m '{MODEL}' {options} -q -o fit.json"));
        assert_eq!(fitted.code, Some(0), "{what}: {fitted:?}");
        let report: Value =
            serde_json::from_str(&std::fs::read_to_string(folder.path("fit.json")).unwrap()).unwrap();
        assert!(is_paint(&report), "{what}: {}", report["parameters"]);
        let recorded = report["options"]["reading"].as_array().unwrap();
        assert_eq!(recorded.len(), usize::from(!options.is_empty()), "{what}");
        // The report knows how its measurement was read.
        let again = folder.brdfit("evaluate fit.json --json").good().json();
        assert_eq!(again["errors"], report["errors"], "{what}");
        assert_eq!(again["options"]["reading"], report["options"]["reading"], "{what}");
        if !options.is_empty() {
            // Without it the file is refused or fits to something else.
            let wrong = folder.brdfit(&format!("fit changed.csv -m '{MODEL}' --json"));
            let is_wrong = wrong.code == Some(2) || !is_paint(&wrong.json());
            assert!(is_wrong, "{what}: the option is not needed");
        }
    }
}

/// What speaks for another reading is the same for all models: it is printed with the first, and stands in every report.
#[test]
fn a_doubt_about_the_file_is_printed_once() {
    let folder = Folder::new();
    let samples = paint(&folder);
    write(&folder, "changed.csv", &samples, |[a, b, c, d, f]| [a, b, c, d, f * c.to_radians().cos()]);
    let run = folder.brdfit(&format!("fit changed.csv -m lambert -m '{MODEL}' -o fits.json"));
    let said = run.stderr.lines().filter(|line| line.contains("f cos(theta_o)"));
    assert_eq!(said.count(), 1, "{run:?}");
    let reports: Value = serde_json::from_str(&folder.read("fits.json")).unwrap();
    for report in reports["reports"].as_array().unwrap() {
        let mut kinds = report["warnings"].as_array().unwrap().iter().map(|warning| &warning["kind"]);
        assert!(kinds.any(|kind| kind == "suspicious-values"), "{}", report["model"]);
    }
}

#[test]
fn samples_are_left_out_and_counted() {
    let folder = Folder::new();
    let samples = paint(&folder);
    // A lamp that shadows the viewer, marked; and readings of a strut.
    write(&folder, "marked.csv", &samples, |[a, b, c, d, f]| {
        let hidden = (a - c).abs() < 1.0 && d < 30.0;
        let strut = a == 50.0 && (c - 50.0).abs() < 15.0 && d > 150.0;
        [
            a,
            b,
            c,
            d,
            if hidden {
                -999.0
            } else if strut {
                7.0 * f
            } else {
                f
            },
        ]
    });
    let options = "--missing -999 --leave-out theta_i=50,theta_o=35..65,phi_o=150..180";
    let report = folder.brdfit(&format!("fit marked.csv -m '{MODEL}' {options} --json")).json();
    assert!(is_paint(&report), "{}", report["parameters"]);
    assert_eq!(report["data"]["dropped"]["left-out"], 6);
    assert_eq!(report["data"]["dropped"]["not-measured"], 8);
    assert_eq!(report["options"]["reading"].as_array().unwrap().len(), 2);
    let noticed = folder.brdfit("info marked.csv");
    assert!(
        noticed.stderr.contains("-999 at 8 samples") && noticed.stderr.contains("--missing -999"),
        "{noticed:?}"
    );
}

#[test]
fn polarised_channels_are_averaged_on_request() {
    let folder = Folder::new();
    let samples = paint(&folder);
    let mut text = "theta_i,phi_i,theta_o,phi_o,s,p\n".to_owned();
    for [a, b, c, d, f] in &samples {
        writeln!(text, "{a},{b},{c},{d},{},{}", 1.2 * f, 0.8 * f).unwrap();
    }
    folder.write("polarised.csv", text);
    let report = folder.brdfit(&format!("fit polarised.csv -m '{MODEL}' --mean-of-s-and-p --json")).json();
    assert!(is_paint(&report), "{}", report["parameters"]);
    let noticed = with_notes(&folder, "info polarised.csv");
    assert!(
        noticed.stderr.contains("polarised light") && noticed.stderr.contains("(--mean-of-s-and-p)"),
        "{noticed:?}"
    );
}

/// Standard input, by its usual name.
#[test]
fn a_measurement_from_standard_input() {
    let folder = Folder::new();
    paint(&folder);
    let text = std::fs::read(folder.path("paint.csv")).unwrap();
    let run = assert_cmd::Command::new(env!("CARGO_BIN_EXE_brdfit"))
        .current_dir(folder.path("."))
        .args(["fit", "-", "-m", MODEL, "--json"])
        .write_stdin(text)
        .output()
        .unwrap();
    let report: Value =
        serde_json::from_slice(&run.stdout).unwrap_or_else(|error| panic!("{error}: {run:?}"));
    assert!(is_paint(&report), "{}", report["parameters"]);
    assert_eq!(report["data"]["path"], "-");
}

#[test]
fn mistakes_in_reading_options_are_refused() {
    let folder = Folder::new();
    folder.write("good.csv", super::GOOD);
    with_notes(&folder, "convert good.csv -o good.npz");
    let line = |options: &str| format!("info good.csv {options}");
    assert_refused(
        &folder,
        &[
            refused("a unit", &line("--angles turns"), &["--angles", "degrees", "'turns'"]),
            refused("an azimuth", &line("--azimuth north"), &["--azimuth", "from-mirror"]),
            refused("a quantity", &line("--quantity brdf"), &["--quantity", "reflectance-factor", "'brdf'"]),
            refused("a scale", &line("--scale 0"), &["--scale", "above 0"]),
            refused("a marker", &line("--missing none"), &["--missing", "-999"]),
            refused("a rule", &line("--leave-out theta_i"), &["--leave-out", "theta_i"]),
            refused("a column", &line("--columns theta_i=x,theta_o=y"), &["'x'"]),
            refused("a separator", &line("--separator dot"), &["--separator", "semicolon"]),
            refused("a direction", &line("--light-direction up"), &["--light-direction", "as-it-travels"]),
            refused("no polarised channels", &line("--mean-of-s-and-p"), &["--mean-of-s-and-p", "r, g, b"]),
            refused("columns of arrays", "info good.npz --columns theta_i=a", &["--columns", "npz", "csv"]),
        ],
    );
}

/// The files of the shared cases, with the options that make them right.
#[test]
fn shared_cases_with_the_right_option() {
    let Some(data) = shared("more") else { return };
    let cases = data.join("../../cases");
    if !cases.exists() {
        return;
    }
    let folder = Folder::new();
    for (file, options) in [
        ("01-azimuth/phi-from-mirror.csv", "--azimuth from-mirror"),
        ("01-azimuth/elevation.csv", "--angles elevation"),
        ("03-reflectance-factor/factor.csv", "--quantity reflectance-factor"),
        ("03-reflectance-factor/per-cent.csv", "--quantity reflectance-factor,percent"),
        ("03-reflectance-factor/decibel.csv", "--quantity decibel"),
        ("05-times-cosine/f-cos-o.csv", "--quantity f-cos-o"),
        ("09-holes/minus-999.csv", "--missing -999"),
    ] {
        let path: &Path = &cases.join(file);
        let report = folder.brdfit(&format!("fit '{}' -m '{MODEL}' {options} --json", path.display())).json();
        assert!(is_paint(&report), "{file}: {}", report["parameters"]);
    }
}
