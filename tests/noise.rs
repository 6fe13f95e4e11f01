//! Noise as large as the signal: the intervals of the default metric hold the truth and nothing biases it; other metrics do as well, or
//! warn.
//!
//! Five materials of known parameters, 500 scattered directions drawn anew for each measurement, noise of eight kinds.
//! `cargo test --release --test integration noise -- --ignored --nocapture` makes 1000 measurements of each, and prints the tables of
//! docs/trust/calibration.md; the tests of every day make a tenth of those of three materials.
#![allow(clippy::print_stdout, clippy::cast_precision_loss)]

use brdfit::fit::{Fit, Metric, Options, WarningKind, fit};
use brdfit::geometry::{Azimuths, Directions};
use brdfit::measurement::{Filters, Measurement, Weighting};
use brdfit::model::Expression;
use brdfit::parameters::{ParameterTable, Selector, Setting, Settings};
use brdfit::progress::{Progress, Quiet};
use brdfit::synthetic::{Noise, measurement, scattered_directions};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::sync::Arc;

/// Name, model, and true parameters.
type Material = (&'static str, &'static str, &'static str);
const MATERIALS: [Material; 5] = [
    ("red plastic", "lambert + cook-torrance", "kd=0.3 m=0.2 f0=0.04"),
    ("black plastic", "lambert + cook-torrance", "kd=0.01 m=0.1 f0=0.04"),
    ("brushed metal", "cook-torrance(d=ggx-anisotropic)", "mx=0.1 my=0.3 f0=0.6"),
    ("sharp metal", "cook-torrance", "m=0.05 f0=0.8"),
    ("rough metal", "cook-torrance(d=beckmann)", "m=0.4 f0=0.7"),
];
const DIRECTIONS: usize = 500;
const MAX_THETA: f64 = 80.0;

/// How large the noise is.
#[derive(Clone, Copy, PartialEq)]
enum Size {
    /// The same in x = f cos(theta_i) everywhere: the median x over this number.
    Signal(f64),
    /// 1 % of f, and 2 % of the median x over cos(theta_i) cos(theta_o).
    Grazing,
    /// This share of f, and 0.001/sr.
    Share(f64),
}

const SIZES: [Size; 8] = [
    Size::Signal(20.0),
    Size::Signal(5.0),
    Size::Signal(2.0),
    Size::Signal(1.0),
    Size::Signal(0.5),
    Size::Grazing,
    Size::Share(0.02),
    Size::Share(0.01),
];

impl Size {
    fn name(self) -> String {
        match self {
            Self::Signal(ratio) => format!("S/N {ratio}"),
            Self::Grazing => "growing towards grazing".to_owned(),
            Self::Share(share) => format!("{} % + 0.001/sr", 100.0 * share),
        }
    }

    /// The standard deviation of f per sample.
    fn sigma(self, clean: &Measurement) -> Vec<f64> {
        let cosines: Vec<(f64, f64)> = clean.directions.iter().map(|g| (g.cos_i(), g.cos_o())).collect();
        let values = &clean.values[0];
        let mut x: Vec<f64> = values.iter().zip(&cosines).map(|(f, (ci, _))| f * ci).collect();
        x.sort_by(f64::total_cmp);
        let level = x[x.len() / 2];
        let of = |(f, (ci, co)): (&f64, &(f64, f64))| match self {
            Self::Signal(ratio) => level / ratio / ci,
            Self::Grazing => (0.01 * f).hypot(0.02 * level / (ci * co)),
            Self::Share(share) => Noise { relative: share, absolute: 1e-3 }.sigma(*f),
        };
        values.iter().zip(&cosines).map(of).collect()
    }
}

/// A material with its true parameters.
struct Truth {
    name: &'static str,
    expression: Expression,
    /// The true values as starts: the same minimum as from the default search, in a tenth of the time.
    settings: Settings,
    table: ParameterTable,
}

impl Truth {
    fn new(&(name, model, values): &Material) -> Self {
        let expression = Expression::parse(model).unwrap();
        let setting = |text: &str| {
            let (name, value) = text.split_once('=').unwrap();
            (Selector::parse(name).unwrap(), Setting::Init(value.parse().unwrap()))
        };
        let settings: Settings = values.split(' ').map(setting).collect();
        let table = ParameterTable::new(&expression, &["y".into()], Azimuths::Several, &settings).unwrap();
        Self { name, expression, settings, table }
    }

    /// A measurement with its standard deviations.
    fn measured(&self, size: Size, number: u64) -> Measurement {
        let mut rng = Pcg64Mcg::seed_from_u64(number);
        let directions = Directions::Scattered(scattered_directions(DIRECTIONS, MAX_THETA, rng.random()));
        let mut data = measurement(&self.expression, &self.table, directions, Noise::default(), 0);
        let sigma = size.sigma(&data);
        for (value, sigma) in data.values[0].iter_mut().zip(&sigma) {
            *value += sigma * rng.sample::<f64, _>(StandardNormal);
        }
        data.with_sigma(vec![sigma]).unwrap()
    }

    fn fitted(&self, data: &Measurement, metric: Metric, weighting: Weighting) -> Fit {
        let quiet: Arc<dyn Progress> = Arc::new(Quiet);
        let filters = Filters::default().with_weighting(weighting);
        let options = Options::default().with_metric(metric).with_filters(filters);
        fit(data, &self.expression, &options.with_settings(self.settings.clone()), &quiet).unwrap()
    }
}

/// What all measurements say of one parameter.
struct Summary {
    parameter: String,
    /// Per cent of the intervals that hold the truth.
    coverage: f64,
    /// The mean error in standard errors.
    bias: f64,
}

/// What all measurements of a material say in one metric.
struct Case {
    what: String,
    parameters: Vec<Summary>,
    /// Per cent of the fits that warn of a bias.
    warned: f64,
}

fn case(truth: &Truth, size: Size, metric: Metric, weighting: Weighting, sets: u64) -> Case {
    let of_set = |number: u64| {
        let mut data = truth.measured(size, number);
        // Without weights by sigma, nothing tells how large the noise is.
        data.sigma.take_if(|_| weighting != Weighting::Sigma);
        let found = truth.fitted(&data, metric, weighting);
        let of_parameter = |index: &usize| {
            let covariance = found.covariance.as_ref().filter(|_| found.unusable.is_none())?;
            let std_error = covariance.std_error(*index)?;
            let error = found.table.rows()[*index].value - truth.table.rows()[*index].value;
            Some((error / std_error, error.abs() <= covariance.half_interval(*index)? * std_error))
        };
        let verdicts: Vec<_> = truth.table.free().iter().map(of_parameter).collect();
        (verdicts, found.warnings.iter().any(|warning| warning.kind() == WarningKind::Bias))
    };
    // The same numbers in every case would make the same chance count many times.
    let label: u64 = format!("{} {}", truth.name, size.name()).bytes().map(u64::from).sum();
    let first = 10_000 * label;
    let all: Vec<_> = (first..first + sets).into_par_iter().map(of_set).collect();
    let summary = |(place, index): (usize, &usize)| {
        let known: Vec<(f64, bool)> = all.iter().filter_map(|(verdicts, _)| verdicts[place]).collect();
        let covered = known.iter().filter(|(_, covered)| *covered).count();
        Summary {
            parameter: truth.table.rows()[*index].spec.name.to_owned(),
            coverage: 100.0 * covered as f64 / sets as f64,
            bias: known.iter().map(|(errors, _)| errors).sum::<f64>() / known.len().max(1) as f64,
        }
    };
    let weights = if weighting == Weighting::Sigma { "sigma" } else { "uniform" };
    let warned = all.iter().filter(|(_, warned)| *warned).count();
    Case {
        what: format!("{} | {} | {weights} | {}", truth.name, size.name(), metric.name()),
        parameters: truth.table.free().iter().enumerate().map(summary).collect(),
        warned: 100.0 * warned as f64 / sets as f64,
    }
}

fn cases(materials: &[Material], sizes: &[Size], metrics: &[Metric], sets: u64) -> Vec<Case> {
    let mut cases = Vec::new();
    for truth in materials.iter().map(Truth::new) {
        for size in sizes {
            for weighting in [Weighting::Uniform, Weighting::Sigma] {
                cases.extend(metrics.iter().map(|metric| case(&truth, *size, *metric, weighting, sets)));
            }
        }
    }
    cases
}

fn print(cases: &[Case]) {
    println!(
        "\n| material | noise | weights | metric | coverage; bias in standard errors | warned |\n|---|---|---|---|---|---|"
    );
    for Case { what, parameters, warned } in cases {
        let of = |s: &Summary| format!("{} {:.1} %; {:+.2}", s.parameter, s.coverage, s.bias);
        let cells: Vec<String> = parameters.iter().map(of).collect();
        println!("| {what} | {} | {warned:.0} % |", cells.join(" · "));
    }
}

/// With 100 measurements a true coverage of 95 % is seen with a standard deviation of 2.2 %, and a bias with one of 0.1; all of them
/// together with far smaller ones.
#[test]
fn the_default_metric_is_calibrated_and_unbiased() {
    let cases = cases(&MATERIALS[..3], &SIZES[..6], &[Metric::UnbiasedCbrt], 100);
    print(&cases);
    let all: Vec<(&Case, &Summary)> =
        cases.iter().flat_map(|case| case.parameters.iter().map(move |summary| (case, summary))).collect();
    for (Case { what, warned, .. }, Summary { parameter, coverage, bias }) in &all {
        assert!(*coverage >= 87.0, "{what}, {parameter}: {coverage} %");
        assert!(bias.abs() < 0.45, "{what}, {parameter}: {bias} standard errors");
        assert_eq!(*warned, 0.0, "{what}");
    }
    let mean = |of: &dyn Fn(&Summary) -> f64| all.iter().map(|(_, s)| of(s)).sum::<f64>() / all.len() as f64;
    let (coverage, bias) = (mean(&|s| s.coverage), mean(&|s| s.bias));
    assert!((93.0..97.0).contains(&coverage) && bias.abs() < 0.1, "{coverage} %, {bias}");
}

/// A metric that bends noise warns wherever that is to be seen, and not where it is not.
#[test]
fn other_metrics_warn_where_noise_biases_them() {
    let cases = cases(&MATERIALS[..2], &SIZES[..4], &[Metric::Cbrt, Metric::Log], 40);
    print(&cases);
    for Case { what, parameters, warned } in &cases {
        let worst = parameters.iter().map(|s| s.bias.abs()).fold(0.0, f64::max);
        assert!(worst < 0.6 || *warned >= 95.0, "{what}: {worst} standard errors, warned in {warned} %");
    }
}

/// With 1000 measurements the standard deviation of a coverage is 0.7 %, and that of a bias 0.03.
#[test]
#[ignore = "takes minutes: the figures of docs/trust/calibration.md"]
fn a_thousand_of_each() {
    let of_default = cases(&MATERIALS, &SIZES, &[Metric::UnbiasedCbrt], 1000);
    print(&of_default);
    let others = cases(&MATERIALS, &SIZES, &[Metric::Cbrt, Metric::Log, Metric::L2], 200);
    print(&others);
    for Case { what, parameters, .. } in &of_default {
        // At a signal/noise ratio of 1/2 errors are a sixth to a third of the values, and the model is not linear within them.
        let least = if what.contains("S/N 0.5") { 91.0 } else { 92.0 };
        for Summary { parameter, coverage, bias } in parameters {
            assert!(
                (least..98.0).contains(coverage) && bias.abs() < 0.3,
                "{what}, {parameter}: {coverage} %, {bias}"
            );
        }
    }
    for Case { what, parameters, warned } in &others {
        // 200 measurements show a coverage with a standard deviation of 1.5 %.
        let good = |s: &Summary| s.coverage > 87.0 && s.bias.abs() < 0.4;
        assert!(parameters.iter().all(good) || *warned >= 90.0, "{what}: warned in {warned} %");
    }
}
