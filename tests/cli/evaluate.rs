//! `brdfit evaluate`.

use super::{assert_refused, laboratory, refused, timeless};
use crate::common::{Folder, parse};
use approx::assert_relative_eq;
use serde_json::json;
use std::f64::consts::PI;

#[test]
fn evaluation_of_the_truth_is_exact() {
    let folder = laboratory();
    let truth = "--set kd.r=0.5 kd.g=0.3 kd.b=0.1 f0=0.05 m=0.3";
    let line = format!("evaluate clean.csv -m 'lambert + cook-torrance' {truth}");
    let report = folder.brdfit(&format!("{line} --json -o r.json")).good().json();
    for metric in ["l2", "log", "cbrt", "log_ratio", "relative"] {
        assert!(report["errors"][metric].as_f64().unwrap() < 1e-12, "{}", report["errors"]);
        for channel in ["r", "g", "b"] {
            assert!(report["errors_by_channel"][channel][metric].as_f64().unwrap() < 1e-12);
        }
    }
    assert_eq!(report["termination"]["reason"], "evaluated");
    assert_eq!(timeless(&folder.read("r.json")), timeless(&folder.brdfit(&format!("{line} -o -")).stdout));
    // As a table.
    let table = folder.brdfit(&line).good();
    assert!(table.stdout.contains("clean.csv") && table.stdout.contains("cbrt"));
    // With a dash in the order of the contract, options may also be repeated.
    let again = folder
        .brdfit(
            "evaluate clean.csv -m 'lambert + cook-torrance' --set kd.r=0.5 --set kd.g=0.3 --set kd.b=0.1 \
             --set cook-torrance.f0=0.05 --set cook-torrance.m=0.3 --json",
        )
        .good();
    assert_eq!(again.json()["errors"], report["errors"]);
}

/// Two samples, two channels, worked out here from the definitions of the metrics.
#[test]
fn errors_are_what_their_definitions_say() {
    let folder = Folder::new();
    folder.write(
        "two.csv",
        "theta_i,phi_i,theta_o,phi_o,p,q\n60,0,30,180,0.2,0.1\n0,0,45,90,0.05,0.3\n85,0,0,0,9,9\n",
    );
    let report = folder.brdfit("evaluate two.csv -m lambert --set kd.p=0.5 kd.q=0.8 --json").good().json();
    // f cos(theta_i) of the model and measured; 85 degrees lies beyond the default limit of 80.
    let (co, ci) = ([30.0_f64, 45.0].map(|t| t.to_radians().cos()), [0.5, 1.0]);
    let measured = [[0.2, 0.05], [0.1, 0.3]];
    let model = [0.5 / PI, 0.8 / PI];
    let mut expected = [0.0; 5];
    let mut of_q = [0.0; 5];
    let mut scale = [0.0; 2];
    for channel in 0..2 {
        for sample in 0..2 {
            let (f, g) = (model[channel], measured[channel][sample]);
            let (x, y) = (f * ci[sample], g * ci[sample]);
            let e = 1e-3;
            let q = (ci[sample] * co[sample]).max(e);
            let terms = [
                (x - y).powi(2),
                ((1.0 + x).ln() - (1.0 + y).ln()).powi(2),
                (x.cbrt() - y.cbrt()).powi(2),
                ((f * q + e) / (g * q + e)).ln().abs(),
                (x - y).abs(),
            ];
            for (sum, term) in expected.iter_mut().zip(terms) {
                *sum += term;
            }
            scale[0] += y;
            if channel == 1 {
                of_q.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
                scale[1] += y;
            }
        }
    }
    let names = ["l2", "log", "cbrt", "log_ratio", "relative"];
    for (sums, n, scale, found) in [
        (expected, 4.0, scale[0], &report["errors"]),
        (of_q, 2.0, scale[1], &report["errors_by_channel"]["q"]),
    ] {
        let [l2, log, cbrt, log_ratio, relative] = sums;
        let values = [(l2 / n).sqrt(), (log / n).sqrt(), (cbrt / n).sqrt(), log_ratio / n, relative / scale];
        for (name, value) in names.into_iter().zip(values) {
            assert_relative_eq!(found[name].as_f64().unwrap(), value, max_relative = 1e-12);
        }
    }
    assert_eq!(report["data"]["samples"], 3);
    assert_eq!(report["data"]["used"], 2);
    assert_eq!(report["data"]["dropped"], json!({"beyond-max-theta": 1}));
    assert_eq!(report["fit"]["n"], 4);
}

