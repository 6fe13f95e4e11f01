//! Robust losses: how strongly residuals that are far larger than the others are down-weighted.
//!
//! The cost of a residual u with scale s, both in the same units, is s^2 rho(u^2/s^2):
//!
//! ```text
//! none    rho(z) = z
//! huber   rho(z) = z for z <= 1, else 2 sqrt(z) - 1          (Huber 1964, doi:10.1214/aoms/1177703732)
//! cauchy  rho(z) = ln(1 + z)                                  (Holland and Welsch 1977, doi:10.1080/03610927708827533)
//! ```
//!
//! All equal u^2 near zero. Beyond s, a residual under Huber's loss pulls no more than one at s, and a residual under
//! Cauchy's loss pulls less the larger it is.

use super::metric::Metric;
use std::ops::RangeInclusive;

/// The shape of a loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum LossKind {
    /// u^2: every residual pulls in proportion to its size.
    #[default]
    None,
    /// Quadratic up to the scale, linear beyond it.
    Huber,
    /// Logarithmic: s^2 ln(1 + u^2/s^2).
    Cauchy,
}

/// Scales of a loss at which neither the square of the scale, nor that of a residual in units of it, overflows or vanishes.
pub const LOSS_SCALES: RangeInclusive<f64> = 1e-100..=1e100;

impl LossKind {
    /// Name on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Huber => "huber",
            Self::Cauchy => "cauchy",
        }
    }
}

/// The objective of a fit: the metric of its residuals and the loss applied to them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Objective {
    /// The metric in which the model and the measurement are compared.
    pub metric: Metric,
    /// How strongly large residuals are down-weighted.
    pub loss: LossKind,
    /// The residual above which the loss down-weights a sample, in units of the metric's transform, or in standard
    /// deviations if weights are by sigma.
    pub scale: f64,
}

impl From<Metric> for Objective {
    fn from(metric: Metric) -> Self {
        Self { metric, loss: LossKind::None, scale: 1.0 }
    }
}

/// A residual's contribution to the cost and to its quadratic model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Influence {
    /// Cost, s^2 rho.
    pub(super) cost: f64,
    /// rho'; half the derivative of the cost with respect to u is `slope` times u.
    pub(super) slope: f64,
    /// Half the second derivative of the cost with respect to u, kept positive.
    pub(super) curvature: f64,
}

/// The least ratio of curvature to slope. The true curvature, rho' + 2 z rho'', is zero beyond Huber's scale and
/// negative beyond Cauchy's, where a minimum of the model would not be a minimum of the cost.
const LEAST_CURVATURE: f64 = 0.1;

impl LossKind {
    /// The influence of a residual `u` at a scale.
    #[inline]
    pub(super) fn influence(self, u: f64, scale: f64) -> Influence {
        let z = (u / scale) * (u / scale);
        let (rho, slope, curvature) = match self {
            Self::None => return Influence { cost: u * u, slope: 1.0, curvature: 1.0 },
            Self::Huber if z <= 1.0 => (z, 1.0, 1.0),
            Self::Huber => (2.0 * z.sqrt() - 1.0, 1.0 / z.sqrt(), 0.0),
            Self::Cauchy => {
                let slope = 1.0 / (1.0 + z);
                (z.ln_1p(), slope, slope * slope * (1.0 - z))
            }
        };
        Influence { cost: scale * scale * rho, slope, curvature: curvature.max(LEAST_CURVATURE * slope) }
    }
}

/// 1.4826 times the median absolute deviation from the median. This is the standard deviation if the values are
/// normal, however far off a minority of them may be. `values` holds pairs of a value and its weight and is reordered.
pub(super) fn robust_deviation(values: &mut [(f64, f64)]) -> f64 {
    /// Ratio of the standard deviation to the median absolute deviation of a normal distribution.
    const NORMAL: f64 = 1.4826;
    let median = weighted_quantile(values, 0.5);
    values.iter_mut().for_each(|(value, _)| *value = (*value - median).abs());
    NORMAL * weighted_quantile(values, 0.5)
}

/// The value below which `fraction` of the weight lies. Sorts `values`.
pub(super) fn weighted_quantile(values: &mut [(f64, f64)], fraction: f64) -> f64 {
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = values.iter().map(|(_, weight)| weight).sum();
    let mut below = 0.0;
    for (value, weight) in values.iter() {
        below += weight;
        if below >= fraction * total {
            return *value;
        }
    }
    values.last().map_or(0.0, |(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn slopes_match_differences() {
        for kind in [LossKind::None, LossKind::Huber, LossKind::Cauchy] {
            for u in [-7.0, -0.4, 0.01, 0.9, 1.7, 30.0] {
                let scale = 1.3;
                let cost = |u: f64| kind.influence(u, scale).cost;
                let step = 1e-5;
                let slope = (cost(u + step) - cost(u - step)) / (2.0 * step);
                assert_relative_eq!(slope, 2.0 * u * kind.influence(u, scale).slope, max_relative = 1e-7);
            }
        }
    }

    #[test]
    fn curvature_is_that_of_the_cost_where_it_is_convex() {
        for (kind, u) in [(LossKind::Huber, 0.9), (LossKind::Cauchy, 0.6)] {
            let slope = |u: f64| 2.0 * u * kind.influence(u, 1.3).slope;
            let second = (slope(u + 1e-6) - slope(u - 1e-6)) / 2e-6;
            assert_relative_eq!(second, 2.0 * kind.influence(u, 1.3).curvature, max_relative = 1e-6);
        }
    }

    #[test]
    fn a_minority_does_not_move_the_robust_deviation() {
        // Quantiles of the normal distribution at (i + 1/2)/1000, of which a tenth are moved far away.
        use statrs::distribution::{ContinuousCDF, Normal};
        let normal = Normal::new(3.0, 0.2).unwrap();
        let mut values: Vec<(f64, f64)> =
            (0..1000).map(|i| (normal.inverse_cdf((f64::from(i) + 0.5) / 1000.0), 1.0)).collect();
        assert_relative_eq!(robust_deviation(&mut values.clone()), 0.2, max_relative = 3e-3);
        values.iter_mut().step_by(10).for_each(|(value, _)| *value *= 1e6);
        assert_relative_eq!(robust_deviation(&mut values), 0.2, max_relative = 0.2);
    }

    #[test]
    fn weights_count_as_repetitions() {
        let mut weighted = [(1.0, 1.0), (5.0, 3.0), (2.0, 1.0)];
        assert_relative_eq!(weighted_quantile(&mut weighted, 0.5), 5.0);
    }
}
