//! f in the plane of incidence: measured samples, the fit, and how uncertain it is.

use crate::error::Error;
use crate::figure::data::{
    Axes, Axis, Body, Colour, Curves, Dash, FigureData, Look, Mark, MarkForm, Marker, Panel, Scale, Series,
};
use crate::figure::in_plane::{
    InPlane, PLANE_DEG, angles_of_incidence, at_angle, has_azimuth, in_plane, usual_azimuth,
};
use crate::figure::kind::{
    Kind, Needs, Several, Subject, Wanted, channel_title, channels_shown, chosen_channels, names,
    same_measurement,
};
use crate::figure::text::Text;
use crate::geometry::{Directions, Pair, direction};
use crate::model::{Expression, LobeValues};
use crate::parameters::ParameterTable;
use crate::report::Spread;
use std::sync::Arc;

/// The entry of the registry.
pub const KIND: Kind = Kind {
    name: "lobe",
    summary: "f in the plane of incidence at several angles: samples, fit and its uncertainty",
    needs: Needs::Measurement,
    several: Several::Overlaid,
    raster: false,
    compute,
};

/// Largest viewing angle of a curve, degrees.
const STEEPEST_DEG: f64 = 89.0;
/// Values that span more than this factor are shown on a logarithmic scale.
const WIDE: f64 = 30.0;
/// A logarithmic scale shows at most this many decades below the largest value.
const DECADES: i32 = 6;

fn compute(subjects: &[Subject], wanted: &Wanted) -> Result<FigureData, Error> {
    let mut samples: Vec<Arc<Vec<InPlane>>> = Vec::new();
    for (index, subject) in subjects.iter().enumerate() {
        let before = subjects.iter().take(index).position(|other| same_measurement(other, subject));
        // Looking through a full table takes long enough to do it once.
        samples.push(match before.and_then(|before| samples.get(before)) {
            Some(known) => Arc::clone(known),
            None => Arc::new(in_plane(&subject.measured()?.directions)),
        });
    }
    let first = first_of(subjects)?;
    let angles = angles_of_incidence(samples.first().map_or(&[], |all| all.as_slice()), &wanted.theta_i_deg);
    let channels = first.channels();
    let chosen = chosen_channels(&channels, wanted)?;
    let anisotropic = subjects.iter().any(is_anisotropic);
    let phi_i = if anisotropic { samples.first().map_or(0.0, |all| usual_azimuth(all)) } else { 0.0 };
    let several = subjects.len() > 1;
    let called = names(subjects);

    let mut panels = Vec::new();
    let mut in_plane_samples = 0;
    for &channel in &chosen {
        let (mut series, mut measured) = (Vec::new(), Vec::new());
        for (index, (subject, samples)) in subjects.iter().zip(&samples).enumerate() {
            // Samples of one measurement are shown once, however many models were fitted to it.
            let shown_before = subjects.iter().take(index).any(|other| same_measurement(other, subject));
            for (k, &theta_i) in angles.iter().enumerate() {
                let named = Text::of_symbol("theta_i").words(" = ").degrees(theta_i);
                if !shown_before {
                    let here: Vec<InPlane> = if anisotropic {
                        samples.iter().filter(|sample| has_azimuth(sample, phi_i)).copied().collect()
                    } else {
                        samples.to_vec()
                    };
                    let points = measured_points(subject, channel, &at_angle(&here, theta_i))?;
                    in_plane_samples += points.len();
                    let whose = if several {
                        format!(", {} measured", subject.stem())
                    } else {
                        ", measured".to_owned()
                    };
                    // A measurement alone is joined by thin lines, so that the eye finds its lobes.
                    let line = subject.recorded.is_none().then_some(Dash::Thin);
                    let look = Look { colour: Colour::Of(k), line, marker: Some(Marker::Of(k)) };
                    let in_legend = !points.is_empty();
                    measured.push(Series {
                        name: named.clone().words(whose),
                        look,
                        points,
                        band: None,
                        in_legend,
                    });
                }
                if several && k == 0 && subject.recorded.is_some() {
                    // The colours tell angles apart and the dashes models, so that the legend names each once.
                    let look = Look { colour: Colour::Ink, line: Some(Dash::Of(index)), marker: None };
                    let name = Text::from(called.get(index).map_or("", String::as_str));
                    series.push(Series { name, look, points: Vec::new(), band: None, in_legend: true });
                }
                let Some(fit) = fitted_curve(subject, channel, theta_i, phi_i)? else { continue };
                let whose = called.get(index).map_or("", String::as_str);
                let name = if several { named.words(format!(", {whose}")) } else { named.words(", fit") };
                let dash = if several { Dash::Of(index) } else { Dash::Of(k) };
                let look = Look { colour: Colour::Of(k), line: Some(dash), marker: None };
                series.push(Series { name, look, in_legend: !several, ..fit });
            }
        }
        let title = channels.get(channel).map(channel_title).unwrap_or_default();
        measured.extend(series);
        let series = measured;
        // The ends of the axis are those of all panels.
        let y = Axis::new(Text::of_symbol("f"), "1/sr");
        let marks = angles.iter().enumerate().map(|(k, &theta_i)| Mark {
            name: Text::from("light at ").symbol("theta_i").words(" = ").degrees(theta_i),
            x: -theta_i,
            colour: Colour::Of(k),
            form: MarkForm::Arrow,
        });
        let curves = Curves {
            axes: wanted.axes.unwrap_or(Axes::Cartesian),
            x: Axis::angle("theta_o").from_to(-90.0, 90.0),
            y,
            series,
            marks: marks.collect(),
        };
        let title = if channels.len() > 1 { Text::from(title) } else { Text::default() };
        panels.push(Panel { title, body: Body::Curves(curves) });
    }
    let side_by_side = [1, panels.len().min(3)];
    share_axis(&mut panels, wanted.scale, first.options.filters.max_theta_deg);
    let caption = caption(subjects, in_plane_samples, anisotropic.then_some(phi_i))
        .words(channels_shown(&channels, &chosen));
    Ok(FigureData { kind: KIND.name, panels, caption, side_by_side })
}

