//! Figures as the library gives them: their numbers against formulas, and what their SVG must not contain.

use brdfit::figure::{Body, Curves, Drawing, FigureData, KINDS, Subject, Wanted, Width};
use brdfit::fit::Metric;
use brdfit::measurement::formats::{ReadOptions, read as read_file};
use brdfit::report::{Parameter, Recorded};
use brdfit::{Directions, Expression, Fit, Measurement, Options};
use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::path::PathBuf;
use std::sync::Arc;

/// Scans in the plane of incidence at these angles of incidence, and across it, in degrees.
fn scans(angles: &[f64]) -> Directions {
    let viewing = || (-8..=8).map(|o| 10.0 * f64::from(o));
    let both = |i: f64| viewing().flat_map(move |o| [[i, 0.0, o, 0.0], [i, 0.0, o, 90.0]]);
    Directions::from_degrees(angles.iter().flat_map(|i| both(*i))).unwrap()
}

/// A measurement of a model at these values, every other value too large by a fraction `noise` and the others too small.
fn measured(
    model: &str,
    values: &[(&str, f64)],
    channels: &[&str],
    angles: &[f64],
    noise: f64,
) -> Measurement {
    let brdf = brdfit::Brdf::new(&model.parse().unwrap(), channels, values).unwrap();
    let directions = scans(angles);
    let off = |k: usize| if k.is_multiple_of(2) { 1.0 + noise } else { 1.0 - noise };
    let rows = brdf.values(&directions);
    let rows = channels.iter().zip(rows).map(|(name, row)| {
        (*name, row.into_iter().enumerate().map(|(k, f)| f * off(k)).collect::<Vec<f64>>())
    });
    Measurement::new(directions, rows.collect::<Vec<_>>()).unwrap()
}

/// A fit of a model, as a figure takes it.
fn subject(measurement: &Measurement, model: &str, metric: Metric) -> Subject {
    let expression: Expression = model.parse().unwrap();
    let (_, report) = Fit::of(&expression, measurement).metric(metric).run_with_report().unwrap();
    Subject {
        path: PathBuf::from("fit.json"),
        recorded: Some(Recorded::of(report).unwrap()),
        measurement: Some(Arc::new(measurement.clone())),
        options: Options::default().with_metric(metric),
    }
}

fn alone(measurement: &Measurement) -> Subject {
    Subject {
        path: PathBuf::from("measured.csv"),
        recorded: None,
        measurement: Some(Arc::new(measurement.clone())),
        options: Options::default(),
    }
}

fn figure_as(kind: &str, subjects: &[Subject], wanted: &Wanted) -> FigureData {
    let kind = KINDS.iter().find(|known| known.name == kind).unwrap();
    let figure = (kind.compute)(subjects, wanted).unwrap();
    well_formed(&figure);
    figure
}

fn figure(kind: &str, subjects: &[Subject]) -> FigureData {
    figure_as(kind, subjects, &Wanted::default())
}

fn curves(figure: &FigureData, panel: usize) -> &Curves {
    match &figure.panels[panel].body {
        Body::Curves(curves) => curves,
        _ => panic!("panel {panel} has no curves"),
    }
}

