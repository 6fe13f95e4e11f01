//! The cost over each shape parameter, with all other parameters fitted again at every value.

use crate::error::Error;
use crate::figure::data::{
    Axes, Axis, Body, Colour, Curves, Dash, FigureData, Look, Mark, MarkForm, Marker, Panel, Scale, Series,
};
use crate::figure::kind::{Kind, Needs, Several, Subject, Wanted, only};
use crate::figure::refit::{MOST_SAMPLES, refit_options, reported, starts};
use crate::figure::text::Text;
use crate::fit::{Options, fit};
use crate::measurement::Measurement;
use crate::model::{Role, Scale as Coordinate, Unit};
use crate::parameters::{ParameterRow, Selector, Setting, Settings, Status};
use crate::report::{Parameter, Recorded};

/// The entry of the registry.
pub const KIND: Kind = Kind {
    name: "profile",
    summary: "cost over each shape parameter, with the others fitted again at every value",
    needs: Needs::Both,
    several: Several::Refused,
    raster: false,
    compute,
};

/// Values on either side of the minimum.
const STEPS: i32 = 6;
/// A parameter on a logarithmic scale is followed to this multiple of its value, and to the inverse of it.
const FACTOR: f64 = 2.0;
/// Another parameter is followed this far, in units of its value, or of its typical range if the value is smaller than that.
const SHARE: f64 = 0.5;
/// The largest number of parameters that have a panel.
const MOST_PANELS: usize = 6;

fn compute(subjects: &[Subject], wanted: &Wanted) -> Result<FigureData, Error> {
    let subject = only(subjects, KIND.name)?;
    let (recorded, measurement) = (subject.fitted()?, subject.measured()?);
    let shapes: Vec<usize> =
        (0..recorded.table.rows().len()).filter(|row| is_fitted_shape(recorded, *row)).collect();
    if shapes.is_empty() {
        let found = format!("{}, of which none was fitted", recorded.expression.canonical());
        return Err(Error::invalid(KIND.name, "a report with a shape that was fitted", found));
    }
    let options = refit_options(&subject.options, recorded);
    let least = cost_with(measurement, recorded, &options, None, wanted)?;
    let mut panels = Vec::new();
    for &row in shapes.iter().take(MOST_PANELS) {
        panels.push(panel(measurement, recorded, &options, least, row, wanted)?);
    }
    let caption = caption(subject, recorded, &shapes);
    let side_by_side = [panels.len().min(2), panels.len().min(3)];
    Ok(FigureData { kind: KIND.name, panels, caption, side_by_side })
}

fn caption(subject: &Subject, recorded: &Recorded, shapes: &[usize]) -> Text {
    let mut text = Text::from(format!(
        "{}: cost of {} in the metric {}, in units of the least, over each shape; all other parameters are fitted again at every value",
        subject.stem(),
        recorded.expression.canonical(),
        subject.options.metric.name()
    ));
    if recorded.report.data.used > MOST_SAMPLES {
        text = text.words(format!(", on {MOST_SAMPLES} of the samples"));
    }
    text = text.words(". Solid line: the fitted value; dashed: its 95 % interval.");
    if shapes.len() > MOST_PANELS {
        text = text.words(format!(" Shown: the first {MOST_PANELS} of {} shapes.", shapes.len()));
    }
    text
}

fn is_fitted_shape(recorded: &Recorded, row: usize) -> bool {
    let fitted = reported(&recorded.report, &recorded.table, row).is_some_and(Parameter::was_fitted);
    recorded
        .table
        .rows()
        .get(row)
        .is_some_and(|r| r.spec.role == Role::Shape && r.status == Status::Free && fitted)
}

/// The cost of a fit from the report's values, with one parameter fixed at a value.
fn cost_with(
    measurement: &Measurement,
    recorded: &Recorded,
    options: &Options,
    fixed: Option<(usize, f64)>,
    wanted: &Wanted,
) -> Result<f64, Error> {
    let mut settings: Settings = starts(recorded, &measurement.channel_names())?;
    if let Some((row, value)) = fixed {
        let selector = Selector::parse(&recorded.table.name(row))?;
        settings.retain(|(other, setting)| !(*other == selector && matches!(setting, Setting::Init(_))));
        settings.push((selector, Setting::Fix(value)));
    }
    let options = options.clone().with_settings(settings);
    Ok(fit(measurement, &recorded.expression, &options, &wanted.progress)?.cost)
}

/// The values at which a shape is fixed, ascending, the fitted one in the middle; at a bound they end.
fn grid(row: &ParameterRow) -> Vec<f64> {
    let (low, high) = row.bounds;
    let (least, most) = row.spec.typical;
    let at = |k: i32| {
        let t = f64::from(k) / f64::from(STEPS);
        match row.spec.scale {
            Coordinate::Log => row.value * FACTOR.powf(t),
            Coordinate::Linear | Coordinate::Square => {
                row.value + SHARE * t * row.value.abs().max(0.2 * (most - least))
            }
        }
    };
    (-STEPS..=STEPS).map(at).filter(|value| (low..=high).contains(value)).collect()
}

fn panel(
    measurement: &Measurement,
    recorded: &Recorded,
    options: &Options,
    least: f64,
    row: usize,
    wanted: &Wanted,
) -> Result<Panel, Error> {
    let name = recorded.table.name(row);
    let Some(shape) = recorded.table.rows().get(row) else {
        return Err(Error::invalid(KIND.name, "a shape", name));
    };
    let values = grid(shape);
    let mut points = Vec::new();
    for (k, &value) in values.iter().enumerate() {
        wanted.progress.stage(&format!("{name}, {} of {}", k + 1, values.len()));
        points.push([value, cost_with(measurement, recorded, options, Some((row, value)), wanted)? / least]);
    }
    let look = Look { colour: Colour::Of(0), line: Some(Dash::Of(0)), marker: Some(Marker::Of(0)) };
    let series = Series { name: "cost/least cost".into(), look, points, band: None, in_legend: false };
    let mark = |name: &str, x: f64, colour| Mark { name: name.into(), x, colour, form: MarkForm::Line };
    let mut marks = vec![mark("fitted value", shape.value, Colour::Ink)];
    if let Some([low, high]) = reported(&recorded.report, &recorded.table, row).and_then(|p| p.ci95) {
        marks.extend([
            mark("95 % interval, low", low, Colour::Grey),
            mark("95 % interval, high", high, Colour::Grey),
        ]);
    }
    let unit = match shape.spec.unit {
        Unit::Degrees => "deg",
        Unit::UnscaledMerl => "unscaled MERL",
        Unit::One => "",
    };
    let scale = if shape.spec.scale == Coordinate::Log { Scale::Log } else { Scale::Linear };
    let x = Axis::new(Text::of_symbol(shape.spec.name), unit).scaled(scale);
    let y = Axis::new("cost/least cost", "");
    let curves = Curves { axes: Axes::Cartesian, x, y, series: vec![series], marks };
    Ok(Panel { title: Text::from(name), body: Body::Curves(curves) })
}
