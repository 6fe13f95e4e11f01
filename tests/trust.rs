//! The options that say how far a fit can be trusted, as a user sees them: samples held out, resampled
//! standard errors, other solvers.
#![allow(clippy::print_stdout)]

use crate::common::{Folder, Run, parse};
use approx::assert_relative_eq;
use brdfit::fit::{Fit, HoldOut, Metric, Options, Uncertainty, fit};
use brdfit::geometry::{Azimuths, Directions, Pair, direction};
use brdfit::measurement::Measurement;
use brdfit::model::Expression;
use brdfit::parameters::ParameterTable;
use brdfit::progress::{Progress, Quiet};
use brdfit::report::{Circumstances, OptionRecord, Report, Times};
use brdfit::solver::StopSignal;
use brdfit::synthetic::{Noise, measurement};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

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

/// The groups that each fold of a report's held-out errors left out.
fn folds(held: &Value) -> Vec<Vec<[f64; 2]>> {
    let pair = |pair: &Value| [0, 1].map(|k| pair[k].as_f64().unwrap());
    let groups = |fold: &Value| fold["theta_i_deg"].as_array().unwrap().iter().map(pair).collect();
    held["folds"].as_array().unwrap().iter().map(groups).collect()
}

#[test]
fn every_angle_is_held_out_once() {
    let folder = laboratory();
    let line = format!("fit paint.csv -m {MODEL} --hold-out 0.3");
    let report = assert_same_at_any_threads(&folder, &line);
    assert_eq!(report["options"]["hold_out"], 0.3);
    // The fit itself is that to all samples.
    let plain = folder.brdfit(&format!("fit paint.csv -m {MODEL} --json")).good().json();
    for field in ["parameters", "errors", "fit", "correlation", "misfit", "data"] {
        assert_eq!(report[field], plain[field], "{field}");
    }
    // The closest to 1/0.3 is three folds, of 7 angles with 32 samples each.
    let held = &report["selection"]["held_out"];
    assert_eq!(held["samples"], 224);
    let folds = folds(held);
    let mut sizes: Vec<usize> = folds.iter().map(Vec::len).collect();
    sizes.sort_unstable();
    assert_eq!(sizes, [2, 2, 3]);
    let mut angles: Vec<[f64; 2]> = folds.into_iter().flatten().collect();
    angles.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let expected: Vec<[f64; 2]> = (1..8).map(|k| [10.0 * f64::from(k); 2]).collect();
    assert_eq!(angles, expected);
    assert_eq!(held["theta_i_deg"], json!(expected));
    for fold in held["folds"].as_array().unwrap() {
        let n = fold["theta_i_deg"].as_array().unwrap().len();
        assert_eq!((&fold["samples"], &fold["converged"]), (&json!(32 * n), &json!(true)));
    }
    // The model is the true one: unseen angles are predicted to the noise, like those that were fitted.
    for metric in ["l2", "log", "cbrt"] {
        let ratio = held[metric].as_f64().unwrap() / report["errors"][metric].as_f64().unwrap();
        assert!((0.95..1.5).contains(&ratio), "{metric}: {ratio}");
    }
    // Mean and standard deviation over the folds.
    let of_folds: Vec<f64> = held["folds"]
        .as_array()
        .unwrap()
        .iter()
        .map(|fold| fold["unbiased_cbrt"].as_f64().unwrap())
        .collect();
    let mean = of_folds.iter().sum::<f64>() / 3.0;
    let variance = of_folds.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / 2.0;
    assert_relative_eq!(held["mean"].as_f64().unwrap(), mean, max_relative = 1e-12);
    assert_relative_eq!(held["std_dev"].as_f64().unwrap(), variance.sqrt(), max_relative = 1e-9);

    // The table has it in one line.
    let table = folder.brdfit(&line).good().stdout;
    let line = table.lines().find(|line| line.starts_with("held out: ")).unwrap();
    assert!(
        line.starts_with("held out: each of 7 angles of incidence once, in 3 folds: unbiased-cbrt ")
            && line.contains(" +/- ")
            && line.contains("; all together: l2 "),
        "{line}"
    );
    assert!(table.contains("224 of 224 samples\n"), "{table}");
}

