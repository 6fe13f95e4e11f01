//! The options that say how far a fit can be trusted, as a user sees them: samples held out, resampled
//! standard errors, other solvers.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

mod common;

use common::{Folder, Run, parse};
use serde_json::{Value, json};

/// Directions as a goniometer takes them: each angle of incidence with viewing angles in and out of plane.
fn goniometer(theta_i: impl IntoIterator<Item = f64>) -> String {
    let mut text = String::from("theta_i,phi_i,theta_o,phi_o\n");
    for theta_i in theta_i {
        for theta_o in (0..=70).step_by(10) {
            for phi_o in [180, 150, 90, 0] {
                text += &format!("{theta_i},0,{theta_o},{phi_o}\n");
            }
        }
    }
    text
}

const MODEL: &str = "'lambert + cook-torrance'";

/// A folder with a paint measured at seven angles of incidence with 2 % noise, `paint.csv`, the same at one
/// angle, `single.csv`, and in random directions, `random.csv`.
fn laboratory() -> Folder {
    let folder = Folder::new();
    folder.write("angles.csv", goniometer((1..8).map(|k| 10.0 * f64::from(k))));
    folder.write("angle.csv", goniometer([45.0]));
    let set = "--set kd=0.3 --set m=0.2 --set f0=0.05 --noise 0.02";
    for line in [
        format!("synth -m {MODEL} {set} --at angles.csv -o paint.csv"),
        format!("synth -m {MODEL} {set} --at angle.csv -o single.csv"),
        format!("synth -m {MODEL} {set} --directions 600 -o random.csv"),
    ] {
        folder.brdfit(&line).good();
    }
    folder
}

/// Exit code 2, nothing on standard output, and one line on standard error that holds `words`.
fn assert_refused(run: &Run, words: &[&str]) {
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.stdout.is_empty(), "{run:?}");
    assert_eq!(run.stderr.matches('\n').count(), 1, "{run:?}");
    words.iter().for_each(|word| assert!(run.stderr.contains(word), "'{word}' is not in {run:?}"));
}

/// A report without the part that differs from run to run.
fn timeless(text: &str) -> Value {
    let mut report = parse(text);
    report["time_s"] = Value::Null;
    report
}

/// The same report, to the last digit, at one thread and at two.
fn assert_same_at_any_threads(folder: &Folder, line: &str) -> Value {
    let [one, two] = [1, 2].map(|n| folder.brdfit(&format!("{line} --json --threads {n}")));
    assert_eq!(one.code, two.code);
    let report = timeless(&one.stdout);
    assert_eq!(report, timeless(&two.stdout));
    report
}

#[test]
fn whole_angles_are_held_out() {
    let folder = laboratory();
    let line = format!("fit paint.csv -m {MODEL} --hold-out 0.3");
    let report = assert_same_at_any_threads(&folder, &line);
    // 0.3 of 7 angles is 2, of 32 samples each.
    assert_eq!(report["options"]["hold_out"], 0.3);
    assert_eq!(report["data"]["dropped"], json!({"held-out": 64}));
    assert_eq!(report["data"]["used"], 160);
    assert_eq!(report["fit"]["n"], 160);
    let held = &report["selection"]["held_out"];
    assert_eq!(held["samples"], 64);
    let angles = held["theta_i_deg"].as_array().unwrap();
    assert_eq!(angles.len(), 2);
    for pair in angles {
        assert_eq!(pair[0], pair[1]);
        assert_eq!(pair[0].as_f64().unwrap() % 10.0, 0.0);
    }
    // The model is the true one: unseen angles are predicted to the noise, like those that were fitted.
    for metric in ["l2", "log", "cbrt"] {
        let ratio = held[metric].as_f64().unwrap() / report["errors"][metric].as_f64().unwrap();
        assert!((0.2..5.0).contains(&ratio), "{metric}: {ratio}");
    }

    // The table has it in one line.
    let table = folder.brdfit(&line).good().stdout;
    let line = table.lines().find(|line| line.starts_with("held out: ")).unwrap();
    let angles: Vec<String> = angles.iter().map(|pair| pair[0].as_f64().unwrap().to_string()).collect();
    assert!(
        line.starts_with(&format!("held out: 64 samples at theta_i {} deg: l2 ", angles.join(", "))),
        "{line}"
    );
    assert!(table.contains("160 of 224 samples; left out: 64 held-out"), "{table}");
}

