//! Fits of measurements as extreme as files can hold: each ends usable with the right parameters, or not usable with the
//! right reason. None panics, runs for ever or prints a number that is none.

use brdfit::Error;
use brdfit::fit::{Fit, Metric, Options, Unusable, fit};
use brdfit::geometry::{Directions, HalfDifferenceGrid, Pair, direction};
use brdfit::measurement::{Filters, Measurement};
use brdfit::model::Expression;
use brdfit::parameters::{ParameterTable, Selector, Setting, Settings};
use brdfit::progress::{Progress, Quiet};
use brdfit::report::{Circumstances, OptionRecord, Report, Times, table};
use brdfit::synthetic::{Noise, measurement, scattered_directions};
use std::sync::Arc;

const ONE_LOBE: &str = "lambert + cook-torrance";

fn settings(values: &[(&str, Setting)]) -> Settings {
    values.iter().map(|(name, setting)| (Selector::parse(name).unwrap(), setting.clone())).collect()
}

/// A measurement without noise.
fn synthetic(model: &str, channels: &[&str], values: &[(&str, f64)], directions: Directions) -> Measurement {
    let expression = Expression::parse(model).unwrap();
    let channels: Vec<String> = channels.iter().map(|name| (*name).to_owned()).collect();
    let set: Vec<(&str, Setting)> =
        values.iter().map(|(name, value)| (*name, Setting::Set(*value))).collect();
    let table = ParameterTable::new(&expression, &channels, directions.azimuths(), &settings(&set)).unwrap();
    measurement(&expression, &table, directions, Noise::default(), 1)
}

fn scattered(n: usize) -> Directions {
    Directions::Scattered(scattered_directions(n, 80.0, 3))
}

/// Every 30th cell of a full table and all with the half vector within 5 degrees of the normal.
fn grid() -> Directions {
    let grid = Arc::new(HalfDifferenceGrid::merl(0.5));
    let cells = (0..u32::try_from(HalfDifferenceGrid::CELLS).unwrap()).filter(|cell| {
        let g = grid.geometry(*cell);
        g.cos_i() > 0.0 && g.cos_o() > 0.0 && (cell % 30 == 0 || g.cos_h() > 5_f64.to_radians().cos())
    });
    Directions::Grid { cells: cells.collect(), grid: Arc::clone(&grid) }
}

fn attempt(data: &Measurement, model: &str, options: &Options) -> Result<Fit, Error> {
    let quiet: Arc<dyn Progress> = Arc::new(Quiet);
    fit(data, &Expression::parse(model).unwrap(), options, &quiet)
}

/// Fits, and looks at everything that would be printed.
fn fitted(data: &Measurement, model: &str, options: &Options) -> Fit {
    let result = attempt(data, model, options).unwrap();
    let circumstances = Circumstances {
        metric: options.metric,
        max_theta_deg: options.filters.max_theta_deg,
        options: OptionRecord::default(),
        times: Times::default(),
        fitted: true,
    };
    let report = Report::new(data, &result, &circumstances);
    let text = table(&report);
    let spoken = text.split(|c: char| !c.is_ascii_alphabetic()).find(|word| matches!(*word, "NaN" | "inf"));
    assert!(spoken.is_none(), "{text}");
    for row in result.table.rows() {
        assert!(row.value.is_finite(), "{text}");
    }
    if result.unusable.is_none() {
        let errors = result.errors.all;
        assert!([errors.l2, errors.log, errors.cbrt].iter().all(|e| e.is_finite()), "{text}");
    }
    result
}

fn usable(data: &Measurement, model: &str, options: &Options) -> Fit {
    let result = fitted(data, model, options);
    assert!(result.unusable.is_none(), "{:?} {:?}", result.unusable, result.termination);
    result
}

/// A parameter's value, by its full name; of the first channel where it has none.
fn value(fit: &Fit, name: &str) -> f64 {
    let of_channel = format!("{name}.");
    let is_meant = |index: &usize| {
        let full = fit.table.name(*index);
        full == name || full.starts_with(&of_channel)
    };
    let index = (0..fit.table.rows().len()).find(is_meant);
    fit.table.rows()[index.unwrap_or_else(|| panic!("no {name}"))].value
}