/// What `fit` writes, the other subcommands take: `evaluate` repeats the errors, gives values at directions that `synth` repeats, and
/// `check` and `fit --init` take it too.
#[test]
fn reports_are_inputs() {
    let folder = laboratory();
    let options = "--metric l2 --max-theta 70 --weights uniform";
    folder
        .brdfit(&format!("fit a.csv -m 'lambert + cook-torrance(d=beckmann)' {options} -o fit.json -q"))
        .good();
    let fitted = parse(&folder.read("fit.json"));
    let errors =
        |line: &str| folder.brdfit(&format!("evaluate {line} --json")).good().json()["errors"].clone();
    // On its own measurement and with its own options, unless others are given.
    assert_eq!(errors("fit.json"), fitted["errors"]);
    assert_eq!(errors("fit.json a.csv"), fitted["errors"]);
    assert_eq!(errors("a.csv fit.json"), fitted["errors"]);
    assert_ne!(errors("fit.json --max-theta 80"), fitted["errors"]);
    assert_ne!(errors("fit.json b.csv"), fitted["errors"]);
    let rougher = errors("fit.json --set m=0.5 kd.r=0.4");
    assert!(rougher["cbrt"].as_f64().unwrap() > 2.0 * fitted["errors"]["cbrt"].as_f64().unwrap());
    assert_eq!(errors("--set m=0.5 kd.r=0.4 fit.json"), rougher);

    // Values at directions.
    folder.brdfit("evaluate fit.json --at clean.csv -o values.csv").good();
    folder.brdfit("synth fit.json --at clean.csv -o again.csv").good();
    let rows = |name: &str| {
        let text = folder.read(name);
        // Without the standard errors, which only `evaluate` gives.
        let values = |line: &str| line.split(',').take(7).collect::<Vec<_>>().join(",");
        text.lines().filter(|line| !line.starts_with('#')).map(values).collect::<Vec<_>>()
    };
    assert_eq!(rows("values.csv"), rows("again.csv"));
    assert_eq!(rows("values.csv")[0], "theta_i,phi_i,theta_o,phi_o,r,g,b");
    assert_eq!(rows("values.csv").len(), 201);
    let exact = errors("fit.json values.csv");
    assert!(exact["l2"].as_f64().unwrap() < 1e-14, "{exact}");
    let printed = folder.brdfit("evaluate fit.json --at clean.csv").good();
    assert_eq!(printed.stdout, folder.read("values.csv"));
    let of_model = "-m 'lambert + cook-torrance(d=beckmann)' --set kd=0.1";
    folder.brdfit(&format!("evaluate {of_model} --at clean.csv -o values.csv")).good();
    folder.brdfit(&format!("synth {of_model} --at clean.csv -o again.csv")).good();
    assert_eq!(rows("values.csv"), rows("again.csv"));

    // A table in three channels, and a model that is sound.
    folder.brdfit("synth fit.json --set m=0.4 --grid merl -o table.binary").good();
    let checked = folder.brdfit("check fit.json --set kd=0.1 --json").good().json();
    let kd = &checked["parameters"].as_array().unwrap()[0];
    assert_eq!((&kd["name"], &kd["value"]), (&json!("lambert.kd.r"), &json!(0.1)));

    // A fit that starts where another ended repeats it, without a model of its own and with its constraints.
    let start = |line: &str| folder.brdfit(&format!("fit --init fit.json {line} --json")).good();
    let again = start(&format!("a.csv {options}")).json();
    assert_eq!((&again["model"], again["starts"].as_array().unwrap().len()), (&fitted["model"], 1));
    let costs = [&again, &fitted].map(|report| report["fit"]["cost"].as_f64().unwrap());
    assert_relative_eq!(costs[0], costs[1], max_relative = 1e-10);
    assert_eq!(again["options"]["parameters"], json!(["--init fit.json"]));
    for (ours, theirs) in
        again["parameters"].as_array().unwrap().iter().zip(fitted["parameters"].as_array().unwrap())
    {
        // The scan finds the amplitudes for each shape anew.
        if theirs["name"] == "m" {
            assert_eq!(ours["initial"], theirs["value"]);
        }
    }
    // What the user says about a value comes first, and models start from what they share with the report.
    let fixed = start("m=0.35 a.csv --fix kd.r=0.2").json();
    let values = fixed["parameters"].as_array().unwrap();
    assert_eq!(values[0]["value"], 0.2);
    assert_eq!(values.iter().find(|p| p["name"] == "m").unwrap()["initial"], 0.35);
    let other = folder.brdfit("fit a.csv -m eon -m lambert --init fit.json -q");
    assert_eq!(other.stderr, "note: fit.json has no value to start 'eon' from\n");
}

