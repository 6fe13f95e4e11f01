//! `brdfit select`: the cheapest model that a scene cannot tell from the measurement.
//!
//! A scene shows a surface from some directions in some light, and nothing else of it matters. Its pairs of directions are
//! drawn in proportion to how much they matter to the image; every model of the ladder is fitted to the measurement there, and the
//! image that it makes is compared with the one that the measurement itself makes. docs/select.md describes it, and the JSON form field by field.

mod seen;
mod text;

pub use seen::SeenMap;
pub use text::table;

use crate::error::Error;
use crate::fit::{Options, ParameterValue, Progress, Quiet, fit};
use crate::geometry::{Directions, Pair};
use crate::image::{Differences, Image, Route, ToRgb, differences, luminance};
use crate::math::count;
use crate::measurement::interpolant::{Interpolant, LeaveOut, LeftOut};
use crate::measurement::{Filters, Measurement, Weighting};
use crate::model::Expression;
use crate::scene::{Scene, View};
use crate::tradeoff::{Candidate, counted, in_single_precision};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Name of the schema.
pub const SCHEMA: &str = "brdfit.select/1";
/// The tolerance where none is given: the 95th percentile of CIEDE2000 that is just noticeable.
pub const JUST_NOTICEABLE: f64 = 1.0;
/// Pairs of directions that models are fitted to.
pub const DRAWN: usize = 20_000;
/// A pixel counts if at least this share of its light comes along directions with data around them.
pub const COVERED_SHARE: f64 = 0.5;

/// What a scene needs.
#[derive(Clone, Debug, Serialize)]
pub struct Selected {
    /// `brdfit.select/1`.
    pub schema: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// What was measured.
    pub data: Data,
    /// What it is looked at in.
    pub scene: SceneRecord,
    /// The metric of the fits: l2, log or cbrt.
    pub metric: &'static str,
    /// `scene`: pairs of directions count as they do in the image; or solid-angle, uniform or sigma: samples of the measurement
    /// count so.
    pub weights: &'static str,
    /// The 95th percentile of CIEDE2000 that passes.
    pub tolerance: f64,
    /// Which of `tried` is the cheapest that passes; null if none does.
    pub answer: Option<usize>,
    /// Which of `tried` is the dearest that is cheaper than the answer and fails; null if there is none.
    pub next_cheaper: Option<usize>,
    /// Every model and precision, from the cheapest up.
    pub tried: Vec<Tried>,
    /// Which directions the scene shows.
    pub seen: SeenMap,
}

/// What was measured.
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
    /// How well samples are foretold by the others, relative: the image of the measurement is no better known.
    pub left_out: Option<LeaveOut>,
}

/// A scene as it is seen.
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
    /// Pairs of directions.
    pub pairs: usize,
    /// Share of all light at pixels of the object that comes along directions with data around them.
    pub covered_light: f64,
}

/// A model in a precision.
#[derive(Clone, Debug, Serialize)]
pub struct Tried {
    /// The expression with every choice spelled out.
    pub model: String,
    /// Parameters that were freed, fixed by default.
    pub free: Vec<&'static str>,
    /// f32 or f64: what it is evaluated in.
    pub precision: &'static str,
    /// Operations of one evaluation, weighted as docs/tradeoff.md says.
    pub cost: u64,
    /// The parameters.
    pub parameters: Vec<ParameterValue>,
    /// How far its image is from the measured one.
    pub differences: Differences,
    /// Whether the fit is usable and the image within the tolerance.
    pub passes: bool,
    /// Whether the fit is usable.
    pub usable: bool,
}

/// What to choose from and how.
#[derive(Clone, Debug)]
pub struct Request<'a> {
    /// The models; the ladder of `tradeoff` if none.
    pub expressions: &'a [Expression],
    /// Metric, largest angles, seed and deadline of the fits. With a weighting the models are fitted to the measurement's own
    /// samples, `filters.samples` of them, and not to what the scene shows.
    pub options: &'a Options,
    /// The 95th percentile of CIEDE2000 that passes.
    pub tolerance: f64,
}

