//! `brdfit synth`.

use crate::common::Folder;
use approx::{assert_abs_diff_eq, assert_relative_eq};
use serde_json::Value;
use std::f64::consts::PI;
use std::fs;

#[test]
fn synth_writes_what_it_was_asked_for() {
    let folder = Folder::new();
    // Anything may stand beside the angles; a negative theta is on the other side of the normal.
    folder.write(
        "angles.csv",
        "# places\nname,theta_i,phi_i,theta_o,phi_o\nhere,10,20,30,40\nthere,0,0,89.5,-170\nback,-25,30,60,0\n",
    );
    let run = folder.brdfit("synth -m lambert --set kd=0.5 --at angles.csv -o -").good();
    let rows = table(&run.stdout);
    assert_eq!(rows.0, ["theta_i", "phi_i", "theta_o", "phi_o", "f"]);
    let expected = [[10.0, 20.0, 30.0, 40.0], [0.0, 0.0, 89.5, -170.0], [25.0, -150.0, 60.0, 0.0]];
    assert_eq!(rows.1.len(), 3);
    for (row, expected) in rows.1.iter().zip(expected) {
        for (angle, expected) in row.iter().zip(expected) {
            assert_abs_diff_eq!(*angle, expected, epsilon = 1e-10);
        }
        assert_relative_eq!(row[4], 0.5 / PI, max_relative = 1e-14);
    }
    folder.brdfit("synth -m lambert --set kd=0.5 --at angles.csv -o f.csv").good();
    assert_eq!(folder.read("f.csv"), run.stdout);

    // Channels by name; the same seed draws the same bytes, another seed others.
    let line =
        "synth -m 'lambert + cook-torrance' --set kd.r=0.1 kd[550]=0.3 --directions 100 --max-theta 50 -o -";
    let first = folder.brdfit(&format!("{line} --noise 0.1 --noise-abs 0.001 --seed 5")).good().stdout;
    assert_eq!(folder.brdfit(&format!("{line} --noise 0.1 --noise-abs 0.001 --seed 5")).stdout, first);
    assert_ne!(folder.brdfit(&format!("{line} --noise 0.1 --noise-abs 0.001 --seed 6")).stdout, first);
    let (names, rows) = table(&first);
    assert_eq!(names[4..], ["r", "550", "sigma_r", "sigma_550"]);
    assert_eq!(rows.len(), 100);
    let clean = table(&folder.brdfit(&format!("{line} --seed 5")).good().stdout);
    assert_eq!(clean.0[4..], ["r", "550"], "no sigma without noise");
    for (noisy, clean) in rows.iter().zip(&clean.1) {
        assert_eq!(noisy[..4], clean[..4], "noise does not move the directions");
        assert!(noisy[0] <= 50.0 + 1e-9 && noisy[2] <= 50.0 + 1e-9);
        for channel in [4, 5] {
            // sigma^2 = (REL f)^2 + S^2; 6 sigma happen once in 10^9 draws.
            let sigma = (0.1 * clean[channel]).hypot(0.001);
            assert_relative_eq!(noisy[channel + 2], sigma, max_relative = 1e-12);
            assert!((noisy[channel] - clean[channel]).abs() < 6.0 * sigma);
            assert!(noisy[channel] != clean[channel]);
        }
    }
}