fn assert_found(fit: &Fit, expected: &[(&str, f64)]) {
    for (name, wanted) in expected {
        let found = value(fit, name);
        assert!((found / wanted - 1.0).abs() < 1e-6, "{name}: {found} for {wanted}");
    }
}

fn warned(fit: &Fit, kind: &str) -> bool {
    fit.warnings.iter().any(|warning| warning.kind().name() == kind)
}

#[test]
fn nearly_a_mirror() {
    let truth = [("lambert.kd", 0.1), ("cook-torrance.f0", 0.9), ("cook-torrance.m", 1e-3)];
    let data = synthetic(ONE_LOBE, &["r", "g", "b"], &truth, grid());
    for metric in [Metric::L2, Metric::Cbrt, Metric::Log] {
        let result = usable(&data, ONE_LOBE, &Options::default().with_metric(metric));
        assert_found(
            &result,
            &[("cook-torrance.m", 1e-3), ("lambert.kd.g", 0.1), ("cook-torrance.f0.g", 0.9)],
        );
    }
}

#[test]
fn nearly_diffuse() {
    let truth = [("lambert.kd", 0.4), ("cook-torrance.f0", 0.3), ("cook-torrance.m", 0.95)];
    assert_found(
        &usable(&synthetic(ONE_LOBE, &["f"], &truth, scattered(2000)), ONE_LOBE, &Options::default()),
        &truth,
    );
    let truth = [("oren-nayar.albedo", 0.6), ("oren-nayar.sigma", 0.5)];
    let model = "oren-nayar";
    assert_found(
        &usable(&synthetic(model, &["f"], &truth, scattered(2000)), model, &Options::default()),
        &truth,
    );
}

/// A millionth of the usual, and as small and as large as double precision holds comfortably.
#[test]
fn values_of_any_size() {
    let model = "lambert + ward";
    for scale in [1e-6, 1e-30] {
        let truth = [("lambert.kd", 0.4 * scale), ("ward.ks", 0.2 * scale), ("ward.m", 0.2)];
        let data = synthetic(model, &["f"], &truth, scattered(2000));
        for metric in [Metric::L2, Metric::Cbrt, Metric::Log] {
            let result = usable(&data, model, &Options::default().with_metric(metric));
            assert_found(&result, &truth);
        }
    }
    let truth = [("lambert.kd", 0.4), ("ward.ks", 0.2), ("ward.m", 0.2)];
    let mut data = synthetic(model, &["f"], &truth, scattered(2000));
    data.values[0].iter_mut().for_each(|f| *f *= 1e30);
    let wide = |name| (name, Setting::Bounds(0.0, 1e32));
    let options = Options::default().with_settings(settings(&[wide("kd"), wide("ks")]));
    assert_found(
        &usable(&data, model, &options),
        &[("lambert.kd", 0.4e30), ("ward.ks", 0.2e30), ("ward.m", 0.2)],
    );
    // Within the usual bounds nothing reflects so much: the fit says at which bound it stopped.
    let held = fitted(&data, model, &Options::default());
    assert!(held.unusable.is_some() || warned(&held, "at-bound"), "{:?}", held.warnings);
}

/// A value a billion billion times the others spoils a fit, which a loss mends.
#[test]
fn one_absurd_value() {
    let truth = [("lambert.kd", 0.4), ("cook-torrance.f0", 0.1), ("cook-torrance.m", 0.2)];
    let mut data = synthetic(ONE_LOBE, &["f"], &truth, scattered(2000));
    data.values[0][7] = 1e30;
    fitted(&data, ONE_LOBE, &Options::default());
    let options = Options::default().with_loss(brdfit::fit::LossKind::Cauchy);
    let robust = usable(&data, ONE_LOBE, &options);
    assert!((value(&robust, "cook-torrance.m") - 0.2).abs() < 1e-3, "{}", value(&robust, "cook-torrance.m"));
}