#[test]
fn the_held_out_errors_are_those_of_a_loop_by_hand() {
    // For each angle, the file without it gives a fit, and evaluating that at the angle alone gives the errors.
    let folder = laboratory();
    let report = folder.brdfit(&format!("fit paint.csv -m {MODEL} --hold-out each --json")).good().json();
    assert_eq!(report["options"]["hold_out"], "each");
    let held = &report["selection"]["held_out"];
    assert_eq!(folds(held).len(), 7);
    let text = folder.read("paint.csv");
    let (mut squares, mut log_ratios) = (0.0, 0.0);
    for fold in held["folds"].as_array().unwrap() {
        let out = fold["theta_i_deg"][0][0].as_f64().unwrap();
        let part = |wanted: bool| {
            let of_part = text.lines().filter(|line| {
                let angle: Result<f64, _> = line.split(',').next().unwrap().parse();
                angle.map_or(true, |angle| ((angle - out).abs() < 0.01) == wanted)
            });
            of_part.map(|line| format!("{line}\n")).collect::<String>()
        };
        folder.write("kept.csv", part(false));
        folder.write("out.csv", part(true));
        let kept = folder.brdfit(&format!("fit kept.csv -m {MODEL} --json")).good().json();
        let values: Vec<String> = ["kd", "m", "f0"]
            .iter()
            .map(|name| format!("--set {name}={}", parameter(&kept, name)["value"]))
            .collect();
        let line = format!("evaluate out.csv -m {MODEL} {} --json", values.join(" "));
        let evaluated = folder.brdfit(&line).good().json();
        assert_eq!(evaluated["options"]["hold_out"], Value::Null);
        assert_eq!(evaluated["selection"]["held_out"], Value::Null);
        for metric in ["l2", "log", "cbrt", "unbiased_cbrt", "log_ratio", "relative"] {
            let [fold, by_hand] = [&fold[metric], &evaluated["errors"][metric]].map(|e| e.as_f64().unwrap());
            assert_relative_eq!(fold, by_hand, max_relative = 1e-12);
        }
        squares += evaluated["errors"]["l2"].as_f64().unwrap().powi(2);
        log_ratios += evaluated["errors"]["log_ratio"].as_f64().unwrap();
    }
    // Every angle has as many samples.
    assert_relative_eq!(held["l2"].as_f64().unwrap(), (squares / 7.0).sqrt(), max_relative = 1e-12);
    assert_relative_eq!(held["log_ratio"].as_f64().unwrap(), log_ratios / 7.0, max_relative = 1e-12);
}

#[test]
fn the_library_holds_out_what_the_command_does() {
    let folder = laboratory();
    let data = Measurement::read(folder.path("paint.csv")).unwrap();
    let model = Expression::parse("lambert + cook-torrance").unwrap();
    for (text, hold_out) in [("each", HoldOut::Each), ("0.4", HoldOut::fraction(0.4).unwrap())] {
        let (fit, report) = Fit::of(&model, &data).hold_out(hold_out).run_with_report().unwrap();
        let held = fit.held_out.unwrap();
        let line = format!("fit paint.csv -m {MODEL} --hold-out {text} --json");
        let written = folder.brdfit(&line).good().json();
        assert_eq!(written["selection"]["held_out"]["cbrt"], held.errors.cbrt);
        assert_eq!(written["selection"]["held_out"]["mean"], held.mean(Metric::UnbiasedCbrt).unwrap());
        // The report is read back as it was written.
        let json = report.to_json().unwrap();
        let again: Report = serde_json::from_str(&json).unwrap();
        assert_eq!(again.to_json().unwrap(), json);
        assert_eq!(parse(&json)["options"]["hold_out"], written["options"]["hold_out"]);
    }
    assert!(HoldOut::fraction(1.0).is_err());
    let unchecked = Fit::of(&model, &data).hold_out(HoldOut::Fraction(2.0)).run();
    assert!(unchecked.unwrap_err().to_string().contains("hold-out: expected a fraction above 0"));
}

