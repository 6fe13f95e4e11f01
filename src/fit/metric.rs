//! The metrics that a fit can minimise, as transforms of x = f cos(theta_i).

use crate::math::elementary;

/// What is compared: the residual of a sample is g(x) - g(x*) with g the metric's transform.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
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

/// Measured values below this do not have a useful logarithm of 1 + x.
const LOG_FLOOR: f64 = -0.99;

impl Metric {
    /// All of them.
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

    /// A measured value as the metric takes it.
    #[must_use]
    pub fn measured(self, x: f64) -> f64 {
        if self == Self::Log { x.max(LOG_FLOOR) } else { x }
    }

    /// g(x), exactly as the metric is defined.
    #[must_use]
    pub fn exact(self, x: f64) -> f64 {
        match self {
            Self::L2 => x,
            Self::Log => x.ln_1p(),
            Self::Cbrt => x.cbrt(),
        }
    }

    /// The form that is minimised for a channel of mean magnitude `mean` = mean |x*|.
    pub(super) fn transform(self, mean: f64) -> Transform {
        // A channel that is zero throughout still needs a finite slope.
        let smoothing = (CBRT_SMOOTHING * mean).max(1e-30);
        Transform { metric: self, smoothing2: smoothing * smoothing }
    }
}

/// A metric's transform with a finite slope everywhere.
///
/// Real data hold exact zeros, where cbrt has an infinite slope; x/(x^2 + e^2)^(1/3) differs from it only
/// within a few e of zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transform {
    metric: Metric,
    smoothing2: f64,
}

impl Transform {
    /// g(x) and g'(x).
    #[inline]
    pub(super) fn apply(self, x: f64) -> (f64, f64) {
        match self.metric {
            Metric::L2 => (x, 1.0),
            Metric::Log => (elementary::ln_1p(x), 1.0 / (1.0 + x)),
            Metric::Cbrt => {
                let square = x * x + self.smoothing2;
                let root = elementary::inverse_cbrt(square);
                (x * root, root * (1.0 - (2.0 / 3.0) * (x * x / square)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
