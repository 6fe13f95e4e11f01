//! Converts the channels of a measurement to linear RGB.
//!
//! ```text
//! X = kx sum_j w_j S(l_j) xbar(l_j) f_j     Y, Z likewise with ybar, zbar
//! (r, g, b) = M (X, Y, Z)                   M: IEC 61966-2-1, from its primaries and the white of D65
//! ```
//!
//! - xbar, ybar, zbar: colour matching functions of the CIE 1931 two-degree observer, in the multi-lobe fit of Wyman, Sloan
//!   and Shirley 2013, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), section 2.2.
//! - S: spectral power of D65, CIE 15:2004, table T.1, every 10 nm, interpolated linearly.
//! - w: weights of the trapezoidal rule on the given wavelengths, which may be in any order and unevenly spaced.
//!   Wavelengths outside 380 to 780 nm contribute nothing and are not part of the rule.
//! - Under E the power is the same at every wavelength, and Bradford's adaptation turns its white into that of D65 (src/image/primaries.rs).
//! - kx, ky, kz: X, Y and Z are each scaled so that f = 1 at every wavelength gives the white of the light, and so
//!   RGB (1, 1, 1). That removes most of the error that the fit and a short or coarse sum cause in the white.
//!
//! A spectrum determines a hue only if it is sampled in several places: there must be a wavelength below 490 nm, one
//! from 490 to 580 nm and one above, all visible. Otherwise, and for channels that are neither RGB nor spectral, the
//! image is grey: the mean of the visible channels, or of all if none is visible. [`Route`] says which case applies.

use super::primaries::{Primaries, REC709, adaptation, from_xy};
use crate::geometry::Pair;
use crate::math::count;
use crate::measurement::{Channel, Continuous, Measurement};
use nalgebra::{Matrix3, Vector3};
use schemars::JsonSchema;
use serde::Serialize;
use std::borrow::Cow;
use std::sync::{Arc, LazyLock};

/// How the channels were converted to RGB.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Route {
    /// Channels named r, g and b, unchanged.
    Rgb,
    /// A spectrum under D65, seen by the CIE 1931 observer.
    Spectrum,
    /// Grey: a single channel, or channels that are neither RGB nor spectral; their mean.
    Grey,
    /// Grey: the mean of the visible wavelengths, which are too few for a hue.
    GreyFewWavelengths,
    /// Grey: the mean of all wavelengths, none of which is visible.
    GreyInvisible,
}

/// The linear map from a measurement's channels to linear RGB.
#[derive(Clone, Debug)]
pub struct ToRgb {
    /// Per output channel, red first, a weight per channel of the measurement.
    pub matrix: [Vec<f64>; 3],
    /// How the map was chosen.
    pub route: Route,
}

/// The light under which a spectrum is seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Illuminant {
    /// Daylight, CIE D65.
    #[default]
    D65,
    /// Equal power at all wavelengths, CIE E. White is adapted to that of D65.
    E,
}

impl Illuminant {
    /// Spectral power at a wavelength in nm, up to a factor.
    fn power(self, nm: f64) -> f64 {
        match self {
            Self::D65 => d65(nm),
            Self::E => 1.0,
        }
    }

    /// The chromaticity of its white.
    fn white(self) -> [f64; 2] {
        match self {
            Self::D65 => REC709.white,
            Self::E => [1.0 / 3.0; 2],
        }
    }
}

/// Range of wavelengths that contribute, nm.
const VISIBLE: std::ops::RangeInclusive<f64> = 380.0..=780.0;

impl ToRgb {
    /// Makes the map for these channels to linear Rec.709; spectra are seen under D65.
    #[must_use]
    pub fn new(channels: &[Channel]) -> Self {
        Self::under(channels, Illuminant::D65)
    }

