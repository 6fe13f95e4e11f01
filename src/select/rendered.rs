//! Renders a measurement, and a model at given values beside it.

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

/// The images of a measurement and of a model in the same scene.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The image that the measurement makes; black where it has no data.
    pub measured: Image,
    /// The image that the model makes, and its differences from the measured one; `None` without a model.
    pub fitted: Option<(Image, Differences)>,
    /// The factor that makes the 99th percentile of the measured image's luminance 1.
    pub exposure: f64,
    /// How red, green and blue were found.
    pub colour: Route,
}

/// Renders a measurement in a scene, and a model whose channels are those of the measurement.
///
/// # Errors
/// [`Error::Malformed`] for a scene in which nothing is visible for which the measurement has data; [`Error::Invalid`] for an image that
/// is not finite.
pub fn render(
    measurement: &Measurement,
    scene: &Scene,
    model: Option<ModelAt<'_>>,
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
    let exposure = crate::image::exposure(&studio.measured, &studio.compared)?;
    let fitted = model.map(|model| {
        // Converting values of f to colours is linear, so that it may come after the model.
        let rows = studio.rows(model.expression, model.values, Precision::Double);
        studio.compare(&colour.rows(rows, coloured.channels.len()))
    });
    Ok(Rendered { fitted: fitted.transpose()?, measured: studio.measured, exposure, colour: colour.route })
}
