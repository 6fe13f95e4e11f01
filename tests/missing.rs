//! Values that were not measured. A gap in a channel takes that value away and nothing else: what belongs to the channel alone is what a
//! file of its own samples gives, and what the channels share is known from what remains.

use approx::assert_relative_eq;
use brdfit::fit::{
    Budget, Fit, HoldOut, LossKind, Metric, Options, ParameterState, SigmaScale, Uncertainty, WarningKind,
    evaluate, fit, fit_within,
};
use brdfit::geometry::{Azimuths, Directions};
use brdfit::measurement::formats::csv;
use brdfit::measurement::{Filters, Measurement, Samples, Weighting, coverage};
use brdfit::model::Expression;
use brdfit::parameters::{ParameterTable, Selector, Setting, Settings};
use brdfit::progress::{Progress, Quiet};
use brdfit::report::{Circumstances, OptionRecord, Report, Times, table};
use brdfit::synthetic::{Noise, measurement, scattered_directions};
use rand::{RngExt, SeedableRng};
use std::sync::Arc;

const MODEL: &str = "lambert + cook-torrance";

fn quiet() -> Arc<dyn Progress> {
    Arc::new(Quiet)
}

fn fitted(data: &Measurement, options: &Options) -> Fit {
    fit(data, &Expression::parse(MODEL).unwrap(), options, &quiet()).unwrap()
}

/// A paint in `channels`, at `directions`, with 2 % of noise.
fn paint(channels: &[&str], directions: Directions, settings: &[(&str, f64)], seed: u64) -> Measurement {
    let expression = Expression::parse(MODEL).unwrap();
    let setting = |(name, value): &(&str, f64)| (Selector::parse(name).unwrap(), Setting::Set(*value));
    let mut all: Settings = vec![(Selector::parse("m").unwrap(), Setting::PerChannel)];
    all.extend(settings.iter().map(setting));
    let names: Vec<String> = channels.iter().map(|name| (*name).to_owned()).collect();
    let table = ParameterTable::new(&expression, &names, Azimuths::Several, &all).unwrap();
    measurement(&expression, &table, directions, Noise { relative: 0.02, absolute: 0.0 }, seed)
}

/// A goniometer's directions: angles of incidence, and views around each.
fn goniometer() -> Directions {
    let mut angles = Vec::new();
    for theta_i in [5.0, 15.0, 25.0, 35.0, 45.0, 55.0, 65.0] {
        for theta_o in (0..16).map(|k| 5.0 * f64::from(k)) {
            angles.extend([0.0, 90.0, 150.0, 180.0].map(|phi| [theta_i, 0.0, theta_o, phi]));
        }
    }
    Directions::from_degrees(angles).unwrap()
}

/// Deletes values of a channel at random.
fn delete(data: &mut Measurement, channel: usize, share: f64, seed: u64) {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    for value in &mut data.values[channel] {
        if rng.random::<f64>() < share {
            *value = f64::NAN;
        }
    }
}

/// One channel of a measurement, at the samples at which it was measured.
fn alone(data: &Measurement, channel: usize) -> Measurement {
    let kept: Vec<usize> =
        (0..data.directions.len()).filter(|sample| !data.values[channel][*sample].is_nan()).collect();
    let gather = |row: &Vec<f64>| kept.iter().map(|sample| row[*sample]).collect::<Vec<f64>>();
    let one = Measurement::new(
        data.directions.select(&kept),
        [(&data.channels[channel].name, gather(&data.values[channel]))],
    );
    one.unwrap().with_sigma(vec![gather(&data.sigma.as_ref().unwrap()[channel])]).unwrap()
}

fn per_channel() -> Settings {
    ["kd", "m", "f0"].map(|name| (Selector::parse(name).unwrap(), Setting::PerChannel)).to_vec()
}