    /// Makes the map for these channels to linear Rec.709; spectra are seen under `illuminant`.
    #[must_use]
    pub fn under(channels: &[Channel], illuminant: Illuminant) -> Self {
        if let Some(matrix) = named(channels) {
            return Self { matrix, route: Route::Rgb };
        }
        let wavelengths: Option<Vec<f64>> = channels.iter().map(|channel| channel.wavelength_nm).collect();
        let Some(wavelengths) = wavelengths.filter(|all| all.len() > 1) else {
            return Self::grey(channels.len(), |_| true, Route::Grey);
        };
        let visible = |j: usize| VISIBLE.contains(&wavelengths[j]);
        if !(0..wavelengths.len()).any(visible) {
            return Self::grey(channels.len(), |_| true, Route::GreyInvisible);
        }
        let thirds = [VISIBLE.start()..&490.0, &490.0..&580.0, &580.0..&780.1];
        if thirds.iter().all(|third| wavelengths.iter().any(|nm| third.contains(&nm))) {
            return Self { matrix: spectral(&wavelengths, illuminant), route: Route::Spectrum };
        }
        Self::grey(channels.len(), visible, Route::GreyFewWavelengths)
    }

    /// The same map to other primaries.
    #[must_use]
    pub fn in_primaries(self, primaries: &Primaries) -> Self {
        if primaries.are_rec709() {
            return self;
        }
        let channels = self.matrix[0].len();
        let mixed = primaries.from_rec709().map(|row| {
            (0..channels).map(|j| row.iter().zip(&self.matrix).map(|(w, from)| w * from[j]).sum()).collect()
        });
        Self { matrix: mixed, ..self }
    }

    /// The map to the mean of the `used` ones of `n` channels.
    fn grey(n: usize, used: impl Fn(usize) -> bool, route: Route) -> Self {
        let share = 1.0 / count((0..n).filter(|j| used(*j)).count()).max(1.0);
        let row: Vec<f64> = (0..n).map(|j| if used(j) { share } else { 0.0 }).collect();
        Self { matrix: [row.clone(), row.clone(), row], route }
    }

    /// Converts one value per channel to RGB.
    #[must_use]
    pub fn apply(&self, values: impl Iterator<Item = f64> + Clone) -> [f64; 3] {
        self.matrix.each_ref().map(|row| row.iter().zip(values.clone()).map(|(weight, f)| weight * f).sum())
    }

    /// Values by channel converted to red, green and blue, or to a single grey channel if `colours` is 1.
    #[must_use]
    pub fn rows(&self, rows: Vec<Vec<f64>>, colours: usize) -> Vec<Vec<f64>> {
        if rows.len() == 1 {
            return rows;
        }
        let samples = rows.first().map_or(0, Vec::len);
        let of_colour = |weights: &Vec<f64>| {
            let at =
                |sample: usize| weights.iter().zip(&rows).map(|(weight, row)| weight * row[sample]).sum();
            (0..samples).map(at).collect()
        };
        self.matrix.iter().take(colours).map(of_colour).collect()
    }

    /// The channels to which it leads: r, g and b, or grey.
    #[must_use]
    pub fn channels(&self) -> Vec<Channel> {
        let names: &[&str] = match self.route {
            Route::Rgb | Route::Spectrum => &["r", "g", "b"],
            Route::Grey | Route::GreyFewWavelengths | Route::GreyInvisible => &["grey"],
        };
        names.iter().map(|name| Channel::named(name)).collect()
    }

    /// The number of samples that lack a value in a channel that is mixed with others, so that the mixture is missing; 0 if no channels
    /// are mixed.
    #[must_use]
    pub fn incomplete(&self, measurement: &Measurement) -> usize {
        let n = measurement.channels.len();
        let is_mixture = |row: &&Vec<f64>| row.iter().filter(|weight| **weight != 0.0).count() > 1;
        let weights: Vec<&Vec<f64>> = self.matrix.iter().filter(is_mixture).collect();
        let is_mixed = |channel: &usize| weights.iter().any(|row| row[*channel] != 0.0);
        let mixed: Vec<&Vec<f64>> =
            (0..n).filter(is_mixed).map(|channel| &measurement.values[channel]).collect();
        (0..measurement.directions.len())
            .filter(|sample| mixed.iter().any(|row| row[*sample].is_nan()))
            .count()
    }