/// Values cut off where a detector saturates: the lobe seems wider, and the fit says why.
#[test]
fn saturated() {
    let truth = [("lambert.kd", 0.2), ("cook-torrance.f0", 0.5), ("cook-torrance.m", 0.1)];
    let data = synthetic(ONE_LOBE, &["f"], &truth, scattered(2000));
    assert!(!warned(&usable(&data, ONE_LOBE, &Options::default()), "saturated"));
    let clipped = |level: f64| {
        let mut data = data.clone();
        data.values[0].iter_mut().for_each(|f| *f = f.min(level));
        data
    };
    let below_the_peak = clipped(1.0);
    assert!(warned(&fitted(&below_the_peak, ONE_LOBE, &Options::default()), "saturated"));

    // Three values are enough, and a loss that takes them for outliers finds the peak.
    let mut sorted = data.values[0].clone();
    sorted.sort_by(|a, b| b.total_cmp(a));
    assert!(!warned(&fitted(&clipped(sorted[1]), ONE_LOBE, &Options::default()), "saturated"));
    let mut three = clipped(sorted[2]);
    assert!(warned(&fitted(&three, ONE_LOBE, &Options::default()), "saturated"));
    let robust = Options::default().with_loss(brdfit::fit::LossKind::Cauchy);
    for data in [&three, &clipped(sorted[40])] {
        let plain = value(&fitted(data, ONE_LOBE, &Options::default()), "cook-torrance.m");
        let found = value(&fitted(data, ONE_LOBE, &robust), "cook-torrance.m");
        assert!(
            (found - 0.1).abs() < 0.1 * (plain - 0.1).abs() && (found - 0.1).abs() < 1e-4,
            "{found}, {plain}"
        );
    }

    // Values rounded to few digits are shared everywhere, and no value of them is cut off.
    three.values[0] = data.values[0].iter().map(|f| (f * 10.0).round() / 10.0).collect();
    assert!(!warned(&fitted(&three, ONE_LOBE, &Options::default()), "saturated"));
}

/// One direction read at every azimuth, and directions that differ by exchange or mirroring, are read alike, and nothing is cut off.
#[test]
fn repeated_directions_are_not_saturated() {
    let mut angles: Vec<[f64; 4]> = (0..12).map(|k| [0.0, 0.0, 0.0, 30.0 * f64::from(k)]).collect();
    for k in 1..200 {
        let (theta_i, theta_o) = (f64::from(k % 7) * 10.0, f64::from(k / 7) * 2.5);
        angles.push([theta_i, 0.0, theta_o, 180.0]);
        angles.push([theta_o, 0.0, theta_i, 180.0]);
        angles.push([theta_i, 90.0, theta_o, 270.0]);
    }
    let pairs = angles.iter().map(|[ti, pi, to, po]| Pair {
        wi: direction(ti.to_radians(), pi.to_radians()),
        wo: direction(to.to_radians(), po.to_radians()),
    });
    let truth = [("lambert.kd", 0.3), ("cook-torrance.f0", 0.04), ("cook-torrance.m", 0.3)];
    let data = synthetic(ONE_LOBE, &["f"], &truth, Directions::Scattered(pairs.collect()));
    assert!(!warned(&usable(&data, ONE_LOBE, &Options::default()), "saturated"));
}

#[test]
fn too_few_samples() {
    let one = |model| synthetic(model, &["f"], &[], scattered(1));
    let result = fitted(&one("lambert"), ONE_LOBE, &Options::default());
    assert!(matches!(result.unusable, Some(Unusable::TooFewValues { .. })), "{:?}", result.unusable);
    // One value and one parameter leave no degree of freedom: the model fits whatever the value is.
    let result = fitted(&one("lambert"), "lambert", &Options::default());
    assert!(matches!(result.unusable, Some(Unusable::TooFewValues { free: 1 })), "{:?}", result.unusable);
    assert!((value(&result, "lambert.kd") - 0.2).abs() < 1e-12);
    let two = synthetic("lambert", &["f"], &[], scattered(2));
    usable(&two, "lambert", &Options::default());
    let none = Measurement::new(scattered(0), [("f", Vec::new())]).unwrap();
    assert!(matches!(attempt(&none, ONE_LOBE, &Options::default()), Err(Error::NoSamples { .. })));
}

