//! How much each pair of directions of a scene matters to its image, and samples drawn in proportion.

use crate::image::luminance;
use crate::math::count;
use crate::scene::View;

/// A pixel counts if at least this share of its light comes along directions with data around them.
pub const COVERED_SHARE: f64 = 0.5;

/// How much the pairs of a view matter to its image.
pub(super) struct Importance {
    /// Luminance of the light that each pair carries.
    light: Vec<f64>,
    /// The sum over the pairs of each pixel, and of those with data around them.
    by_pixel: Vec<[f64; 2]>,
}

impl Importance {
    /// How much the pairs of a view matter, of which those that are `known` have data around them.
    pub(super) fn new(view: &View, known: &[bool]) -> Self {
        assert_eq!(known.len(), view.samples.len(), "what is known stands beside each pair of the view");
        let light: Vec<f64> = view.samples.iter().map(|seen| luminance(seen.weight)).collect();
        let mut by_pixel = vec![[0.0; 2]; view.covered.len()];
        for ((seen, light), known) in view.samples.iter().zip(&light).zip(known) {
            let [all, with_data] = &mut by_pixel[seen.place()];
            *all += light;
            *with_data += if *known { *light } else { 0.0 };
        }
        Self { light, by_pixel }
    }

    /// Whether each pixel counts: it shows the object, and enough of its light comes along pairs with data around them.
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

    /// Draws `wanted` pairs of the view in proportion to what an error there does to the image. `None` means that no pair is
    /// known.
    ///
    /// An error d of f at a pair with weight w changes its pixel by w d, and the pairs of a pixel err alike, so
    /// the pixel's squared error is at most W sum(w d^2), W their sum (Cauchy and Schwarz). Fits compare x = f cos(theta_i):
    /// a pair counts W w/cos(theta_i)^2.
    pub(super) fn draw(&self, view: &View, known: &[bool], wanted: usize) -> Option<Vec<usize>> {
        assert_eq!(self.light.len(), view.samples.len(), "the view is the one whose pairs matter");
        assert_eq!(known.len(), view.samples.len(), "what is known stands beside each pair of the view");
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
        // One from each of as many equal stretches of the sum, at its middle: no chance is left.
        let pair_at = |k: usize| {
            let at = (count(k) + 0.5) / count(wanted) * sum;
            running.partition_point(|running| *running <= at).min(running.len().saturating_sub(1))
        };
        Some((0..wanted).map(pair_at).collect())
    }
}
