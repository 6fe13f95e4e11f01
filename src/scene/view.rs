//! Computes what the pixels of a scene see.

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
    /// Whether each pixel, row by row, sees the surface.
    pub covered: Vec<bool>,
    /// The pairs of directions that the pixels see, pixel by pixel.
    pub samples: Vec<Seen>,
}

/// One pair of directions that a pixel sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// The pixel, as column + width * row.
    pub pixel: u32,
    /// The directions, in the local frame.
    pub pair: Pair,
    /// Factors of the BRDF for red, green and blue, W/m^2.
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

    /// Renders the image from values of the BRDF, one per channel and sample. The pixels are red, green and blue radiance,
    /// W/(m^2 sr), row by row; those that do not see the surface are black.
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
    /// Computes what the pixels see.
    ///
    /// # Errors
    /// [`Error::Malformed`] if no pixel sees the surface, if no light reaches what they see, or if the view would have more
    /// than [`MOST_SAMPLES`] samples.
    pub fn view(&self) -> Result<View, Error> {
        of(self, &self.lamps, usize::MAX)
    }

    /// Computes what at most `pixels` of the pixels, evenly spaced in their order, see when lights are divided into
    /// [`FINER`](super::FINER) times as many points. The comparison shows whether the lights have enough points. Fewer pixels
    /// are used if they would take more than a quarter of [`MOST_SAMPLES`].
    ///
    /// # Errors
    /// As for [`Self::view`].
    pub fn finer_view(&self, pixels: usize) -> Result<View, Error> {
        let most = MOST_SAMPLES / 4 / self.finer_lamps.len().max(1);
        of(self, &self.finer_lamps, pixels.min(most.max(1)))
    }
}

/// Computes what the pixels of `scene` see in the light of `lamps`, for at most `most` of the pixels that see the surface.
fn of(scene: &Scene, lamps: &[Lamp], most: usize) -> Result<View, Error> {
    let (width, height) = scene.size();
    let hit = |pixel: u32| scene.surface.hit(&scene.camera.ray(pixel % width, pixel / width));
    // The points on the surface are computed again below; storing those of a large image would take gigabytes.
    let mut covered: Vec<bool> =
        (0..width * height).into_par_iter().map(|pixel| hit(pixel).is_some()).collect();
    let pixels: Vec<u32> = (0..).zip(&covered).filter_map(|(pixel, seen)| seen.then_some(pixel)).collect();
    if pixels.is_empty() {
        return Err(scene.wrong("a camera that sees the outside of the surface", "none of its pixels does"));
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
            "{seeing} pixels times {lamps} points of light; reduce the width and height, or the samples of the lights"
        );
        return Err(scene.wrong(format!("at most {MOST_SAMPLES} samples"), found));
    }
    // Pieces of a fixed size are joined in order, so the list is the same at any number of threads.
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
        return Err(scene.wrong("a light that reaches the visible surface", "none"));
    }
    Ok(View { width, height, covered, samples })
}

/// Appends the samples of one pixel.
fn look(scene: &Scene, lamps: &[Lamp], pixel: u32, hit: &Hit, samples: &mut Vec<Seen>) {
    let wo = hit.frame.local((scene.camera.position - hit.point).normalize());
    // At the edge of a mesh, a visible facet may have a shading normal that faces away from the camera.
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
        // The weight is 0 for a panel seen edge-on, or for light so faint that it underflows.
        if weight.max_element() > 0.0 {
            let wi = hit.frame.local(to_light);
            samples.push(Seen { pixel, pair: Pair { wi, wo }, weight: weight.to_array() });
        }
    }
}