#[test]
fn random_directions_are_held_out_in_ranges() {
    let folder = laboratory();
    let held_out = |seed: u32| {
        let line = format!("fit random.csv -m {MODEL} --hold-out 0.25 --seed {seed} --json");
        folder.brdfit(&line).good().json()["selection"]["held_out"].clone()
    };
    let held = held_out(3);
    // 16 ranges of 5 degrees up to 80, in four folds. Each fold extends over all of them.
    let folds_of_3 = folds(&held);
    assert_eq!(folds_of_3.len(), 4);
    assert_eq!(held["samples"], 600);
    for fold in &folds_of_3 {
        assert_eq!(fold.len(), 4);
        assert!(fold.iter().all(|[low, high]| high - low == 5.0));
        assert!(fold.iter().zip([20.0, 40.0, 60.0, 80.0]).all(|([_, high], end)| *high <= end), "{fold:?}");
    }
    assert_ne!(folds(&held_out(4)), folds_of_3);
}

#[test]
fn models_are_ranked_by_what_they_have_not_seen() {
    let folder = laboratory();
    // The third has a parameter more than the truth, which can follow nothing but noise.
    let models = format!("-m lambert -m {MODEL} -m 'oren-nayar + cook-torrance'");
    let line = format!("fit paint.csv {models} --metric log --hold-out each");
    let several = folder.brdfit(&format!("{line} --json")).json();
    let ranking = several["ranking"].as_array().unwrap();
    let report =
        |rank: &Value| several["reports"][usize::try_from(rank["index"].as_u64().unwrap()).unwrap()].clone();
    for rank in ranking {
        assert_eq!(rank["criterion"], "held-out log");
        assert_eq!(rank["value"], report(rank)["selection"]["held_out"]["log"]);
        // All models leave out the same.
        let held = &report(rank)["selection"]["held_out"];
        assert_eq!(folds(held), folds(&several["reports"][0]["selection"]["held_out"]));
    }
    // Lambert is clearly worse, the other two differ by noise only.
    let [first, second, last] = ranking.as_slice() else { panic!("{ranking:?}") };
    assert_eq!((&last["index"], &last["not_told_apart"]), (&json!(0), &json!([])));
    assert_eq!(first["not_told_apart"], json!([second["index"]]));
    assert_eq!(second["not_told_apart"], json!([first["index"]]));
    let table = folder.brdfit(&line).stdout;
    assert!(table.contains("\nranking by held-out log:\n  1. "), "{table}");
    assert!(table.contains("  (not told apart from 2)\n  2. "), "{table}");
    assert!(table.contains("  (not told apart from 1)\n  3. "), "{table}");
    assert!(table.trim_end().ends_with("lambert"), "{table}");

    // Without held-out samples nothing is said.
    let fitted = folder.brdfit(&format!("fit paint.csv {models} --json")).json();
    assert!(fitted["ranking"].as_array().unwrap().iter().all(|rank| rank["not_told_apart"] == Value::Null));
    let table = folder.brdfit(&format!("fit paint.csv {models}")).stdout;
    assert!(!table.contains("told apart"), "{table}");
}