/// What every figure keeps: the same bytes each time, ids of its own, nothing from elsewhere, balanced elements, and numbers that are
/// numbers.
fn well_formed(figure: &FigureData) {
    for width in [Width::One, Width::Two] {
        let drawing = Drawing { width, ..Drawing::default() };
        let svg = figure.svg(drawing).unwrap();
        assert_eq!(svg, figure.svg(drawing).unwrap());
        let ids: Vec<&str> = svg
            .match_indices(" id=\"")
            .map(|(at, m)| svg[at + m.len()..].split('"').next().unwrap())
            .collect();
        assert_eq!(ids.iter().collect::<BTreeSet<_>>().len(), ids.len(), "{ids:?}");
        for reference in
            svg.match_indices("url(#").map(|(at, m)| svg[at + m.len()..].split(')').next().unwrap())
        {
            assert!(ids.contains(&reference), "{reference}");
        }
        let links: Vec<&str> =
            svg.match_indices("href=\"").map(|(at, m)| &svg[at + m.len()..at + m.len() + 22]).collect();
        assert!(links.iter().all(|link| *link == "data:image/png;base64,"), "{links:?}");
        // The content of an image may contain any word.
        let outside = |(k, part)| if k == 0 { part } else { str::split_once(part, '"').unwrap().1 };
        let words: String = svg.split("base64,").enumerate().map(outside).collect();
        assert!(
            !words.contains("NaN")
                && !words.contains("inf ")
                && !words.contains("<script")
                && !words.contains("url(http")
        );
        assert_eq!(svg.matches("<text").count(), svg.matches("</text>").count());
        assert_eq!(svg.matches("<g ").count(), svg.matches("</g>").count());
        assert_eq!(svg.matches("<tspan").count(), svg.matches("</tspan>").count());
        let millimetres = if width == Width::One { "85mm" } else { "175mm" };
        assert!(svg.contains(&format!("width=\"{millimetres}\"")));
    }
    let csv = String::from_utf8(figure.csv().unwrap()).unwrap();
    let columns = csv.lines().next().unwrap().split(',').count();
    assert!(csv.lines().count() > 1 && columns >= 5, "{csv}");
    assert!(!csv.contains("NaN"), "{csv}");
}

fn close(found: f64, right: f64, relative: f64) {
    assert!((found - right).abs() <= relative * right.abs().max(1e-12), "{found}, not {right}");
}

/// Half the 95 % interval of a parameter, in standard errors.
fn half_interval(parameter: &Parameter) -> f64 {
    let [low, high] = parameter.ci95.unwrap();
    (high - low) / 2.0 / parameter.std_error.unwrap()
}

/// Lambert's f is kd/pi at every angle, and so is its band: the 95 % interval of kd, over pi.
#[test]
fn a_lobe_is_the_formula_with_the_band_of_its_parameter() {
    let measurement = measured("lambert", &[("kd", 0.4)], &["f"], &[10.0, 30.0, 50.0, 70.0], 0.02);
    let subject = subject(&measurement, "lambert", Metric::L2);
    let kd = subject.recorded.as_ref().unwrap().report.parameters[0].clone();
    // Few groups decide it, so that its interval is wider than that of a known error.
    let [least, most] = kd.ci95.unwrap();
    assert!(most - least > 2.0 * 2.0 * kd.std_error.unwrap(), "{kd:?}");
    let figure = figure("lobe", &[subject]);
    let curves = curves(&figure, 0);
    let fits: Vec<_> = curves.series.iter().filter(|series| series.band.is_some()).collect();
    assert_eq!(fits.len(), 4);
    assert_eq!(fits[1].name.to_string(), "theta_i = 30 deg, fit");
    for fit in &fits {
        for ([theta_o, f], [low, high]) in fit.points.iter().zip(fit.band.as_ref().unwrap()) {
            assert!(theta_o.abs() <= 89.0);
            close(*f, kd.value / PI, 1e-12);
            close(high - f, (most - least) / 2.0 / PI, 1e-5);
            close(f - low, high - f, 1e-6);
        }
    }
    // Scans of seventeen angles, each once: those across the plane are not in it, but for the one along the normal.
    let samples: Vec<_> = curves.series.iter().filter(|series| series.band.is_none()).collect();
    assert!(samples.iter().all(|series| series.points.len() == 17), "{samples:?}");
    for [_, f] in &samples[0].points {
        assert!((f / (0.4 / PI) - 1.0).abs() < 0.021);
    }
}