/// What is chosen, and the images.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What is chosen.
    pub selected: Selected,
    /// The image that the measurement makes.
    pub measured: Image,
    /// That of the answer, or of the model with the least difference where there is none.
    pub fitted: Image,
    /// Pixels that are compared.
    pub compared: Vec<bool>,
}

/// A tolerance that a difference can pass.
///
/// # Errors
/// [`Error::Usage`] unless it is a number above 0.
pub fn checked_tolerance(tolerance: f64) -> Result<f64, Error> {
    if tolerance > 0.0 && tolerance.is_finite() {
        return Ok(tolerance);
    }
    Err(Error::Usage(format!("--tolerance: expected a number above 0, found {tolerance}")))
}

/// Fits and renders every model, and chooses.
///
/// # Errors
/// [`Error::Malformed`] for a scene that sees nothing, [`Error::Usage`] where the measurement has nothing to say of what the scene shows, and as in [`fit`].
pub fn select(
    measurement: &Measurement,
    scene: &Scene,
    request: &Request<'_>,
    progress: &dyn Progress,
) -> Result<Outcome, Error> {
    let tolerance = checked_tolerance(request.tolerance)?;
    progress.stage("looking");
    let view = scene.view()?;
    let pairs: Vec<Pair> = view.samples.iter().map(|seen| seen.pair).collect();
    let interpolant = Interpolant::new(measurement);
    let there = interpolant.at(&pairs);
    let known = known(&pairs, &there.covered, request.options.filters.max_theta_deg);
    let colour = ToRgb::new(&measurement.channels);
    let studio =
        Studio { view: &view, pairs: &pairs, directions: view.directions(), known: &known, colour: &colour };
    let measured = studio.image(&there.values)?;
    let importance = Importance::new(&view, &known);
    let compared = importance.compared(&view);
    if !compared.contains(&true) {
        return Err(Error::Usage(format!(
            "{}: expected a scene that shows directions of the measurement, found none of {} that has data around it",
            scene.path().display(),
            view.samples.len()
        )));
    }
    let fits = match request.options.filters.weighting {
        Some(weighting) => Fits {
            data: Cow::Borrowed(measurement),
            filters: request.options.filters.clone(),
            weights: weighting.name(),
        },
        None => {
            let drawn = importance.draw(measurement, &view, &there.values, &known, request.options);
            let data = drawn.ok_or_else(|| {
                Error::Usage(format!(
                    "{}: expected directions within --max-theta, found none",
                    scene.path().display()
                ))
            })?;
            let uniform = Some(Weighting::Uniform);
            let filters = Filters { samples: None, weighting: uniform, ..request.options.filters.clone() };
            Fits { data: Cow::Owned(data), filters, weights: "scene" }
        }
    };

    let candidates = Candidate::all(request.expressions)?;
    let mut shown: Vec<(Tried, Image)> = Vec::new();
    let mut failure = None;
    for (index, candidate) in candidates.iter().enumerate() {
        let name = candidate.expression.canonical();
        progress.stage(&format!("model {} of {}: {name}", index + 1, candidates.len()));
        match studio.try_model(candidate, &fits, request, (&measured, &compared)) {
            Ok(both) => shown.extend(both),
            // A model with more parameters than there is to fit, for one: the others may do.
            Err(error) => failure = Some(error),
        }
    }
    // Stable: of the same cost and precision, the first of the ladder.
    shown.sort_by_key(|(tried, _)| (tried.cost, tried.precision != "f32"));
    let answer = shown.iter().position(|(tried, _)| tried.passes);
    let best = shown.iter().enumerate().min_by(|(_, (a, _)), (_, (b, _))| {
        a.differences.delta_e_2000.p95.total_cmp(&b.differences.delta_e_2000.p95)
    });
    let Some(displayed) = answer.or(best.map(|(index, _)| index)) else {
        return Err(failure.unwrap_or_else(|| Error::Usage("expected a model, found none".to_owned())));
    };
    let next_cheaper = answer.and_then(|answer| {
        let cost = shown.get(answer).map(|(tried, _)| tried.cost)?;
        shown.iter().take(answer).rposition(|(tried, _)| !tried.passes && tried.cost < cost)
    });
    let (tried, images): (Vec<Tried>, Vec<Image>) = shown.into_iter().unzip();
    let fitted = images.into_iter().nth(displayed).unwrap_or_else(|| measured.clone());
    let selected = Selected {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        data: Data {
            path: measurement.source.path.display().to_string(),
            sha256: measurement.source.sha256.clone(),
            channels: measurement.channels.iter().map(|channel| channel.name.clone()).collect(),
            colour: colour.route,
            left_out: interpolant.leave_out_error(LeftOut::Light),
        },
        scene: SceneRecord {
            path: scene.path().display().to_string(),
            width: view.width,
            height: view.height,
            object_pixels: view.covered.iter().filter(|covered| **covered).count(),
            compared_pixels: compared.iter().filter(|compared| **compared).count(),
            pairs: view.samples.len(),
            covered_light: importance.covered_light(),
        },
        metric: request.options.metric.name(),
        weights: fits.weights,
        tolerance,
        answer,
        next_cheaper,
        tried,
        seen: SeenMap::new(&view, measurement),
    };
    Ok(Outcome { selected, measured, fitted, compared })
}