#[test]
fn extrapolation_to_an_angle_at_the_edge_is_noted() {
    let folder = laboratory();
    // The highlight is in view at the last angle only: nothing else tells how strong and how wide it is.
    let mut directions = String::from("theta_i,phi_i,theta_o,phi_o\n");
    for theta_i in (1..8).map(|k| 10 * k) {
        for theta_o in (10..=70).step_by(5) {
            for phi_o in if theta_i == 70 { [180, 170, 160] } else { [0, 20, 40] } {
                directions += &format!("{theta_i},0,{theta_o},{phi_o}\n");
            }
        }
    }
    folder.write("views.csv", directions);
    let set = "--set kd=0.3 --set m=0.2 --set f0=0.05 --noise 0.02";
    folder.brdfit(&format!("synth -m {MODEL} {set} --at views.csv -o edge.csv")).good();
    let warned = |file: &str| {
        let report = folder.brdfit(&format!("fit {file} -m {MODEL} --hold-out each --json")).json();
        let warnings = report["warnings"].as_array().unwrap().clone();
        let found = warnings.into_iter().find(|w| w["kind"] == "extrapolated");
        found.map(|warning| warning["text"].as_str().unwrap().to_owned())
    };
    let text = warned("edge.csv").unwrap();
    assert!(text.starts_with("left out of the fit, theta_i 70 deg is predicted with "), "{text}");
    assert!(text.contains("angles between the edges: 1."), "{text}");
    // Where every angle has the highlight in view, the true model extrapolates as well as it interpolates.
    assert_eq!(warned("paint.csv"), None);
}

#[test]
fn folds_stop_when_told() {
    let folder = laboratory();
    let data = Measurement::read(folder.path("paint.csv")).unwrap();
    let expression = Expression::parse("lambert + cook-torrance").unwrap();
    /// Asks for a stop once so many folds are done.
    struct AfterFolds(StopSignal, &'static str);
    impl Progress for AfterFolds {
        fn stage(&self, name: &str) {
            self.0.fetch_or(name.starts_with(self.1), Ordering::Relaxed);
        }

        fn iteration(&self, _: u64, _: f64) {}
    }
    for begin in ["leaving angles out, 0 of 7", "leaving angles out, 2 of 7"] {
        let stop = StopSignal::default();
        let options = Options::default().with_hold_out(HoldOut::Each).with_stop(Arc::clone(&stop));
        let progress: Arc<dyn Progress> = Arc::new(AfterFolds(stop, begin));
        let result = fit(&data, &expression, &options, &progress).unwrap();
        assert!(result.is_usable() && result.held_out.is_none(), "{begin}");
        let warnings: Vec<&str> = result.warnings.iter().map(|w| w.kind().name()).collect();
        assert!(warnings.contains(&"hold-out"), "{warnings:?}");
    }
    let options = Options::default().with_hold_out(HoldOut::Each);
    let result = fit(&data, &expression, &options, &(Arc::new(Quiet) as Arc<dyn Progress>)).unwrap();
    assert_eq!(result.held_out.unwrap().folds.len(), 7);
}

#[test]
fn mistakes_in_hold_out_are_named() {
    let folder = laboratory();
    for wrong in ["0", "1", "-0.5", "2", "NaN", "inf", "some", "Each"] {
        let run = folder.brdfit(&format!("fit paint.csv -m lambert --hold-out={wrong}"));
        assert_refused(&run, &["--hold-out", "above 0 and below 1", "'each'", wrong]);
    }
    for folds in ["0.5", "each"] {
        let run = folder.brdfit(&format!("fit single.csv -m lambert --hold-out {folds}"));
        assert_refused(&run, &["single.csv", "--hold-out", "at least 2 angles of incidence", "found 1"]);
    }
}

/// The parameter called `name` of a report.
fn parameter<'r>(report: &'r Value, name: &str) -> &'r Value {
    report["parameters"].as_array().unwrap().iter().find(|p| p["name"] == name).unwrap()
}

