//! What the pixels of a scene see.

use super::description::{MOST_SAMPLES, Scene};
use super::frame::Hit;
use super::lights::Lamp;
use crate::error::Error;
use crate::geometry::{Directions, Pair};
use rayon::prelude::*;

/// What the pixels of a scene see of its surface.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Pixels per row.
    pub width: u32,
    /// Rows, the first one at the top.
    pub height: u32,
    /// Whether a pixel, by rows, sees the surface.
    pub covered: Vec<bool>,
    /// What they see of it, pixel after pixel.
    pub samples: Vec<Seen>,
}

/// One pair of directions that a pixel sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// The pixel: column + width row.
    pub pixel: u32,
    /// The directions, in the local frame.
    pub pair: Pair,
    /// What the BRDF is to be multiplied by for red, green and blue, W/m^2.
    pub weight: [f64; 3],
}

impl Seen {
    /// The pixel as an index.
    pub(crate) fn place(&self) -> usize {
        usize::try_from(self.pixel).unwrap_or(usize::MAX)
    }
}

impl View {
    /// The pairs of directions of all samples, in order.
    #[must_use]
    pub fn directions(&self) -> Directions {
        Directions::Scattered(self.samples.iter().map(|seen| seen.pair).collect())
    }

    /// The image, W/(m^2 sr) of red, green and blue by rows, that values of the BRDF make, one per sample and channel. What does
    /// not see the surface is black.
    #[must_use]
    pub fn image(&self, values: [&[f64]; 3]) -> Vec<[f64; 3]> {
        let mut image = vec![[0.0; 3]; self.covered.len()];
        for (channel, values) in values.into_iter().enumerate() {
            for (seen, f) in self.samples.iter().zip(values) {
                let pixel = image.get_mut(seen.place());
                let sum = pixel.and_then(|pixel| pixel.get_mut(channel));
                if let (Some(sum), Some(weight)) = (sum, seen.weight.get(channel)) {
                    *sum += weight * f;
                }
            }
        }
        image
    }
}

impl Scene {
    /// What its pixels see.
    ///
    /// # Errors
    /// [`Error::Malformed`] if no pixel sees the surface, if no light reaches what they see, or if that takes more than
    /// [`MOST_SAMPLES`] samples.
    pub fn view(&self) -> Result<View, Error> {
        of(self, &self.lamps, usize::MAX)
    }

    /// What some of its pixels, at most `pixels` and evenly from their order, see of lights that are [`FINER`](super::FINER) times as many points: what
    /// tells whether there are enough of them. Fewer pixels if that took more than a quarter of [`MOST_SAMPLES`].
    ///
    /// # Errors
    /// As for [`Self::view`].
    pub fn finer_view(&self, pixels: usize) -> Result<View, Error> {
        let most = MOST_SAMPLES / 4 / self.finer_lamps.len().max(1);
        of(self, &self.finer_lamps, pixels.min(most.max(1)))
    }
}

/// What the pixels of `scene` see of `lamps`; if more than `most` pixels see the surface, `most` of them at the most.
fn of(scene: &Scene, lamps: &[Lamp], most: usize) -> Result<View, Error> {
    let (width, height) = scene.size();
    let hit = |pixel: u32| scene.surface.hit(&scene.camera.ray(pixel % width, pixel / width));
    // The points themselves are found again below: kept, those of a large image would be gigabytes.
    let mut covered: Vec<bool> =
        (0..width * height).into_par_iter().map(|pixel| hit(pixel).is_some()).collect();
    let pixels: Vec<u32> = (0..).zip(&covered).filter_map(|(pixel, seen)| seen.then_some(pixel)).collect();
    if pixels.is_empty() {
        return Err(scene.wrong("a camera that sees the outside of the surface", "no pixel that does"));
    }
    let pixels: Vec<u32> = pixels.iter().copied().step_by(pixels.len().div_ceil(most.max(1))).collect();
    let place = |pixel: &u32| usize::try_from(*pixel).unwrap_or(usize::MAX);
    covered.fill(false);
    for pixel in &pixels {
        covered.get_mut(place(pixel)).into_iter().for_each(|covered| *covered = true);
    }
    let seeing = pixels.len();
    if seeing.saturating_mul(lamps.len()) > MOST_SAMPLES {
        let lamps = lamps.len();
        let found = format!(
            "{seeing} pixels times {lamps} points of light: less width and height, or fewer samples of the lights, will do"
        );
        return Err(scene.wrong(format!("at most {MOST_SAMPLES} samples"), found));
    }
    // Pieces of a fixed size, joined in order: the same list at any number of threads.
    let pieces: Vec<Vec<Seen>> = pixels
        .par_chunks(64)
        .map(|pixels| {
            let mut samples = Vec::with_capacity(pixels.len() * lamps.len() / 2);
            for &pixel in pixels {
                if let Some(hit) = hit(pixel) {
                    look(scene, lamps, pixel, &hit, &mut samples);
                }
            }
            samples
        })
        .collect();
    let mut samples = Vec::with_capacity(pieces.iter().map(Vec::len).sum());
    pieces.into_iter().for_each(|piece| samples.extend(piece));
    if samples.is_empty() {
        return Err(scene.wrong("a light that reaches what is seen", "none"));
    }
    Ok(View { width, height, covered, samples })
}

/// Adds what one pixel sees.
fn look(scene: &Scene, lamps: &[Lamp], pixel: u32, hit: &Hit, samples: &mut Vec<Seen>) {
    let wo = hit.frame.local((scene.camera.position - hit.point).normalize());
    // At the rim of a mesh a facet may be seen whose shading normal looks away.
    if wo.z <= 0.0 {
        return;
    }
    for lamp in lamps {
        let Some((to_light, distance, irradiance)) = lamp.at(hit.point) else { continue };
        let cosine = hit.frame.normal().dot(to_light);
        if cosine <= 0.0 || scene.surface.hides(hit, to_light, distance) {
            continue;
        }
        let weight = irradiance * cosine;
        // A panel seen from its edge, or light so faint that it vanishes.
        if weight.max_element() > 0.0 {
            let wi = hit.frame.local(to_light);
            samples.push(Seen { pixel, pair: Pair { wi, wo }, weight: weight.to_array() });
        }
    }
}
