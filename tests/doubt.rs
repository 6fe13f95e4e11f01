//! What a fit says when the data are not what one would wish: outliers, directions that do not tell
//! parameters apart, parameters at bounds, lobes that could change places.

use crate::common::{Folder, Run, shared};
use rand::seq::index::sample;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::Value;

const ONE_LOBE: &str = "'lambert + cook-torrance'";

/// A folder with a synthetic measurement, `clean.csv`, made with these options.
fn measured(options: &str) -> Folder {
    let folder = Folder::new();
    folder.brdfit(&format!("synth {options} -o clean.csv")).good();
    folder
}

/// `clean.csv` with one in so many values multiplied by `factor`, as `spoiled.csv`.
fn spoil(folder: &Folder, one_in: usize, factor: f64, seed: u64) {
    let text = folder.read("clean.csv");
    let (head, rows): (Vec<&str>, Vec<&str>) =
        text.lines().partition(|line| line.starts_with('#') || line.starts_with("theta"));
    let names: Vec<&str> = head.last().unwrap().split(',').collect();
    let column = names.iter().position(|name| *name == "f").unwrap();
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let chosen: Vec<usize> = sample(&mut rng, rows.len(), rows.len() / one_in).into_vec();
    let mut spoiled: Vec<String> = head.iter().map(|line| (*line).to_owned()).collect();
    for (index, row) in rows.iter().enumerate() {
        let mut fields: Vec<String> = row.split(',').map(str::to_owned).collect();
        if chosen.contains(&index) {
            fields[column] = format!("{}", fields[column].parse::<f64>().unwrap() * factor);
        }
        spoiled.push(fields.join(","));
    }
    folder.write("spoiled.csv", spoiled.join("\n") + "\n");
}

fn find<'a>(report: &'a Value, name: &str) -> &'a Value {
    let parameters = report["parameters"].as_array().unwrap();
    parameters.iter().find(|p| p["name"] == name).unwrap_or_else(|| panic!("no {name}"))
}

fn value(report: &Value, name: &str) -> f64 {
    find(report, name)["value"].as_f64().unwrap()
}

/// All warnings of a kind: parameter, text, and what is suggested, as the program prints it.
fn warnings(report: &Value, kind: &str) -> Vec<String> {
    let of_kind = report["warnings"].as_array().unwrap().iter().filter(|w| w["kind"] == kind);
    let suggestion =
        |s: &Value| format!("--{} {}", s["option"].as_str().unwrap(), s["value"].as_str().unwrap());
    let text = |w: &Value| {
        let suggestions: Vec<String> = w["suggestions"].as_array().unwrap().iter().map(suggestion).collect();
        format!("{}: {} ({})", w["parameter"].as_str().unwrap_or(""), w["text"], suggestions.join(", "))
    };
    of_kind.map(text).collect()
}

/// No parameter at a bound has an error, and no error is zero or not finite.
fn assert_errors_mean_something(report: &Value) {
    for p in report["parameters"].as_array().unwrap() {
        let error = p["std_error"].as_f64();
        if p["status"] != "free" {
            assert!(error.is_none() && p["ci95"].is_null(), "{p}");
        }
        assert!(error.is_none_or(|e| e.is_finite() && e > 0.0), "{p}");
    }
}

fn fitted(run: Run) -> Value {
    assert_eq!(run.code, Some(0), "{run:?}");
    run.json()
}

// Outliers.

#[test]
fn cauchy_recovers_the_roughness_from_spoiled_data() {
    for (roughness, noise) in [(0.02, 0.0), (0.02, 0.01), (0.1, 0.01), (0.5, 0.0), (0.5, 0.01)] {
        let set = format!("--set kd=0.3 f0=0.05 m={roughness} --noise {noise} --seed 7");
        let folder = measured(&format!("-m {ONE_LOBE} --directions 1000 {set}"));
        spoil(&folder, 100, 100.0, 3);
        for metric in ["cbrt", "log", "l2"] {
            let fit = format!("fit spoiled.csv -m {ONE_LOBE} --metric {metric} --json");
            let error = |options: &str| {
                let report = fitted(folder.brdfit(&format!("{fit} {options}")));
                (value(&report, "m") / roughness - 1.0).abs()
            };
            let (plain, huber, cauchy) = (error(""), error("--loss huber"), error("--loss cauchy"));
            println!(
                "m {roughness} noise {noise} {metric}: none {plain:.1e} huber {huber:.1e} cauchy {cauchy:.1e}"
            );
            assert!(cauchy < 0.01, "m {roughness} noise {noise} {metric}: off by {cauchy}");
            assert!(huber < 0.01, "m {roughness} noise {noise} {metric}: huber off by {huber}");
            // The data are bad enough for the test to mean something.
            assert!(plain > huber.max(cauchy), "m {roughness} noise {noise} {metric}: {plain}");
        }
    }
}