fn first_of(subjects: &[Subject]) -> Result<&Subject, Error> {
    subjects.first().ok_or_else(|| Error::invalid(KIND.name, "a report or a measurement", "none"))
}

/// What the figure shows, in sentences.
fn caption(subjects: &[Subject], samples: usize, phi_i: Option<f64>) -> Text {
    let whose: Vec<String> = subjects.iter().map(Subject::stem).collect();
    let mut unique = whose.clone();
    unique.dedup();
    let mut text = Text::from(format!("{}: BRDF ", unique.join(", ")))
        .symbol("f")
        .words(" in the plane of incidence over ")
        .symbol("theta_o")
        .words(", positive on the side of the mirror direction; arrows show where the light comes from.");
    if let Some(phi_i) = phi_i {
        text = text.words(" The light's azimuth is ").symbol("phi_i").words(" = ").degrees(phi_i).words(".");
    }
    text = match samples {
        0 => text.words(format!(" The measurement has no samples within {PLANE_DEG} degrees of that plane.")),
        _ => text.words(format!(" Markers: samples within {PLANE_DEG} degrees of that plane.")),
    };
    match subjects {
        [Subject { recorded: Some(recorded), .. }] => {
            text = text.words(format!(" Lines: {}", recorded.expression.canonical()));
            text = match Spread::of(recorded) {
                None => text.words("; the report has no covariance."),
                Some(spread) if spread.complete => text.words(", with its 95 % band."),
                Some(_) => text.words(", with the 95 % band of the parameters that have a standard error."),
            };
        }
        several if several.len() > 1 => text = text.words(" Lines: the fits that the legend names, with their 95 % bands where the reports have a covariance."),
        _ => {}
    }
    text
}

/// Whether the model of a subject changes when the surface is turned.
fn is_anisotropic(subject: &Subject) -> bool {
    let Some(recorded) = &subject.recorded else { return false };
    recorded.table.rows().iter().any(|row| row.spec.isotropy.is_some())
        && turning_matters(recorded.table.channels(), &recorded.expression, &recorded.table)
}

fn turning_matters(channels: &[String], expression: &Expression, table: &ParameterTable) -> bool {
    let pair = |turn: f64| Pair { wi: direction(0.6, turn), wo: direction(0.9, turn + 2.5) };
    let directions = Directions::Scattered((0..4).map(|k| pair(0.7 * f64::from(k))).collect());
    let values: Vec<Vec<LobeValues>> =
        (0..channels.len()).map(|channel| table.formula_values(channel)).collect();
    expression.values(&directions, &values).iter().any(|row| {
        let (low, high) = ends(row.iter().copied());
        high - low > 1e-9 * high
    })
}

