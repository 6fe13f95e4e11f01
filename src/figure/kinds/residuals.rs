//! Residuals against each angle, in the metric of the fit.

use crate::error::Error;
use crate::figure::data::{Axes, Axis, Body, Colour, Curves, Dash, FigureData, Look, Marker, Panel, Series};
use crate::figure::kind::{Kind, Needs, Several, Subject, Wanted, names};
use crate::figure::refit::{at_most, problem_table};
use crate::figure::text::Text;
use crate::fit::{Metric, ReflectanceProblem};
use crate::geometry::Geometry;
use crate::math::{Real as _, count};
use crate::measurement::{Samples, Weighting};
use nalgebra::DVector;
use rayon::prelude::*;

/// The entry of the registry.
pub const KIND: Kind = Kind {
    name: "residuals",
    summary: "residuals against theta_i, theta_o, theta_h and theta_d, in the metric",
    needs: Needs::Both,
    several: Several::Overlaid,
    raster: false,
    compute,
};

/// Width of the ranges of an angle in which residuals are summed up, degrees.
const RANGE_DEG: f64 = 5.0;
/// Number of those ranges.
const RANGES: usize = 18;
/// The largest number of samples: medians of a few thousand residuals do not change with more.
const MOST_SAMPLES: usize = 100_000;
/// The fewest residuals of a range that has a median.
const FEWEST: usize = 5;
/// The largest number of residuals that are drawn one by one.
const MOST_DOTS: usize = 600;
/// The vertical axis reaches to this fraction of the residuals that are drawn, times [`ROOM`].
const BULK: f64 = 0.97;
/// Room beyond the bulk of the residuals.
const ROOM: f64 = 1.3;
/// Half and two thirds of normal errors: the ends of the band.
const QUANTILES: [f64; 3] = [0.16, 0.5, 0.84];

/// The residuals of a subject.
struct Residuals {
    /// theta_i, theta_o, theta_h and theta_d of each sample, degrees.
    angles: Vec<[f64; 4]>,
    /// Model less measurement by channel and sample; NaN where nothing was measured. Dead channels have none.
    rows: Vec<Vec<f64>>,
    /// The root mean square of the noise in the same unit; `None` if it is not known.
    noise: Option<f64>,
    metric: Metric,
    /// Whether the residuals are in standard deviations of the samples.
    in_sigma: bool,
}

fn compute(subjects: &[Subject], _: &Wanted) -> Result<FigureData, Error> {
    let all: Vec<Residuals> = subjects.par_iter().map(residuals).collect::<Result<_, _>>()?;
    let called = names(subjects);
    let Some(first) = all.first() else { return Err(Error::invalid(KIND.name, "a report", "none")) };
    if let Some(other) =
        all.iter().find(|other| (other.metric, other.in_sigma) != (first.metric, first.in_sigma))
    {
        let found = format!("{} and {}", first.metric.name(), other.metric.name());
        return Err(Error::invalid(KIND.name, "reports in one metric and with one kind of weights", found));
    }
    let several = all.len() > 1;
    let top = all.iter().map(reach).fold(0.0, f64::max);
    let unit = if first.in_sigma { "standard deviations" } else { unit_of(first.metric) };
    let panel = |place: usize, symbol: &str| {
        let series =
            all.par_iter().zip(&called).enumerate().map(|(k, (residuals, name))| {
                series_of(residuals, place, k, if several { name } else { "" })
            });
        let series = series.collect::<Vec<_>>().concat();
        let y = Axis::new("residual", unit).from_to(-top, top);
        let x = Axis::angle(symbol).from_to(0.0, 90.0);
        Panel {
            title: Text::default(),
            body: Body::Curves(Curves { axes: Axes::Cartesian, x, y, series, marks: Vec::new() }),
        }
    };
    let symbols = ["theta_i", "theta_o", "theta_h", "theta_d"];
    let panels = symbols.iter().enumerate().map(|(place, symbol)| panel(place, symbol)).collect();
    Ok(FigureData {
        kind: KIND.name,
        panels,
        caption: caption(subjects, &all, &called),
        side_by_side: [2, 4],
    })
}

fn caption(subjects: &[Subject], all: &[Residuals], called: &[String]) -> Text {
    let metric = all.first().map_or("", |residuals| residuals.metric.name());
    let mut stems: Vec<String> = subjects.iter().map(Subject::stem).collect();
    stems.dedup();
    let of_whom = match called {
        [only] => format!(" of {only}"),
        _ => String::new(),
    };
    let mut text = Text::from(format!(
        "{}: residuals (model less measurement){of_whom} in the metric {metric}, all channels together: median of every {RANGE_DEG} degrees",
        stems.join(", ")
    ));
    text = text.words(", and the band of the middle 68 %");
    let all_used =
        subjects.iter().filter_map(|subject| subject.recorded.as_ref()).map(|r| r.report.data.used).max();
    if let Some(residuals) = all.first().filter(|first| Some(first.angles.len()) < all_used) {
        text = text.words(format!(", on {} of the samples", residuals.angles.len()));
    }
    if all.len() == 1 {
        text = text.words("; dots are single residuals");
    }
    match all {
        [Residuals { noise: Some(_), .. }] => {
            text.words(". Dashed: the size of the noise, either side of 0.")
        }
        [_] => text.words(". No noise is visible in the data."),
        _ => text.words("."),
    }
}

/// The unit of a residual in a metric.
fn unit_of(metric: Metric) -> &'static str {
    match metric {
        Metric::L2 => "1/sr",
        Metric::Log => "",
        Metric::Cbrt | Metric::UnbiasedCbrt => "sr^-1/3",
    }
}