/// Two channels that share nothing are fitted as if each were measured alone, by every metric and with weights of both kinds.
#[test]
fn channels_that_share_nothing_are_fitted_as_if_alone() {
    let truth = [("kd.x", 0.4), ("kd.y", 0.1), ("m.x", 0.2), ("m.y", 0.3), ("f0.x", 0.05), ("f0.y", 0.08)];
    let mut both = paint(&["x", "y"], goniometer(), &truth, 4);
    delete(&mut both, 1, 0.4, 9);
    let missing = both.missing()[1];
    assert!(missing > 100 && both.missing()[0] == 0);
    let singles = [alone(&both, 0), alone(&both, 1)];
    for metric in Metric::ALL {
        for weighting in [Weighting::Uniform, Weighting::Sigma] {
            let filters = Filters::default().with_weighting(weighting);
            let options = Options::default().with_metric(metric).with_filters(filters);
            let found = fitted(&both, &options.clone().with_settings(per_channel()));
            assert!(found.is_usable() && found.missing == [0, missing], "{metric:?}");
            let mut n = 0;
            for (name, single) in ["x", "y"].into_iter().zip(&singles) {
                let expected = fitted(single, &options);
                n += expected.n;
                for parameter in ["kd", "m", "f0"] {
                    let (a, b) = (
                        found.parameter(&format!("{parameter}[{name}]")).unwrap(),
                        expected.parameter(parameter).unwrap(),
                    );
                    assert_relative_eq!(a.value, b.value, max_relative = 1e-7);
                    assert_relative_eq!(a.std_error.unwrap(), b.std_error.unwrap(), max_relative = 1e-5);
                }
                let channel = usize::from(name == "y");
                let (of_both, of_single) = (found.errors.by_channel[channel], expected.errors.by_channel[0]);
                assert_relative_eq!(of_both.l2, of_single.l2, max_relative = 1e-6);
                assert_relative_eq!(of_both.log_ratio, of_single.log_ratio, max_relative = 1e-6);
                assert_relative_eq!(of_both.unbiased_cbrt, of_single.unbiased_cbrt, max_relative = 1e-6);
                assert_relative_eq!(
                    of_both.relative.unwrap(),
                    of_single.relative.unwrap(),
                    max_relative = 1e-6
                );
            }
            assert_eq!((found.n, found.dof), (n, i64::try_from(n).unwrap() - 6));
        }
    }
}

/// A third of all values deleted at random leaves the shared roughness and every channel's albedo known: their 95 % intervals contain the
/// truth about as often as they should.
#[test]
fn truth_is_found_in_what_remains() {
    let truth = [("kd.r", 0.4), ("kd.g", 0.2), ("kd.b", 0.1), ("f0", 0.05), ("m", 0.25)];
    let (mut inside, mut all) = (0, 0);
    for seed in 0..6 {
        let mut data = paint(
            &["r", "g", "b"],
            Directions::Scattered(scattered_directions(500, 80.0, seed)),
            &truth,
            seed,
        );
        (0..3).for_each(|channel| {
            delete(&mut data, channel, 0.3, 100 * seed + u64::try_from(channel).unwrap())
        });
        // The samples that lost all of their values.
        let names = data.channel_names();
        let data = Measurement::new(data.directions.clone(), names.iter().zip(data.values.clone())).unwrap();
        assert!(data.dropped["not-measured"] > 3 && data.missing().iter().all(|missing| *missing > 90));
        let found = fitted(&data, &Options::default());
        assert_eq!(found.n, 3 * data.directions.len() - data.missing().iter().sum::<usize>());
        for (name, value) in [("m", 0.25), ("kd[r]", 0.4), ("kd[g]", 0.2), ("kd[b]", 0.1)] {
            let parameter = found.parameter(name).unwrap();
            let (low, high) = parameter.ci95.map(|[low, high]| (low, high)).unwrap();
            assert_relative_eq!(parameter.value, value, max_relative = 0.05);
            inside += usize::from(low <= value && value <= high);
            all += 1;
        }
    }
    // 22.8 of 24 on average; fewer than 19 once in a hundred times.
    assert!(inside >= 19, "{inside} of {all}");
}