#[test]
fn angles_are_resampled() {
    let folder = laboratory();
    let line = format!("fit paint.csv -m {MODEL} --free ks --uncertainty block-bootstrap");
    let report = assert_same_at_any_threads(&folder, &line);
    assert_eq!(report["options"]["uncertainty"], "block-bootstrap");
    assert_eq!(report["fit"]["uncertainty_method"], "block-bootstrap");
    assert_eq!(report["fit"]["resampling"]["replicates"], 200);
    let angles: Vec<Value> = (1..8).map(|k| json!([10.0 * f64::from(k), 10.0 * f64::from(k)])).collect();
    assert_eq!(report["fit"]["resampling"]["theta_i_deg"], json!(angles));

    // The fit itself is the formula's, and so is which parameters have an error.
    let formula =
        folder.brdfit(&format!("fit paint.csv -m {MODEL} --free ks --uncertainty formula --json")).json();
    assert_eq!(formula["options"]["uncertainty"], "formula");
    assert_eq!(formula["fit"]["resampling"], Value::Null);
    for name in ["kd", "m", "f0", "ks"] {
        let (resampled, by_formula) = (parameter(&report, name), parameter(&formula, name));
        assert_eq!(resampled["value"], by_formula["value"]);
        assert_eq!(resampled["std_error"].is_null(), by_formula["std_error"].is_null());
        let ratio = resampled["std_error"].as_f64().unwrap() / by_formula["std_error"].as_f64().unwrap();
        // Seven angles tell a standard error to some 30 %; ks and f0 hang on the last of them.
        assert!((0.2..5.0).contains(&ratio), "{name}: {ratio}");
        let [low, high] = [0, 1].map(|end| resampled["ci95"][end].as_f64().unwrap());
        // Percentiles of 200 values: 3.9 standard errors apart where they are normal.
        let width = (high - low) / resampled["std_error"].as_f64().unwrap();
        assert!((2.5..5.5).contains(&width), "{name}: {width}");
    }
    // ks and f0 are strongly correlated, and their product is determined far better than either.
    let product = &report["derived"][0];
    let relative = |p: &Value| p["std_error"].as_f64().unwrap() / p["value"].as_f64().unwrap();
    assert!(relative(product) < 0.5 * relative(parameter(&report, "ks")), "{product}");
    assert!(product["ci95"][0].as_f64() < product["value"].as_f64());
    let named = |name: &str| {
        let names = report["correlation"]["parameters"].as_array().unwrap();
        names.iter().position(|n| n.as_str().unwrap().contains(name)).unwrap()
    };
    assert!(report["correlation"]["matrix"][named("ks")][named("f0")].as_f64().unwrap() < -0.5);

    // Another seed draws other angles.
    let other = folder.brdfit(&format!("{line} --seed 1 --json")).json();
    assert_ne!(parameter(&other, "m")["std_error"], parameter(&report, "m")["std_error"]);

    let table = folder.brdfit(&line).stdout;
    let words = "standard errors: block bootstrap over 7 incidence angles, 200 replicates\n";
    assert!(table.contains(words), "{table}");
    let table =
        folder.brdfit(&format!("fit random.csv -m {MODEL} --uncertainty block-bootstrap")).good().stdout;
    let words = "standard errors: block bootstrap over 16 ranges of incidence angle, 200 replicates\n";
    assert!(table.contains(words), "{table}");
}

#[test]
fn parameters_at_bounds_are_not_resampled() {
    let folder = laboratory();
    let line = format!("fit paint.csv -m {MODEL} --bounds m=0.3..1 --uncertainty block-bootstrap --json");
    let report = folder.brdfit(&line).json();
    let m = parameter(&report, "m");
    assert_eq!(m["status"], "at-lower");
    assert!(m["std_error"].is_null() && m["ci95"].is_null());
    assert!(parameter(&report, "kd")["std_error"].as_f64().unwrap() > 0.0);
    // Nothing is free: nothing is resampled, as nothing has an error by the formula.
    let line = "fit paint.csv -m lambert --fix kd=0.3 --uncertainty block-bootstrap --json";
    let report = folder.brdfit(line).json();
    assert_eq!(report["fit"]["uncertainty_method"], Value::Null);
}