/// The residuals of a subject at the values of its report.
fn residuals(subject: &Subject) -> Result<Residuals, Error> {
    let (recorded, measurement) = (subject.fitted()?, subject.measured()?);
    let samples = Samples::select(measurement, &at_most(MOST_SAMPLES, subject.options.filters.clone()))?;
    let table = problem_table(recorded, measurement, &samples)?;
    let metric = subject.options.metric;
    let problem = ReflectanceProblem::new(&recorded.expression, &samples, table.clone(), metric);
    let rows = problem.residuals_of_channels(&DVector::from_vec(table.coordinates()));
    let angles = samples.directions.each(|g: &Geometry<f64>| {
        let theta_o = g.sin2_o().sqrt().atan2(g.cos_o()).to_degrees();
        let theta_d = (2.0 * (0.5 * g.one_less_cos_d).max(0.0).sqrt().min(1.0).asin()).to_degrees();
        [g.theta_i_deg(), theta_o, g.theta_h_deg(), theta_d]
    });
    // The report says how much larger the residuals are than the noise.
    let ratio = recorded.report.misfit.as_ref().and_then(|misfit| misfit.ratio).filter(|ratio| *ratio > 0.0);
    let (mut sum, mut total) = (0.0, 0.0);
    for row in rows.iter().filter(|row| !row.is_empty()) {
        for (r, weight) in row.iter().zip(&samples.weights).filter(|(r, _)| !r.is_nan()) {
            (sum, total) = (sum + weight * r * r, total + weight);
        }
    }
    let rms = if total > 0.0 { (sum / total).sqrt() } else { 0.0 };
    let in_sigma = samples.weighting == Weighting::Sigma;
    Ok(Residuals { angles, rows, noise: ratio.map(|ratio| rms / ratio), metric, in_sigma })
}

/// Residuals one by one, each with its angles, so that at most [`MOST_DOTS`] are left, evenly over samples and channels.
fn dots(residuals: &Residuals) -> Vec<([f64; 4], f64)> {
    let rows: Vec<&Vec<f64>> = residuals.rows.iter().filter(|row| !row.is_empty()).collect();
    let samples = residuals.angles.len();
    let step = (samples * rows.len()).div_ceil(MOST_DOTS).max(1);
    let at = |k: usize| {
        let sample = k / rows.len().max(1);
        let r = rows.get(k % rows.len().max(1))?.get(sample)?;
        Some((*residuals.angles.get(sample)?, *r)).filter(|_| !r.is_nan())
    };
    (0..samples * rows.len()).step_by(step).filter_map(at).collect()
}

/// How far the vertical axis has to reach on either side of 0.
fn reach(residuals: &Residuals) -> f64 {
    let mut sizes: Vec<f64> = dots(residuals).iter().map(|(_, r)| r.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let place = (BULK * count(sizes.len())).whole();
    let bulk = sizes.get(place).or(sizes.last()).copied().unwrap_or(1.0);
    (ROOM * bulk).max(1.2 * residuals.noise.unwrap_or(0.0)).max(f64::MIN_POSITIVE)
}

/// The series of a subject over the angle in this place; `name` is empty if it is the only one.
fn series_of(residuals: &Residuals, place: usize, k: usize, name: &str) -> Vec<Series> {
    let angle = |angles: &[f64; 4]| angles.get(place).copied().unwrap_or(f64::NAN);
    let range_of: Vec<usize> =
        residuals.angles.iter().map(|angles| (angle(angles) / RANGE_DEG).whole().min(RANGES - 1)).collect();
    let mut ranges: Vec<(f64, Vec<f64>)> = vec![(0.0, Vec::new()); RANGES];
    for row in &residuals.rows {
        for ((angles, range), r) in residuals.angles.iter().zip(&range_of).zip(row) {
            if let Some((sum, range)) = ranges.get_mut(*range).filter(|_| !r.is_nan()) {
                *sum += angle(angles);
                range.push(*r);
            }
        }
    }
    let (mut points, mut band) = (Vec::new(), Vec::new());
    for (sum, range) in ranges.iter_mut().filter(|(_, range)| range.len() >= FEWEST) {
        let n = range.len();
        let [low, median, high] = QUANTILES.map(|q| {
            let place = (q * count(n)).whole().min(n - 1);
            *range.select_nth_unstable_by(place, f64::total_cmp).1
        });
        points.push([*sum / count(n), median]);
        band.push([low, high]);
    }
    let mut series = Vec::new();
    if name.is_empty() {
        let dots = dots(residuals).iter().map(|(angles, r)| [angle(angles), *r]).collect();
        let look = Look { colour: Colour::Grey, line: None, marker: Some(Marker::Dot) };
        series.push(Series {
            name: "single residuals".into(),
            look,
            points: dots,
            band: None,
            in_legend: true,
        });
    }
    let look = Look { colour: Colour::Of(k), line: Some(Dash::Of(k)), marker: Some(Marker::Of(k)) };
    let of_whom = if name.is_empty() { "median, and middle 68 %".to_owned() } else { name.to_owned() };
    series.push(Series { name: of_whom.into(), look, points, band: Some(band), in_legend: true });
    // With several reports the levels would hide the medians.
    if let Some(noise) = residuals.noise.filter(|_| name.is_empty()) {
        let look = Look { colour: Colour::Ink, line: Some(Dash::Level), marker: None };
        for (level, in_legend) in [(noise, true), (-noise, false)] {
            let points = vec![[0.0, level], [90.0, level]];
            series.push(Series { name: "noise".into(), look, points, band: None, in_legend });
        }
    }
    series
}