/// The JSON and the table of a report.
fn reported(data: &Measurement, fit: &Fit, options: &Options) -> (Report, String) {
    let circumstances = Circumstances {
        metric: options.metric,
        max_theta_deg: options.filters.max_theta_deg,
        options: OptionRecord::default(),
        times: Times::default(),
        fitted: true,
    };
    let report = Report::new(data, fit, &circumstances);
    let text = report.to_json().unwrap() + &table(&report);
    (report, text)
}

fn has_no_nan(what: &str, text: &str) {
    for word in ["NaN", "nan", "inf"] {
        let found = text.split(|c: char| !c.is_alphanumeric()).find(|w| *w == word);
        assert!(found.is_none(), "{what}: {text}");
    }
}

/// Every loss, every method of uncertainty, weights by sigma, held-out angles, budgets and few samples: nothing is NaN.
#[test]
fn every_way_of_fitting_takes_gaps() {
    let truth = [("kd.r", 0.4), ("kd.g", 0.2), ("kd.b", 0.1), ("f0", 0.05), ("m", 0.25)];
    let mut data = paint(&["r", "g", "b"], goniometer(), &truth, 3);
    delete(&mut data, 1, 0.3, 1);
    delete(&mut data, 2, 0.9, 2);
    let sigma = |value: &f64, s: &f64| if value.is_nan() { f64::NAN } else { *s };
    let values = data.values.clone();
    for (row, values) in data.sigma.iter_mut().flatten().zip(&values) {
        row.iter_mut().zip(values).for_each(|(s, value)| *s = sigma(value, s));
    }
    let by_sigma = Filters::default().with_weighting(Weighting::Sigma);
    let plain = Options::default;
    let ways = [
        ("huber", plain().with_loss(LossKind::Huber)),
        ("cauchy", plain().with_loss(LossKind::Cauchy).with_metric(Metric::Cbrt)),
        ("bootstrap", plain().with_uncertainty(Uncertainty::BlockBootstrap)),
        ("hold-out", plain().with_hold_out(HoldOut::fraction(0.3).unwrap())),
        ("sigma", plain().with_filters(by_sigma.clone())),
        ("sigma up to a factor", plain().with_filters(by_sigma.clone()).with_sigma_scale(SigmaScale::Auto)),
        ("sigma in cbrt", plain().with_filters(by_sigma.clone()).with_metric(Metric::Cbrt)),
        ("sigma and a loss", plain().with_filters(by_sigma).with_loss(LossKind::Huber)),
        ("cbrt", plain().with_metric(Metric::Cbrt)),
        ("log", plain().with_metric(Metric::Log)),
        ("l2", plain().with_metric(Metric::L2)),
        ("some", plain().with_filters(Filters::default().with_samples(200))),
    ];
    for (what, options) in ways {
        let found = fitted(&data, &options);
        assert!(found.is_usable(), "{what}: {:?}", found.warnings);
        let kd = |channel: &str| found.parameter(&format!("kd[{channel}]")).unwrap();
        for (channel, value) in [("r", 0.4), ("g", 0.2), ("b", 0.1)] {
            assert_relative_eq!(kd(channel).value, value, max_relative = 0.1);
            assert!(kd(channel).std_error.is_some_and(|error| error > 0.0), "{what}: {channel}");
        }
        // Fewer values, larger errors.
        let relative = |channel: &str| kd(channel).std_error.unwrap() / kd(channel).value;
        assert!(relative("b") > 1.5 * relative("r"), "{what}: {} {}", relative("b"), relative("r"));
        let (report, text) = reported(&data, &found, &options);
        has_no_nan(what, &text);
        let names: Vec<&str> = report.data.missing.0.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["g", "b"], "{what}");
        let used: usize = report.data.missing.0.iter().map(|(_, n)| n).sum();
        assert_eq!(report.fit.n, 3 * report.data.used - used, "{what}");
        assert!(text.contains("values not measured: "), "{what}");
        if let Some(held) = &found.held_out {
            assert!(held.errors.l2.is_finite() && held.samples > 0);
        }
        // The report is read again.
        let again: Report = serde_json::from_str(&report.to_json().unwrap()).unwrap();
        assert_eq!(again.data.missing.0, report.data.missing.0);
    }
    let within =
        fit_within(Budget::Fast, &data, &Expression::parse(MODEL).unwrap(), &plain(), &quiet()).unwrap();
    assert!(within.errors_on_all.unwrap().l2.is_finite());
}

