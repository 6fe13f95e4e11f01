//! The options that say how far a fit can be trusted, as a user sees them: samples held out, resampled
//! standard errors, other solvers.
#![allow(clippy::print_stdout)]

use crate::common::{Folder, Run, parse};
use brdfit::fit::{Fit, Metric, Options, Uncertainty, fit};
use brdfit::geometry::{Azimuths, Directions, Pair, direction};
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
    for metric in ["l2", "log", "cbrt", "unbiased_cbrt", "log_ratio", "relative"] {
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
    assert!(folder.brdfit(&line).stdout.contains("\nranking by held-out log:"));
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
    assert_refused(&run, &["single.csv", "--hold-out", "at least 2 angles of incidence", "found 1"]);
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
    // Angles held out cannot be drawn: 3 of 7 remain.
    let run = folder.brdfit("fit paint.csv -m lambert --uncertainty block-bootstrap --hold-out 0.6");
    assert_refused(&run, &["at least 5 angles of incidence", "found 3"]);
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
