//! A larger model is never worse: every lobe of a sum can be absent, and the fit of a sum knows that.
//!
//! All pairs of models on five data sets take minutes:
//! `cargo test --release --test integration every_pair_on_five -- --ignored --nocapture`. docs/trust/nesting.md holds the last result.
#![allow(clippy::print_stdout)]

use crate::common::{every_variant, shared};
use brdfit::fit::{Fit, Metric, Options, ParameterState, ReflectanceProblem, WarningKind, fit};
use brdfit::geometry::{Azimuths, Directions};
use brdfit::measurement::{Filters, Measurement, Samples};
use brdfit::model::{Expression, LobeValues, ModelEntry, REGISTRY, Role, Strength};
use brdfit::parameters::{ParameterTable, Selector, Setting};
use brdfit::progress::{Progress, Quiet};
use brdfit::synthetic::{Noise, measurement, scattered_directions};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

const SAMPLES: usize = 200;
/// A cost may exceed that of the smaller model by rounding: by this fraction, and by this share of the data's squares.
const SLACK: f64 = 1e-9;
const NOTHING: f64 = 1e-18;
const PAIRS: usize = 60;

/// Each model says what must be 0 for it to vanish: then it does, and without that it does not.
#[test]
fn every_model_says_how_it_vanishes() {
    for (entry, model, choices) in every_variant() {
        let specs = model.parameters();
        let strength = model.strength();
        let expression = Expression::parse(&format!("{}({})", entry.name, choices.text())).unwrap();
        let values = |role: Role| -> Vec<f64> {
            let of_role = specs.iter().filter(|spec| spec.role == role);
            let value = |spec: &brdfit::model::ParamSpec| {
                let is_zero = match strength {
                    Strength::Amplitudes | Strength::Missing => role == Role::Amplitude && !spec.fixed,
                    Strength::Shape(name) | Strength::Scale(name) => spec.name == name,
                };
                if is_zero { spec.bounds.0 } else { spec.in_formula_units(spec.initial) }
            };
            of_role.map(value).collect()
        };
        let parameters =
            vec![vec![LobeValues { shapes: values(Role::Shape), amplitudes: values(Role::Amplitude) }]];
        let found = expression.values(&Directions::Scattered(scattered_directions(50, 85.0, 3)), &parameters);
        let vanishes = found[0].iter().all(|f| *f == 0.0);
        let says = strength != Strength::Missing;
        assert!(vanishes == says, "{}: {strength:?}, and f = {:?}", expression.canonical(), &found[0][..5]);
    }
}

fn fitted(data: &Measurement, model: &str) -> Fit {
    fitted_with(data, model, &[])
}

fn fitted_with(data: &Measurement, model: &str, settings: &[(&str, Setting)]) -> Fit {
    let settings = settings.iter().map(|(name, s)| (Selector::parse(name).unwrap(), s.clone())).collect();
    let options = Options::default().with_filters(filters()).with_settings(settings);
    let quiet: Arc<dyn Progress> = Arc::new(Quiet);
    fit(data, &Expression::parse(model).unwrap(), &options, &quiet).unwrap()
}

fn filters() -> Filters {
    Filters::default().with_samples(SAMPLES)
}

/// The sum of squares of the samples, in the metric of the fit.
fn squares(data: &Measurement) -> f64 {
    let expression = Expression::parse("lambert").unwrap();
    let samples = Samples::select(data, &filters()).unwrap();
    let channels: Vec<String> = data.channels.iter().map(|channel| channel.name.clone()).collect();
    let table = ParameterTable::new(&expression, &channels, Azimuths::Several, &Vec::new()).unwrap();
    ReflectanceProblem::new(&expression, &samples, table, Metric::Cbrt).magnitude().powi(2)
}

fn synthetic(model: &str, set: &[(&str, f64)], channels: &[&str], noise: Noise) -> Measurement {
    let expression = Expression::parse(model).unwrap();
    let channels: Vec<String> = channels.iter().map(|name| (*name).to_owned()).collect();
    let settings =
        set.iter().map(|(name, value)| (Selector::parse(name).unwrap(), Setting::Set(*value))).collect();
    let table = ParameterTable::new(&expression, &channels, Azimuths::Several, &settings).unwrap();
    measurement(&expression, &table, Directions::Scattered(scattered_directions(SAMPLES, 80.0, 5)), noise, 6)
}

/// Of one model, of another with noise, and of a metal that no model of the registry is.
fn made() -> Vec<(&'static str, Measurement)> {
    let noise = Noise { relative: 0.03, absolute: 1e-3 };
    let two = "lambert + cook-torrance(d=beckmann) + cook-torrance(d=gtr, f=conductor)";
    vec![
        ("matte", synthetic("lambert", &[("kd", 0.4)], &["y"], Noise::default())),
        ("satin", synthetic("lambert + cook-torrance", &[("kd", 0.2), ("m", 0.3)], &["y"], noise)),
        (
            "two lobes",
            synthetic(
                two,
                &[("kd", 0.1), ("cook-torrance.m", 0.5), ("cook-torrance#2.m", 0.15)],
                &["y"],
                noise,
            ),
        ),
    ]
}