#[test]
fn the_scale_of_the_loss_is_in_units_of_the_residual() {
    let folder =
        measured(&format!("-m {ONE_LOBE} --directions 2000 --noise 0.02 --noise-abs 0.001 --seed 1"));
    spoil(&folder, 100, 100.0, 4);
    // With given standard deviations the residuals' unit is one of them, so auto must find 1; the median
    // absolute deviation of 2000 residuals is good to about 2.6 %.
    for metric in ["l2", "cbrt"] {
        let line = format!("fit spoiled.csv -m {ONE_LOBE} --weights sigma --metric {metric} --json");
        let report = fitted(folder.brdfit(&format!("{line} --loss cauchy")));
        let scale = report["options"]["loss_scale"].as_f64().unwrap();
        assert!((scale - 1.0).abs() < 0.1, "{metric}: {scale}");
        assert_eq!(report["options"]["loss_scale_auto"], true);
        assert_eq!(report["options"]["loss"], "cauchy");
        // The cost is no likelihood, so there is nothing to compare models by it.
        assert!(report["selection"]["aicc"].is_null() && report["fit"]["reduced_chi2"].is_null());
        assert_eq!(report["fit"]["uncertainty_method"], "clustered");
    }
    // A scale far beyond every residual is no loss at all.
    let line = format!("fit clean.csv -m {ONE_LOBE} --json");
    let plain = fitted(folder.brdfit(&line));
    for loss in ["huber", "cauchy"] {
        let wide = fitted(folder.brdfit(&format!("{line} --loss {loss} --loss-scale 1e5")));
        assert_eq!(wide["options"]["loss_scale"], 1e5);
        assert_eq!(wide["options"]["loss_scale_auto"], false);
        for name in ["m", "f0", "kd"] {
            let ratio = value(&wide, name) / value(&plain, name);
            assert!((ratio - 1.0).abs() < 1e-6, "{loss} {name}: {ratio}");
        }
    }
}

#[test]
fn losses_are_refused_where_they_make_no_sense() {
    let folder = measured("-m lambert --directions 10");
    for (options, words) in [
        ("--loss cauchy --loss-scale 0", "found '0'"),
        ("--loss cauchy --loss-scale wide", "found 'wide'"),
        ("--loss-scale 1", "expected --loss huber or --loss cauchy"),
        ("--loss tukey", "tukey"),
    ] {
        let run = folder.brdfit(&format!("fit clean.csv -m lambert {options}"));
        assert_eq!(run.code, Some(2), "{run:?}");
        assert!(run.stdout.is_empty() && run.stderr.matches('\n').count() == 1, "{run:?}");
        assert!(run.stderr.contains(words), "{run:?}");
    }
}

#[test]
fn a_loss_that_discards_what_decides_says_so() {
    // Noise in proportion to a mirror peak is far beyond the scale of the rest: the peak, which alone
    // knows m, looks like a set of outliers in l2, much less so in cbrt.
    for (roughness, metric, discards) in [(0.02, "l2", true), (0.2, "l2", true), (0.2, "cbrt", false)] {
        let folder = measured(&format!(
            "-m {ONE_LOBE} --set m={roughness} kd=0.3 f0=0.05 --directions 1000 --noise 0.02 --seed 3"
        ));
        let line = format!("fit clean.csv -m {ONE_LOBE} --metric {metric} --loss cauchy --json");
        let report = fitted(folder.brdfit(&line));
        let texts = warnings(&report, "loss-discards");
        assert_eq!(texts.iter().any(|text| text.contains("cook-torrance.m")), discards, "{texts:?}");
        assert_eq!(find(&report, "m")["std_error"].is_null(), discards, "m {roughness} {metric}");
    }
}

// What the data cannot tell apart.

