//! `brdfit fit`.

use super::{HEADER, laboratory, timeless};
use crate::common::{Folder, Run, merl_filled, parse};
use approx::assert_relative_eq;
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::fs;

#[test]
fn several_bad_inputs_are_each_named() {
    let folder = Folder::new();
    folder.write("a.csv", "");
    folder.write("b.csv", "theta_i\n");
    let run = folder.brdfit("fit a.csv b.csv c.csv -m lambert --json -o r.json");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert_eq!(run.stdout, "");
    for name in ["a.csv", "b.csv", "c.csv"] {
        assert_eq!(run.stderr.lines().filter(|line| line.contains(name)).count(), 1, "{run:?}");
    }
    assert_eq!(folder.listing().len(), 2);
}

#[test]
fn table_on_stdout_and_warnings_on_stderr() {
    let folder = laboratory();
    let run = folder.brdfit("fit a.csv -m 'lambert + cook-torrance'").good();
    assert!(serde_json::from_str::<Value>(&run.stdout).is_err(), "a table, not JSON");
    for word in ["a.csv", "lambert", "cook-torrance", "kd", "m", "f0", "cbrt", "l2", "log"] {
        assert!(run.stdout.contains(word), "{word}: {}", run.stdout);
    }
    assert!(!run.stdout.contains("NaN") && !run.stdout.contains('\u{1b}'), "{}", run.stdout);
    // Several inputs and models: each in the table, and a ranking.
    let run = folder.brdfit("fit a.csv b.csv -m lambert -m oren-nayar").good();
    for word in ["a.csv", "b.csv", "oren-nayar", "ranking"] {
        assert!(run.stdout.contains(word), "{word}: {}", run.stdout);
    }
}

#[test]
fn json_on_stdout_is_alone_and_the_same_in_a_file() {
    let folder = laboratory();
    let json = folder.brdfit("fit a.csv -m lambert --json").good();
    assert_eq!(json.json()["schema"], "brdfit.report/1");
    assert!(json.stdout.ends_with("}\n"));

    let table = folder.brdfit("fit a.csv -m lambert -o r.json").good();
    assert!(table.stdout.contains("lambert") && !table.stdout.starts_with('{'));
    assert_eq!(timeless(&folder.read("r.json")), timeless(&json.stdout));

    let dash = folder.brdfit("fit a.csv -m lambert -o -").good();
    assert_eq!(timeless(&dash.stdout), timeless(&json.stdout));

    // Both at once; an older file is replaced.
    folder.write("r.json", "old");
    let both = folder.brdfit("fit a.csv -m lambert --json -o r.json").good();
    assert_eq!(folder.read("r.json"), both.stdout);
    assert_eq!(timeless(&both.stdout), timeless(&json.stdout));

    // No temporary file stays behind, and the report can be read by whom other files can.
    let names: Vec<_> = folder.listing().into_keys().collect();
    assert_eq!(names, ["a.csv", "b.csv", "clean.csv", "r.json"].map(std::path::PathBuf::from));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        folder.write("plain", "");
        let mode = |name: &str| fs::metadata(folder.path(name)).unwrap().permissions().mode();
        assert_eq!(mode("r.json"), mode("plain"));
    }
}

#[test]
fn quiet_prints_nothing() {
    let folder = laboratory();
    let run = folder.brdfit("fit a.csv -m lambert -q -o r.json").good();
    assert_eq!(run.stdout, "");
    assert_eq!(parse(&folder.read("r.json"))["schema"], "brdfit.report/1");
    assert_eq!(folder.brdfit("fit a.csv b.csv -m lambert --quiet").good().stdout, "");
    assert_eq!(folder.brdfit("evaluate a.csv -m lambert -q").good().stdout, "");
    // Quiet is not mute: bad input is still named.
    let run = folder.brdfit("fit nothing.csv -m lambert -q");
    assert_eq!((run.code, run.stderr.lines().count()), (Some(2), 1));
}