    /// A sentence about those samples; `None` if there are none.
    #[must_use]
    pub fn incomplete_in_words(&self, measurement: &Measurement) -> Option<String> {
        let incomplete = self.incomplete(measurement);
        let of = measurement.directions.len();
        (incomplete > 0).then(|| {
            format!(
                "{incomplete} of {of} samples lack a channel that is mixed with others, and were left out"
            )
        })
    }

    /// The measurement converted to red, green and blue, or to a single grey channel.
    ///
    /// A mixture lacks what one of its channels lacks. Samples that then have no value are left out, and counted as `not-measured`.
    #[must_use]
    pub fn measurement<'m>(&self, measurement: &'m Measurement) -> Cow<'m, Measurement> {
        let n = measurement.channels.len();
        let one_each =
            |(k, row): (usize, &Vec<f64>)| row.iter().zip(0..).all(|(w, j)| *w == f64::from(j == k));
        if n == 1 || (n == 3 && self.matrix.iter().enumerate().all(one_each)) {
            return Cow::Borrowed(measurement);
        }
        let channels = self.channels();
        let samples = measurement.directions.len();
        let mixed = |rows: &[Vec<f64>], term: &dyn Fn(f64, f64) -> f64| -> Vec<Vec<f64>> {
            let of_colour = |weights: &Vec<f64>| {
                let mut sums = vec![0.0; samples];
                for (weight, row) in weights.iter().zip(rows).filter(|(weight, _)| **weight != 0.0) {
                    sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += term(*weight, *value));
                }
                sums
            };
            self.matrix.iter().take(channels.len()).map(of_colour).collect()
        };
        // The errors of the channels are assumed to be independent.
        let variances = measurement.sigma.as_ref().map(|sigma| mixed(sigma, &|w, s| (w * s) * (w * s)));
        let root = |row: Vec<f64>| row.into_iter().map(f64::sqrt).collect();
        let mut converted = Measurement {
            values: mixed(&measurement.values, &|w, f| w * f),
            sigma: variances.map(|rows| rows.into_iter().map(root).collect()),
            source: measurement.source.clone(),
            directions: measurement.directions.clone(),
            dropped: measurement.dropped.clone(),
            stated: measurement.stated.clone(),
            doubts: measurement.doubts.clone(),
            remarks: measurement.remarks.clone(),
            instrument: measurement.instrument.clone(),
            continuous: measurement.continuous.as_ref().map(|inside| {
                let matrix = self.matrix.iter().take(channels.len()).cloned().collect();
                let mixed: Arc<dyn Continuous> = Arc::new(Mixed { matrix, inside: Arc::clone(inside) });
                mixed
            }),
            channels,
            empty: Vec::new(),
        };
        converted.leave_out_empty();
        Cow::Owned(converted)
    }
}

/// The colours of a BRDF that a file defines everywhere.
#[derive(Debug)]
struct Mixed {
    /// Weights by colour and channel.
    matrix: Vec<Vec<f64>>,
    inside: Arc<dyn Continuous>,
}

impl Continuous for Mixed {
    fn at(&self, pair: &Pair, values: &mut [f64]) {
        let mut channels = vec![0.0; self.matrix.first().map_or(0, Vec::len)];
        self.inside.at(pair, &mut channels);
        for (value, weights) in values.iter_mut().zip(&self.matrix) {
            *value = weights.iter().zip(&channels).map(|(weight, f)| weight * f).sum();
        }
    }
}