/// A channel that has few values among very many samples is searched, fitted and judged all the same: parts that are drawn hold some.
#[test]
fn a_rare_channel_is_fitted() {
    let truth = [("kd.a", 0.4), ("kd.b", 0.1), ("f0", 0.05), ("m", 0.25)];
    let mut data =
        paint(&["a", "b"], Directions::Scattered(scattered_directions(60_000, 80.0, 1)), &truth, 2);
    let rare = |(sample, value): (usize, &mut f64)| {
        if sample % 2000 != 7 {
            *value = f64::NAN;
        }
    };
    data.values[1].iter_mut().enumerate().for_each(rare);
    let found = fitted(&data, &Options::default());
    assert_eq!((found.n, &found.missing[..]), (60_030, &[0, 59_970][..]));
    let kd = found.parameter("kd[b]").unwrap();
    assert_eq!(kd.state, ParameterState::Free);
    assert!((kd.value - 0.1).abs() < 4.0 * kd.std_error.unwrap(), "{kd}");
    let of_many = found.parameter("kd[a]").unwrap();
    assert_relative_eq!(of_many.value, 0.4, max_relative = 0.002);
    assert!(kd.std_error.unwrap() > 5.0 * of_many.std_error.unwrap(), "{kd}");

    // At the roughness that both share, the rare channel has what its samples alone give.
    let fixed = Setting::Fix(found.parameter("m").unwrap().value);
    let options = Options::default().with_settings(vec![(Selector::parse("m").unwrap(), fixed)]);
    let expected = fitted(&alone(&data, 1), &options);
    for name in ["kd", "f0"] {
        let value = found.parameter(&format!("{name}[b]")).unwrap().value;
        assert_relative_eq!(value, expected.parameter(name).unwrap().value, max_relative = 1e-5);
    }
}

/// What a channel lacks altogether is said by its name.
#[test]
fn a_channel_without_values_is_named() {
    let mut data = paint(&["r", "g"], goniometer(), &[("kd", 0.3)], 1);
    let steep: Vec<bool> = data.directions.iter().map(|g| g.cos_i() < 30_f64.to_radians().cos()).collect();
    data.values[1].iter_mut().zip(&steep).filter(|(_, steep)| !**steep).for_each(|(f, _)| *f = f64::NAN);
    let refused = |options: &Options| {
        fit(&data, &Expression::parse("lambert").unwrap(), options, &quiet()).unwrap_err().to_string()
    };
    let low = Options::default().with_filters(Filters::default().with_max_theta_deg(30.0));
    assert!(refused(&low).contains("channel g was not measured at any of"), "{}", refused(&low));
    let error = Samples::select(&data, &low.filters).unwrap_err().to_string();
    assert!(error.contains("no usable sample"), "{error}");
    let evaluated = evaluate(&data, &Expression::parse("lambert").unwrap(), &low);
    assert!(evaluated.unwrap_err().to_string().contains("channel g"));
    // Four of the seven angles are left to the channel: too few to resample.
    let resampled = Options::default().with_uncertainty(Uncertainty::BlockBootstrap);
    assert!(refused(&resampled).contains("5 angles of incidence in channel g"), "{}", refused(&resampled));
    // Whatever is left out, one of four angles is fitted.
    let each = Options::default().with_hold_out(HoldOut::Each);
    assert!(fit(&data, &Expression::parse("lambert").unwrap(), &each, &quiet()).is_ok());
    // The only angle of the channel is left out once.
    let others: Vec<bool> =
        data.directions.iter().map(|g| (g.cos_i().acos().to_degrees() - 45.0).abs() > 1.0).collect();
    data.values[1].iter_mut().zip(&others).filter(|(_, other)| **other).for_each(|(f, _)| *f = f64::NAN);
    for options in [each, Options::default().with_hold_out(HoldOut::fraction(0.5).unwrap())] {
        let found = fit(&data, &Expression::parse("lambert").unwrap(), &options, &quiet());
        let message = found.unwrap_err().to_string();
        assert!(message.contains("hold-out: expected values of channel g"), "{message}");
    }
}