/// The band of Cook-Torrance's f follows from Schlick's reflectance, which is linear in f0: its half width is sqrt(g C g) times
/// the widest interval in standard errors, with the gradient by differences of a model that knows nothing of reports.
#[test]
fn the_band_takes_correlations_into_account() {
    let model = "lambert + cook-torrance";
    let values = [("kd", 0.2), ("m", 0.3), ("f0", 0.08)];
    let angles: Vec<f64> = (1..=14).map(|k| 5.0 * f64::from(k)).collect();
    let measurement = measured(model, &values, &["f"], &angles, 0.03);
    let subject = subject(&measurement, model, Metric::Cbrt);
    let report = subject.recorded.as_ref().unwrap().report.clone();
    let wanted = Wanted { theta_i_deg: vec![40.0], ..Wanted::default() };
    let figure = figure_as("lobe", &[subject], &wanted);
    let fit = curves(&figure, 0).series.iter().find(|series| series.band.is_some()).unwrap();

    let correlation = report.correlation.unwrap();
    let parameter = |name: &str| {
        report
            .parameters
            .iter()
            .find(|p| format!("{}.{}", p.lobe, p.name) == name)
            .or_else(|| report.parameters.iter().find(|p| format!("{}.{}.f", p.lobe, p.name) == name))
    };
    let known: Vec<_> = correlation.parameters.iter().map(|name| parameter(name).unwrap()).collect();
    assert_eq!(known.len(), 3);
    let at = |values: &[f64], theta_o: f64| {
        let named: Vec<(&str, f64)> =
            known.iter().map(|p| p.name.as_ref()).zip(values.iter().copied()).collect();
        let brdf = brdfit::Brdf::new(&model.parse().unwrap(), &["f"], &named).unwrap();
        let pair = Directions::from_degrees([[40.0, 0.0, theta_o, 180.0]]).unwrap();
        brdf.values(&pair)[0][0]
    };
    let values: Vec<f64> = known.iter().map(|p| p.value).collect();
    let widest = known.iter().map(|p| half_interval(p)).fold(1.96, f64::max);
    for ([theta_o, f], [_, high]) in fit.points.iter().zip(fit.band.as_ref().unwrap()).step_by(37) {
        let gradient: Vec<f64> = (0..3)
            .map(|k| {
                let (mut above, mut below) = (values.clone(), values.clone());
                let step = 1e-5 * values[k];
                (above[k], below[k]) = (values[k] + step, values[k] - step);
                (at(&above, *theta_o) - at(&below, *theta_o)) / (2.0 * step) * known[k].std_error.unwrap()
            })
            .collect();
        let variance: f64 = (0..3)
            .flat_map(|a| (0..3).map(move |b| (a, b)))
            .map(|(a, b)| gradient[a] * gradient[b] * correlation.matrix[a][b].unwrap())
            .sum();
        close(*f, at(&values, *theta_o), 1e-12);
        close(high - f, widest * variance.sqrt(), 1e-3);
    }
}

/// In l2 the residual of kd 0.5 against kd 0.4 is 0.1/pi cos(theta_i).
#[test]
fn residuals_are_those_of_the_metric() {
    let angles = [0.0, 20.0, 40.0, 60.0];
    let measurement = measured("lambert", &[("kd", 0.4)], &["f"], &angles, 0.0);
    let mut subject = subject(&measurement, "lambert", Metric::L2);
    let mut report = subject.recorded.unwrap().report;
    report.parameters[0].value = 0.5;
    subject.recorded = Some(Recorded::of(report).unwrap());
    let figure = figure("residuals", &[subject]);
    assert_eq!(figure.panels.len(), 4);
    let over_theta_i = curves(&figure, 0);
    assert_eq!((over_theta_i.x.quantity.to_string().as_str(), over_theta_i.y.unit), ("theta_i", "1/sr"));
    let medians = over_theta_i.series.iter().find(|series| series.band.is_some()).unwrap();
    assert_eq!(medians.points.len(), angles.len());
    for ([theta_i, median], expected) in medians.points.iter().zip(angles) {
        close(*theta_i, expected, 1e-9);
        close(*median, 0.1 / PI * expected.to_radians().cos(), 1e-9);
    }
    // Across the plane, cos(theta_h) and cos(theta_d) follow from the two directions.
    let dots = |panel: usize| curves(&figure, panel).series[0].points.clone();
    for ((i, o), (h, d)) in dots(0).iter().zip(dots(1)).zip(dots(2).iter().zip(dots(3))) {
        let [i, o, h, d] = [i[0], o[0], h[0], d[0]].map(f64::to_radians);
        // (cos i + cos o) = 2 cos(theta_h) cos(theta_d), whatever the azimuths are.
        close(i.cos() + o.cos(), 2.0 * h.cos() * d.cos(), 1e-9);
    }
}