/// The matrix that picks the channels called r, g and b. `None` unless each occurs exactly once.
fn named(channels: &[Channel]) -> Option<[Vec<f64>; 3]> {
    let row = |names: [&str; 2]| {
        let row: Vec<f64> = channels
            .iter()
            .map(|channel| f64::from(names.iter().any(|name| channel.name.eq_ignore_ascii_case(name))))
            .collect();
        (row.iter().filter(|is| **is > 0.0).count() == 1).then_some(row)
    };
    Some([row(["r", "red"])?, row(["g", "green"])?, row(["b", "blue"])?])
}

/// RGB weights of the channels of a spectrum.
fn spectral(wavelengths: &[f64], illuminant: Illuminant) -> [Vec<f64>; 3] {
    let weights = trapezoid(wavelengths);
    let xyz: Vec<[f64; 3]> = wavelengths
        .iter()
        .zip(weights)
        .map(|(nm, weight)| matching(*nm).map(|bar| bar * weight * illuminant.power(*nm)))
        .collect();
    let white: Vector3<f64> = xyz.iter().map(|at| Vector3::from(*at)).sum();
    let scale = from_xy(illuminant.white()).component_div(&white);
    let to_rgb = *FROM_XYZ * adaptation(illuminant.white(), REC709.white);
    let rgb: Vec<Vector3<f64>> =
        xyz.iter().map(|at| to_rgb * Vector3::from(*at).component_mul(&scale)).collect();
    [0, 1, 2].map(|c| rgb.iter().map(|at| at[c]).collect())
}

/// Weights of the trapezoidal rule on the visible wavelengths, in any order; 0 for invisible ones.
fn trapezoid(wavelengths: &[f64]) -> Vec<f64> {
    let mut order: Vec<(f64, usize)> =
        wavelengths.iter().copied().zip(0..).filter(|(nm, _)| VISIBLE.contains(nm)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut weights = vec![0.0; wavelengths.len()];
    for pair in order.windows(2) {
        let ((low, i), (high, j)) = (pair[0], pair[1]);
        for index in [i, j] {
            weights[index] += 0.5 * (high - low);
        }
    }
    weights
}

/// xbar, ybar, zbar at a wavelength: sums of Gaussians that each have a different width on either side.
fn matching(nm: f64) -> [f64; 3] {
    let lobe = |height: f64, centre: f64, below: f64, above: f64| {
        let t = (nm - centre) * if nm < centre { below } else { above };
        height * (-0.5 * t * t).exp()
    };
    [
        lobe(1.056, 599.8, 0.0264, 0.0323)
            + lobe(0.362, 442.0, 0.0624, 0.0374)
            + lobe(-0.065, 501.1, 0.0490, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725),
    ]
}

/// Relative spectral power of D65 every 10 nm from 380 to 780 nm.
const D65: [f64; 41] = [
    49.9755, 54.6482, 82.7549, 91.4860, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923,
    108.811, 109.354, 107.802, 104.790, 107.689, 104.405, 104.046, 100.000, 96.3342, 95.7880, 88.6856,
    90.0062, 89.5991, 87.6987, 83.2886, 83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091,
    74.3490, 61.6040, 69.8856, 75.0870, 63.5927, 46.4182, 66.8054, 63.3828,
];

/// The spectral power of D65 at a wavelength, interpolated in the table; 0 outside it.
fn d65(nm: f64) -> f64 {
    let mut low = 380.0;
    for pair in D65.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        if nm <= low + 10.0 {
            return a + (b - a) * (nm - low) / 10.0;
        }
        low += 10.0;
    }
    0.0
}

/// X, Y, Z of white: D65 with Y = 1, as IEC 61966-2-1 rounds it.
pub(super) fn white_xyz() -> Vector3<f64> {
    from_xy(REC709.white)
}

/// Linear RGB to XYZ.
pub(super) static TO_XYZ: LazyLock<Matrix3<f64>> = LazyLock::new(|| REC709.to_xyz());

/// XYZ to linear RGB.
static FROM_XYZ: LazyLock<Matrix3<f64>> = LazyLock::new(|| TO_XYZ.try_inverse().unwrap_or_default());