#[test]
fn a_folder_takes_one_report_per_input() {
    let folder = laboratory();
    fs::create_dir(folder.path("there")).unwrap();
    folder.write("sub/a.csv", folder.read("b.csv"));
    for target in ["new/", "there", "there/"] {
        folder.brdfit(&format!("fit a.csv b.csv -m lambert -o {target}")).good();
        for (name, input) in [("a.json", "a.csv"), ("b.json", "b.csv")] {
            let report = parse(&folder.read(&format!("{}/{name}", target.trim_end_matches('/'))));
            assert_eq!(report["schema"], "brdfit.report/1");
            assert_eq!(report["data"]["path"], input);
        }
    }
    // Several models of one input share its file; inputs of one name do not share.
    folder.brdfit("fit a.csv sub/a.csv -m lambert -m oren-nayar -o both/").good();
    let names: Vec<_> = folder.listing().into_keys().filter(|p| p.starts_with("both")).collect();
    assert_eq!(names.len(), 3, "{names:?}");
    let mut inputs = Vec::new();
    for name in &names[1..] {
        let reports = parse(&folder.read(name.to_str().unwrap()));
        assert_eq!(reports["schema"], "brdfit.reports/1");
        assert_eq!(reports["reports"].as_array().unwrap().len(), 2);
        inputs.push(reports["reports"][0]["data"]["path"].clone());
    }
    inputs.sort_by_key(ToString::to_string);
    assert_eq!(inputs, [json!("a.csv"), json!("sub/a.csv")]);
}

#[test]
fn several_fits_are_ranked() {
    let folder = laboratory();
    let line = "fit a.csv b.csv -m lambert -m 'lambert + cook-torrance' -m oren-nayar --json";
    for metric in ["cbrt", "l2"] {
        let all = folder.brdfit(&format!("{line} --metric {metric}")).json();
        assert_eq!(all["schema"], "brdfit.reports/1");
        assert_eq!(all["failed"], json!([]));
        let reports = all["reports"].as_array().unwrap();
        assert_eq!(reports.len(), 6);
        let ranking = all["ranking"].as_array().unwrap();
        let order: Vec<usize> =
            ranking.iter().map(|r| usize::try_from(r["index"].as_u64().unwrap()).unwrap()).collect();
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, [0, 1, 2, 3, 4, 5], "every report has one rank");
        for rank in ranking {
            assert!(rank["criterion"].as_str().unwrap().contains(metric), "{rank}");
            let report = &reports[usize::try_from(rank["index"].as_u64().unwrap()).unwrap()];
            assert_eq!(rank["value"], report["errors"][metric]);
        }
        for input in ["a.csv", "b.csv"] {
            let of_input: Vec<&Value> = ranking
                .iter()
                .filter(|r| {
                    reports[usize::try_from(r["index"].as_u64().unwrap()).unwrap()]["data"]["path"] == input
                })
                .collect();
            let values: Vec<f64> = of_input.iter().map(|r| r["value"].as_f64().unwrap()).collect();
            assert!(values.is_sorted(), "{input}: {values:?}");
            // The model that made the data wins.
            let best = usize::try_from(of_input[0]["index"].as_u64().unwrap()).unwrap();
            assert!(reports[best]["model"].as_str().unwrap().starts_with("lambert + cook-torrance"));
        }
    }
}

