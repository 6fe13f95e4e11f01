//! The target colour of a pixel as residuals of a least-squares problem.
//!
//! For similar colours CIEDE2000 is a length: dE^2 = d^T G d, with d the difference in L*, a*, b* and G a matrix that
//! depends on the colour. With G = T^T T at the measured colour, the residuals of a pixel are
//!
//! ```text
//! r = T (Lab(a') - Lab(b'))        a: the image, b: the measured one, both exposed
//! ```
//!
//! - b' = b where a screen can show it, 0 <= b <= 1, and 0 below.
//! - Where b > 1 a screen shows white, and any a > 1 looks the same. So that a is not arbitrary there, both are
//!   compressed to 1 + 0.3 (cbrt(v) - 1), which continues with a tenth of the slope.
//! - Where b <= 1, a' = a however bright a is, so that the residual of a value that is too bright keeps its slope.

use super::difference::{ciede2000, lab_with_slopes};
use nalgebra::{Matrix3, Vector3};

/// The colour that a pixel should have.
#[derive(Clone, Debug)]
pub(crate) struct ColourTarget {
    lab: Vector3<f64>,
    /// T.
    root: Matrix3<f64>,
    /// Whether the measured value of each channel is beyond the white of a screen.
    white: [bool; 3],
}

/// Factor of the cube root of a value above white.
const SHOULDER: f64 = 0.3;

impl ColourTarget {
    /// The target of a measured pixel: linear RGB, exposed.
    pub(crate) fn new(measured: [f64; 3]) -> Self {
        let (lab, _) = lab_with_slopes(measured.map(|value| bent(value.max(0.0)).0));
        Self { lab, root: root(lab), white: measured.map(|value| value > 1.0) }
    }

    /// The residuals of a pixel of linear RGB `x`, exposed, and their derivatives: a row per residual, a column per colour.
    pub(crate) fn compare(&self, x: [f64; 3]) -> (Vector3<f64>, Matrix3<f64>) {
        let mut shown = x;
        let mut moves = Vector3::repeat(1.0);
        for ((value, moves), white) in shown.iter_mut().zip(moves.iter_mut()).zip(self.white) {
            if white {
                (*value, *moves) = bent(*value);
            }
        }
        let (lab, slopes) = lab_with_slopes(shown);
        (self.root * (lab - self.lab), self.root * slopes * Matrix3::from_diagonal(&moves))
    }
}

/// A value, compressed if it is above white, and its derivative.
fn bent(value: f64) -> (f64, f64) {
    let root = value.cbrt();
    if value > 1.0 { (1.0 + SHOULDER * (root - 1.0), SHOULDER / (3.0 * root * root)) } else { (value, 1.0) }
}

/// The matrix T with |T d|^2 = dE^2 for small differences d from a colour.
fn root(lab: Vector3<f64>) -> Matrix3<f64> {
    // Small compared with a noticeable difference, large compared with rounding.
    const STEP: f64 = 0.05;
    let squared = |d: Vector3<f64>| {
        let ends = [lab - STEP * d, lab + STEP * d].map(<[f64; 3]>::from);
        (ciede2000(ends[0], ends[1]) / (2.0 * STEP)).powi(2)
    };
    let (l, a, b) = (Vector3::x(), Vector3::y(), Vector3::z());
    let (ll, aa, bb) = (squared(l), squared(a), squared(b));
    let mixed = |one, other, sum: f64| 0.5 * (squared(one + other) - sum);
    let (la, lb, ab) = (mixed(l, a, ll + aa), mixed(l, b, ll + bb), mixed(a, b, aa + bb));
    let tensor = Matrix3::new(ll, la, lb, la, aa, ab, lb, ab, bb);
    // If hues change too fast for one matrix, use the lengths along the axes only.
    let axes = || Matrix3::from_diagonal(&Vector3::new(ll, aa, bb).map(f64::sqrt));
    tensor.cholesky().map_or_else(axes, |factor| factor.l().transpose())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::lab;
    use approx::assert_relative_eq;

    const COLOURS: [[f64; 3]; 6] = [
        [0.5, 0.5, 0.5],
        [0.02, 0.1, 0.6],
        [0.9, 0.3, 0.05],
        [0.001, 0.002, 0.001],
        [0.2, 0.9, 0.9],
        [0.0, 0.0, 0.3],
    ];

    #[test]
    fn small_differences_are_those_of_ciede2000() {
        for measured in COLOURS {
            let target = ColourTarget::new(measured);
            for turn in [[1.0, 0.5, -0.5], [0.3, -1.0, 0.2], [0.1, 0.2, 1.0]] {
                let x = [0, 1, 2].map(|k| measured[k] + 2e-4 * turn[k] * (0.1 + measured[k]));
                let expected = ciede2000(lab(measured), lab(x));
                let (found, _) = target.compare(x);
                assert_relative_eq!(found.norm(), expected, max_relative = 0.03);
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_residuals() {
        for measured in COLOURS {
            let target = ColourTarget::new(measured);
            let x = measured.map(|value| 0.8 * value + 0.01);
            let (_, slopes) = target.compare(x);
            for k in 0..3 {
                let step = 1e-6;
                let moved = |sign: f64| {
                    let mut x = x;
                    x[k] += sign * step;
                    target.compare(x).0
                };
                let expected = (moved(1.0) - moved(-1.0)) / (2.0 * step);
                let size = slopes.norm();
                assert_relative_eq!(slopes.column(k).into_owned(), expected, epsilon = 1e-6 * size);
            }
        }
    }

    #[test]
    fn beyond_white_only_the_order_of_magnitude_counts() {
        let target = ColourTarget::new([3.0, 3.0, 3.0]);
        let away = |factor: f64| target.compare([3.0 * factor; 3]).0.norm();
        assert_eq!(away(1.0), 0.0);
        assert!(away(1.1) < 0.5, "{}", away(1.1));
        assert!(away(10.0) > 5.0 && away(100.0) > 1.5 * away(10.0), "{} {}", away(10.0), away(100.0));
        // If the measured pixel is not white, every step away from it counts.
        let grey = ColourTarget::new([0.9; 3]);
        assert!(grey.compare([1.5; 3]).0.norm() > 8.0);
    }
}