/// The profile has its least value at the fitted one, and grows on either side.
#[test]
fn a_profile_grows_away_from_the_minimum() {
    let model = "lambert + ward(shape=isotropic)";
    let measurement = measured(
        model,
        &[("kd", 0.2), ("ks", 0.1), ("m", 0.25)],
        &["f"],
        &[10.0, 25.0, 40.0, 55.0, 70.0],
        0.05,
    );
    let subject = subject(&measurement, model, Metric::UnbiasedCbrt);
    let recorded = subject.recorded.clone().unwrap();
    let m = recorded.report.parameters.iter().find(|p| p.name == "m").unwrap().clone();
    let figure = figure("profile", &[subject]);
    assert_eq!(figure.panels.len(), 1);
    let points = &curves(&figure, 0).series[0].points;
    assert_eq!(points.len(), 13);
    close(points[6][0], m.value, 1e-12);
    close(points[6][1], 1.0, 1e-6);
    close(points[12][0], 2.0 * m.value, 1e-12);
    assert!(points[..7].windows(2).all(|pair| pair[0][1] >= pair[1][1]), "{points:?}");
    assert!(points[6..].windows(2).all(|pair| pair[0][1] <= pair[1][1]), "{points:?}");
    // A fit with m fixed there, set up by hand, has the same cost.
    let expression: Expression = model.parse().unwrap();
    let by_hand = Fit::of(&expression, &measurement).fix("m", points[9][0]).unwrap().run().unwrap();
    close(points[9][1] * recorded.report.fit.cost.unwrap(), by_hand.cost, 1e-6);
    let [low, high] = m.ci95.unwrap();
    let marks: Vec<f64> = curves(&figure, 0).marks.iter().map(|mark| mark.x).collect();
    assert_eq!(marks, [m.value, low, high]);
}

/// Schlick: F = f0 + (1 - f0)(1 - cos)^5, with 1 - (1 - cos)^5 standard errors of f0 on either side, times the widest interval in standard errors.
#[test]
fn fresnel_is_schlicks_formula() {
    let model = "lambert + cook-torrance";
    let values = [("kd", 0.2), ("m", 0.3), ("f0", 0.08)];
    let measurement = measured(model, &values, &["f"], &[10.0, 25.0, 40.0, 55.0, 70.0], 0.03);
    let schlick = subject(&measurement, model, Metric::L2);
    let exact = subject(&measurement, "lambert + cook-torrance(f=dielectric)", Metric::L2);
    let widest = schlick
        .recorded
        .as_ref()
        .unwrap()
        .report
        .parameters
        .iter()
        .filter(|p| p.std_error.is_some())
        .map(half_interval)
        .fold(1.96, f64::max);
    let f0 =
        schlick.recorded.as_ref().unwrap().report.parameters.iter().find(|p| p.name == "f0").unwrap().clone();
    let f0_exact =
        exact.recorded.as_ref().unwrap().report.parameters.iter().find(|p| p.name == "f0").unwrap().value;
    let figure = figure("fresnel", &[schlick, exact]);
    let series = &curves(&figure, 0).series;
    assert_eq!(series.len(), 2);
    for ([angle, f], [_, high]) in series[0].points.iter().zip(series[0].band.as_ref().unwrap()) {
        let s = (1.0 - angle.to_radians().cos()).powi(5);
        close(*f, f0.value + (1.0 - f0.value) * s, 1e-9);
        close(high - f, (widest * f0.std_error.unwrap() * (1.0 - s)).min(1.0 - f), 1e-4);
    }
    // Exact: at Brewster's angle only half of the perpendicular part is left.
    let eta = (1.0 + f0_exact.sqrt()) / (1.0 - f0_exact.sqrt());
    let brewster = eta.atan();
    let perpendicular = ((1.0 - eta * eta) / (1.0 + eta * eta)).powi(2);
    let nearest = series[1]
        .points
        .iter()
        .min_by(|[a, _], [b, _]| {
            let off = |angle: &f64| (angle - brewster.to_degrees()).abs();
            off(a).total_cmp(&off(b))
        })
        .unwrap();
    close(nearest[1], 0.5 * perpendicular, 0.02);
}