#[test]
fn one_bad_input_among_several() {
    let folder = laboratory();
    folder.write("bad.csv", "theta_i,phi_i,theta_o,phi_o,r\n10,0,20,180,abc\n");
    let run = folder.brdfit("fit a.csv bad.csv nothing.csv b.csv -m lambert --json");
    assert_eq!(run.code, Some(1), "{run:?}");
    let all = run.json();
    assert_eq!(all["schema"], "brdfit.reports/1");
    let paths: Vec<&Value> = all["reports"].as_array().unwrap().iter().map(|r| &r["data"]["path"]).collect();
    assert_eq!(paths, [&json!("a.csv"), &json!("b.csv")]);
    assert_eq!(all["ranking"].as_array().unwrap().len(), 2);
    let failed = all["failed"].as_array().unwrap();
    assert_eq!(failed.len(), 2);
    assert_eq!(failed[0]["path"], "bad.csv");
    let error = failed[0]["error"].as_str().unwrap();
    assert!(error.contains("bad.csv:2:") && error.contains("'abc'") && !error.contains('\n'), "{error}");
    assert_eq!(failed[1]["path"], "nothing.csv");
    let errors = run.stderr.lines().filter(|line| line.starts_with("error: ")).count();
    assert_eq!(errors, 2, "{}", run.stderr);

    // A folder gets the files of the good inputs alone; the file for all gets everything.
    let run = folder.brdfit("fit a.csv bad.csv -m lambert -q -o out/");
    assert_eq!((run.code, run.stdout.as_str()), (Some(1), ""));
    let names: Vec<_> = folder.listing().into_keys().filter(|p| p.starts_with("out")).collect();
    assert_eq!(names, ["out", "out/a.json"].map(std::path::PathBuf::from));
    let run = folder.brdfit("fit bad.csv a.csv -m lambert -q -o all.json");
    assert_eq!((run.code, run.stdout.as_str()), (Some(1), ""));
    assert_eq!(parse(&folder.read("all.json"))["failed"].as_array().unwrap().len(), 1);
}

/// A database: a table that broke off in the middle costs its own report, and nothing else.
#[test]
fn a_broken_file_in_a_database_stops_nothing() {
    let folder = laboratory();
    let mut broken = merl_filled(1.0);
    broken.truncate(1_000_000);
    folder.write("broken.binary", broken);
    let models = "-m lambert -m 'lambert + cook-torrance'";
    let run = folder.brdfit(&format!("fit a.csv broken.binary b.csv {models} -o out/"));
    assert_eq!(run.code, Some(1), "{run:?}");
    let error = "broken.binary: byte 1000000: expected 34992012 bytes in all, or 17496012 with 32-bit floats, found 1000000 (truncated)";
    assert!(run.stderr.contains(&format!("error: {error}\n")), "{}", run.stderr);
    assert!(run.stdout.ends_with(&format!("\n  failed: {error}\n")), "{}", run.stdout);
    let names: Vec<_> = folder.listing().into_keys().filter(|p| p.starts_with("out")).collect();
    assert_eq!(names, ["out", "out/a.json", "out/b.json"].map(std::path::PathBuf::from));
    // Each is what the input gives alone.
    for name in ["a", "b"] {
        folder.brdfit(&format!("fit {name}.csv {models} -q -o alone.json")).good();
        let together = folder.read(&format!("out/{name}.json"));
        assert_eq!(timeless(&together), timeless(&folder.read("alone.json")), "{name}");
    }
}

#[test]
fn inputs_that_the_time_does_not_reach_are_listed() {
    let folder = laboratory();
    let run = folder.brdfit("fit a.csv b.csv nothing.csv -m lambert --timeout 1e-9 --json");
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stderr.contains("error: timeout: 2 of 3 inputs not started\n"), "{}", run.stderr);
    let all = run.json();
    assert_eq!(all["reports"].as_array().unwrap().len(), 1);
    let failed = json!([{"path": "b.csv", "error": "timeout"}, {"path": "nothing.csv", "error": "timeout"}]);
    assert_eq!(all["failed"], failed);
    let table = folder.brdfit("fit a.csv b.csv -m lambert --timeout 1e-9");
    assert!(table.stdout.ends_with("\n  failed: b.csv: timeout\n"), "{}", table.stdout);
}

/// A report that must be complete although its fit is not usable.
fn assert_unusable(run: &Run) -> Value {
    assert_eq!(run.code, Some(1), "{run:?}");
    let report = run.json();
    assert_eq!(report["schema"], "brdfit.report/1");
    assert_eq!(report["termination"]["usable"], false);
    let why: Vec<&Value> =
        report["warnings"].as_array().unwrap().iter().filter(|w| w["kind"] == "not-usable").collect();
    assert_eq!(why.len(), 1, "{report}");
    assert!(why[0]["text"].as_str().unwrap().len() > 20);
    assert!(!report["parameters"].as_array().unwrap().is_empty());
    report
}

