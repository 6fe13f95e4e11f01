//! Colours for values: perceptually uniform, and safe for readers who confuse colours.

use super::difference::clip;
use crate::math::{Real as _, count};

/// Colours along a scale from 0 to 1, with straight lines in sRGB between evenly spaced points.
#[derive(Debug)]
pub struct ColourMap {
    /// Its name in the literature.
    pub name: &'static str,
    /// The points, sRGB.
    points: [[u8; 3]; 17],
}

/// Viridis by van der Walt and Smith (2015, matplotlib's default, CC0): every sixteenth of its 256 colours. For magnitudes.
pub static VIRIDIS: ColourMap = ColourMap {
    name: "viridis",
    points: [
        [68, 1, 84],
        [72, 24, 106],
        [71, 45, 123],
        [66, 64, 134],
        [59, 82, 139],
        [51, 99, 141],
        [44, 114, 142],
        [38, 130, 142],
        [33, 145, 140],
        [31, 159, 136],
        [39, 173, 129],
        [61, 188, 116],
        [92, 200, 99],
        [129, 211, 77],
        [170, 220, 50],
        [213, 226, 26],
        [253, 231, 37],
    ],
};

/// Vik by Crameri (2018, doi:10.5281/zenodo.1243862, MIT): every sixteenth of its 256 colours, blue below the neutral middle and red
/// above it. For differences.
pub static VIK: ColourMap = ColourMap {
    name: "vik",
    points: [
        [0, 18, 97],
        [2, 43, 113],
        [3, 68, 129],
        [12, 94, 146],
        [48, 125, 166],
        [97, 158, 189],
        [148, 190, 210],
        [198, 219, 230],
        [236, 229, 224],
        [233, 204, 186],
        [220, 172, 144],
        [207, 142, 104],
        [195, 114, 67],
        [179, 83, 31],
        [148, 47, 6],
        [116, 21, 6],
        [89, 0, 8],
    ],
};

impl ColourMap {
    /// The colour at `t` between 0 and 1, sRGB 0..255; NaN has the colour of 0.
    #[must_use]
    pub fn at(&self, t: f64) -> [f64; 3] {
        let t = if t > 0.0 { clip(t) } else { 0.0 };
        let along = t * count(self.points.len() - 1);
        let low = along.whole().min(self.points.len() - 2);
        let rest = along - count(low);
        let (a, b) = (self.points[low].map(f64::from), self.points[low + 1].map(f64::from));
        [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::lab;

    /// CIELAB of a colour of a map.
    fn lightness_and_colour(map: &ColourMap, t: f64) -> [f64; 3] {
        let linear = |v: f64| {
            let v = v / 255.0;
            if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        };
        lab(map.at(t).map(linear))
    }

    #[test]
    fn magnitudes_grow_lighter_and_differences_darken_from_a_neutral_middle() {
        let lightness = |map, k: i32| lightness_and_colour(map, f64::from(k) / 100.0)[0];
        assert!((0..100).all(|k| lightness(&VIRIDIS, k + 1) > lightness(&VIRIDIS, k)));
        assert!((0..47).all(|k| lightness(&VIK, k + 1) > lightness(&VIK, k)));
        assert!((51..100).all(|k| lightness(&VIK, k + 1) < lightness(&VIK, k)));
        let [l, a, b] = lightness_and_colour(&VIK, 0.5);
        assert!(l > 88.0 && a.hypot(b) < 6.0, "{l} {a} {b}");
        // Equal distances from the middle are about equally dark.
        for k in [10, 25, 40] {
            assert!((lightness(&VIK, k) - lightness(&VIK, 100 - k)).abs() < 12.0, "{k}");
        }
    }

    #[test]
    fn the_ends_hold_beyond_the_scale() {
        assert_eq!(VIRIDIS.at(-1.0), VIRIDIS.at(0.0));
        assert_eq!(VIRIDIS.at(f64::NAN), VIRIDIS.at(0.0));
        assert_eq!(VIK.at(7.0), [89.0, 0.0, 8.0]);
    }
}