#[test]
fn a_front_shows_errors_and_numbers_of_parameters() {
    let measurement = measured(
        "lambert + ward(shape=isotropic)",
        &[("kd", 0.2), ("ks", 0.1), ("m", 0.25)],
        &["f"],
        &[10.0, 30.0, 50.0, 70.0],
        0.05,
    );
    let models = ["lambert", "lambert + ward(shape=isotropic)", "oren-nayar"];
    let subjects: Vec<Subject> =
        models.iter().map(|model| subject(&measurement, model, Metric::L2)).collect();
    let figure = figure("front", &subjects);
    let series = &curves(&figure, 0).series;
    let of = |model: &str| {
        series.iter().find(|series| series.name.to_string().starts_with(model)).unwrap().points[0]
    };
    let error = |k: usize| subjects[k].recorded.as_ref().unwrap().report.errors.l2.unwrap();
    assert_eq!(of("lambert"), [1.0, error(0)]);
    assert_eq!(of("lambert + ward"), [3.0, error(1)]);
    assert_eq!(of("oren-nayar"), [2.0, error(2)]);
    let front: Vec<f64> = series[0].points.iter().map(|[x, _]| *x).collect();
    assert!(front.starts_with(&[1.0]) && front.ends_with(&[3.0]));
    assert!(series[0].points.windows(2).all(|pair| pair[1][1] < pair[0][1]));
}

/// The cost falls from one iteration to the next, to the one in the report.
#[test]
fn a_convergence_ends_at_the_cost_of_the_report() {
    let model = "lambert + cook-torrance";
    let measurement = measured(
        model,
        &[("kd", 0.2), ("m", 0.3), ("f0", 0.08)],
        &["f"],
        &[10.0, 25.0, 40.0, 55.0, 70.0],
        0.03,
    );
    for metric in [Metric::UnbiasedCbrt, Metric::L2] {
        let subject = subject(&measurement, model, metric);
        let cost = subject.recorded.as_ref().unwrap().report.fit.cost.unwrap();
        let figure = figure("convergence", &[subject]);
        let series = &curves(&figure, 0).series;
        let points = &series[0].points;
        assert!(points.len() > 2, "{points:?}");
        assert!(points.windows(2).all(|pair| pair[1][1] <= pair[0][1] * (1.0 + 1e-9)), "{points:?}");
        close(points.last().unwrap()[1], cost, 1e-8);
        assert!(
            points
                .iter()
                .enumerate()
                .all(|(k, [iteration, _])| *iteration == f64::from(u32::try_from(k).unwrap()))
        );
    }
}

/// A matte map is kd/pi wherever there are samples, with kd 0.5 a quarter above kd 0.4.
#[test]
fn a_map_is_the_mean_of_its_samples() {
    let measurement = measured("lambert", &[("kd", 0.4)], &["f"], &[10.0, 30.0, 50.0, 70.0], 0.0);
    let mut subject = subject(&measurement, "lambert", Metric::L2);
    let mut report = subject.recorded.unwrap().report;
    report.parameters[0].value = 0.5;
    subject.recorded = Some(Recorded::of(report).unwrap());
    let figure = figure("map", &[subject]);
    let cells = |panel: usize| match &figure.panels[panel].body {
        Body::Map(map) => map.cells.clone(),
        _ => panic!("a map"),
    };
    let filled = cells(0).iter().flatten().count();
    assert!(filled > 20 && filled < cells(0).len(), "{filled}");
    cells(0).iter().flatten().for_each(|f| close(*f, 0.4 / PI, 1e-12));
    cells(1).iter().flatten().for_each(|f| close(*f, 0.5 / PI, 1e-12));
    cells(2).iter().flatten().for_each(|e| close(*e, 0.25, 1e-9));
    assert!(figure.png().unwrap().starts_with(b"\x89PNG"));
}