#[test]
fn the_held_out_errors_are_those_of_the_samples_left_out() {
    // The file without the angles left out gives the same fit, and evaluating it at those angles alone
    // gives the same errors.
    let folder = laboratory();
    let report = folder.brdfit(&format!("fit paint.csv -m {MODEL} --hold-out 0.3 --json")).good().json();
    let held = &report["selection"]["held_out"];
    let out: Vec<f64> =
        held["theta_i_deg"].as_array().unwrap().iter().map(|pair| pair[0].as_f64().unwrap()).collect();
    let text = folder.read("paint.csv");
    let part = |wanted: bool| {
        let of_part = text.lines().filter(|line| {
            let angle: Result<f64, _> = line.split(',').next().unwrap().parse();
            angle.map_or(true, |a| out.iter().any(|o| (a - o).abs() < 0.01) == wanted)
        });
        of_part.map(|line| format!("{line}\n")).collect::<String>()
    };
    folder.write("kept.csv", part(false));
    folder.write("out.csv", part(true));
    let kept = folder.brdfit(&format!("fit kept.csv -m {MODEL} --json")).good().json();
    assert_eq!(kept["parameters"], report["parameters"]);
    assert_eq!(kept["errors"], report["errors"]);
    let values: Vec<String> = ["kd", "m", "f0"]
        .iter()
        .map(|name| {
            let all = report["parameters"].as_array().unwrap();
            format!("--set {name}={}", all.iter().find(|p| p["name"] == *name).unwrap()["value"])
        })
        .collect();
    let line = format!("evaluate out.csv -m {MODEL} {} --json", values.join(" "));
    let evaluated = folder.brdfit(&line).good().json();
    for metric in ["l2", "log", "cbrt", "log_ratio", "relative"] {
        assert_eq!(held[metric], evaluated["errors"][metric], "{metric}");
    }
    assert_eq!(evaluated["options"]["hold_out"], Value::Null);
    assert_eq!(evaluated["selection"]["held_out"], Value::Null);
}

#[test]
fn random_directions_are_held_out_in_ranges() {
    let folder = laboratory();
    let report =
        folder.brdfit(&format!("fit random.csv -m {MODEL} --hold-out 0.25 --seed 3 --json")).good().json();
    let held = &report["selection"]["held_out"];
    // 16 ranges of 5 degrees up to 80; a quarter of them.
    let ranges = held["theta_i_deg"].as_array().unwrap();
    assert_eq!(ranges.len(), 4);
    assert!(ranges.iter().all(|r| r[1].as_f64().unwrap() - r[0].as_f64().unwrap() == 5.0));
    assert_eq!(report["data"]["dropped"]["held-out"], held["samples"]);
    let other =
        folder.brdfit(&format!("fit random.csv -m {MODEL} --hold-out 0.25 --seed 4 --json")).good().json();
    assert_ne!(other["selection"]["held_out"]["theta_i_deg"], held["theta_i_deg"]);
}

#[test]
fn models_are_ranked_by_what_they_have_not_seen() {
    let folder = laboratory();
    let line = format!("fit paint.csv -m lambert -m {MODEL} --metric log --hold-out 0.3");
    let run = folder.brdfit(&format!("{line} --json"));
    let several = run.json();
    let ranking = several["ranking"].as_array().unwrap();
    assert_eq!(ranking[0]["index"], 1);
    for rank in ranking {
        assert_eq!(rank["criterion"], "held-out log");
        let report = &several["reports"][usize::try_from(rank["index"].as_u64().unwrap()).unwrap()];
        assert_eq!(rank["value"], report["selection"]["held_out"]["log"]);
    }
    assert!(folder.brdfit(&line).stdout.contains("\n  held-out log "));
    // Both models leave out the same.
    let out = |n: usize| &several["reports"][n]["selection"]["held_out"]["theta_i_deg"];
    assert_eq!(out(0), out(1));
}

#[test]
fn mistakes_in_hold_out_are_named() {
    let folder = laboratory();
    for wrong in ["0", "1", "-0.5", "2", "NaN", "inf"] {
        let run = folder.brdfit(&format!("fit paint.csv -m lambert --hold-out {wrong}"));
        assert_refused(&run, &["--hold-out", "above 0 and below 1", wrong]);
    }
    assert_refused(&folder.brdfit("fit paint.csv -m lambert --hold-out some"), &["--hold-out", "'some'"]);
    let run = folder.brdfit("fit single.csv -m lambert --hold-out 0.5");
    assert_refused(&run, &["single.csv", "--hold-out 0.5", "at least 2 angles of incidence", "found 1"]);
}
