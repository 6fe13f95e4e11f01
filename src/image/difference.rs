//! Differences between two images: in radiance, and as an eye sees them.
//!
//! Sums run over the pixels of the mask, which is the object, and over the three channels. b is the measured image, a the
//! other.
//!
//! ```text
//! relative RMSE = sqrt(sum |a - b|^2 / sum |b|^2)         linear radiance, not exposed
//! exposure e:     e times the 99th percentile of b's luminance = 1
//! a' = clip(e a, 0, 1), b' likewise
//! PSNR = -10 log10(sum |a' - b'|^2 / (3 n))               dB; the peak is the exposure's white, 1
//! delta E_00(Lab(a'), Lab(b'))                            per pixel
//! ```
//!
//! - The relative RMSE uses no exposure and no clipping, so highlights count in full.
//! - PSNR and delta E compare what a screen would show. Both images get the exposure of the measured one, so an image that
//!   is too bright stays too bright.
//! - Lab: CIE 15:2004, 8.2.1, with the white of D65, which is RGB (1, 1, 1).
//! - delta E_00: CIEDE2000 with kL = kC = kH = 1, in the formulation of Sharma, Wu and Dalal 2005 (doi:10.1002/col.20070);
//!   a trained eye can just tell a difference of about 1 side by side.
//! - The percentile p of n values is the one with rank ceil(p n) in ascending order.

use super::Image;
use super::colour::{TO_XYZ, luminance, white_xyz};
use crate::error::Error;
use crate::math::count;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// The differences between an image and the measured one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Differences {
    /// sqrt(sum |a - b|^2 / sum |b|^2) of linear radiance; null where the measured image is black.
    pub relative_rmse: Option<f64>,
    /// Peak signal-to-noise ratio of the exposed, clipped images, dB; null where they are equal.
    pub psnr_db: Option<f64>,
    /// CIEDE2000 of the exposed, clipped images.
    pub delta_e_2000: DeltaE2000,
    /// The factor that radiance is multiplied by before clipping; it makes the 99th percentile of the measured image's
    /// luminance 1.
    pub exposure: f64,
    /// Number of pixels of the object.
    pub pixels: usize,
}

/// CIEDE2000 over the pixels of the object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DeltaE2000 {
    /// Mean.
    pub mean: f64,
    /// Median.
    pub p50: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Largest.
    pub max: f64,
}

/// Compares an image with the measured one over the pixels where `mask` is true.
///
/// # Errors
/// [`Error::Invalid`] if the images and the mask differ in size, if no pixel is in the mask, or if one in it is not finite.
pub fn differences(measured: &Image, other: &Image, mask: &[bool]) -> Result<Differences, Error> {
    let exposure = exposure(measured, mask)?;
    let delta_e = delta_e_2000(measured, other, mask, exposure)?;
    let (mut apart, mut whole, mut shown) = (0.0, 0.0, 0.0);
    for (b, a) in object(measured, mask).zip(object(other, mask)) {
        for (b, a) in b.into_iter().zip(a) {
            apart += (a - b) * (a - b);
            whole += b * b;
            let step = clip(a * exposure) - clip(b * exposure);
            shown += step * step;
        }
    }
    let mut sorted: Vec<f64> = object(&delta_e, mask).collect();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    Ok(Differences {
        relative_rmse: (whole > 0.0).then(|| (apart / whole).sqrt()),
        psnr_db: (shown > 0.0).then(|| -10.0 * (shown / (3.0 * count(n))).log10()),
        delta_e_2000: DeltaE2000 {
            mean: sorted.iter().sum::<f64>() / count(n),
            p50: percentile(&sorted, 50),
            p95: percentile(&sorted, 95),
            max: percentile(&sorted, 100),
        },
        exposure,
        pixels: n,
    })
}

/// The factor that makes the 99th percentile of the object's luminance 1; 1 if that percentile is not positive.
///
/// # Errors
/// [`Error::Invalid`] if the mask has a different size, if no pixel is in it, or if one in it is not finite.
pub fn exposure(image: &Image, mask: &[bool]) -> Result<f64, Error> {
    check(image, mask)?;
    let mut sorted: Vec<f64> = object(image, mask).map(luminance).collect();
    sorted.sort_by(f64::total_cmp);
    let white = percentile(&sorted, 99);
    Ok(if white > 0.0 && white.recip().is_finite() { white.recip() } else { 1.0 })
}