/// Half the albedo is half the radiance, pixel by pixel.
#[test]
fn a_sphere_is_linear_in_the_albedo() {
    let angles: Vec<f64> = (0..9).map(|k| 10.0 * f64::from(k)).collect();
    let measurement = measured("lambert", &[("kd", 0.4)], &["f"], &angles, 0.0);
    let mut subject = subject(&measurement, "lambert", Metric::L2);
    let mut report = subject.recorded.unwrap().report;
    report.parameters[0].value = 0.2;
    subject.recorded = Some(Recorded::of(report).unwrap());
    let figure = figure("sphere", &[subject]);
    let pixels = |panel: usize| match &figure.panels[panel].body {
        Body::Picture(picture) => picture.image.pixels.clone(),
        _ => panic!("a picture"),
    };
    let bright = pixels(0).iter().filter(|[r, ..]| *r > 0.0).count();
    assert!(bright > 3000, "{bright}");
    for ((measured, fit), difference) in pixels(0).iter().zip(pixels(1)).zip(pixels(2)) {
        close(fit[0], 0.5 * measured[0], 1e-6);
        close(difference[0], 0.5 * measured[0], 1e-6);
    }
}

/// The numbers of a figure, without its title and captions.
fn numbers(figure: &FigureData) -> Vec<String> {
    let csv = String::from_utf8(figure.csv().unwrap()).unwrap();
    // Panels are called after the models only where there are several.
    csv.lines().skip(1).map(|line| line.split_once(',').unwrap().1.to_owned()).collect()
}

/// Several models have a row of panels each, with the numbers that they have alone.
#[test]
fn several_models_have_rows_of_their_own() {
    let measurement = measured("lambert", &[("kd", 0.4)], &["f"], &[10.0, 30.0, 50.0, 70.0], 0.02);
    let models = ["lambert", "lambert + ward(shape=isotropic)", "oren-nayar"];
    let fits: Vec<Subject> = models.iter().map(|model| subject(&measurement, model, Metric::L2)).collect();
    for kind in ["map", "sphere"] {
        let together = figure(kind, &fits);
        let titles: Vec<String> = together.panels.iter().map(|panel| panel.title.to_string()).collect();
        assert_eq!(titles.len(), 9);
        assert_eq!(titles[3], "measured");
        assert!(titles[1] == "fit A" && titles[8].ends_with(" C"), "{titles:?}");
        let alone: Vec<String> =
            fits.iter().flat_map(|fit| numbers(&figure(kind, std::slice::from_ref(fit)))).collect();
        assert_eq!(numbers(&together), alone, "{kind}");
        assert!(
            models
                .iter()
                .all(|model| together.caption.to_string().contains(&model.replace("(shape=isotropic)", "")))
        );
    }
}