#[test]
fn resampling_can_be_cut_short() {
    // Out of time before the fit has ended: no errors, and a warning that says so.
    let folder = laboratory();
    let line = format!("fit paint.csv -m {MODEL} --uncertainty block-bootstrap --timeout 1e-9 --json");
    let report = folder.brdfit(&line).json();
    assert_eq!(report["fit"]["uncertainty_method"], Value::Null);
    assert_eq!(report["fit"]["resampling"], Value::Null);
    let warnings = report["warnings"].as_array().unwrap();
    assert!(warnings.iter().any(|w| w["kind"] == "resampling"), "{warnings:?}");
}

/// Asks for a stop once so many fits have been repeated.
struct Impatient {
    stop: StopSignal,
    resampling: AtomicBool,
    after: u64,
}

impl Progress for Impatient {
    fn stage(&self, name: &str) {
        self.resampling.store(name == "resampling", Ordering::Relaxed);
    }

    fn iteration(&self, iteration: u64, _: f64) {
        if self.resampling.load(Ordering::Relaxed) && iteration >= self.after {
            self.stop.store(true, Ordering::Relaxed);
        }
    }
}

#[test]
fn resampling_stops_when_told() {
    let expression = Expression::parse("lambert").unwrap();
    let table = ParameterTable::new(&expression, &["y".to_owned()], Azimuths::Several, &Vec::new()).unwrap();
    let wi = (0..70).map(|k| direction(f64::from(k / 7).to_radians() * 5.0, 0.0));
    let wo = (0..70).map(|k| direction(f64::from(k % 7).to_radians() * 10.0, 1.0));
    let pairs = wi.zip(wo).map(|(wi, wo)| Pair { wi, wo }).collect();
    let noise = Noise { relative: 0.05, absolute: 0.0 };
    let data = measurement(&expression, &table, Directions::Scattered(pairs), noise, 0);
    // The flag is looked at between batches: a few more fits may be made than those asked for.
    for (after, wanted) in [(10, None), (90, Some(90..200)), (1000, Some(200..201))] {
        let stop = StopSignal::default();
        let options =
            Options::default().with_uncertainty(Uncertainty::BlockBootstrap).with_stop(Arc::clone(&stop));
        let progress: Arc<dyn Progress> =
            Arc::new(Impatient { stop, resampling: AtomicBool::new(false), after });
        let result = fit(&data, &expression, &options, &progress).unwrap();
        assert!(result.unusable.is_none(), "the fit itself had ended");
        let replicates = result.resampled.as_ref().map(|r| r.replicates);
        match (&wanted, replicates) {
            (None, None) => assert_eq!(result.covariance.unwrap().method.name(), "sandwich"),
            (Some(range), Some(n)) => assert!(range.contains(&n), "{n}"),
            _ => panic!("{after}: {replicates:?}"),
        }
        let warned = result.warnings.iter().filter(|w| w.kind().name() == "resampling").count();
        assert_eq!(warned, usize::from(replicates != Some(200)), "{:?}", result.warnings);
    }
}

#[test]
fn mistakes_in_uncertainty_are_named() {
    let folder = laboratory();
    folder.write("four.csv", {
        let text = folder.read("paint.csv");
        // Angles are written with the rounding of their directions; the head is no number.
        let angle = |line: &str| line.split(',').next().unwrap().parse().unwrap_or(0.0);
        let few = text.lines().filter(|line| angle(line) < 45.0);
        few.map(|line| format!("{line}\n")).collect::<String>()
    });
    let run = folder.brdfit("fit four.csv -m lambert --uncertainty block-bootstrap");
    assert_refused(&run, &["four.csv", "block-bootstrap", "at least 5 angles of incidence", "found 4"]);
    let run = folder.brdfit("fit paint.csv -m lambert --uncertainty guess");
    assert_refused(&run, &["'guess'", "--uncertainty", "formula", "block-bootstrap"]);
}