#[test]
fn one_angle_of_incidence() {
    let wi = direction(30_f64.to_radians(), 0.0);
    let pairs = scattered_directions(1500, 80.0, 5).into_iter().map(|pair| Pair { wi, wo: pair.wo });
    let truth = [("lambert.kd", 0.3), ("cook-torrance.f0", 0.2), ("cook-torrance.m", 0.25)];
    let data = synthetic(ONE_LOBE, &["f"], &truth, Directions::Scattered(pairs.collect()));
    assert_found(&usable(&data, ONE_LOBE, &Options::default()), &truth);
}

/// Beyond 80 degrees nothing counts unless it is asked for.
#[test]
fn all_at_grazing() {
    let pair = |pair: &Pair| {
        let steep = |v: glam::DVec3| {
            let theta = 85.0 + 4.9 * (v.z.acos() / 80_f64.to_radians());
            direction(theta.to_radians(), v.y.atan2(v.x))
        };
        Pair { wi: steep(pair.wi), wo: steep(pair.wo) }
    };
    let pairs = scattered_directions(1500, 80.0, 6).iter().map(pair).collect();
    let truth = [("lambert.kd", 0.3), ("cook-torrance.f0", 0.2), ("cook-torrance.m", 0.25)];
    let data = synthetic(ONE_LOBE, &["f"], &truth, Directions::Scattered(pairs));
    let why = attempt(&data, ONE_LOBE, &Options::default()).unwrap_err().to_string();
    assert!(why.contains("1500 beyond-max-theta"), "{why}");
    let filters = Filters::default().with_max_theta_deg(90.0);
    assert_found(&usable(&data, ONE_LOBE, &Options::default().with_filters(filters)), &truth);
}

#[test]
fn all_equal_and_a_dark_channel() {
    let data = synthetic("lambert", &["f"], &[("lambert.kd", 0.3)], scattered(1000));
    let result = usable(&data, "lambert + ward", &Options::default());
    assert!((value(&result, "lambert.kd") - 0.3).abs() < 1e-6, "{}", value(&result, "lambert.kd"));
    assert!(value(&result, "ward.ks").abs() < 1e-9 && !warned(&result, "saturated"));

    let truth = [("lambert.kd", 0.4), ("cook-torrance.f0", 0.1), ("cook-torrance.m", 0.2)];
    let mut data = synthetic(ONE_LOBE, &["r", "g", "b"], &truth, scattered(2000));
    data.values[2].fill(0.0);
    let result = usable(&data, "lambert + ward", &Options::default());
    assert!(value(&result, "lambert.kd.b").abs() < 1e-9 && value(&result, "ward.ks.b").abs() < 1e-9);
    data.values.fill(vec![0.0; 2000]);
    assert!(value(&usable(&data, "lambert + ward", &Options::default()), "lambert.kd.r").abs() < 1e-9);
}

#[test]
fn duplicated_rows() {
    let truth = [("lambert.kd", 0.4), ("cook-torrance.f0", 0.1), ("cook-torrance.m", 0.2)];
    let pairs = scattered_directions(700, 80.0, 8);
    let thrice = [pairs.clone(), pairs.clone(), pairs].concat();
    let data = synthetic(ONE_LOBE, &["f"], &truth, Directions::Scattered(thrice));
    assert_found(&usable(&data, ONE_LOBE, &Options::default()), &truth);
}

#[test]
fn ten_million_samples() {
    let truth = [("lambert.kd", 0.4), ("cook-torrance.f0", 0.1), ("cook-torrance.m", 0.2)];
    let data = synthetic(ONE_LOBE, &["f"], &truth, scattered(10_000_000));
    let result = usable(&data, ONE_LOBE, &Options::default());
    assert_eq!(result.used, 10_000_000);
    assert_found(&result, &truth);
}