#[test]
fn unusable_fits_are_still_reported() {
    let folder = laboratory();
    folder.write("few.csv", "theta_i,phi_i,theta_o,phi_o,r\n10,0,20,180,0.1\n");
    let report = assert_unusable(&folder.brdfit("fit few.csv -m 'lambert + cook-torrance' --json"));
    // One value, three free parameters.
    assert_eq!(report["fit"]["n"], 1);
    assert_eq!(report["fit"]["dof"].as_f64(), Some(-2.0));
    for parameter in report["parameters"].as_array().unwrap() {
        assert_eq!(parameter["std_error"], Value::Null, "nothing is known about it: {parameter}");
    }
    // The same in a file and as a table.
    let run = folder.brdfit("fit few.csv -m 'lambert + cook-torrance' -o r.json");
    assert_eq!(run.code, Some(1));
    assert!(run.stderr.contains("no more values") && run.stdout.contains("NOT USABLE"), "{run:?}");
    assert_eq!(parse(&folder.read("r.json"))["termination"]["usable"], false);

    let run = folder.brdfit("fit a.csv -m 'lambert + cook-torrance' --timeout 1e-9 --json");
    assert_eq!(assert_unusable(&run)["termination"]["reason"], "timeout");
    // A generous limit changes nothing.
    let run = folder.brdfit("fit a.csv -m lambert --timeout 600 --json").good();
    assert_eq!(run.json()["termination"]["usable"], true);

    // One of several that is not usable makes the command's exit code 1.
    let run = folder.brdfit("fit a.csv few.csv -m 'lambert + cook-torrance' --json");
    assert_eq!(run.code, Some(1));
    let usable: Vec<bool> = run.json()["reports"]
        .as_array()
        .unwrap()
        .iter()
        .map(|r| r["termination"]["usable"].as_bool().unwrap())
        .collect();
    assert_eq!(usable, [true, false]);
}

/// The mean is the least-squares albedo of a constant BRDF: kd = pi times the weighted mean of f.
#[test]
fn lambert_fit_in_l2_is_the_weighted_mean() {
    let folder = Folder::new();
    folder.write("m.csv", "theta_i,phi_i,theta_o,phi_o,f\n60,0,30,180,0.2\n0,0,45,90,0.05\n30,0,10,0,0.1\n");
    let report = folder.brdfit("fit m.csv -m lambert --metric l2 --json").good().json();
    // Residuals are (kd/pi - f) cos(theta_i), so the weights are cos^2.
    let (w, f) = ([0.25, 1.0, 0.75], [0.2, 0.05, 0.1]);
    let mean = w.iter().zip(f).map(|(w, f)| w * f).sum::<f64>() / w.iter().sum::<f64>();
    let kd = &report["parameters"][0];
    assert_relative_eq!(kd["value"].as_f64().unwrap(), PI * mean, max_relative = 1e-9);
    assert_eq!(kd["status"], "free");
    assert_eq!(kd["channel"], "f");
    assert_eq!(report["fit"]["dof"].as_f64(), Some(2.0));
}

