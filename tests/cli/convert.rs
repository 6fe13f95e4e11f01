//! `brdfit convert`.

use super::{assert_refused, paint, refused, with_notes};
use crate::common::Folder;

const MODEL: &str = "lambert + cook-torrance";

/// The records of a CSV, as numbers.
fn numbers(text: &str) -> Vec<Vec<f64>> {
    let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    lines.map(|line| line.split(',').map(|word| word.parse().unwrap()).collect()).collect()
}

/// The values of some parameters of a fit.
fn fitted(folder: &Folder, line: &str, names: &[&str]) -> Vec<f64> {
    let run = folder.brdfit(&format!("fit {line} -m '{MODEL}' --json"));
    let report = run.json();
    let parameters = report["parameters"].as_array().unwrap().clone();
    let value = |name: &&str| {
        let (parameter, channel) = name.split_once('.').map_or((*name, None), |(p, c)| (p, Some(c)));
        let own = parameters.iter().find(|p| p["name"] == parameter && p["channel"].as_str() == channel);
        own.unwrap_or_else(|| panic!("{name} in {report}"))["value"].as_f64().unwrap()
    };
    names.iter().map(value).collect()
}

#[test]
fn values_at_given_directions_are_those_of_the_model_or_of_the_samples() {
    let folder = Folder::new();
    paint(&folder);
    folder
        .write("at.csv", "theta_i,phi_i,theta_o,phi_o\n0,0,0,0\n30,10,40,200\n-20,0,35,0\n89.9,0,89.9,180\n");
    with_notes(&folder, "convert paint.json --at at.csv -o model.csv");
    folder.brdfit("evaluate paint.json --at at.csv -o evaluated.csv").good();
    let (model, evaluated) = (numbers(&folder.read("model.csv")), numbers(&folder.read("evaluated.csv")));
    for (found, wanted) in model.iter().zip(&evaluated) {
        assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?} {wanted:?}");
    }
    assert_eq!(model.len(), 4);
    assert!(folder.read("model.csv").contains("theta_i,phi_i,theta_o,phi_o,r,g,b\n"));
    // A measurement gives back its own samples at their directions.
    let run = with_notes(&folder, "convert paint.csv --at paint.csv -o same.csv");
    assert!(!run.stderr.contains("extrapolated"), "{run:?}");
    for (found, wanted) in numbers(&folder.read("same.csv")).iter().zip(numbers(&folder.read("paint.csv"))) {
        assert!(
            found.iter().zip(&wanted).skip(4).all(|(a, b)| (a - b).abs() < 1e-12 * b),
            "{found:?} {wanted:?}"
        );
    }
    // Beyond the samples it says that it extrapolates.
    let run = with_notes(&folder, "convert paint.csv --at at.csv -o beyond.csv");
    assert!(run.stderr.contains("of 4 directions lie outside the measured ones"), "{run:?}");
}

#[test]
fn a_table_keeps_what_it_can_and_says_what_it_cannot() {
    let folder = Folder::new();
    paint(&folder);
    let run = with_notes(&folder, "convert paint.csv -o copy.csv");
    assert!(
        run.stderr.contains("copy.csv: csv; read back") && run.stderr.contains("relative RMS 0 %"),
        "{run:?}"
    );
    for (found, wanted) in numbers(&folder.read("copy.csv")).iter().zip(numbers(&folder.read("paint.csv"))) {
        assert_eq!(found[4..], wanted[4..]);
        assert!(found.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-10), "{found:?} {wanted:?}");
    }
    // A MERL table of a fit gives the fit back.
    let run = with_notes(&folder, "convert paint.json -o paint.binary");
    assert!(run.stderr.contains("paint.binary: merl; read back at 4000 random"), "{run:?}");
    let found = fitted(&folder, "paint.binary --samples 20000", &["kd.r", "kd.g", "kd.b", "m"]);
    for (found, wanted) in found.iter().zip([0.4, 0.1, 0.05, 0.2]) {
        assert!((found / wanted - 1.0).abs() < 1e-3, "{found} for {wanted}");
    }
    // So does a grid of angles, of which as many are written as asked for.
    let grid = "theta_i=10:20:70,theta_o=0:10:80,phi=0:30:180";
    with_notes(&folder, &format!("convert paint.json --grid {grid} -o grid.csv"));
    assert_eq!(numbers(&folder.read("grid.csv")).len(), 4 * (1 + 8 * 7));
    let found = fitted(&folder, "grid.csv", &["m"]);
    assert!((found[0] - 0.2).abs() < 1e-6, "{found:?}");
    // One channel becomes three equal ones, and is said.
    folder.brdfit("synth -m lambert --set kd=0.5 --directions 50 -o grey.csv").good();
    folder.brdfit("fit grey.csv -m lambert -o grey.json -q").good();
    let run = with_notes(&folder, "convert grey.json --to merl -o grey.table");
    assert!(run.stderr.contains("written three times"), "{run:?}");
}