/// Luminance of linear RGB, 1 for white.
#[must_use]
pub fn luminance(pixel: [f64; 3]) -> f64 {
    TO_XYZ.row(1).transpose().dot(&Vector3::from(pixel))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Directions, Pair};
    use crate::measurement::Source;
    use approx::assert_abs_diff_eq;
    use glam::DVec3;

    /// The CIE 1931 functions every 10 nm from 380 nm, to four digits (CIE 15:2004, table T.4), which the fit approximates.
    const TABLE: [[f64; 41]; 3] = [
        [
            0.0014, 0.0042, 0.0143, 0.0435, 0.1344, 0.2839, 0.3483, 0.3362, 0.2908, 0.1954, 0.0956, 0.0320,
            0.0049, 0.0093, 0.0633, 0.1655, 0.2904, 0.4334, 0.5945, 0.7621, 0.9163, 1.0263, 1.0622, 1.0026,
            0.8544, 0.6424, 0.4479, 0.2835, 0.1649, 0.0874, 0.0468, 0.0227, 0.0114, 0.0058, 0.0029, 0.0014,
            0.0007, 0.0003, 0.0002, 0.0001, 0.0000,
        ],
        [
            0.0000, 0.0001, 0.0004, 0.0012, 0.0040, 0.0116, 0.0230, 0.0380, 0.0600, 0.0910, 0.1390, 0.2080,
            0.3230, 0.5030, 0.7100, 0.8620, 0.9540, 0.9950, 0.9950, 0.9520, 0.8700, 0.7570, 0.6310, 0.5030,
            0.3810, 0.2650, 0.1750, 0.1070, 0.0610, 0.0320, 0.0170, 0.0082, 0.0041, 0.0021, 0.0010, 0.0005,
            0.0002, 0.0001, 0.0001, 0.0000, 0.0000,
        ],
        [
            0.0065, 0.0201, 0.0679, 0.2074, 0.6456, 1.3856, 1.7471, 1.7721, 1.6692, 1.2876, 0.8130, 0.4652,
            0.2720, 0.1582, 0.0782, 0.0422, 0.0203, 0.0087, 0.0039, 0.0021, 0.0017, 0.0011, 0.0008, 0.0003,
            0.0002, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000,
            0.0000, 0.0000, 0.0000, 0.0000, 0.0000,
        ],
    ];

    fn spectrum(wavelengths: impl Iterator<Item = f64>) -> (Vec<f64>, ToRgb) {
        let wavelengths: Vec<f64> = wavelengths.collect();
        let channels: Vec<Channel> = wavelengths.iter().map(|nm| Channel::at_wavelength(*nm)).collect();
        (wavelengths, ToRgb::new(&channels))
    }

    fn every(step: f64, low: f64, high: f64) -> impl Iterator<Item = f64> {
        std::iter::successors(Some(low), move |nm| Some(nm + step)).take_while(move |nm| *nm <= high)
    }

    #[test]
    fn the_matrix_is_the_published_one() {
        // IEC 61966-2-1 prints it with four digits, of a matrix to XYZ that was rounded too; CSS Color 4 in full.
        let published = [
            [3.240_969_94, -1.537_383_18, -0.498_610_76],
            [-0.969_243_64, 1.875_967_50, 0.041_555_06],
            [0.055_630_08, -0.203_976_96, 1.056_971_51],
        ];
        for (row, expected) in FROM_XYZ.row_iter().zip(published) {
            for (value, expected) in row.iter().zip(expected) {
                assert_abs_diff_eq!(*value, expected, epsilon = 1e-8);
            }
        }
        for c in 0..3 {
            assert_abs_diff_eq!((*FROM_XYZ * white_xyz())[c], 1.0, epsilon = 1e-14);
        }
        assert_abs_diff_eq!(luminance([1.0, 0.0, 0.0]), 0.2126, epsilon = 1e-4);
    }

    #[test]
    fn the_fit_is_near_the_table() {
        for (c, row) in TABLE.iter().enumerate() {
            for (nm, expected) in every(10.0, 380.0, 780.0).zip(row) {
                assert_abs_diff_eq!(matching(nm)[c], *expected, epsilon = 0.04);
            }
        }
    }

    #[test]
    fn d65_has_the_chromaticity_of_d65() {
        let sum: Vector3<f64> =
            every(5.0, 380.0, 780.0).map(|nm| Vector3::from(matching(nm)) * d65(nm)).sum();
        assert_abs_diff_eq!(sum[0] / sum.sum(), 0.3127, epsilon = 2e-3);
        assert_abs_diff_eq!(sum[1] / sum.sum(), 0.3290, epsilon = 2e-3);
        assert_abs_diff_eq!(d65(560.0), 100.0, epsilon = 1e-12);
        assert_abs_diff_eq!(d65(780.0), 63.3828, epsilon = 1e-12);
    }

    #[test]
    fn white_is_white() {
        let all: [Box<dyn Iterator<Item = f64>>; 5] = [
            Box::new(every(10.0, 400.0, 700.0)),
            Box::new(every(7.3, 300.0, 2500.0)),
            Box::new([650.0, 450.0, 550.0].into_iter()),
            Box::new([380.0, 490.0, 580.0].into_iter()),
            Box::new(every(1.0, 380.0, 780.0)),
        ];
        for wavelengths in all {
            let (wavelengths, to) = spectrum(wavelengths);
            assert_eq!(to.route, Route::Spectrum);
            for value in to.apply(wavelengths.iter().map(|_| 1.0)) {
                assert_abs_diff_eq!(value, 1.0, epsilon = 1e-13);
            }
            assert_eq!(to.apply(wavelengths.iter().map(|_| 1.0)), to.apply(wavelengths.iter().map(|_| 1.0)));
        }
    }

    /// Smooth reflectances of many hues have the colour that the table gives, up to a hardly visible difference in Lab.
    #[test]
    fn colours_agree_with_the_table() {
        let (wavelengths, to) = spectrum(every(10.0, 380.0, 780.0));
        let mut worst: f64 = 0.0;
        for centre in every(20.0, 420.0, 680.0) {
            for width in [30.0, 60.0, 120.0] {
                let r = |nm: f64| 0.05 + 0.75 * (-0.5 * ((nm - centre) / width).powi(2)).exp();
                let sum = |f: &dyn Fn(f64) -> f64| {
                    TABLE.map(|row| {
                        wavelengths.iter().zip(row).map(|(nm, bar)| bar * d65(*nm) * f(*nm)).sum::<f64>()
                    })
                };
                let (lit, white) = (sum(&r), sum(&|_| 1.0));
                let xyz = Vector3::from(lit).component_div(&Vector3::from(white)).component_mul(&white_xyz());
                let rgb = to.apply(wavelengths.iter().map(|nm| r(*nm)));
                let exact = *FROM_XYZ * xyz;
                let (a, b) = (super::super::lab(rgb), super::super::lab(exact.into()));
                worst = worst.max(super::super::ciede2000(a, b));
            }
        }
        println!("worst delta E of the fit: {worst:.2}");
        assert!(worst < 3.0, "{worst}");
    }

    #[test]
    fn routes() {
        let route = |names: &[&str]| {
            ToRgb::new(&names.iter().map(|name| Channel::named(name)).collect::<Vec<_>>()).route
        };
        assert_eq!(route(&["r", "g", "b"]), Route::Rgb);
        assert_eq!(route(&["y"]), Route::Grey);
        assert_eq!(route(&["550"]), Route::Grey);
        assert_eq!(route(&["y", "z"]), Route::Grey);
        assert_eq!(route(&["450", "650"]), Route::GreyFewWavelengths);
        assert_eq!(route(&["600", "620", "650", "1000"]), Route::GreyFewWavelengths);
        assert_eq!(route(&["3000", "4000", "5000"]), Route::GreyInvisible);
        assert_eq!(route(&["450", "550", "650", "1000"]), Route::Spectrum);

        // Channels in any order; grey is the mean of the visible ones.
        let to = ToRgb::new(&["b", "x", "r", "g"].map(Channel::named));
        assert_eq!(to.apply([3.0, 9.0, 1.0, 2.0].into_iter()), [1.0, 2.0, 3.0]);
        let to = ToRgb::new(&["600", "700", "900"].map(Channel::named));
        assert_eq!(to.apply([1.0, 3.0, 100.0].into_iter()), [2.0; 3]);
    }

    #[test]
    fn a_measurement_is_mixed_sample_by_sample() {
        let channels = |names: &[&str]| names.iter().map(|name| Channel::named(name)).collect::<Vec<_>>();
        let pair = Pair { wi: DVec3::Z, wo: DVec3::Z };
        let measured = |names: &[&str]| {
            let row = |j: usize| vec![0.1 + 0.05 * count(j), 0.4 - 0.02 * count(j)];
            Measurement {
                source: Source { path: "test.csv".into(), sha256: String::new(), format: "csv" },
                sigma: Some((0..names.len()).map(|j| vec![0.01 * count(j + 1); 2]).collect()),
                ..Measurement::of(
                    channels(names),
                    Directions::Scattered(vec![pair; 2]),
                    (0..names.len()).map(row).collect(),
                )
            }
        };
        let spectral = measured(&["450", "500", "550", "600", "650"]);
        let to = ToRgb::new(&spectral.channels);
        let mixed = to.measurement(&spectral);
        assert_eq!(mixed.channels.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["r", "g", "b"]);
        for sample in 0..2 {
            let rgb = to.apply(spectral.values.iter().map(|row| row[sample]));
            for (row, expected) in mixed.values.iter().zip(rgb) {
                assert_abs_diff_eq!(row[sample], expected, epsilon = 1e-15);
            }
        }
        // Independent errors add up in squares.
        let variance: f64 = (0..5).map(|j| (to.matrix[1][j] * 0.01 * count(j + 1)).powi(2)).sum();
        assert_abs_diff_eq!(mixed.sigma.as_ref().unwrap()[1][0], variance.sqrt(), epsilon = 1e-15);

        let swapped = measured(&["b", "g", "r"]);
        let mixed = ToRgb::new(&swapped.channels).measurement(&swapped).into_owned();
        assert_eq!((&mixed.values[0], &mixed.values[2]), (&swapped.values[2], &swapped.values[0]));
        let two = measured(&["left", "right"]);
        let grey = ToRgb::new(&two.channels).measurement(&two).into_owned();
        assert_eq!((grey.channels.len(), grey.channels[0].name.as_str()), (1, "grey"));
        assert_abs_diff_eq!(grey.values[0][0], 0.125, epsilon = 1e-15);

        // A mixture lacks what one of its channels lacks; one that the observer does not see is not mixed.
        let mut gaps = measured(&["450", "500", "550", "600", "650", "900"]);
        (gaps.values[5][0], gaps.values[2][1]) = (f64::NAN, f64::NAN);
        let to = ToRgb::new(&gaps.channels);
        assert_eq!(to.incomplete(&gaps), 1);
        let mixed = to.measurement(&gaps);
        assert_eq!((mixed.directions.len(), mixed.dropped.get("not-measured")), (1, Some(&1)));
        assert!(mixed.values.iter().flatten().all(|f| f.is_finite()));
        let mut swapped = swapped;
        swapped.values[0][0] = f64::NAN;
        let to = ToRgb::new(&swapped.channels);
        assert_eq!((to.incomplete(&swapped), to.measurement(&swapped).missing()), (0, vec![0, 0, 1]));

        for names in [&["r", "g", "b"][..], &["f"]] {
            let plain = measured(names);
            assert!(matches!(ToRgb::new(&plain.channels).measurement(&plain), Cow::Borrowed(_)));
        }
    }
}