#[test]
fn a_height_field_is_measured_and_fitted() {
    let folder = Folder::new();
    let line = "synth --from-heightfield v-groove --set m=0.3 --rays 50000 --seed 4";
    let text = folder.brdfit(&format!("{line} -o -")).good().stdout;
    folder.brdfit(&format!("{line} -o groove.csv")).good();
    assert_eq!(folder.read("groove.csv"), text, "the same seed traces the same rays");
    let other = folder.brdfit(&format!("{} -o -", line.replace("--seed 4", "--seed 5"))).good().stdout;
    assert_ne!(other, text);

    let (names, rows) = table(&text);
    assert_eq!(names, ["theta_i", "phi_i", "theta_o", "phi_o", "f", "sigma"]);
    let mut angles: Vec<f64> = rows.iter().map(|row| row[0].round()).collect();
    angles.dedup();
    assert_eq!(angles, [0.0, 15.0, 30.0, 45.0, 60.0, 75.0]);
    for row in &rows {
        assert!(row[1] == 0.0 && row[2] <= 80.0 && row[4] >= 0.0 && row[5] > 0.0, "{row:?}");
    }
    // What became of the rays is in the head.
    assert!(text.contains("# 51200 rays for each theta_i, seed 4\n"), "{text:.400}");

    // Full strength and the slope that was asked for, to four standard errors and the 0.2 % of the bins.
    let model = "-m 'cook-torrance(d=beckmann, g=v-cavity, f=none)' --metric l2 --weights sigma";
    let report = folder.brdfit(&format!("fit groove.csv {model} --json")).good().json();
    for (name, truth) in [("m", 0.3), ("ks", 1.0)] {
        let parameters = report["parameters"].as_array().unwrap();
        let row = parameters.iter().find(|row| row["name"] == name).unwrap();
        let error = row["std_error"].as_f64().unwrap();
        assert_abs_diff_eq!(row["value"].as_f64().unwrap(), truth, epsilon = 4.0 * error + 0.002 * truth);
    }

    // Angles and facets of one's own; a smaller limit of viewing.
    let line =
        "synth --from-heightfield gaussian --set m=0.5 --tile 16 --rays 6400 --theta-i 20,40 --max-theta 50";
    let (_, rows) = table(&folder.brdfit(&format!("{line} -o -")).good().stdout);
    assert!(rows.iter().all(|row| row[2] <= 50.0 && [20.0, 40.0].contains(&row[0].round())));
    let line = "synth --from-heightfield v-groove --facets ggx --set m=0.5 --rays 6400 -o ggx.csv";
    folder.brdfit(line).good();
    assert!(folder.read("ggx.csv").contains("facets ggx"));
}

/// Names and numbers of a CSV.
fn table(text: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names = lines.next().unwrap().split(',').map(str::to_owned).collect();
    (names, lines.map(|line| line.split(',').map(|f| f.parse().unwrap()).collect()).collect())
}

#[test]
fn merl_tables_can_be_made_described_and_fitted() {
    let folder = Folder::new();
    folder
        .brdfit("synth -m 'lambert + cook-torrance' --set kd.r=0.5 kd.g=0.2 kd.b=0.1 m=0.2 --grid merl -o m.binary")
        .good();
    assert_eq!(fs::metadata(folder.path("m.binary")).unwrap().len(), 34_992_012);
    let info = folder.brdfit("info m.binary --json").good().json();
    assert_eq!(info["format"], "merl");
    assert_eq!(info["samples"], 1_458_000);
    assert_eq!(info["genuine_merl"], Value::Null);
    let dropped: u64 = info["dropped"].as_object().unwrap().values().map(|n| n.as_u64().unwrap()).sum();
    assert_eq!(info["usable"].as_u64().unwrap() + dropped, 1_458_000);
    let text = folder.brdfit("info m.binary").good().stdout;
    assert!(text.contains("merl") && text.contains("1458000"), "{text}");

    let line = "fit m.binary -m 'lambert + cook-torrance' --samples 3000 --json";
    let report = folder.brdfit(line).good().json();
    assert_eq!(report["data"]["format"], "merl");
    assert_eq!(report["filters"]["weights"], "solid-angle");
    assert_eq!(report["options"]["merl_bins"], "center");
    let m = report["parameters"].as_array().unwrap().iter().find(|p| p["name"] == "m").unwrap();
    assert_relative_eq!(m["value"].as_f64().unwrap(), 0.2, max_relative = 1e-6);
    // Read by the other convention, the same table is another measurement.
    let edge = folder.brdfit(&format!("{line} --merl-bins edge")).json();
    assert_eq!(edge["options"]["merl_bins"], "edge");
    assert!(edge["errors"]["cbrt"].as_f64().unwrap() > 100.0 * report["errors"]["cbrt"].as_f64().unwrap());
}
