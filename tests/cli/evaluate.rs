//! `brdfit evaluate`.

use super::{laboratory, timeless};
use crate::common::Folder;
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
