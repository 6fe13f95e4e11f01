//! Whole fits by the program itself: read, fit, report.

use super::inputs::{self, ONE_LOBE};
use super::process::{Run, brdfit, run};
use super::timing::median;
use super::{Setup, markdown};
use std::path::Path;
use std::process::Command;

const TWO_LOBES: &str = "lambert + cook-torrance(d=ggx) + cook-torrance(d=ggx)";
const DIELECTRIC: &str = "lambert + cook-torrance(d=ggx, f=dielectric)";
const METRICS: [&str; 3] = ["cbrt", "log", "l2"];

/// Runs of one fit.
#[derive(Default)]
struct Runs {
    read: Vec<f64>,
    fit: Vec<f64>,
    whole: Vec<f64>,
    peak: f64,
    cost: f64,
    /// Passes over the samples in the final fit.
    passes: u64,
}

impl Runs {
    /// The titles of [`Runs::cells`].
    const TITLES: [&str; 6] = ["read s", "fit s", "whole process s", "passes", "peak MB", "cost"];

    fn add(&mut self, run: &Run) {
        let report = run.json();
        self.read.push(report["time_s"]["read"].as_f64().unwrap());
        self.fit.push(report["time_s"]["fit"].as_f64().unwrap());
        self.whole.push(run.whole);
        self.peak = self.peak.max(run.peak_megabytes);
        self.passes = report["termination"]["evaluations"].as_u64().unwrap_or_default();
        // The script has its cost at the top.
        let cost = report["fit"]["cost"].as_f64().or(report["cost"].as_f64());
        self.cost = cost.unwrap();
    }

    fn whole(&self) -> f64 {
        median(self.whole.iter().copied())
    }

    fn cells(&self) -> Vec<String> {
        let seconds = |times: &[f64]| format!("{:.3}", median(times.iter().copied()));
        vec![
            seconds(&self.read),
            seconds(&self.fit),
            seconds(&self.whole),
            self.passes.to_string(),
            format!("{:.0}", self.peak),
            format!("{:.9e}", self.cost),
        ]
    }
}

fn fit(file: &Path, model: &str, metric: &str) -> Run {
    run(brdfit().args(["fit", "-m", model, "--metric", metric, "--json"]).arg(file))
}

/// One lobe in every metric, two lobes, and the exact Fresnel reflectance beside Schlick's.
pub fn whole_fits(setup: &Setup) -> String {
    let mut rows = Vec::new();
    let tables = if setup.quick() { &setup.inputs.tables[..1] } else { &setup.inputs.tables[..] };
    for table in tables {
        let mut schlick = f64::NAN;
        let one_lobe = METRICS.map(|metric| (ONE_LOBE, metric));
        let others = [(DIELECTRIC, "cbrt"), (TWO_LOBES, "cbrt")];
        for (model, metric) in one_lobe.into_iter().chain(others) {
            let mut runs = Runs::default();
            (0..setup.effort.runs).for_each(|_| runs.add(&fit(table, model, metric)));
            if (model, metric) == (ONE_LOBE, "cbrt") {
                schlick = runs.whole();
            }
            let ratio = match model {
                DIELECTRIC => format!("{:.2}", runs.whole() / schlick),
                _ => String::new(),
            };
            let first = vec![inputs::name(table), format!("`{model}`"), metric.to_owned()];
            rows.push([first, runs.cells(), vec![ratio]].concat());
        }
    }
    let head = [&["table", "model", "metric"][..], &Runs::TITLES, &["whole, to Schlick's"]].concat();
    markdown(&head, &rows)
}

/// The program and the script, one after the other.
pub fn baseline(setup: &Setup) -> String {
    let Some(python) = &setup.arguments.baseline else {
        return "Not measured: `--baseline PYTHON` was not given.\n".to_owned();
    };
    let mut rows = Vec::new();
    let tables = if setup.quick() { &setup.inputs.tables[..1] } else { &setup.inputs.tables[..] };
    let metrics = if setup.quick() { &METRICS[2..] } else { &METRICS[..] };
    for table in tables {
        for metric in metrics {
            let (mut ours, mut theirs) = (Runs::default(), Runs::default());
            // The script takes far longer: one run of it, between as many of the program as elsewhere.
            let before = setup.effort.runs.div_ceil(2);
            (0..before).for_each(|_| ours.add(&fit(table, ONE_LOBE, metric)));
            let mut script = Command::new(python);
            script.arg(&setup.arguments.baseline_script).arg(table);
            theirs.add(&run(script.args(["--metric", metric, "--json"])));
            (before..setup.effort.runs).for_each(|_| ours.add(&fit(table, ONE_LOBE, metric)));
            rows.push(vec![
                inputs::name(table),
                (*metric).to_owned(),
                format!("{:.3}", ours.whole()),
                format!("{:.1}", theirs.whole()),
                format!("{:.0}", theirs.whole() / ours.whole()),
                format!("{:.0}", ours.peak),
                format!("{:.0}", theirs.peak),
                format!("{:+.1e}", theirs.cost / ours.cost - 1.0),
            ]);
        }
    }
    let head = [
        "table",
        "metric",
        "brdfit, whole s",
        "scipy, whole s",
        "times faster",
        "brdfit, peak MB",
        "scipy, peak MB",
        "scipy's cost above",
    ];
    markdown(&head, &rows)
}

/// Many wavelengths in few directions.
pub fn spectral(setup: &Setup) -> String {
    let mut rows = Vec::new();
    for file in &setup.inputs.spectral {
        let mut runs = Runs::default();
        let mut size = [0, 0];
        for _ in 0..setup.effort.runs {
            let run = fit(file, ONE_LOBE, "cbrt");
            let report = run.json();
            size = [
                report["data"]["channels"].as_array().map_or(0, Vec::len),
                usize::try_from(report["data"]["used"].as_u64().unwrap()).unwrap(),
            ];
            runs.add(&run);
        }
        let first = [inputs::name(file), size[0].to_string(), size[1].to_string()];
        rows.push([first.to_vec(), runs.cells()].concat());
    }
    let head = [&["measurement", "channels", "samples"][..], &Runs::TITLES].concat();
    markdown(&head, &rows)
}
