//! `brdfit select`: finds the cheapest model that a scene cannot tell from the measurement.
//!
//! A scene shows a surface from some directions in some light, and nothing else matters. Every model of the ladder is
//! fitted to the image that the measurement makes, and its image is compared with that one. docs/use/select.md describes
//! the method, and the JSON form field by field.

#![allow(
    clippy::indexing_slicing,
    reason = "lengths are checked where they come in; an index beyond the end is a mistake in the program"
)]

mod fits;
mod importance;
mod rendered;
mod seen;
mod studio;
mod target;
mod text;

pub use fits::DRAWN;
pub use importance::COVERED_SHARE;
pub use rendered::{ModelAt, Rendered, render};
pub use seen::SeenMap;
pub use text::{lines, name, table};

use crate::error::{Error, OptionName, Place};
use crate::fit::Options;
use crate::image::{Differences, Image, Route, ToRgb};
use crate::measurement::interpolant::{Interpolant, LeaveOut, LeftOut};
use crate::measurement::{Measurement, Weighting};
use crate::model::Expression;
use crate::parameters::ParameterValue;
use crate::progress::Progress;
use crate::scene::Scene;
use crate::tradeoff::Candidate;
use fits::Fits;
use serde::Serialize;
use studio::{Precision, Studio, Values};

/// Name of the schema.
pub const SCHEMA: &str = "brdfit.select/1";
/// Default tolerance: a 95th percentile of CIEDE2000 that is just noticeable.
pub const JUST_NOTICEABLE: f64 = 1.0;
/// Largest number of pixels that are rendered again in finer light.
pub const FINER_PIXELS: usize = 1000;

/// The result of the search: every model tried, and the one that the scene needs.
#[derive(Clone, Debug, Serialize)]
pub struct Selected {
    /// `brdfit.select/1`.
    pub schema: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// The measurement.
    pub data: Data,
    /// The scene.
    pub scene: SceneRecord,
    /// The metric of the fits.
    pub metric: &'static str,
    /// `scene` if the image is fitted; otherwise the weights of the measurement's samples: solid-angle, uniform or sigma.
    pub weights: &'static str,
    /// Largest accepted 95th percentile of CIEDE2000.
    pub tolerance: f64,
    /// Index in `tried` of the cheapest that passes; null if none passes.
    pub answer: Option<usize>,
    /// Index in `tried` of the one whose image is shown: the answer, or if none passes, the nearest to the measurement by the
    /// 95th percentile of CIEDE2000.
    pub shown: usize,
    /// Index in `tried` of the most expensive of those that cost less than the answer and fail; null if there is none.
    pub next_cheaper: Option<usize>,
    /// Every model and precision, from the cheapest up.
    pub tried: Vec<Tried>,
    /// Which directions the scene shows.
    pub seen: SeenMap,
}

/// The measurement.
#[derive(Clone, Debug, Serialize)]
pub struct Data {
    /// The file as it was named.
    pub path: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// Names of the channels.
    pub channels: Vec<String>,
    /// How the channels become red, green and blue.
    pub colour: Route,
    /// Relative error of interpolating samples that are left out; the image of the measurement is no more accurate than that.
    pub left_out: Option<LeaveOut>,
}

/// The scene, and what its camera sees.
#[derive(Clone, Debug, Serialize)]
pub struct SceneRecord {
    /// The file as it was named.
    pub path: String,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Pixels that see the surface.
    pub object_pixels: usize,
    /// Of those, pixels that are compared: at least half of their light comes along directions with data around them.
    pub compared_pixels: usize,
    /// Pixels that are compared once more with four times as many points of light.
    pub finer_pixels: usize,
    /// Number of pairs of directions.
    pub pairs: usize,
    /// Share of all light at pixels of the object that comes along directions with data around them.
    pub covered_light: f64,
}