#[test]
fn options_do_what_they_say() {
    let folder = laboratory();
    let fit = |rest: &str| {
        folder.brdfit(&format!("fit a.csv -m 'lambert + cook-torrance' {rest} --json")).good().json()
    };
    let of = |report: &Value, name: &str, channel: Value| -> Value {
        let found: Vec<&Value> = report["parameters"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|p| p["name"] == name && p["channel"] == channel)
            .collect();
        assert_eq!(found.len(), 1, "{name} {channel}");
        found[0].clone()
    };
    let report = fit("--fix kd.r=0.25 --fix m=0.4");
    assert_eq!(of(&report, "kd", json!("r"))["value"], 0.25);
    assert_eq!(of(&report, "kd", json!("r"))["status"], "fixed");
    assert_eq!(of(&report, "kd", json!("r"))["std_error"], Value::Null);
    assert_eq!(of(&report, "kd", json!("g"))["status"], "free");
    assert_eq!(of(&report, "m", Value::Null)["value"], 0.4);

    let report = fit("--bounds m=0.5..0.9");
    assert_eq!(of(&report, "m", Value::Null)["bounds"], json!([0.5, 0.9]));
    assert_eq!(of(&report, "m", Value::Null)["status"], "at-lower", "the truth is 0.3");
    assert_eq!(of(&report, "m", Value::Null)["value"], 0.5);
    assert_eq!(of(&report, "m", Value::Null)["ci95"], Value::Null);

    let report = fit("--tie kd.g=kd.r");
    assert_eq!(of(&report, "kd", json!("g"))["status"], "tied");
    assert_eq!(of(&report, "kd", json!("g"))["value"], of(&report, "kd", json!("r"))["value"]);

    let report = fit("--free ks");
    assert_eq!(of(&report, "ks", json!("r"))["status"], "free");
    assert!(report["derived"].as_array().unwrap().iter().any(|d| d["name"] == "cook-torrance.ks*f0"));

    let report = fit("--shared kd --per-channel m");
    of(&report, "kd", Value::Null);
    for channel in ["r", "g", "b"] {
        of(&report, "m", json!(channel));
    }
    let report = fit("--samples 50");
    assert_eq!(report["data"]["used"], 50);
    assert_eq!(report["options"]["samples"], 50);
    assert_eq!(fit("--samples all")["data"]["used"], 200);
    assert_eq!(fit("--samples 100000")["data"]["used"], 200);
    let report = fit("--max-theta 45");
    assert_eq!(report["filters"]["max_theta_deg"], 45.0);
    let used = report["data"]["used"].as_u64().unwrap();
    assert_eq!(used + report["data"]["dropped"]["beyond-max-theta"].as_u64().unwrap(), 200);
    let report = fit("--weights sigma");
    assert_eq!(report["filters"]["weights"], "sigma");
    let chi2 = report["fit"]["reduced_chi2"].as_f64().unwrap();
    // 600 values of known noise: chi^2/dof has a standard deviation of 0.06.
    assert!((chi2 - 1.0).abs() < 0.3, "{chi2}");
    assert_eq!(fit("")["fit"]["reduced_chi2"], Value::Null);
    assert_eq!(fit("")["filters"]["weights"], "uniform");
    for (metric, report) in ["l2", "log", "cbrt", "unbiased-cbrt"].map(|m| (m, fit(&format!("--metric {m}"))))
    {
        assert_eq!(report["metric"], metric);
    }
    assert_eq!(fit("")["metric"], "unbiased-cbrt");
}

/// Angles at the limit count: `--max-theta` is inclusive.
#[test]
fn max_theta_is_inclusive() {
    let folder = Folder::new();
    let rows: String = (0..=90).map(|theta| format!("{theta},0,10,180,0.1\n")).collect();
    folder.write("m.csv", format!("{HEADER}\n{rows}"));
    for limit in [1, 17, 45, 60, 75, 80, 89, 90] {
        if limit < 10 {
            continue; // theta_o is 10
        }
        let report =
            folder.brdfit(&format!("evaluate m.csv -m lambert --max-theta {limit} --json")).good().json();
        assert_eq!(report["data"]["used"], limit + 1, "--max-theta {limit}");
    }
}

#[test]
fn reports_are_the_same_bytes_every_time() {
    let folder = laboratory();
    let line = "fit a.csv b.csv -m 'lambert + cook-torrance' -m oren-nayar --samples 150 --seed 7 --json";
    let runs: Vec<String> = ["", "--threads 1", "--threads 2", "--threads 7", ""]
        .iter()
        .map(|threads| {
            let run = folder.brdfit(&format!("{line} {threads}")).good();
            let report = &run.json()["reports"][0];
            if let Some((_, n)) = threads.split_once(' ') {
                assert_eq!(report["time_s"]["threads"].to_string(), n);
            }
            assert!(report["options"].get("threads").is_none(), "threads belong to time_s");
            timeless(&run.stdout)
        })
        .collect();
    for run in &runs {
        assert!(*run == runs[0], "the reports differ");
    }
    assert!(runs[0].len() > 5000);
}

