//! Renders a measurement, and models at given values beside it.

use super::studio::{Precision, Studio, Values};
use crate::error::{Error, Place};
use crate::image::{Differences, Image, Route, ToRgb};
use crate::measurement::Measurement;
use crate::measurement::interpolant::Interpolant;
use crate::model::Expression;
use crate::scene::Scene;

/// A model at its values, by channel of the measurement.
#[derive(Clone, Copy, Debug)]
pub struct ModelAt<'a> {
    /// The model.
    pub expression: &'a Expression,
    /// Its values by channel and lobe, in formula units.
    pub values: &'a Values,
}

/// The images of a measurement and of models in the same scene.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The image that the measurement makes; black where it has no data.
    pub measured: Image,
    /// The image that each model makes, and its differences from the measured one.
    pub fitted: Vec<(Image, Differences)>,
    /// The factor that makes the 99th percentile of the luminance of the measured image's lit pixels 1.
    pub exposure: f64,
    /// How red, green and blue were found.
    pub colour: Route,
}

/// Renders a measurement in a scene, and models whose channels are those of the measurement.
///
/// # Errors
/// [`Error::Malformed`] for a scene in which nothing is visible for which the measurement has data; [`Error::Invalid`] for an image that
/// is not finite.
pub fn render(
    measurement: &Measurement,
    scene: &Scene,
    models: &[ModelAt<'_>],
    max_theta_deg: f64,
) -> Result<Rendered, Error> {
    let colour = ToRgb::new(&measurement.channels);
    let coloured = colour.measurement(measurement);
    if coloured.directions.is_empty() {
        return Err(Error::no_samples(&coloured.source.path, &coloured.dropped));
    }
    let studio = Studio::new(scene.view()?, &Interpolant::new(&coloured), max_theta_deg)?;
    if !studio.compared.contains(&true) {
        let found = format!("none of {} that has data around it", studio.view.samples.len());
        let expected = "a scene that shows directions of the measurement";
        return Err(Error::malformed(scene.path(), Place::File, expected, found));
    }
    // Where little is known most of what can be compared may be dark, and the rest of the picture would be white.
    let is_lit = |pixel: &[f64; 3]| pixel.iter().any(|value| *value > 0.0);
    let lit: Vec<bool> = studio.measured.pixels.iter().map(is_lit).collect();
    let shown = if lit.contains(&true) { &lit } else { &studio.compared };
    let exposure = crate::image::exposure(&studio.measured, shown)?;
    let fitted = models.iter().map(|model| {
        // Converting values of f to colours is linear, so that it may come after the model.
        let rows = studio.rows(model.expression, model.values, Precision::Double);
        studio.compare(&colour.rows(rows, coloured.channels.len()))
    });
    Ok(Rendered {
        fitted: fitted.collect::<Result<_, _>>()?,
        measured: studio.measured,
        exposure,
        colour: colour.route,
    })
}