/// A grey spectrum is grey in all primaries and under all lights; a red one is as red as the eye sees it.
#[test]
fn spectra_become_colours() {
    let folder = Folder::new();
    let wavelengths: Vec<u32> = (380..=780).step_by(10).collect();
    let names: Vec<String> = wavelengths.iter().map(|nm| format!("{nm}nm")).collect();
    let row = |f: &dyn Fn(u32) -> f64| {
        let values: Vec<String> = wavelengths.iter().map(|nm| f(*nm).to_string()).collect();
        format!("30,0,40,180,{}\n", values.join(","))
    };
    let table = [row(&|_| 0.25), row(&|nm| if nm >= 600 { 0.25 } else { 0.0 })].concat();
    folder.write("spectra.csv", format!("theta_i,phi_i,theta_o,phi_o,{}\n{table}", names.join(",")));
    for options in ["", "--illuminant e", "--primaries acescg", "--illuminant e --primaries acescg"] {
        let run = with_notes(&folder, &format!("convert spectra.csv --rgb {options} -o rgb.csv"));
        assert!(run.stderr.contains("CIE 1931"), "{run:?}");
        let text = folder.read("rgb.csv");
        assert!(text.contains("theta_i,phi_i,theta_o,phi_o,r,g,b\n"), "{text}");
        let rows = numbers(&text);
        assert!(rows[0][4..].iter().all(|f| (f - 0.25).abs() < 1e-12), "{options}: {rows:?}");
        let [r, g, b] = rows[1][4..] else { panic!("{rows:?}") };
        assert!(r > 0.1 && g.abs() < 0.1 * r && b.abs() < 0.02, "{options}: {rows:?}");
    }
    // More than three channels without --rgb fit in no MERL table.
    assert_refused(
        &folder,
        &[refused("a spectrum as MERL", "convert spectra.csv -o spectra.binary", &["r, g and b", "--rgb"])],
    );
}

#[test]
fn mistakes_are_refused_in_one_line() {
    let folder = Folder::new();
    paint(&folder);
    assert_refused(
        &folder,
        &[
            refused("no such format", "convert paint.csv --to xml -o x.xml", &["xml", "csv", "merl"]),
            refused("an unknown ending", "convert paint.csv -o paint.xyz", &["paint.xyz", ".csv", "--to"]),
            refused("no output", "convert paint.csv", &["--output"]),
            refused("its own input", "convert paint.csv -o paint.csv", &["other than the input"]),
            refused(
                "a bad grid",
                "convert paint.csv --grid theta=3 -o x.csv",
                &["--grid", "theta_i=0:10:80"],
            ),
            refused(
                "a grid for MERL",
                "convert paint.csv --grid theta_i=3 -o x.binary",
                &["which has its own"],
            ),
            refused("binary to the terminal", "convert paint.csv --to merl -o -", &["binary"]),
            refused("no such directions", "convert paint.csv --at nothing.csv -o x.csv", &["nothing.csv"]),
            refused("light without colours", "convert paint.csv --illuminant e -o x.csv", &["--rgb"]),
            refused("no such file", "convert nothing.csv -o x.csv", &["nothing.csv"]),
        ],
    );
}
