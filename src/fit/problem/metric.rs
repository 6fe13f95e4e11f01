//! The metrics that a fit can minimise, as transforms of x = f cos(theta_i).

use crate::geometry::Row;
use crate::math::{Real, Scalar, elementary};

/// A metric: the residual of a sample is g(x) - g(x*), where g is the metric's transform and x* the measured x.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Metric {
    /// g(x) = x.
    L2,
    /// g(x) = ln(1 + x), with the measured x* floored at -0.99 (Low et al. 2012).
    Log,
    /// g(x) = cbrt(x).
    #[default]
    Cbrt,
}

/// The smoothing of cbrt near zero, relative to the mean |x*| of the channel.
const CBRT_SMOOTHING: f64 = 1e-6;

/// Measured values are raised to at least this, because ln(1 + x) has no useful value below it.
const LOG_FLOOR: f64 = -0.99;

impl Metric {
    /// All metrics.
    pub const ALL: [Self; 3] = [Self::L2, Self::Log, Self::Cbrt];

    /// Name on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::L2 => "l2",
            Self::Log => "log",
            Self::Cbrt => "cbrt",
        }
    }

    /// A measured value, raised to the least value that the metric allows.
    #[inline(always)]
    #[must_use]
    pub fn measured(self, x: f64) -> f64 {
        if self == Self::Log { x.greater(LOG_FLOOR) } else { x }
    }

    /// Replaces x by g(x), exactly as the metric defines it.
    #[inline(always)]
    pub(in crate::fit) fn apply_exactly(self, row: &mut Row) {
        match self {
            Self::L2 => {}
            Self::Log => {
                for x in row {
                    *x = Scalar::ln_1p(*x);
                }
            }
            Self::Cbrt => {
                for x in row {
                    *x = cube_root(*x);
                }
            }
        }
    }

    /// The smoothed transform that is minimised, for a channel whose mean |x*| is `mean`.
    pub(in crate::fit) fn transform(self, mean: f64) -> Transform {
        // A channel that is zero everywhere still needs a finite slope.
        let smoothing = (CBRT_SMOOTHING * mean).max(1e-30);
        Transform { metric: self, smoothing2: smoothing * smoothing }
    }
}

/// The cube root of x, computed as x (x^2)^(-1/3).
#[inline(always)]
fn cube_root(x: f64) -> f64 {
    // The squares of very large and very small numbers are out of range, so x is first scaled by a power of 2 whose
    // cube root is exact.
    let (large, small) = (2_f64.powi(300), 2_f64.powi(-300));
    let size = x.abs();
    let choose = |at_large: f64, at_small: f64| {
        let rest = if size < small { at_small } else { 1.0 };
        if size > large { at_large } else { rest }
    };
    let scale = choose(2_f64.powi(-600), 2_f64.powi(600));
    let root = choose(2_f64.powi(200), 2_f64.powi(-200));
    let scaled = x * scale;
    scaled * elementary::inverse_cbrt((scaled * scaled).greater(f64::MIN_POSITIVE)) * root
}

/// A metric's transform, modified to have a finite slope everywhere.
///
/// Real data contain exact zeros, where cbrt has an infinite slope. x/(x^2 + e^2)^(1/3) differs from cbrt only for x
/// within a few e of zero.
#[derive(Clone, Copy, Debug)]
pub(in crate::fit) struct Transform {
    metric: Metric,
    smoothing2: f64,
}

impl Transform {
    /// Returns g(x) and g'(x).
    #[cfg(test)]
    pub(in crate::fit) fn apply(self, x: f64) -> (f64, f64) {
        let (mut g, mut slope) = (Row::filled(0.0), Row::filled(0.0));
        self.differences(&Row::filled(x), &Row::filled(0.0), &mut g, &mut slope);
        (g[0], slope[0])
    }

    /// Computes g(x) - g(x*) and g'(x) for a row; `measured` is g(x*).
    #[inline(always)]
    pub(in crate::fit) fn differences(self, x: &Row, measured: &Row, difference: &mut Row, slope: &mut Row) {
        let samples = x.iter().zip(measured).zip(difference.iter_mut().zip(slope.iter_mut()));
        match self.metric {
            Metric::L2 => {
                for ((x, measured), (difference, slope)) in samples {
                    *difference = x - measured;
                    *slope = 1.0;
                }
            }
            Metric::Log => {
                for ((x, measured), (difference, slope)) in samples {
                    *difference = Scalar::ln_1p(*x) - measured;
                    *slope = 1.0 / (1.0 + x);
                }
            }
            Metric::Cbrt => {
                for ((x, measured), (difference, slope)) in samples {
                    let square = x * x + self.smoothing2;
                    let root = elementary::inverse_cbrt(square);
                    let g = x * root;
                    *difference = g - measured;
                    // x^2/square = g^2 root
                    *slope = root * (1.0 - (2.0 / 3.0) * (g * g * root));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cube_roots_are_those_of_the_library() {
        for x in [0.0, 1e-320, -3e-200, 5e-100, 1e-30, -0.7, 8.0, 1e30, 4e95, -2e180, 1e300] {
            approx::assert_relative_eq!(cube_root(x), f64::cbrt(x), max_relative = 1e-15, epsilon = 1e-110);
        }
    }

    #[test]
    fn slopes_match_differences() {
        for metric in Metric::ALL {
            let transform = metric.transform(0.1);
            for x in [-0.3_f64, 0.0, 1e-8, 1e-3, 0.5, 40.0] {
                let step = 1e-6 * (x.abs() + 1e-7);
                let (above, below) = (transform.apply(x + step).0, transform.apply(x - step).0);
                let slope = transform.apply(x).1;
                approx::assert_relative_eq!((above - below) / (2.0 * step), slope, max_relative = 1e-5);
            }
        }
    }
}