#[test]
fn reports_that_do_not_suit_are_refused() {
    let folder = laboratory();
    folder.brdfit("fit a.csv -m lambert -o fit.json -q").good();
    folder.write("grey.csv", "theta_i,phi_i,theta_o,phi_o,f\n10,0,20,0,0.1\n30,0,20,0,0.2\n");
    folder.brdfit("fit grey.csv -m lambert -o grey.json -q").good();
    folder.write("moved.json", folder.read("fit.json").replace("\"a.csv\"", "\"gone.csv\""));
    folder.write("other.json", folder.read("fit.json").replace("\"a.csv\"", "\"b.csv\""));
    assert_refused(
        &folder,
        &[
            refused("a report and a model", "evaluate fit.json -m lambert a.csv", &["-m", "both"]),
            refused("two reports", "evaluate fit.json grey.json", &["one report", "grey.json"]),
            refused(
                "a measurement that moved",
                "evaluate moved.json",
                &["moved.json", "gone.csv", "no such file"],
            ),
            refused("a measurement that changed", "evaluate other.json", &["other.json", "b.csv", "SHA-256"]),
            refused("other channels", "evaluate fit.json grey.csv", &["a channel among r, g, b", "'f'"]),
            refused("directions twice", "evaluate fit.json a.csv --at b.csv", &["--at", "a.csv"]),
            refused("values as a report", "evaluate fit.json --at b.csv --json", &["--json"]),
            refused("onto the report", "evaluate fit.json -o fit.json", &["fit.json"]),
            refused("no directions", "evaluate fit.json --at none.csv", &["none.csv"]),
            refused("no such parameter", "evaluate fit.json --set ks=1", &["ks"]),
            refused("beyond the bounds", "evaluate fit.json --set kd=3", &["kd", "0..2"]),
            refused("no report", "synth a.csv --directions 3 -o f.csv", &["a.csv", "expected a report"]),
            refused("grey onto a table", "synth grey.json --grid merl -o f.binary", &["r, g and b", "'f'"]),
            refused("a start alone", "fit --init fit.json", &["INPUT"]),
            refused("two starts", "fit --init fit.json grey.json a.csv", &["--init", "one report"]),
            refused("onto the start", "fit a.csv --init fit.json -o fit.json", &["fit.json"]),
            refused("a start in other channels", "fit grey.csv --init fit.json", &["'r'"]),
        ],
    );
}

/// f of lambert is kd/pi, and so is its standard error.
#[test]
fn values_of_a_report_have_standard_errors() {
    let folder = laboratory();
    folder.brdfit("fit a.csv -m lambert -o r.json").good();
    folder.write("at.csv", "theta_i,phi_i,theta_o,phi_o\n10,0,20,90\n60,0,30,180\n");
    let report = parse(&folder.read("r.json"));
    folder.brdfit("evaluate r.json --at at.csv -o out.csv").good();
    let text = folder.read("out.csv");
    let rows: Vec<Vec<f64>> = text
        .lines()
        .filter(|line| line.starts_with(char::is_numeric))
        .map(|line| line.split(',').map(|field| field.parse().unwrap()).collect())
        .collect();
    let parameters = report["parameters"].as_array().unwrap();
    let errors: Vec<f64> =
        parameters.iter().filter_map(|p| p["std_error"].as_f64()).map(|error| error / PI).collect();
    assert!(!errors.is_empty() && rows.len() == 2);
    for row in &rows {
        assert_eq!(row.len(), 4 + 2 * errors.len(), "angles, values, standard errors");
        for (found, wanted) in row[4 + errors.len()..].iter().zip(&errors) {
            assert_relative_eq!(*found, *wanted, max_relative = 1e-6);
        }
    }
    assert!(text.contains("95 % band: f +/- "), "{text}");
    // What was set by hand has no error.
    let set = folder.brdfit("evaluate r.json --at at.csv --set kd=0.5").good();
    assert!(!set.stdout.contains("sigma"), "{}", set.stdout);
}