#[test]
fn the_product_of_scale_and_reflectance_is_known_where_its_factors_are_not() {
    let mut covered = 0;
    let mut total = 0;
    for (kd, f0, m) in [(0.3, 0.04, 0.2), (0.02, 0.6, 0.2), (0.05, 0.9, 0.1)] {
        for seed in 0..12 {
            let set = format!("--set kd={kd} f0={f0} m={m} --noise 0.01 --noise-abs 0.001 --seed {seed}");
            let folder = measured(&format!("-m {ONE_LOBE} --directions 1000 --max-theta 45 {set}"));
            for weights in ["sigma", "uniform"] {
                let line =
                    format!("fit clean.csv -m {ONE_LOBE} --free ks --metric l2 --weights {weights} --json");
                let report = fitted(folder.brdfit(&line));
                let texts = warnings(&report, "not-identifiable");
                assert!(
                    texts.iter().any(|t| t.contains("ks and f0") && t.contains("--fix") && t.contains("70")),
                    "{texts:?}"
                );
                assert_errors_mean_something(&report);
                let product = &report["derived"][0];
                assert_eq!(product["name"], "cook-torrance.ks*f0");
                let interval = &product["ci95"];
                let (low, high) = (interval[0].as_f64().unwrap(), interval[1].as_f64().unwrap());
                // The product is known to a few percent or better, whatever became of its factors.
                assert!(high - low < 0.2 * f0, "{product}");
                total += 1;
                covered += usize::from(low <= f0 && f0 <= high);
            }
        }
    }
    println!("ks*f0 inside its 95 % interval: {covered} of {total}");
    // 95 % of 72 are 68.4; the standard deviation is 1.8.
    assert!(covered * 100 >= total * 88, "{covered} of {total}");
}

#[test]
fn scale_and_reflectance_are_told_apart_near_grazing() {
    let folder =
        measured(&format!("-m {ONE_LOBE} --set kd=0.3 f0=0.04 m=0.2 --directions 1000 --noise 0.01"));
    let report = fitted(folder.brdfit(&format!("fit clean.csv -m {ONE_LOBE} --free ks --json")));
    assert!(report["warnings"].as_array().unwrap().is_empty(), "{}", report["warnings"]);
}

#[test]
fn a_lobe_that_is_not_there_is_noticed() {
    let folder = measured("-m lambert --set kd=0.4 --directions 500 --noise 0.02");
    let report = fitted(folder.brdfit(&format!("fit clean.csv -m {ONE_LOBE} --free ks --json")));
    let kinds: Vec<&str> =
        report["warnings"].as_array().unwrap().iter().filter_map(|w| w["kind"].as_str()).collect();
    let says = ["flat-profile", "not-identifiable", "correlated", "at-bound"];
    assert!(kinds.iter().any(|kind| says.contains(kind)), "{kinds:?}");
    assert_errors_mean_something(&report);
}

// Bounds.

#[test]
fn a_mirror_sharper_than_the_bounds_has_no_errors_that_depend_on_them() {
    // Below its lower bound m cannot go, and the strength of the lobe makes up for it.
    let folder =
        measured(&format!("-m {ONE_LOBE} --set kd=0.1 f0=0.5 m=0.01 --directions 1000 --noise 0.01"));
    let report = fitted(folder.brdfit(&format!("fit clean.csv -m {ONE_LOBE} --bounds m=0.03..1 --json")));
    assert_eq!(find(&report, "m")["status"], "at-lower");
    let texts = warnings(&report, "at-bound");
    assert!(
        texts.iter().any(|text| text.contains("cook-torrance.m") && text.contains("--bounds")),
        "{texts:?}"
    );
    assert_errors_mean_something(&report);
}

#[test]
fn measured_and_mirror_like_data_have_no_meaningless_errors() {
    let folder = Folder::new();
    let Some(cayman) = shared("cornell/cayman.brdf") else { return };
    for options in ["", "--free ks", "--metric l2", "--metric log --free ks"] {
        let line = format!("fit '{}' -m {ONE_LOBE} --json {options}", cayman.display());
        let report = fitted(folder.brdfit(&line));
        assert_errors_mean_something(&report);
        let bound = |p: &&Value| p["status"] == "at-lower" || p["status"] == "at-upper";
        let at_bound = report["parameters"].as_array().unwrap().iter().filter(bound).count();
        assert_eq!(at_bound > 0, !warnings(&report, "at-bound").is_empty(), "{options}");
    }
}

// Lobes.