/// CIEDE2000 per pixel of the images after `exposure` and clipping to 0..1; 0 outside the mask.
///
/// # Errors
/// [`Error::Invalid`] as for [`differences`].
pub fn delta_e_2000(
    measured: &Image,
    other: &Image,
    mask: &[bool],
    exposure: f64,
) -> Result<Vec<f64>, Error> {
    check(measured, mask)?;
    check(other, mask)?;
    if (measured.width, measured.height) != (other.width, other.height) {
        let [a, b] = [measured, other].map(|image| format!("{} x {}", image.width, image.height));
        return Err(Error::invalid("images", "two images of the same size", format!("{a} and {b}")));
    }
    let shown = |pixel: [f64; 3]| lab(pixel.map(|value| clip(value * exposure)));
    let pixels = measured.pixels.par_iter().zip(&other.pixels).zip(mask);
    Ok(pixels.map(|((b, a), is)| if *is { ciede2000(shown(*b), shown(*a)) } else { 0.0 }).collect())
}

/// The image |a - b|, per channel and pixel.
///
/// # Errors
/// [`Error::Invalid`] if they differ in size.
pub fn absolute_difference(a: &Image, b: &Image) -> Result<Image, Error> {
    if (a.width, a.height, a.pixels.len()) != (b.width, b.height, b.pixels.len()) {
        let [a, b] = [a, b].map(|image| format!("{} x {}", image.width, image.height));
        return Err(Error::invalid("images", "two images of the same size", format!("{a} and {b}")));
    }
    let pixels = a.pixels.iter().zip(&b.pixels);
    let apart = |([ar, ag, ab], [br, bg, bb]): (&[f64; 3], &[f64; 3])| {
        [(ar - br).abs(), (ag - bg).abs(), (ab - bb).abs()]
    };
    Image::new(a.width, a.height, pixels.map(apart).collect())
}

/// The pixels of an image, or the values of a map, that belong to the object.
fn object<'a, T: Copy + 'a>(
    of: &'a (impl Pixels<T> + ?Sized),
    mask: &'a [bool],
) -> impl Iterator<Item = T> + 'a {
    of.pixels().iter().zip(mask).filter(|(_, is)| **is).map(|(value, _)| *value)
}

trait Pixels<T> {
    fn pixels(&self) -> &[T];
}

impl Pixels<[f64; 3]> for Image {
    fn pixels(&self) -> &[[f64; 3]] {
        &self.pixels
    }
}

impl Pixels<f64> for Vec<f64> {
    fn pixels(&self) -> &[f64] {
        self
    }
}

fn check(image: &Image, mask: &[bool]) -> Result<(), Error> {
    image.check()?;
    if image.pixels.len() != mask.len() {
        let (expected, found) = (image.pixels.len(), mask.len());
        return Err(Error::invalid("mask", format!("{expected} pixels"), found.to_string()));
    }
    if !mask.contains(&true) {
        return Err(Error::invalid("mask", "at least one pixel of the object", "none"));
    }
    if object(image, mask).flatten().any(|value| !value.is_finite()) {
        return Err(Error::invalid("image", "finite radiance", "NaN or infinity"));
    }
    Ok(())
}

/// The value of rank ceil(percent n / 100) of `n` sorted values, at least one.
fn percentile(sorted: &[f64], percent: usize) -> f64 {
    assert!(!sorted.is_empty(), "a percentile needs at least one value");
    let rank = (sorted.len() * percent).div_ceil(100).max(1);
    sorted[rank - 1]
}

/// Clips a value to the range that a screen can show, 0 to 1.
pub(super) fn clip(value: f64) -> f64 {
    value.clamp(0.0, 1.0)
}

/// L*, a*, b* of linear RGB, with (1, 1, 1) as the white.
#[must_use]
pub fn lab(rgb: [f64; 3]) -> [f64; 3] {
    let xyz = (*TO_XYZ * Vector3::from(rgb)).component_div(&white_xyz());
    from_roots(xyz.map(root)).into()
}

/// Like [`lab`], with derivatives: a row for each of L*, a*, b*, a column for each of red, green, blue.
pub(super) fn lab_with_slopes(rgb: [f64; 3]) -> (Vector3<f64>, Matrix3<f64>) {
    let relative = Matrix3::from_diagonal(&white_xyz().map(f64::recip)) * *TO_XYZ;
    let xyz = relative * Vector3::from(rgb);
    let roots = Matrix3::from_diagonal(&xyz.map(root_slope)) * relative;
    let columns: Vec<Vector3<f64>> = roots.column_iter().map(|slopes| from_roots(slopes.into())).collect();
    let mut slopes = Matrix3::from_columns(&columns);
    // The constant 16 of L* has no derivative.
    slopes.row_mut(0).add_scalar_mut(16.0);
    (from_roots(xyz.map(root)), slopes)
}

/// L*, a*, b* from the cube roots of X, Y and Z.
fn from_roots(roots: Vector3<f64>) -> Vector3<f64> {
    let [x, y, z] = roots.into();
    Vector3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
}

/// Cube root below which, at (6/29)^3, a straight line with the same slope replaces it, since the root gets too steep.
const KNEE: f64 = 6.0 / 29.0;

