//! Renders the measurement and the models in a scene, and compares their images.

use super::importance::Importance;
use super::target::Target;
use crate::error::Error;
use crate::fit::{Metric, Shown};
use crate::geometry::{Directions, Pair};
use crate::image::{Differences, Image, differences, exposure};
use crate::measurement::Measurement;
use crate::measurement::interpolant::Interpolant;
use crate::model::{Expression, LobeValues};
use crate::scene::View;
use crate::tradeoff::{counted, in_single_precision};

/// Parameter values by channel and lobe.
pub type Values = Vec<Vec<LobeValues>>;

/// The precision that a model is evaluated in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Precision {
    Single,
    Double,
}

impl Precision {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Single => "f32",
            Self::Double => "f64",
        }
    }
}

/// A scene with the measurement rendered in it, which models are compared with.
pub(super) struct Studio {
    pub(super) view: View,
    pub(super) importance: Importance,
    /// f of the measurement, by channel and pair of the view.
    pub(super) values: Vec<Vec<f64>>,
    /// Whether the measurement covers each pair.
    pub(super) known: Vec<bool>,
    /// The image that the measurement makes.
    pub(super) measured: Image,
    /// Whether each pixel is compared.
    pub(super) compared: Vec<bool>,
    /// The directions of the view's samples.
    pub(super) directions: Directions,
}

impl Studio {
    /// Renders a measurement, using pairs with angles up to `max_theta_deg` degrees.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a view without pixels.
    pub(super) fn new(view: View, interpolant: &Interpolant, max_theta_deg: f64) -> Result<Self, Error> {
        let pairs: Vec<Pair> = view.samples.iter().map(|seen| seen.pair).collect();
        let there = interpolant.where_covered(&pairs);
        let known = known(&pairs, &there.covered, max_theta_deg);
        let measured = image(&view, &known, &there.values)?;
        let importance = Importance::new(&view, &known);
        let compared = importance.compared(&view);
        let directions = Directions::Scattered(pairs);
        Ok(Self { view, importance, values: there.values, known, measured, compared, directions })
    }

    fn pairs(&self) -> &[Pair] {
        match &self.directions {
            Directions::Scattered(pairs) => pairs,
            Directions::Grid { .. } => &[],
        }
    }

    /// The measurement interpolated at `wanted` pairs of the view, drawn in proportion to the effect that an error there has
    /// on the image. `None` if the measurement covers no pair.
    pub(super) fn draw(&self, measurement: &Measurement, wanted: usize) -> Option<Measurement> {
        let chosen = self.importance.draw(&self.view, &self.known, wanted)?;
        let pick = |row: &Vec<f64>| chosen.iter().map(|&index| row[index]).collect();
        Some(Measurement {
            source: measurement.source.clone(),
            ..Measurement::of(
                measurement.channels.clone(),
                self.directions.select(&chosen),
                self.values.iter().map(pick).collect(),
            )
        })
    }

    /// Weighted operations of one evaluation of the first channel.
    pub(super) fn cost(&self, expression: &Expression, values: &Values) -> u64 {
        counted(expression, &values[0], self.pairs()).0.weighted()
    }

    /// Renders a model, and returns the image and its differences from the measured one.
    ///
    /// # Errors
    /// [`Error::Invalid`] for an image that is not finite.
    pub(super) fn look(
        &self,
        expression: &Expression,
        values: &Values,
        precision: Precision,
    ) -> Result<(Image, Differences), Error> {
        self.compare(&self.rows(expression, values, precision))
    }

    /// f of a model, by channel and pair of the view.
    pub(super) fn rows(
        &self,
        expression: &Expression,
        values: &Values,
        precision: Precision,
    ) -> Vec<Vec<f64>> {
        match precision {
            Precision::Double => expression.values(&self.directions, values),
            Precision::Single => {
                values.iter().map(|values| in_single_precision(expression, values, self.pairs())).collect()
            }
        }
    }

    /// Renders values of f in one channel or three, and returns the image and its differences from the measured one.
    ///
    /// # Errors
    /// [`Error::Invalid`] for an image that is not finite.
    pub(super) fn compare(&self, rows: &[Vec<f64>]) -> Result<(Image, Differences), Error> {
        let image = image(&self.view, &self.known, rows)?;
        let differences = differences(&self.measured, &image, &self.compared)?;
        Ok((image, differences))
    }

    /// The measured image, exposed, as a target for fits, with the pairs that each compared pixel sees.
    ///
    /// # Errors
    /// [`Error::Invalid`] for an image that is not finite.
    pub(super) fn shown(&self, metric: Metric) -> Result<Shown<Target>, Error> {
        let exposure = exposure(&self.measured, &self.compared)?;
        let mut shown = Shown::new();
        let mut last = None;
        for (seen, known) in self.view.samples.iter().zip(&self.known) {
            let pixel = seen.place();
            if !known || !self.compared[pixel] {
                continue;
            }
            if last != Some(pixel) {
                let colour = self.measured.pixels[pixel];
                shown.add_pixel(Target::new(metric, colour.map(|value| value * exposure)));
                last = Some(pixel);
            }
            shown.add_pair(seen.pair, seen.weight.map(|weight| weight * exposure));
        }
        Ok(shown)
    }
}

/// Renders values given by channel and pair; one channel makes a grey image, three are red, green and blue. Pairs that
/// the measurement does not cover are left out of every image, so that they do not count as differences.
fn image(view: &View, known: &[bool], values: &[Vec<f64>]) -> Result<Image, Error> {
    assert!(matches!(values.len(), 1 | 3), "expected one channel or three, found {}", values.len());
    let masked = |row: &Vec<f64>| -> Vec<f64> {
        assert_eq!(row.len(), known.len(), "one value and one entry of `known` per pair");
        row.iter().zip(known).map(|(f, known)| if *known { *f } else { 0.0 }).collect()
    };
    let rows: Vec<Vec<f64>> = values.iter().map(masked).collect();
    let row = |k: usize| rows[k.min(rows.len() - 1)].as_slice();
    let side = |n: u32| usize::try_from(n).unwrap_or(0);
    Image::new(side(view.width), side(view.height), view.image([row(0), row(1), row(2)]))
}

/// Whether each pair has data around it and lies within the largest angles.
fn known(pairs: &[Pair], covered: &[bool], max_theta_deg: f64) -> Vec<bool> {
    let least_cosine = max_theta_deg.to_radians().cos();
    let within = |pair: &Pair| pair.wi.z >= least_cosine && pair.wo.z >= least_cosine;
    pairs.iter().zip(covered).map(|(pair, covered)| *covered && within(pair)).collect()
}