#[test]
fn two_lobes_are_found_and_come_in_order() {
    let two = "'lambert + cook-torrance + cook-torrance'";
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    for round in 0..12_u32 {
        let mut log = |low: f64, high: f64| low * (high / low).powf(rng.random::<f64>());
        let (sharp, ratio) = (log(0.02, 0.15), log(2.5, 6.0));
        let (first, second) = (log(0.02, 0.5), log(0.02, 0.5));
        // The sharper lobe second in writing: the report puts it first.
        let set = format!(
            "--set kd=0.2 cook-torrance.m={} cook-torrance#2.m={sharp} cook-torrance.f0={first} cook-torrance#2.f0={second}",
            sharp * ratio
        );
        let folder = measured(&format!("-m {two} {set} --directions 1500 --seed {round}"));
        let report = fitted(folder.brdfit(&format!("fit clean.csv -m {two} --json")));
        let found: Vec<(String, f64)> = report["parameters"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|p| p["name"] != "ks")
            .map(|p| {
                (
                    format!("{}.{}", p["lobe"].as_str().unwrap(), p["name"].as_str().unwrap()),
                    p["value"].as_f64().unwrap(),
                )
            })
            .collect();
        let wanted = [
            ("lambert.kd", 0.2),
            ("cook-torrance.m", sharp),
            ("cook-torrance.f0", second),
            ("cook-torrance#2.m", sharp * ratio),
            ("cook-torrance#2.f0", first),
        ];
        for ((name, value), (wanted_name, wanted)) in found.iter().zip(wanted) {
            assert_eq!(name, wanted_name);
            assert!((value / wanted - 1.0).abs() < 1e-6, "round {round} {set}\n{name}: {value} for {wanted}");
        }
        // All starts are reported with the lobes in order too.
        for start in report["starts"].as_array().unwrap() {
            let m = |lobe: &str| start["reached"][format!("{lobe}.m")].as_f64().unwrap();
            assert!(m("cook-torrance") <= m("cook-torrance#2"), "{start}");
        }
    }
}

#[test]
fn one_reflectance_for_both_lobes_by_a_tie() {
    let two = "'lambert + cook-torrance + cook-torrance'";
    let set = "--set kd=0.2 cook-torrance.m=0.05 cook-torrance#2.m=0.3 cook-torrance.f0=0.1 cook-torrance#2.f0=0.1 \
               cook-torrance.ks=0.4 cook-torrance#2.ks=0.6";
    let folder = measured(&format!("-m {two} {set} --directions 1500"));
    let report = fitted(folder.brdfit(&format!(
        "fit clean.csv -m {two} --free cook-torrance.ks --free cook-torrance#2.ks --tie cook-torrance#2.f0=cook-torrance.f0 --json"
    )));
    let values: Vec<f64> =
        report["parameters"].as_array().unwrap().iter().map(|p| p["value"].as_f64().unwrap()).collect();
    for (found, wanted) in values.iter().zip([0.2, 0.05, 0.1, 0.4, 0.3, 0.1, 0.6]) {
        assert!((found / wanted - 1.0).abs() < 1e-6, "{values:?}");
    }
    assert_eq!(report["parameters"][5]["status"], "tied");
}

// Starts from which no single parameter shows the way.

#[test]
fn fits_leave_points_where_derivatives_vanish() {
    // A lobe without strength, and facets without spread: all derivatives in question are 0 or point out.
    for (model, truth, start) in [
        (ONE_LOBE, "kd=0.3 f0=0.3 m=0.2 ks=0.5", "--free ks --init m=0.2 --init ks=0 --init f0=0"),
        ("'oren-nayar'", "albedo=0.5 sigma=25", "--init sigma=0"),
        ("'oren-nayar(variant=qualitative)'", "albedo=0.5 sigma=25", "--init sigma=0 --init albedo=0"),
    ] {
        let folder = measured(&format!("-m {model} --set {truth} --directions 500"));
        let report = fitted(folder.brdfit(&format!("fit clean.csv -m {model} {start} --json")));
        for setting in truth.split(' ') {
            let (name, wanted) = setting.split_once('=').unwrap();
            let (found, wanted) = (value(&report, name), wanted.parse::<f64>().unwrap());
            assert!((found / wanted - 1.0).abs() < 1e-6, "{model} {start}: {name} {found} for {wanted}");
        }
    }
}

// Determinism.

#[test]
fn doubtful_fits_are_the_same_bytes_at_any_number_of_threads() {
    let folder = measured(&format!("-m {ONE_LOBE} --directions 3000 --noise 0.05 --seed 9"));
    spoil(&folder, 100, 100.0, 5);
    let two = "'lambert + cook-torrance + cook-torrance'";
    for options in [
        format!("-m {ONE_LOBE} --loss cauchy"),
        format!("-m {ONE_LOBE} --loss huber --loss-scale 0.05 --weights sigma"),
        format!("-m {two} --free cook-torrance.ks --free cook-torrance#2.ks"),
        "-m 'oren-nayar + cook-torrance(f=conductor)' --samples 1000".to_owned(),
    ] {
        let reports: Vec<Value> = [1, 2, 7, 2]
            .map(|threads| {
                let run = folder.brdfit(&format!("fit spoiled.csv {options} --threads {threads} --json"));
                assert!(run.code.is_some_and(|code| code < 2), "{run:?}");
                let mut report = run.json();
                report["time_s"] = Value::Null;
                report
            })
            .into();
        reports.iter().for_each(|report| assert_eq!(report, &reports[0], "{options}"));
    }
}