/// A model in single or double precision.
#[derive(Clone, Debug, Serialize)]
pub struct Tried {
    /// The expression with every choice spelled out.
    pub model: String,
    /// Parameters that are fixed by default and were freed.
    pub free: Vec<&'static str>,
    /// Precision that it is evaluated in: f32 or f64.
    pub precision: &'static str,
    /// Operations of one evaluation, weighted as docs/use/tradeoff.md says.
    pub cost: u64,
    /// The parameters.
    pub parameters: Vec<ParameterValue>,
    /// How far its image is from the measured one.
    pub differences: Differences,
    /// The same with four times as many points of light, over `finer_pixels` of the scene; null if none of those pixels has
    /// data around its directions.
    pub finer_light: Option<Differences>,
    /// Whether the fit is usable and the image within the tolerance, by `finer_light` or, if that is null, by `differences`.
    pub passes: bool,
    /// Whether the fit is usable; a fit to the image always is.
    pub usable: bool,
}

impl Selected {
    /// The model whose image is shown: the answer, or the nearest if none passes.
    #[must_use]
    pub fn shown(&self) -> &Tried {
        &self.tried[self.shown]
    }
}

impl Tried {
    /// The 95th percentile of CIEDE2000 that decides: the one in finer light, which is more accurate, if there is one.
    #[must_use]
    pub fn p95(&self) -> f64 {
        self.finer_light.unwrap_or(self.differences).delta_e_2000.p95
    }
}

/// The models to choose from, and how to choose.
#[derive(Clone, Debug)]
pub struct Request<'a> {
    /// The models; if empty, the ladder of `tradeoff`.
    pub expressions: &'a [Expression],
    /// Metric, largest angles, seed and deadline of the fits. With a weighting the models are fitted to `filters.samples` of
    /// the measurement's own samples, and not to the image of the scene.
    pub options: &'a Options,
    /// Largest accepted 95th percentile of CIEDE2000.
    pub tolerance: f64,
}

/// The result, and the images.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The result.
    pub selected: Selected,
    /// The image that the measurement makes.
    pub measured: Image,
    /// The image that the model at `selected.shown` makes.
    pub fitted: Image,
    /// Whether each pixel is compared.
    pub compared: Vec<bool>,
}

/// Checks that a tolerance is a finite number above 0.
///
/// # Errors
/// [`Error::Invalid`] if it is not.
pub fn checked_tolerance(tolerance: f64) -> Result<f64, Error> {
    if tolerance > 0.0 && tolerance.is_finite() {
        return Ok(tolerance);
    }
    Err(Error::invalid(OptionName::Tolerance, "a number above 0", tolerance.to_string()))
}