fn root(t: f64) -> f64 {
    if t > KNEE * KNEE * KNEE { t.cbrt() } else { t / (3.0 * KNEE * KNEE) + 4.0 / 29.0 }
}

/// The derivative of `root`.
fn root_slope(t: f64) -> f64 {
    let root = root(t).max(KNEE);
    1.0 / (3.0 * root * root)
}

/// CIEDE2000 between two colours in L*, a*, b*, with all three parametric factors 1.
///
/// Equation numbers are those of Sharma, Wu and Dalal 2005. Hues are in degrees.
#[must_use]
pub fn ciede2000([l1, a1, b1]: [f64; 3], [l2, a2, b2]: [f64; 3]) -> f64 {
    // sqrt(c^7/(c^7 + 25^7)): how far the chroma c is from grey (4 and 17).
    let saturation = |c: f64| {
        let c7 = c.powi(7);
        (c7 / (c7 + 25.0_f64.powi(7))).sqrt()
    };
    // a* is stretched near the neutral axis (2 to 7).
    let g = 0.5 * (1.0 - saturation(0.5 * (a1.hypot(b1) + a2.hypot(b2))));
    let [(c1, h1), (c2, h2)] = [(a1, b1), (a2, b2)].map(|(a, b)| {
        let a = (1.0 + g) * a;
        // atan2(0, 0) is 0, which is the hue that the paper gives to greys.
        (a.hypot(b), b.atan2(a).to_degrees().rem_euclid(360.0))
    });

    // Differences of lightness, chroma and hue; hue differences are taken the short way round (8 to 11).
    let (dl, dc) = (l2 - l1, c2 - c1);
    let grey = c1 * c2 == 0.0;
    let turn = match h2 - h1 {
        _ if grey => 0.0,
        turn if turn > 180.0 => turn - 360.0,
        turn if turn < -180.0 => turn + 360.0,
        turn => turn,
    };
    let dh = 2.0 * (c1 * c2).sqrt() * (0.5 * turn).to_radians().sin();

    // Means; the mean hue lies in the middle of the short way round (12 to 14).
    let (l, c) = (0.5 * (l1 + l2), 0.5 * (c1 + c2));
    let sum = h1 + h2;
    let h = match (h1 - h2).abs() {
        _ if grey => sum,
        apart if apart <= 180.0 => 0.5 * sum,
        _ if sum < 360.0 => 0.5 * (sum + 360.0),
        _ => 0.5 * (sum - 360.0),
    };

    // Weights (15 to 20) and the rotation between chroma and hue in the blue (16, 17, 21).
    let cos = |degrees: f64| degrees.to_radians().cos();
    let t = 1.0 - 0.17 * cos(h - 30.0) + 0.24 * cos(2.0 * h) + 0.32 * cos(3.0 * h + 6.0)
        - 0.20 * cos(4.0 * h - 63.0);
    let l50 = (l - 50.0) * (l - 50.0);
    let (sl, sc, sh) = (1.0 + 0.015 * l50 / (20.0 + l50).sqrt(), 1.0 + 0.045 * c, 1.0 + 0.015 * c * t);
    let blue = (h - 275.0) / 25.0;
    let rt = -(60.0 * (-blue * blue).exp()).to_radians().sin() * 2.0 * saturation(c);
    let (l, c, h) = (dl / sl, dc / sc, dh / sh);
    // (22); rounding could make the sum negative.
    (l * l + c * c + h * h + rt * c * h).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    /// All pairs of table 1 of Sharma, Wu and Dalal 2005: L, a, b of both colours, and delta E.
    const SHARMA: [[f64; 7]; 34] = [
        [50.0000, 2.6772, -79.7751, 50.0000, 0.0000, -82.7485, 2.0425],
        [50.0000, 3.1571, -77.2803, 50.0000, 0.0000, -82.7485, 2.8615],
        [50.0000, 2.8361, -74.0200, 50.0000, 0.0000, -82.7485, 3.4412],
        [50.0000, -1.3802, -84.2814, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -1.1848, -84.8006, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -0.9009, -85.5211, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, 0.0000, 0.0000, 50.0000, -1.0000, 2.0000, 2.3669],
        [50.0000, -1.0000, 2.0000, 50.0000, 0.0000, 0.0000, 2.3669],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0009, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0010, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0011, 7.2195],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0012, 7.2195],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0009, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0010, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0011, -2.4900, 4.7461],
        [50.0000, 2.5000, 0.0000, 50.0000, 0.0000, -2.5000, 4.3065],
        [50.0000, 2.5000, 0.0000, 73.0000, 25.0000, -18.0000, 27.1492],
        [50.0000, 2.5000, 0.0000, 61.0000, -5.0000, 29.0000, 22.8977],
        [50.0000, 2.5000, 0.0000, 56.0000, -27.0000, -3.0000, 31.9030],
        [50.0000, 2.5000, 0.0000, 58.0000, 24.0000, 15.0000, 19.4535],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.1736, 0.5854, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2972, 0.0000, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 1.8634, 0.5757, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2592, 0.3350, 1.0000],
        [60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644],
        [63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630],
        [61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731],
        [35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645],
        [22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373],
        [36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146],
        [90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441],
        [90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381],
        [6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377],
        [2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082],
    ];

    #[test]
    fn published_pairs() {
        for [l1, a1, b1, l2, a2, b2, expected] in SHARMA {
            let (one, two) = ([l1, a1, b1], [l2, a2, b2]);
            // Printed with four decimals.
            assert_abs_diff_eq!(ciede2000(one, two), expected, epsilon = 0.5001e-4);
            assert_abs_diff_eq!(ciede2000(two, one), expected, epsilon = 0.5001e-4);
            assert_eq!(ciede2000(one, one), 0.0);
        }
    }

    #[test]
    fn lab_of_known_colours() {
        // L* = 116 cbrt(Y) - 16 of greys; sRGB red in Lab with D65, to two decimals, as colour tools print it.
        let [l, a, b] = lab([0.18; 3]);
        assert_relative_eq!(l, 116.0 * 0.18_f64.cbrt() - 16.0, max_relative = 1e-12);
        assert_abs_diff_eq!(a, 0.0, epsilon = 1e-12);
        assert_abs_diff_eq!(b, 0.0, epsilon = 1e-12);
        for (value, expected) in lab([1.0, 0.0, 0.0]).into_iter().zip([53.24, 80.09, 67.20]) {
            assert_abs_diff_eq!(value, expected, epsilon = 0.02);
        }
        assert_relative_eq!(lab([1e-4; 3])[0], 24389.0 / 27.0 * 1e-4, max_relative = 1e-12);
    }

    fn grey(values: &[f64]) -> Image {
        Image::new(values.len(), 1, values.iter().map(|v| [*v; 3]).collect()).unwrap()
    }

    #[test]
    fn differences_of_simple_images() {
        let measured = grey(&[1.0, 2.0, 4.0, 100.0]);
        let other = grey(&[1.0, 2.0, 2.0, 0.0]);
        let mask = [true, true, true, false];
        let found = differences(&measured, &other, &mask).unwrap();
        assert_relative_eq!(found.exposure, 0.25, max_relative = 1e-12);
        assert_eq!(found.pixels, 3);
        // |4 - 2|^2 / (1 + 4 + 16), the same in each channel.
        assert_relative_eq!(found.relative_rmse.unwrap(), (4.0_f64 / 21.0).sqrt(), max_relative = 1e-12);
        // Exposed: 1 against 0.5, in one of three pixels.
        assert_relative_eq!(found.psnr_db.unwrap(), -10.0 * (0.25_f64 / 3.0).log10(), max_relative = 1e-12);
        let expected = ciede2000([100.0, 0.0, 0.0], [116.0 * 0.5_f64.cbrt() - 16.0, 0.0, 0.0]);
        assert_relative_eq!(found.delta_e_2000.max, expected, max_relative = 1e-9);
        assert_relative_eq!(found.delta_e_2000.mean, expected / 3.0, max_relative = 1e-9);
        assert_eq!(found.delta_e_2000.p50, 0.0);

        let same = differences(&measured, &measured, &mask).unwrap();
        assert_eq!((same.relative_rmse, same.psnr_db, same.delta_e_2000.max), (Some(0.0), None, 0.0));
        let black = differences(&grey(&[0.0; 4]), &other, &mask).unwrap();
        assert_eq!((black.relative_rmse, black.exposure), (None, 1.0));
        assert_eq!(absolute_difference(&measured, &other).unwrap(), grey(&[0.0, 0.0, 2.0, 100.0]));
    }

    #[test]
    fn the_exposure_leaves_a_hundredth_beyond_white() {
        let values: Vec<f64> = (1..=1000).map(f64::from).collect();
        let found = exposure(&grey(&values), &[true; 1000]).unwrap();
        assert_relative_eq!(found, 1.0 / 990.0, max_relative = 1e-12);
    }

    #[test]
    fn what_does_not_fit_is_an_error() {
        let image = grey(&[1.0, 2.0]);
        for (other, mask) in [
            (grey(&[1.0]), [true; 2].as_slice()),
            (image.clone(), &[true]),
            (image.clone(), &[false, false]),
            (grey(&[f64::NAN, 1.0]), &[true, true]),
            (Image::new(1, 2, image.pixels.clone()).unwrap(), &[true, true]),
        ] {
            assert!(differences(&image, &other, mask).is_err());
        }
        assert!(Image::new(2, 2, image.pixels).is_err());
    }
}