/// Which pairs have data around them and lie within the largest angles.
fn known(pairs: &[Pair], covered: &[bool], max_theta_deg: f64) -> Vec<bool> {
    let least_cosine = max_theta_deg.to_radians().cos();
    let within = |pair: &Pair| pair.wi.z >= least_cosine && pair.wo.z >= least_cosine;
    pairs.iter().zip(covered).map(|(pair, covered)| *covered && within(pair)).collect()
}

/// What models are fitted to.
struct Fits<'a> {
    data: Cow<'a, Measurement>,
    filters: Filters,
    /// How its samples came to count as they do.
    weights: &'static str,
}

/// What turns values of a BRDF into an image.
struct Studio<'a> {
    view: &'a View,
    /// Of the view's samples, once more as `directions`.
    pairs: &'a [Pair],
    directions: Directions,
    /// Whether the measurement has something to say there.
    known: &'a [bool],
    colour: &'a ToRgb,
}

impl Studio<'_> {
    /// The image that values per channel and pair make.
    fn image(&self, values: &[Vec<f64>]) -> Result<Image, Error> {
        // What nobody has measured is left out of every image, so that none is wrong there.
        let mut rgb = self.colour.rows(values);
        for (rgb, known) in rgb.iter_mut().zip(self.known) {
            if !known {
                *rgb = [0.0; 3];
            }
        }
        let row = |k: usize| rgb.iter().map(|rgb| rgb.get(k).copied().unwrap_or(0.0)).collect::<Vec<f64>>();
        let (r, g, b) = (row(0), row(1), row(2));
        let side = |n: u32| usize::try_from(n).unwrap_or(0);
        Image::new(side(self.view.width), side(self.view.height), self.view.image([&r, &g, &b]))
    }

    /// Fits a model and compares its images in both precisions.
    fn try_model(
        &self,
        candidate: &Candidate,
        fits: &Fits<'_>,
        request: &Request<'_>,
        (measured, compared): (&Image, &[bool]),
    ) -> Result<[(Tried, Image); 2], Error> {
        let options = Options { filters: fits.filters.clone(), ..candidate.options(request.options)? };
        let quiet = Arc::new(Quiet) as Arc<dyn Progress>;
        let fitted = fit(&fits.data, &candidate.expression, &options, &quiet)?;
        let channels = fits.data.channels.len();
        let values: Vec<_> = (0..channels).map(|channel| fitted.table.formula_values(channel)).collect();
        let pairs = self.pairs;
        let cost =
            values.first().map_or(0, |first| counted(&candidate.expression, first, pairs).0.weighted());
        let usable = fitted.unusable.is_none();
        let tried = |precision: &'static str, rows: &[Vec<f64>]| -> Result<(Tried, Image), Error> {
            let image = self.image(rows)?;
            let differences = differences(measured, &image, compared)?;
            let tried = Tried {
                model: candidate.expression.canonical(),
                free: candidate.free.to_vec(),
                precision,
                cost,
                parameters: fitted.table.parameter_values(),
                passes: usable && differences.delta_e_2000.p95 <= request.tolerance,
                differences,
                usable,
            };
            Ok((tried, image))
        };
        let double = candidate.expression.values(&self.directions, &values);
        let single: Vec<Vec<f64>> =
            values.iter().map(|values| in_single_precision(&candidate.expression, values, pairs)).collect();
        Ok([tried("f32", &single)?, tried("f64", &double)?])
    }
}