/// Fits and renders every model, and chooses the cheapest that passes.
///
/// # Errors
/// [`Error::Malformed`] for a scene in which nothing is visible, or nothing for which the measurement has data; otherwise
/// as in [`crate::fit::fit`].
pub fn select(
    measurement: &Measurement,
    scene: &Scene,
    request: &Request<'_>,
    progress: &dyn Progress,
) -> Result<Outcome, Error> {
    let tolerance = checked_tolerance(request.tolerance)?;
    progress.stage("rendering the measurement");
    let colour = ToRgb::new(&measurement.channels);
    let coloured = colour.measurement(measurement);
    if coloured.directions.is_empty() {
        return Err(Error::no_samples(&coloured.source.path, &coloured.dropped));
    }
    let interpolant = Interpolant::new(&coloured);
    let max_theta_deg = request.options.filters.max_theta_deg;
    let studio = Studio::new(scene.view()?, &interpolant, max_theta_deg)?;
    if !studio.compared.contains(&true) {
        return Err(Error::malformed(
            scene.path(),
            Place::File,
            "a scene that shows directions of the measurement",
            format!("none of {} that has data around it", studio.view.samples.len()),
        ));
    }
    // It may happen that none of the pixels chosen for finer light is lit.
    let finer = scene.finer_view(FINER_PIXELS).ok();
    let finer = finer.map(|view| Studio::new(view, &interpolant, max_theta_deg)).transpose()?;
    let finer = finer.filter(|finer| finer.compared.contains(&true));
    let fits = Fits::new(&coloured, &studio, request.options)?;

    let candidates = Candidate::all(request.expressions)?;
    let mut shown: Vec<(Tried, Image)> = Vec::new();
    let mut failure = None;
    for (index, candidate) in candidates.iter().enumerate() {
        let name = candidate.expression.canonical();
        progress.stage(&format!("model {} of {}: {name}", index + 1, candidates.len()));
        match try_model(candidate, &fits, request, (&studio, finer.as_ref())) {
            Ok(both) => shown.extend(both),
            // One model may fail, for example if it has more parameters than there are data; the others may succeed.
            Err(error) => failure = Some(error),
        }
    }
    // The sort is stable: models of the same cost and precision stay in the order of the ladder.
    shown.sort_by_key(|(tried, _)| (tried.cost, tried.precision != "f32"));
    let answer = shown.iter().position(|(tried, _)| tried.passes);
    let nearest = shown.iter().enumerate().min_by(|(_, (a, _)), (_, (b, _))| a.p95().total_cmp(&b.p95()));
    let Some(displayed) = answer.or(nearest.map(|(index, _)| index)) else {
        return Err(failure.unwrap_or_else(|| Error::invalid("model", "at least one", "none")));
    };
    let next_cheaper = answer.and_then(|answer| {
        let cost = shown[answer].0.cost;
        shown.iter().take(answer).rposition(|(tried, _)| !tried.passes && tried.cost < cost)
    });
    let (tried, mut images): (Vec<Tried>, Vec<Image>) = shown.into_iter().unzip();
    let fitted = images.swap_remove(displayed);
    let selected = Selected {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        data: Data {
            path: measurement.source.path.display().to_string(),
            sha256: measurement.source.sha256.clone(),
            channels: measurement.channel_names(),
            colour: colour.route,
            left_out: interpolant.leave_out_error(LeftOut::Light),
        },
        scene: SceneRecord {
            path: scene.path().display().to_string(),
            width: studio.view.width,
            height: studio.view.height,
            object_pixels: trues(&studio.view.covered),
            compared_pixels: trues(&studio.compared),
            finer_pixels: finer.as_ref().map_or(0, |finer| trues(&finer.compared)),
            pairs: studio.view.samples.len(),
            covered_light: studio.importance.covered_light(),
        },
        metric: request.options.metric.name(),
        weights: request.options.filters.weighting.map_or("scene", Weighting::name),
        tolerance,
        answer,
        shown: displayed,
        next_cheaper,
        tried,
        seen: SeenMap::new(&studio.view, measurement),
    };
    Ok(Outcome { selected, measured: studio.measured, fitted, compared: studio.compared })
}

fn trues(mask: &[bool]) -> usize {
    mask.iter().filter(|is| **is).count()
}

/// Fits a model and renders it in both precisions, each in the light of the scene and in finer light.
fn try_model(
    candidate: &Candidate,
    fits: &Fits<'_>,
    request: &Request<'_>,
    (studio, finer): (&Studio, Option<&Studio>),
) -> Result<[(Tried, Image); 2], Error> {
    let expression = &candidate.expression;
    let (table, usable) = fits.fit(candidate, request.options)?;
    let values: Values = (0..table.channels().len()).map(|channel| table.formula_values(channel)).collect();
    let cost = studio.cost(expression, &values);
    let tried = |precision: Precision| -> Result<(Tried, Image), Error> {
        let (image, differences) = studio.look(expression, &values, precision)?;
        let finer = finer.map(|finer| finer.look(expression, &values, precision)).transpose()?;
        let mut tried = Tried {
            model: expression.canonical(),
            free: candidate.free.to_vec(),
            precision: precision.name(),
            cost,
            parameters: table.parameter_values(),
            passes: false,
            differences,
            finer_light: finer.map(|(_, differences)| differences),
            usable,
        };
        tried.passes = usable && tried.p95() <= request.tolerance;
        Ok((tried, image))
    };
    let (single, double) = rayon::join(|| tried(Precision::Single), || tried(Precision::Double));
    Ok([single?, double?])
}
