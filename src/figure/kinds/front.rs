//! Error against the number of parameters or the cost of an evaluation: several fits of one measurement, or a tradeoff.

use crate::error::{Error, OptionName};
use crate::figure::data::{
    Axes, Axis, Body, Colour, Curves, Dash, FigureData, Look, Marker, Panel, Scale, Series,
};
use crate::figure::kind::{Against, Kind, Needs, Several, Subject, Wanted};
use crate::figure::text::Text;
use crate::fit::Metric;
use crate::report::Recorded;
use crate::synthetic::scattered_directions;
use crate::tradeoff::{Tradeoff, counted};

/// The entry of the registry.
pub const KIND: Kind = Kind {
    name: "front",
    summary: "several reports of one measurement: error against number of parameters or cost",
    needs: Needs::Report,
    several: Several::Needed,
    raster: false,
    compute,
};

/// The axis of the cost of an evaluation.
const COST: &str = "cost of an evaluation, operations";
/// What the cost counts, for a caption.
const COUNTED: &str = " A quotient counts 4 operations, an exponential 25.";

/// A model on the plot.
struct Candidate {
    name: String,
    x: f64,
    error: f64,
}

fn compute(subjects: &[Subject], wanted: &Wanted) -> Result<FigureData, Error> {
    let Some(first) = subjects.first() else { return Err(Error::invalid(KIND.name, "a report", "none")) };
    let report = &first.fitted()?.report;
    let metric = report.metric.known().unwrap_or_default();
    let (mut candidates, mut unusable) = (Vec::new(), 0);
    for subject in subjects {
        let recorded = subject.fitted()?;
        if recorded.report.data.sha256 != report.data.sha256 {
            let found = format!("{} and {}", report.data.path, recorded.report.data.path);
            return Err(Error::invalid(KIND.name, "reports of one measurement", found));
        }
        let error = recorded.report.errors.of(metric).filter(|error| *error > 0.0);
        match error.filter(|_| recorded.report.termination.usable) {
            None => unusable += 1,
            Some(error) => {
                let x = match wanted.against {
                    Against::Parameters => parameters(recorded),
                    Against::Cost => cost(recorded),
                };
                candidates.push(Candidate { name: recorded.expression.canonical(), x, error });
            }
        }
    }
    if candidates.is_empty() {
        return Err(Error::invalid(KIND.name, "a usable report with an error above 0", "none"));
    }
    let mut caption =
        format!("{}: error in the metric {} of each model against ", first.stem(), metric.name());
    let x = match wanted.against {
        Against::Parameters => {
            caption.push_str("the number of fitted parameters of all channels.");
            Axis::new("number of fitted parameters", "")
        }
        Against::Cost => {
            caption.push_str("the cost of an evaluation.");
            caption.push_str(COUNTED);
            Axis::new(COST, "").scaled(Scale::Log)
        }
    };
    if unusable > 0 {
        caption.push_str(&format!(" Left out: {unusable} without a usable error."));
    }
    Ok(figure(candidates, x, metric, &caption))
}

/// The front of a tradeoff: the errors of its usable models against the cost of an evaluation.
///
/// # Errors
/// [`Error::Invalid`] if no usable model has a positive error.
pub fn of_tradeoff(found: &Tradeoff) -> Result<FigureData, Error> {
    let usable = found.models.iter().filter(|entry| entry.usable).filter_map(|entry| {
        let error = entry.errors.of(found.metric).filter(|error| *error > 0.0)?;
        Some(Candidate { name: entry.model.clone(), x: as_f64(entry.cost.weighted.max(1)), error })
    });
    let candidates: Vec<Candidate> = usable.collect();
    if candidates.is_empty() {
        return Err(Error::invalid(OptionName::Svg, "a usable model with an error above 0", "none"));
    }
    let caption = format!(
        "{}: error in the metric {} of each model against the cost of an evaluation.{COUNTED}",
        found.data.path,
        found.metric.name()
    );
    Ok(figure(candidates, Axis::new(COST, "").scaled(Scale::Log), found.metric, &caption))
}

/// The number of parameters that a fit moved, of all channels.
fn parameters(recorded: &Recorded) -> f64 {
    crate::math::count(recorded.report.parameters.iter().filter(|p| p.was_fitted()).count())
}

/// The weighted operations of an evaluation of the first channel; at least 1, which a logarithmic axis can show.
fn cost(recorded: &Recorded) -> f64 {
    // Any directions: no formula has branches that cost differently.
    let pairs = scattered_directions(1, 80.0, 1);
    let (operations, _) = counted(&recorded.expression, &recorded.table.formula_values(0), &pairs);
    as_f64(operations.weighted().max(1))
}

#[expect(clippy::cast_precision_loss, reason = "operations stay far below 2^53")]
fn as_f64(count: u64) -> f64 {
    count as f64
}

/// The figure of some models: those that no other beats in both respects are joined by a line.
fn figure(mut candidates: Vec<Candidate>, x: Axis, metric: Metric, caption: &str) -> FigureData {
    candidates.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.error.total_cmp(&b.error)));
    let mut least = f64::INFINITY;
    let on_front: Vec<bool> = candidates
        .iter()
        .map(|candidate| {
            let better = candidate.error < least;
            least = least.min(candidate.error);
            better
        })
        .collect();
    let front =
        candidates.iter().zip(&on_front).filter(|(_, on)| **on).map(|(c, _)| [c.x, c.error]).collect();
    let look = Look { colour: Colour::Of(0), line: Some(Dash::Of(0)), marker: None };
    let mut series = vec![Series {
        name: "not beaten in both respects".into(),
        look,
        points: front,
        band: None,
        in_legend: true,
    }];
    for (k, (candidate, on)) in candidates.into_iter().zip(on_front).enumerate() {
        let colour = if on { Colour::Of(0) } else { Colour::Grey };
        let look = Look { colour, line: None, marker: Some(Marker::Number(k + 1)) };
        let points = vec![[candidate.x, candidate.error]];
        series.push(Series { name: candidate.name.into(), look, points, band: None, in_legend: true });
    }
    let y = Axis::new(format!("{} error", metric.name()), "").scaled(Scale::Log);
    let curves = Curves { axes: Axes::Cartesian, x, y, series, marks: Vec::new() };
    let panels = vec![Panel { title: Text::default(), body: Body::Curves(curves) }];
    FigureData { kind: KIND.name, panels, caption: caption.into(), side_by_side: [1, 1] }
}