/// The paint of the studies below: kd, m, f0.
const TRUTH: [f64; 3] = [0.3, 0.25, 0.05];

/// What repeated measurements of the same paint show about its standard errors.
struct Study {
    /// Standard deviation of a factor common to each angle of incidence.
    common: f64,
    noise: Noise,
    metric: Metric,
    angles: u32,
    sets: u64,
}

impl Study {
    /// Each set's report by each method.
    fn reports(&self) -> Vec<[Report; 2]> {
        let expression = Expression::parse("lambert + cook-torrance").unwrap();
        let mut truth =
            ParameterTable::new(&expression, &["y".to_owned()], Azimuths::Several, &Vec::new()).unwrap();
        for (row, value) in truth.free().to_vec().into_iter().zip(TRUTH) {
            truth.set_value(row, value);
        }
        let mut pairs = Vec::new();
        for theta_i in (0..self.angles).map(|k| 75.0 * f64::from(k) / f64::from(self.angles)) {
            for theta_o in (0..=75_u8).step_by(5) {
                for phi_o in [180.0, 90.0, 0.0_f64] {
                    let wi = direction(theta_i.to_radians(), 0.0);
                    pairs.push(Pair {
                        wi,
                        wo: direction(f64::from(theta_o).to_radians(), phi_o.to_radians()),
                    });
                }
            }
        }
        let per_angle = pairs.len() / usize::try_from(self.angles).unwrap();
        let quiet: Arc<dyn Progress> = Arc::new(Quiet);
        let run = |seed: u64| {
            let directions = Directions::Scattered(pairs.clone());
            let mut data = measurement(&expression, &truth, directions, self.noise, seed);
            let mut rng = Pcg64Mcg::seed_from_u64(seed + 7_000);
            for angle in data.values[0].chunks_mut(per_angle) {
                let factor = 1.0 + self.common * rng.sample::<f64, _>(StandardNormal);
                angle.iter_mut().for_each(|f| *f *= factor);
            }
            [Uncertainty::Formula, Uncertainty::BlockBootstrap].map(|uncertainty| {
                let options =
                    Options::default().with_uncertainty(uncertainty).with_seed(seed).with_metric(self.metric);
                let result: Fit = fit(&data, &expression, &options, &quiet).unwrap();
                let circumstances = Circumstances {
                    metric: self.metric,
                    max_theta_deg: 80.0,
                    options: OptionRecord::default(),
                    times: Times::default(),
                    fitted: true,
                };
                Report::new(&data, &result, &circumstances)
            })
        };
        (0..self.sets).map(run).collect()
    }
}

#[test]
fn resampling_agrees_with_the_formula_where_samples_are_independent() {
    // Equal independent noise fitted by least squares: both methods estimate the same standard deviation.
    // Each set's estimate scatters by 1/sqrt(2 x 200) for the replicates and 1/sqrt(2 x 50) for the angles.
    let noise = Noise { relative: 0.0, absolute: 0.01 };
    let study = Study { common: 0.0, noise, metric: Metric::L2, angles: 50, sets: 12 };
    let reports = study.reports();
    for (place, name) in ["kd", "m", "f0"].iter().enumerate() {
        let error = |report: &Report| report.parameters[place].std_error.unwrap();
        let ratios = reports.iter().map(|[formula, resampled]| error(resampled) / error(formula));
        let mean = ratios.clone().sum::<f64>() / 12.0;
        println!("{name}: bootstrap / formula {:?}, mean {mean}", ratios.collect::<Vec<_>>());
        assert!((0.8..1.25).contains(&mean), "{name}: {mean}");
    }
}

