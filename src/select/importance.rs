//! Importance of each pair of directions to the image of a scene, and samples drawn in proportion to it.

use crate::image::luminance;
use crate::math::count;
use crate::scene::View;

/// A pixel is compared if at least this share of its light comes along directions with data around them.
pub const COVERED_SHARE: f64 = 0.5;

/// The importance of the pairs of a view to its image.
pub(super) struct Importance {
    /// Luminance of the light that each pair carries.
    light: Vec<f64>,
    /// For each pixel, the luminance summed over all of its pairs, and over those with data around them.
    by_pixel: Vec<[f64; 2]>,
}

impl Importance {
    /// Computes the importance of the pairs of a view; `known` says for each pair whether there are data around it.
    pub(super) fn new(view: &View, known: &[bool]) -> Self {
        assert_eq!(known.len(), view.samples.len(), "one entry of `known` per pair of the view");
        let light: Vec<f64> = view.samples.iter().map(|seen| luminance(seen.weight)).collect();
        let mut by_pixel = vec![[0.0; 2]; view.covered.len()];
        for ((seen, light), known) in view.samples.iter().zip(&light).zip(known) {
            let [all, with_data] = &mut by_pixel[seen.place()];
            *all += light;
            *with_data += if *known { *light } else { 0.0 };
        }
        Self { light, by_pixel }
    }

    /// Which pixels are compared: those that show the object and get enough of their light along pairs with data around
    /// them.
    pub(super) fn compared(&self, view: &View) -> Vec<bool> {
        let lit = self.by_pixel.iter().zip(&view.covered);
        lit.map(|([all, with_data], object)| *object && *all > 0.0 && *with_data >= COVERED_SHARE * all)
            .collect()
    }

    /// The share of all light that comes along pairs with data around them.
    pub(super) fn covered_light(&self) -> f64 {
        let sums = self.by_pixel.iter().fold([0.0; 2], |[a, b], [all, with_data]| [a + all, b + with_data]);
        if sums[0] > 0.0 { sums[1] / sums[0] } else { 0.0 }
    }

    /// Draws `wanted` pairs of the view in proportion to the effect that an error there has on the image, and returns their
    /// indices. `None` if no pair is known.
    ///
    /// An error d of f at a pair with weight w changes its pixel by w d. The pairs of a pixel tend to err in the same way,
    /// so the bound W sum(w d^2) on the pixel's squared error is used, with W = sum w (Cauchy and Schwarz). Fits compare
    /// x = f cos(theta_i), so a pair counts W w/cos(theta_i)^2.
    pub(super) fn draw(&self, view: &View, known: &[bool], wanted: usize) -> Option<Vec<usize>> {
        assert_eq!(
            self.light.len(),
            view.samples.len(),
            "the view is the one that the importance was computed for"
        );
        assert_eq!(known.len(), view.samples.len(), "one entry of `known` per pair of the view");
        let mut sum = 0.0;
        let seen = view.samples.iter().zip(&self.light).zip(known);
        let running: Vec<f64> = seen
            .map(|((seen, light), known)| {
                let [of_pixel, _] = self.by_pixel[seen.place()];
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
        // The sum is cut into `wanted` equal stretches, and the pair at the middle of each is taken: nothing is random.
        let pair_at = |k: usize| {
            let at = (count(k) + 0.5) / count(wanted) * sum;
            running.partition_point(|running| *running <= at).min(running.len().saturating_sub(1))
        };
        Some((0..wanted).map(pair_at).collect())
    }
}