/// Enough samples to be divided over threads in many ways.
#[test]
fn thread_count_does_not_change_a_large_fit() {
    let folder = Folder::new();
    folder
        .brdfit("synth -m 'lambert + cook-torrance' --set kd.r=0.4 kd.g=0.2 m=0.25 f0=0.1 --directions 20000 --noise 0.1 -o l.csv")
        .good();
    let run = |threads| {
        let line = format!("fit l.csv -m 'lambert + cook-torrance' --json --threads {threads}");
        timeless(&folder.brdfit(&line).good().stdout)
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5), "the reports differ");
}

/// Every way to give a constraint is the same constraint.
#[test]
fn constraints_inside_the_expression_and_as_options_are_the_same() {
    let folder = laboratory();
    let value = |line: &str| {
        let report = folder.brdfit(&format!("{line} --json")).json();
        (report["model"].clone(), report["errors"].clone(), report["termination"]["reason"].clone())
    };
    let first = value("fit a.csv -m 'lambert + cook-torrance(m=0.2, ks=free)'");
    for line in [
        "fit a.csv -m 'lambert + cook-torrance' --fix m=0.2 --free ks",
        "fit -m 'lambert + cook-torrance' --free ks --fix m=0.2 a.csv",
        "fit -m 'lambert + cook-torrance(ks=free)' a.csv --fix m=0.2",
    ] {
        assert_eq!(value(line), first, "{line}");
    }
    let both = value("fit -m 'lambert + cook-torrance' --fix m=0.2 kd=0.1 a.csv");
    assert_eq!(both, value("fit a.csv -m 'lambert(kd=0.1) + cook-torrance(m=0.2)'"));
    // A file whose name holds an equals sign is written with its folder.
    std::fs::copy(folder.path("a.csv"), folder.path("a=b.csv")).unwrap();
    folder.brdfit("fit -m lambert --fix kd=0.1 ./a=b.csv").good();
    // Constraints that contradict each other are refused, wherever they stand.
    for line in [
        "fit a.csv -m 'lambert(kd=0.1)' --fix kd=0.2",
        "fit a.csv -m 'lambert(kd=0.1, kd=free)'",
        "fit a.csv -m lambert --fix kd=0.1 --free kd",
        "fit a.csv -m lambert --bounds kd=0..0.5 kd=0..0.6",
        "evaluate a.csv -m 'lambert(kd=0.1)' --set kd=0.2",
    ] {
        let run = folder.brdfit(line);
        assert!(run.code == Some(2) && run.stderr.contains("contradict each other"), "{line}: {run:?}");
    }
}

/// Several models carry their own constraints, and an option is for those models that have the parameter.
#[test]
fn models_with_constraints_of_their_own_are_ranked_together() {
    let folder = laboratory();
    let line = "fit a.csv -m 'lambert(kd=0.1)' -m lambert -m 'lambert + phong' --fix n=20 --json";
    let run = folder.brdfit(line);
    assert_eq!(run.stderr.lines().filter(|line| line.starts_with("note: ")).count(), 1, "{run:?}");
    assert!(run.stderr.contains("note: 'n' is not a parameter of 'lambert(kd=0.1)' or 'lambert'"), "{run:?}");
    let reports = run.json();
    let models: Vec<&str> =
        reports["reports"].as_array().unwrap().iter().map(|r| r["model"].as_str().unwrap()).collect();
    assert_eq!(models, ["lambert(kd=0.1)", "lambert", "lambert + phong(n=20)"]);
    let run = folder.brdfit("fit a.csv -m lambert -m oren-nayar --fix q=20");
    assert!(run.code == Some(2) && run.stderr.contains("found 'q'"), "{run:?}");
}