#[test]
fn resampling_covers_the_truth_where_angles_share_an_error() {
    // A factor common to all samples of an angle, 5 %, beside 1 % of independent noise.
    let noise = Noise { relative: 0.01, absolute: 0.0 };
    let study = Study { common: 0.05, noise, metric: Metric::Cbrt, angles: 16, sets: 40 };
    let mut covered = [0; 2];
    for reports in study.reports() {
        for (count, report) in covered.iter_mut().zip(&reports) {
            for (parameter, truth) in report.parameters.iter().zip(TRUTH) {
                let [low, high] = parameter.ci95.unwrap();
                *count += u32::from(low <= truth && truth <= high);
            }
        }
    }
    // 40 sets of 3 parameters: 114 would be 95 %.
    let [formula, resampled] = covered;
    println!("of 120 95 % intervals, by formula {formula} hold the truth, resampled {resampled}");
    assert!(resampled >= 96, "{resampled} of 120");
    assert!(formula <= 80, "{formula} of 120");
}

#[test]
fn every_solver_finds_the_same_minimum() {
    let folder = laboratory();
    let line = |solver: &str| format!("fit paint.csv -m {MODEL} --solver {solver}");
    let reference = folder.brdfit(&format!("fit paint.csv -m {MODEL} --json")).good().json();
    assert_eq!(reference["options"]["solver"], "levenberg-marquardt");
    let cost = |report: &Value| report["fit"]["cost"].as_f64().unwrap();
    for (solver, reasons, excess) in [
        ("levenberg-marquardt", &["converged-step", "converged-cost", "converged-gradient"][..], 0.0),
        ("l-bfgs", &["converged-cost", "converged-gradient"], 1e-7),
        ("nelder-mead", &["converged-cost"], 1e-7),
        // The swarm has no test of convergence of its own.
        ("particle-swarm", &["iteration-limit"], 1e-2),
    ] {
        let report = assert_same_at_any_threads(&folder, &line(solver));
        assert_eq!(report["options"]["solver"], solver);
        let reason = report["termination"]["reason"].as_str().unwrap();
        assert!(reasons.contains(&reason), "{solver}: {reason}");
        let converged = solver != "particle-swarm";
        assert_eq!(report["termination"]["usable"], converged);
        assert_eq!(folder.brdfit(&line(solver)).code, Some(i32::from(!converged)));
        let above = cost(&report) / cost(&reference) - 1.0;
        println!("{solver}: cost above Levenberg-Marquardt's by {above:e}, {}", report["termination"]);
        assert!(above <= excess && above > -1e-9, "{solver}: {above}");
        for name in ["kd", "m", "f0"] {
            let value = |report: &Value| parameter(report, name)["value"].as_f64().unwrap();
            let error = parameter(&reference, name)["std_error"].as_f64().unwrap();
            let off = (value(&report) - value(&reference)).abs() / error;
            assert!(off < if converged { 0.01 } else { 1.0 }, "{solver}, {name}: {off} standard errors");
        }
    }
}

#[test]
fn solvers_know_bounds_and_time() {
    let folder = laboratory();
    for solver in ["l-bfgs", "nelder-mead", "particle-swarm"] {
        let line = format!("fit paint.csv -m {MODEL} --bounds m=0.3..1 --solver {solver} --json");
        let report = folder.brdfit(&line).json();
        assert_eq!(parameter(&report, "m")["status"], "at-lower", "{solver}");
        assert_eq!(parameter(&report, "m")["value"], 0.3);
        let line = format!("fit paint.csv -m {MODEL} --solver {solver} --timeout 1e-9 --json");
        let run = folder.brdfit(&line);
        assert_eq!(run.code, Some(1));
        assert_eq!(run.json()["termination"]["reason"], "timeout", "{solver}");
        // Nothing is free: nothing is minimised.
        folder.brdfit(&format!("fit paint.csv -m lambert --fix kd=0.3 --solver {solver}")).good();
    }
    let run = folder.brdfit("fit paint.csv -m lambert --solver simplex");
    assert_refused(&run, &["'simplex'", "--solver", "levenberg-marquardt", "l-bfgs", "nelder-mead"]);
}