/// What was not measured is not drawn: a value that is NaN leaves the figures of the samples without it.
#[test]
fn a_missing_value_is_as_if_its_sample_were_not_there() {
    let whole = measured("lambert", &[("kd", 0.4)], &["f"], &[10.0, 30.0, 50.0, 70.0], 0.05);
    let is_missing = |k: usize| k % 7 == 3;
    let row: Vec<f64> =
        whole.values[0].iter().enumerate().map(|(k, f)| if is_missing(k) { f64::NAN } else { *f }).collect();
    let kept: Vec<usize> = (0..row.len()).filter(|k| !is_missing(*k)).collect();
    let with_holes = Measurement::new(whole.directions.clone(), [("f", row.clone())]).unwrap();
    let without: Vec<f64> = kept.iter().map(|k| row[*k]).collect();
    let without = Measurement::new(whole.directions.select(&kept), [("f", without)]).unwrap();
    for kind in ["lobe", "map", "residuals", "sphere"] {
        let of = |measurement: &Measurement| {
            numbers(&figure(kind, &[subject(measurement, "lambert", Metric::L2)]))
        };
        let (holes, without) = (of(&with_holes), of(&without));
        assert!(!holes.is_empty() && holes.iter().all(|line| !line.contains("NaN")), "{kind}");
        // The models' values differ in their last digits, as sums in another order do.
        let value =
            |line: &String| -> Vec<f64> { line.split(',').filter_map(|cell| cell.parse().ok()).collect() };
        assert_eq!(holes.len(), without.len(), "{kind}");
        for (a, b) in holes.iter().zip(&without) {
            for (a, b) in value(a).into_iter().zip(value(b)) {
                assert!((a - b).abs() <= 1e-9 * a.abs().max(1e-3), "{kind}: {a} and {b}");
            }
        }
    }
}

/// Gaps, a single angle of incidence, and one without a sample in the plane.
#[test]
fn a_measurement_may_lack_much() {
    let single = measured(
        "lambert + ward(shape=isotropic)",
        &[("kd", 0.2), ("ks", 0.1), ("m", 0.2)],
        &["f"],
        &[45.0],
        0.0,
    );
    let lobe = figure("lobe", &[alone(&single)]);
    assert_eq!(curves(&lobe, 0).series.len(), 1);
    figure("map", &[alone(&single)]);
    let fitted = subject(&single, "lambert + ward(shape=isotropic)", Metric::UnbiasedCbrt);
    for kind in ["lobe", "residuals", "map"] {
        figure(kind, std::slice::from_ref(&fitted));
    }

    let across = Directions::from_degrees((1..9).map(|k| [40.0, 0.0, 10.0 * f64::from(k), 90.0])).unwrap();
    let across = Measurement::new(across, [("f", vec![0.1; 8])]).unwrap();
    let lobe = figure("lobe", &[alone(&across)]);
    assert!(lobe.caption.to_string().contains("no samples within 2 degrees"), "{}", lobe.caption);

    // Values of 0 and below have no place on a logarithmic scale.
    let dark = Directions::from_degrees((1..9).map(|k| [40.0, 0.0, 10.0 * f64::from(k), 180.0])).unwrap();
    let dark = Measurement::new(dark, [("f", vec![0.0, -0.1, 0.0, 5.0, 0.0, 0.0, 1e-300, 0.0])]).unwrap();
    figure("lobe", &[alone(&dark)]);
    figure("map", &[alone(&dark)]);
}

/// Of 31 wavelengths three are shown, and the caption says which.
#[test]
fn many_wavelengths_are_represented_by_three() {
    let names: Vec<String> = (0..31).map(|k| (400 + 10 * k).to_string()).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let measurement = measured("lambert", &[("kd", 0.4)], &names, &[10.0, 40.0, 70.0], 0.01);
    let fitted = subject(&measurement, "lambert", Metric::UnbiasedCbrt);
    let lobe = figure("lobe", std::slice::from_ref(&fitted));
    let titles: Vec<String> = lobe.panels.iter().map(|panel| panel.title.to_string()).collect();
    assert_eq!(titles, ["450 nm", "550 nm", "650 nm"]);
    assert!(
        lobe.caption.to_string().contains("Shown: 3 of 31 channels (450 nm, 550 nm, 650 nm)"),
        "{}",
        lobe.caption
    );
    let named = Wanted { channels: vec!["700".to_owned()], ..Wanted::default() };
    assert_eq!(figure_as("lobe", &[fitted], &named).panels[0].title.to_string(), "700 nm");
}