/// Two measured materials, if they are at hand.
fn measured() -> Vec<(&'static str, Measurement)> {
    let files = ["cornell/garnet_red.brdf", "cornell/krylon_blue.brdf"];
    let read = |name: &'static str| {
        let mut data = Measurement::read(shared(name)?).unwrap();
        // Three of the many channels, or the pairs would take hours.
        let every = data.channels.len().div_ceil(3);
        data.channels = data.channels.into_iter().step_by(every).collect();
        data.values = data.values.into_iter().step_by(every).collect();
        Some((name, data))
    };
    files.into_iter().filter_map(read).collect()
}

/// The pairs of `pairs` whose sum is worse than one of the two.
fn worse(data: &Measurement, pairs: &[(String, String)]) -> Vec<String> {
    let mut names: Vec<&String> = pairs.iter().flat_map(|(a, b)| [a, b]).collect();
    names.sort();
    names.dedup();
    let alone: BTreeMap<&String, f64> =
        names.par_iter().map(|name| (*name, fitted(data, name).cost)).collect();
    let least = NOTHING * squares(data);
    let check = |(a, b): &(String, String)| {
        let both = fitted(data, &format!("{a} + {b}"));
        let limit = alone[a].min(alone[b]) * (1.0 + SLACK) + least;
        (both.cost.is_nan() || both.cost > limit)
            .then(|| format!("{a} + {b}: {:e} above {limit:e}, {:?}", both.cost, both.termination))
    };
    pairs.par_iter().filter_map(check).collect()
}

#[test]
fn a_sum_is_never_worse_than_its_parts() {
    let all: Vec<String> =
        every_variant().map(|(entry, _, choices)| format!("{}({})", entry.name, choices.text())).collect();
    let mut rng = Pcg64Mcg::seed_from_u64(17);
    let mut drawn = || {
        // A model first, then a variant: most variants are cook-torrance's.
        let entry = &REGISTRY[rng.random_range(0..REGISTRY.len())];
        let own: Vec<&String> =
            all.iter().filter(|text| text.starts_with(&format!("{}(", entry.name))).collect();
        own[rng.random_range(0..own.len())].clone()
    };
    let pairs: Vec<(String, String)> = (0..PAIRS).map(|_| (drawn(), drawn())).collect();
    let data = made();
    let failed: Vec<String> = (0..data.len())
        .flat_map(|index| {
            let (name, data) = &data[index];
            let own: Vec<(String, String)> = pairs.iter().skip(index).step_by(3).cloned().collect();
            worse(data, &own).into_iter().map(move |line| format!("{name}: {line}"))
        })
        .collect();
    assert!(failed.is_empty(), "{} of {PAIRS} failed:\n{}", failed.len(), failed.join("\n"));
}

#[test]
#[ignore = "takes minutes"]
fn every_pair_on_five_data_sets() {
    let with_later = |(index, a): (usize, &ModelEntry)| {
        REGISTRY[index..].iter().map(|b| (a.name.to_owned(), b.name.to_owned())).collect::<Vec<_>>()
    };
    let pairs: Vec<(String, String)> = REGISTRY.iter().enumerate().flat_map(with_later).collect();
    let mut failed = Vec::new();
    for (name, data) in made().into_iter().chain(measured()) {
        let worse = worse(&data, &pairs);
        println!("{name}: {} pairs, {} of them worse than one of their models", pairs.len(), worse.len());
        failed.extend(worse.into_iter().map(|line| format!("{name}: {line}")));
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

/// A lobe that the data do not show is absent, not at f0 = 0, where it would still rise towards grazing.
#[test]
fn a_lobe_that_matte_data_do_not_show_is_absent() {
    let (_, matte) = made().remove(0);
    for model in
        ["lambert + cook-torrance", "cook-torrance + lambert", "lambert + ashikhmin-shirley", "lambert + eon"]
    {
        let found = fitted(&matte, model);
        assert!(found.cost <= NOTHING * squares(&matte), "{model}: {:e}", found.cost);
    }
    let found = fitted(&matte, "lambert + cook-torrance");
    let ks = found.parameter("ks").unwrap();
    assert_eq!((ks.value, ks.state), (0.0, ParameterState::Absent));
    assert_eq!(found.parameter("m").unwrap().state, ParameterState::Absent);
    assert!((found.parameter("kd").unwrap().value - 0.4).abs() < 1e-9);
    assert!(
        found.warnings.iter().any(|warning| warning.kind() == WarningKind::LobeAbsent),
        "{:?}",
        found.warnings
    );
    // Fixed by the user, it stays.
    let kept = fitted_with(&matte, "lambert + cook-torrance", &[("ks", Setting::Fix(1.0))]);
    assert_ne!(kept.parameter("m").unwrap().state, ParameterState::Absent);
    assert!(kept.cost > 1e6 * found.cost);
}

/// A Fresnel lobe alone keeps its physical strength; several share the light as the data have it.
#[test]
fn strengths_are_free_only_where_several_lobes_share_the_light() {
    let state = |found: &Fit, name: &str| found.parameter(name).unwrap().state;
    let data = made();
    let satin = fitted(&data[1].1, "lambert + cook-torrance");
    let ks = satin.parameter("ks").unwrap();
    assert_eq!((ks.value, ks.state), (1.0, ParameterState::Fixed));
    let two = fitted(&data[2].1, "lambert + cook-torrance + cook-torrance");
    assert_eq!(state(&two, "cook-torrance.ks"), ParameterState::Free);
    assert_eq!(state(&two, "cook-torrance#2.ks"), ParameterState::Free);
    let layered = fitted(&data[2].1, "eon + cook-torrance + phong");
    assert_eq!(state(&layered, "cook-torrance.ks"), ParameterState::Fixed);
}