/// How much the pairs of a view matter to its image.
struct Importance {
    /// Luminance of the light that each pair carries.
    light: Vec<f64>,
    /// The sum over the pairs of each pixel, and of those with data around them.
    by_pixel: Vec<[f64; 2]>,
}

impl Importance {
    fn new(view: &View, known: &[bool]) -> Self {
        let light: Vec<f64> = view.samples.iter().map(|seen| luminance(seen.weight)).collect();
        let mut by_pixel = vec![[0.0; 2]; view.covered.len()];
        for ((seen, light), known) in view.samples.iter().zip(&light).zip(known) {
            let place = usize::try_from(seen.pixel).ok().and_then(|pixel| by_pixel.get_mut(pixel));
            if let Some([all, with_data]) = place {
                *all += light;
                *with_data += if *known { *light } else { 0.0 };
            }
        }
        Self { light, by_pixel }
    }

    /// Pixels that count.
    fn compared(&self, view: &View) -> Vec<bool> {
        let lit = self.by_pixel.iter().zip(&view.covered);
        lit.map(|([all, with_data], object)| *object && *all > 0.0 && *with_data >= COVERED_SHARE * all)
            .collect()
    }

    fn covered_light(&self) -> f64 {
        let sums = self.by_pixel.iter().fold([0.0; 2], |[a, b], [all, with_data]| [a + all, b + with_data]);
        if sums[0] > 0.0 { sums[1] / sums[0] } else { 0.0 }
    }

    /// The measurement at pairs of the view, drawn in proportion to what an error there does to the image; none if no pair is
    /// known.
    ///
    /// An error d of f at a pair with weight w changes its pixel by w d, and the pairs of a pixel err alike, so
    /// the pixel's squared error is at most W sum(w d^2), W their sum (Cauchy and Schwarz). Fits compare x = f cos(theta_i):
    /// a pair counts W w/cos(theta_i)^2.
    fn draw(
        &self,
        measurement: &Measurement,
        view: &View,
        values: &[Vec<f64>],
        known: &[bool],
        options: &Options,
    ) -> Option<Measurement> {
        let mut sum = 0.0;
        let running: Vec<f64> = view
            .samples
            .iter()
            .zip(&self.light)
            .zip(known)
            .map(|((seen, light), known)| {
                let pixel = usize::try_from(seen.pixel).ok().and_then(|pixel| self.by_pixel.get(pixel));
                let [of_pixel, _] = pixel.copied().unwrap_or_default();
                let cosine = seen.pair.wi.z;
                if *known && cosine > 0.0 {
                    sum += of_pixel * light / (cosine * cosine);
                }
                sum
            })
            .collect();
        if !(sum > 0.0 && sum.is_finite()) {
            return None;
        }
        // One from each of as many equal stretches of the sum, at its middle: no chance is left.
        let wanted = options.filters.samples.unwrap_or(DRAWN);
        let chosen: Vec<usize> = (0..wanted)
            .map(|k| {
                let at = (count(k) + 0.5) / count(wanted) * sum;
                running.partition_point(|running| *running <= at).min(running.len().saturating_sub(1))
            })
            .collect();
        let pick = |row: &Vec<f64>| chosen.iter().filter_map(|index| row.get(*index).copied()).collect();
        Some(Measurement {
            directions: view.directions().select(&chosen),
            values: values.iter().map(pick).collect(),
            sigma: None,
            dropped: BTreeMap::new(),
            doubts: Vec::new(),
            source: measurement.source.clone(),
            channels: measurement.channels.clone(),
        })
    }
}