/// A channel is dead if it has the same value wherever it was measured.
#[test]
fn a_dead_channel_may_have_gaps() {
    let mut data = paint(&["r", "g"], goniometer(), &[("kd", 0.3)], 1);
    data.values[1].fill(0.1);
    delete(&mut data, 1, 0.3, 5);
    delete(&mut data, 0, 0.1, 6);
    let found = fitted(&data, &Options::default());
    let kinds: Vec<WarningKind> = found.warnings.iter().map(brdfit::fit::Warning::kind).collect();
    assert!(kinds.contains(&WarningKind::DeadChannel));
    assert_eq!(found.n, data.directions.len() - data.missing()[0]);
    let kd = found.parameter("kd[g]").unwrap().value / std::f64::consts::PI;
    assert!((kd - 0.1).abs() < 0.01, "{kd}");
    has_no_nan("dead", &reported(&data, &found, &Options::default()).1);
}

/// CSV says `nan`, with or without standard deviations; that of a value must be known.
#[test]
fn csv_marks_gaps() {
    let mut data = paint(&["x", "y"], goniometer(), &[("kd", 0.3)], 4);
    delete(&mut data, 1, 0.4, 9);
    let gaps = data.missing()[1];
    let text = csv::write(&data, &[]).unwrap();
    assert_eq!(text.matches(",nan,").count(), gaps);
    let sigma = data.sigma.as_mut().unwrap();
    let missing = data.values[1].iter().position(|f| f.is_nan()).unwrap();
    sigma[1][missing] = f64::NAN;
    assert_eq!(csv::write(&data, &[]).unwrap().matches("nan").count(), gaps + 1);
    data.sigma.as_mut().unwrap()[0][missing] = f64::NAN;
    let error = csv::write(&data, &[]).unwrap_err().to_string();
    assert!(error.contains(&format!("at sample {}", missing + 1)), "{error}");
}

/// What `info` and `check` say of a channel comes from the values that it has.
#[test]
fn coverage_and_health_leave_gaps_out() {
    let truth = [("kd.x", 0.4), ("kd.y", 0.1), ("m", 0.25), ("f0", 0.05)];
    let mut both = paint(&["x", "y"], goniometer(), &truth, 4);
    both.values[1][5] = -0.2;
    delete(&mut both, 1, 0.4, 9);
    both.values[1][6] = -0.001;
    let (all, single) = (coverage(&both), coverage(&alone(&both, 1)));
    assert_eq!((all.range[1], all.negative[1]), (single.range[0], single.negative[0]));
    assert_eq!((all.missing, single.missing), (both.missing(), vec![0]));
    assert!(all.reciprocity.is_some_and(|(difference, pairs)| difference.is_finite() && pairs > 20));
    let [of_both, of_single] = [&both, &alone(&both, 1)]
        .map(|data| brdfit::health::measurement(data).channels.pop().unwrap().negative);
    assert_eq!(
        (of_both.values, of_both.beyond_noise, of_both.least),
        (of_single.values, of_single.beyond_noise, of_single.least)
    );
}