/// The smallest and the largest of some numbers.
fn ends(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

fn measured_points(subject: &Subject, channel: usize, samples: &[InPlane]) -> Result<Vec<[f64; 2]>, Error> {
    let values = subject.measured()?.values.get(channel);
    let value = |sample: usize| values.and_then(|row| row.get(sample)).copied().filter(|f| !f.is_nan());
    Ok(samples.iter().filter_map(|place| Some([place.theta_o, value(place.sample)?])).collect())
}

/// The viewing angles of a curve: every half degree, and more densely near the mirror direction and the light.
fn viewing_angles(theta_i: f64) -> Vec<f64> {
    let even = (-178..=178).map(|k| 0.5 * f64::from(k));
    let near = |centre: f64| {
        // 0.02 degrees at the centre, and 6 degrees at the end.
        (1..=40).flat_map(move |k| {
            let away = 0.02 * 1.155_f64.powi(k - 1);
            [centre - away, centre + away]
        })
    };
    let mut angles: Vec<f64> =
        even.chain(near(theta_i)).chain(near(-theta_i)).chain([theta_i, -theta_i]).collect();
    angles.retain(|angle| angle.abs() <= STEEPEST_DEG);
    angles.sort_by(f64::total_cmp);
    angles.dedup();
    angles
}

/// The model over the viewing angle, with its band; `None` for a measurement alone.
fn fitted_curve(
    subject: &Subject,
    channel: usize,
    theta_i: f64,
    phi_i: f64,
) -> Result<Option<Series>, Error> {
    let Some(recorded) = &subject.recorded else { return Ok(None) };
    let angles = viewing_angles(theta_i);
    let wi = direction(theta_i.to_radians(), phi_i.to_radians());
    // A negative angle is on the other side of the normal: the mirror side is opposite to the light.
    let wo = |theta_o: &f64| direction(-theta_o.to_radians(), phi_i.to_radians());
    let directions =
        Directions::Scattered(angles.iter().map(|theta_o| Pair { wi, wo: wo(theta_o) }).collect());
    let values = subject.values()?;
    let Some(values) = values.get(channel) else { return Ok(None) };
    let evaluate = |values: Vec<LobeValues>| recorded.expression.values(&directions, &[values]).concat();
    let f = evaluate(values.clone());
    let name = subject.channels().get(channel).map(|c| c.name.clone()).unwrap_or_default();
    let place = recorded.table.channels().iter().position(|known| *known == name).unwrap_or(0);
    let band =
        Spread::of(recorded).map(|spread| spread.band(&f, |table| evaluate(table.formula_values(place))));
    let points = angles.iter().zip(&f).map(|(angle, f)| [*angle, *f]).collect();
    let look = Look { colour: Colour::Ink, line: None, marker: None };
    Ok(Some(Series { name: Text::default(), look, points, band, in_legend: true }))
}

/// Gives all panels the same axis of f, so that they can be compared.
///
/// Beyond the steepest angle of the fit a model may grow without limit: what it does there does not set the ends.
fn share_axis(panels: &mut [Panel], scale: Option<Scale>, steepest_deg: f64) {
    let mut all: Vec<Series> = Vec::new();
    for panel in panels.iter() {
        if let Body::Curves(curves) = &panel.body {
            for series in &curves.series {
                let within = series.points.iter().filter(|[theta_o, _]| theta_o.abs() <= steepest_deg);
                all.push(Series { points: within.copied().collect(), ..series.clone() });
            }
        }
    }
    let axis = value_axis(&all, scale);
    for panel in panels {
        if let Body::Curves(curves) = &mut panel.body {
            curves.y = axis.clone();
        }
    }
}

/// The axis of f: logarithmic where the values span a wide range, unless the user chooses.
fn value_axis(series: &[Series], scale: Option<Scale>) -> Axis {
    let values = || series.iter().flat_map(|series| series.points.iter().map(|[_, f]| *f));
    let (low, high) = ends(values().filter(|f| *f > 0.0));
    let scale = scale.unwrap_or(if high > WIDE * low { Scale::Log } else { Scale::Linear });
    let axis = Axis::new(Text::of_symbol("f"), "1/sr").scaled(scale);
    if !(high.is_finite() && high > 0.0) {
        return axis.from_to(if scale == Scale::Log { 0.1 } else { 0.0 }, 1.0);
    }
    match scale {
        Scale::Log => axis.from_to(low.max(high * 10_f64.powi(-DECADES)) / 1.3, 1.5 * high),
        Scale::Linear | Scale::Root => {
            let lowest = ends(values()).0;
            axis.from_to(if lowest < 0.0 { 1.05 * lowest } else { 0.0 }, 1.05 * high)
        }
    }
}