/// Without a model a short ladder is fitted and ranked, and the best one decides about the exit code.
#[test]
fn without_a_model_a_short_ladder_is_ranked() {
    let folder = Folder::new();
    let made = "synth -m 'lambert + cook-torrance' --set kd=0.2 m=0.3 --directions 300 --noise 0.02 --seed 2 -o a.csv";
    folder.brdfit(made).good();
    let run = folder.brdfit("fit a.csv --json");
    assert_eq!(run.code, Some(0), "{run:?}");
    let found = run.json();
    assert_eq!(found["reports"].as_array().unwrap().len(), 4);
    let best = usize::try_from(found["ranking"][0]["index"].as_u64().unwrap()).unwrap();
    let model = found["reports"][best]["model"].as_str().unwrap();
    assert!(model.starts_with("lambert + cook-torrance("), "{model}");
}

/// Mistakes in names, and their answers.
#[test]
fn names_in_any_case_are_understood_and_mistakes_answered() {
    let folder = laboratory();
    let model = |line: &str| folder.brdfit(&format!("{line} --json")).json()["model"].clone();
    let first = model("fit a.csv -m 'lambert(kd.r=0.1) + cook-torrance(d=beckmann, m=0.2, ks=free)'");
    assert_eq!(model("fit a.csv -m 'Lambert(KD.R=0.1) + Cook-Torrance(D=Beckmann, M=0.2, ks=Free)'"), first);
    assert_eq!(
        model("fit a.csv -m 'lambert + cook-torrance(d=beckmann)' --fix Lambert.Kd.R=0.1 M=0.2 --free KS"),
        first
    );
    for (line, answer) in [
        ("fit a.csv -m lambrt", "did you mean 'lambert'?"),
        ("fit a.csv -m qqq", "the nearest of "),
        ("fit a.csv -m 'cook-torrance(d=ggy)'", "did you mean 'ggx'?"),
        ("fit a.csv -m 'cook-torrance(mm=0.2)'", "did you mean 'm'?"),
        ("fit a.csv -m 'disney-2012(rougness=0.2)'", "did you mean 'roughness'?"),
        ("fit a.csv -m lambert --fix kdd=0.2", "did you mean 'lambert.kd'?"),
        ("fit a.csv -m 'lambert(kd.red=0.1)'", "expected a channel among r, g, b, found 'red'"),
        ("fitt a.csv -m lambert", "'fit'"),
        ("fit a.csv -m lambert + cook-torrance", "put it in quotes, as in -m 'lambert + cook-torrance'"),
        ("evaluate a.csv -m lambert + phong", "put it in quotes, as in -m 'lambert + phong'"),
        ("synth -m lambert + phong --directions 10 -o b.csv", "put it in quotes, as in -m 'lambert + phong'"),
    ] {
        let run = folder.brdfit(line);
        assert!(run.code == Some(2) && run.stderr.contains(answer), "{line}: {run:?}");
        assert!(run.stderr.lines().count() == 1 && run.stderr.len() < 600, "{line}: {run:?}");
    }
}

/// What follows an option is a constraint or a file, and the message about a missing file names it.
#[test]
fn files_after_constraints_and_odd_words_are_named() {
    let folder = laboratory();
    for line in ["fit -m lambert --fix kd=0.1 missing.csv", "evaluate -m lambert --set kd=0.1 missing.csv"] {
        let run = folder.brdfit(line);
        assert!(run.code == Some(2) && run.stderr.contains("missing.csv"), "{line}: {run:?}");
    }
    // A channel whose name an expression cannot hold keeps its constraint outside, and the report is read back.
    folder.write("odd.csv", "theta_i,phi_i,theta_o,phi_o,a+b,c\n10,0,20,180,0.1,0.2\n30,0,30,180,0.12,0.2\n");
    let run = folder.brdfit("fit odd.csv -m lambert --fix kd[a+b]=0.3 kd[c]=0.4 -o odd.json").good();
    assert!(run.stdout.contains("lambert(kd.c=0.4)"), "{run:?}");
    folder.brdfit("check odd.json").good();
}

/// A word that is not Unicode is a mistake like any other.
#[cfg(unix)]
#[test]
fn words_need_not_be_unicode() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let run = laboratory().run([OsStr::new("info"), OsStr::from_bytes(b"\xff.csv")]);
    assert!(run.code == Some(2) && run.stderr.lines().count() == 1, "{run:?}");
    assert!(run.stderr.starts_with("error: "), "{run:?}");
}