/// The curve of an anisotropic model is that of the azimuth of the light that was measured, and only samples of that azimuth stand
/// beside it.
#[test]
fn an_anisotropic_model_is_shown_at_the_measured_azimuth() {
    let model = "ward(shape=anisotropic)";
    let values = [("ks", 0.3), ("mx", 0.1), ("my", 0.4)];
    let brdf = brdfit::Brdf::new(&model.parse().unwrap(), &["f"], &values).unwrap();
    // More scans with light along y than along x.
    let scan = |phi: f64, theta: f64| (-8..=8).map(move |o| [theta, phi, 10.0 * f64::from(o), phi]);
    let angles = [(90.0, 20.0), (90.0, 40.0), (90.0, 60.0), (0.0, 40.0), (45.0, 40.0)];
    let directions =
        Directions::from_degrees(angles.iter().flat_map(|(phi, theta)| scan(*phi, *theta))).unwrap();
    let row = brdf.values(&directions).concat();
    let measurement = Measurement::new(directions, [("f", row)]).unwrap();
    let fitted = subject(&measurement, model, Metric::UnbiasedCbrt);
    let wanted = Wanted { theta_i_deg: vec![40.0], ..Wanted::default() };
    let lobe = figure_as("lobe", &[fitted], &wanted);
    assert!(lobe.caption.to_string().contains("phi_i = 90 deg"), "{}", lobe.caption);
    let series = &curves(&lobe, 0).series;
    let (samples, fit) =
        (&series[0].points, &series.iter().find(|s| s.name.to_string().ends_with("fit")).unwrap().points);
    assert_eq!(samples.len(), 17);
    for [theta_o, f] in samples {
        let on_curve = fit.iter().find(|[angle, _]| (angle - theta_o).abs() < 1e-6).unwrap();
        close(on_curve[1], *f, 1e-3);
    }
}

#[test]
fn mistakes_are_errors() {
    let measurement = measured("lambert", &[("kd", 0.4)], &["f"], &[10.0, 40.0], 0.01);
    let fitted = subject(&measurement, "lambert", Metric::L2);
    let message = |kind: &str, subjects: &[Subject]| {
        let kind = KINDS.iter().find(|known| known.name == kind).unwrap();
        (kind.compute)(subjects, &Wanted::default()).unwrap_err().to_string()
    };
    let both = [fitted.clone(), fitted.clone()];
    assert!(message("fresnel", std::slice::from_ref(&fitted)).contains("a Fresnel term"));
    assert!(message("profile", std::slice::from_ref(&fitted)).contains("a shape that was fitted"));
    assert!(message("profile", &both).contains("one report or measurement"));
    let other = measured("lambert", &[("kd", 0.3)], &["f"], &[10.0, 40.0], 0.01);
    for kind in ["map", "sphere"] {
        assert!(message(kind, &[alone(&measurement), alone(&other)]).contains("reports of one"), "{kind}");
    }
    assert!(message("residuals", &[alone(&measurement)]).contains("a report of brdfit"));
    for kind in KINDS {
        assert!((kind.compute)(&[], &Wanted::default()).is_err(), "{}", kind.name);
    }
    // Names from files do not become elements.
    let mut odd = fitted;
    let mut report = odd.recorded.unwrap().report;
    report.data.path = "a<b>&\"c'\u{1}.csv".to_owned();
    odd.recorded = Some(Recorded::of(report).unwrap());
    odd.measurement = None;
    let front = figure("front", &[odd]);
    assert!(front.svg(Drawing::default()).unwrap().contains("a&lt;b&gt;&amp;&quot;c&apos; : error"));
}

/// A table of a shared material, where it exists.
#[test]
fn measured_tables_have_figures() {
    let cornell = crate::common::shared("cornell/garnet_red.brdf");
    let Some(path) = cornell else { return };
    let measurement = read_file(&path, None, &ReadOptions::new()).unwrap();
    for kind in ["lobe", "map", "sphere"] {
        figure(kind, &[alone(&measurement)]);
    }
}
