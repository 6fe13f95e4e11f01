//! The metrics that a fit can minimise, as transforms of x = f cos(theta_i).
//!
//! # The metric `unbiased-cbrt`
//!
//! A cube root bends: the mean of cbrt(x + noise) is less than cbrt(x), so that a fit in `cbrt` comes out too dark once the noise
//! approaches the signal. The condition for its minimum says where this comes from. It is, over the samples,
//!
//! ```text
//! sum w (x - x*) dx/dparameter = 0,    w = g'(x) (g(x) - g(x*))/(x - x*) = 1/(3 c^2 (c^2 + c a + a^2)),   c = cbrt(x), a = cbrt(x*)
//! ```
//!
//! The measured x* stands in its own weight, and a sample that noise has made brighter counts for less. Weights that do not contain
//! the noise of their own sample leave the mean of every term at 0 (quasi-likelihood: Wedderburn 1974, doi:10.1093/biomet/61.3.439),
//! whatever the weights are. So this metric takes, in place of a, the root p of what the sample's neighbours predict
//! ([`crate::measurement::Predicted`]), and the cost whose derivative that is,
//!
//! ```text
//! cost = 2 int_x^x* (x* - t) w(t) dt,    w = alpha (c + 2 k)/(3 c^2 (c + k)^3),   c = cbrt(t + s),  k = kappa p
//!      = alpha (a - c)^2 (c (c + 2 a) + 3 k a^2/(a + k))/(c + k)^2,               a = cbrt(x* + s)
//! ```
//!
//! This w is a rational function close to the w above: with kappa = (1 + sqrt(3))/2 and alpha = (3 + sqrt(3))/4 it has the same value
//! and the same slope at c = p, and in contrast to it an integral without an arc tangent. At a = p the cost is (a - c)^2 to second
//! order, that of `cbrt`. For a < 0 the integral begins at c = 0 instead, which only takes a constant away:
//!
//! ```text
//! cost = alpha c (c^3 - a^3 (3 c + 4 k)/k)/(c + k)^2
//! ```
//!
//! s is about twice the noise of the darkest samples. It keeps weights finite, and makes samples below the noise count as in `l2`.

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
    Cbrt,
    /// As `Cbrt`, but with weights that do not contain the noise of their own sample, so that noise does not bias the fit.
    /// docs/use/conventions.md has its formula.
    #[default]
    UnbiasedCbrt,
}

/// The smoothing of cbrt near zero, relative to the mean |x*| of the channel.
const CBRT_SMOOTHING: f64 = 1e-6;

/// k/p and alpha of `unbiased-cbrt`: (1 + sqrt(3))/2 and (3 + sqrt(3))/4.
const KAPPA: f64 = 1.366_025_403_784_438_6;
const ALPHA: f64 = 1.183_012_701_892_219_3;

/// Measured values are raised to at least this, because ln(1 + x) has no useful value below it.
const LOG_FLOOR: f64 = -0.99;

impl Metric {
    /// All metrics.
    pub const ALL: [Self; 4] = [Self::L2, Self::Log, Self::Cbrt, Self::UnbiasedCbrt];

    /// Name on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::L2 => "l2",
            Self::Log => "log",
            Self::Cbrt => "cbrt",
            Self::UnbiasedCbrt => "unbiased-cbrt",
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
            Self::Cbrt | Self::UnbiasedCbrt => {
                for x in row {
                    *x = cube_root(*x);
                }
            }
        }
    }

    /// The smoothed transform that is minimised, for a channel whose mean |x*| is `mean` and whose noise is at least `noise_floor`.
    pub(in crate::fit) fn transform(self, mean: f64, noise_floor: f64) -> Transform {
        // A channel that is zero everywhere still needs a finite slope.
        let smoothing = (CBRT_SMOOTHING * mean).max(1e-30);
        Transform { metric: self, smoothing2: smoothing * smoothing, noise_floor }
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
    /// s, for `unbiased-cbrt`.
    noise_floor: f64,
}

/// What a model is compared with in a row of samples.
#[derive(Clone, Copy)]
pub(in crate::fit) struct Wanted<'a> {
    /// g(x*) of the measured values.
    pub(in crate::fit) measured: &'a Row,
    /// g of what the neighbours predict, for `unbiased-cbrt`.
    pub(in crate::fit) predicted: &'a Row,
}

impl Transform {
    /// Replaces measured or predicted values by g of them.
    #[inline(always)]
    pub(in crate::fit) fn apply_to(self, row: &mut Row) {
        for x in row {
            *x = match self.metric {
                Metric::L2 => *x,
                Metric::Log => Scalar::ln_1p(*x),
                Metric::Cbrt => *x * elementary::inverse_cbrt(*x * *x + self.smoothing2),
                Metric::UnbiasedCbrt => root_of_measured(*x, self.noise_floor),
            };
        }
    }

    /// Returns g(x) and g'(x).
    #[cfg(test)]
    pub(in crate::fit) fn apply(self, x: f64) -> (f64, f64) {
        let (mut g, mut slope) = (Row::filled(0.0), Row::filled(0.0));
        let zero = Row::filled(0.0);
        let wanted = Wanted { measured: &zero, predicted: &zero };
        self.differences(&Row::filled(x), wanted, &mut g, &mut slope, None);
        (g[0], slope[0])
    }

    /// Computes g(x) - g(x*) and g'(x) for a row, and returns false.
    ///
    /// For `unbiased-cbrt`, whose cost is not the square of a difference that has a simple derivative, computes (x - x*) sqrt(w) and
    /// sqrt(w) instead, with the cost in `squares` if it is wanted, and returns true. The product of the two is half the derivative of the cost, and
    /// the square of the second half its second derivative on average over the noise.
    #[inline(always)]
    pub(in crate::fit) fn differences(
        self,
        x: &Row,
        wanted: Wanted<'_>,
        difference: &mut Row,
        slope: &mut Row,
        squares: Option<&mut Row>,
    ) -> bool {
        let Wanted { measured, predicted } = wanted;
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
            Metric::UnbiasedCbrt => {
                let samples = samples.zip(predicted);
                let s = self.noise_floor;
                // Noise rarely takes a measured value below -s, and the loop is shorter where it does not.
                let any_negative = measured.iter().fold(false, |any, a| any | (*a < 0.0));
                match squares {
                    None => {
                        for (((x, a), (difference, slope)), p) in samples {
                            let model = Root::new(*x, s);
                            let k = KAPPA * p;
                            *slope = model.root_weight(k, 1.0 / (model.c + k));
                            *difference = model.excess(*a) * *slope;
                        }
                    }
                    Some(squares) if any_negative => {
                        for ((((x, a), (difference, slope)), p), square) in samples.zip(squares) {
                            (*square, *difference, *slope) = unbiased::<true>(Root::new(*x, s), *a, *p);
                        }
                    }
                    Some(squares) => {
                        for ((((x, a), (difference, slope)), p), square) in samples.zip(squares) {
                            (*square, *difference, *slope) = unbiased::<false>(Root::new(*x, s), *a, *p);
                        }
                    }
                }
            }
        }
        self.metric == Metric::UnbiasedCbrt
    }
}

/// g(x) of `unbiased-cbrt` for a measured or predicted x: the cube root of x + s.
#[inline(always)]
fn root_of_measured(x: f64, s: f64) -> f64 {
    let u = x + s;
    u * elementary::inverse_cbrt((u * u).greater(1e-100))
}

/// x + s for the x of a model, and c = g(x) of `unbiased-cbrt` with its inverse.
#[derive(Clone, Copy)]
struct Root {
    u: f64,
    c: f64,
    per_c: f64,
}

impl Root {
    /// x is negative only where the model's formula fails; there x + s is held above 0.
    #[inline(always)]
    fn new(x: f64, s: f64) -> Self {
        let u = (x + s).greater(1e-3 * s);
        let per_c = elementary::inverse_cbrt(u);
        Self { u, c: u * per_c * per_c, per_c }
    }

    /// sqrt(w), given 1/(c + k).
    #[inline(always)]
    fn root_weight(self, k: f64, per_both: f64) -> f64 {
        ((ALPHA / 3.0) * (self.c + 2.0 * k) * (self.c + k)).sqrt() * self.per_c * (per_both * per_both)
    }

    /// x - x*, given a = g(x*).
    #[inline(always)]
    fn excess(self, a: f64) -> f64 {
        self.u - a * (a * a)
    }
}

/// The cost of `unbiased-cbrt`, (x - x*) sqrt(w) and sqrt(w), where w is the weight w(x), for the root of a model's x, a = g(x*) and
/// p = g of the prediction. a may be negative only if `NEGATIVE`.
#[inline(always)]
fn unbiased<const NEGATIVE: bool>(model: Root, a: f64, p: f64) -> (f64, f64, f64) {
    let Root { u, c, .. } = model;
    let k = KAPPA * p;
    let a2 = a * a;
    let both = c + k;
    let end = if NEGATIVE { a.greater(0.0) + k } else { a + k };
    // One division in place of two.
    let per_product = 1.0 / (both * end);
    let per_both = per_product * end;
    let way = if !NEGATIVE || a >= 0.0 {
        (a - c) * (a - c) * (c * (c + 2.0 * a) * end + 3.0 * k * a2)
    } else {
        c * (u * end - a * a2 * (3.0 * c + 4.0 * k))
    };
    let root = model.root_weight(k, per_both);
    (ALPHA * way * (per_product * per_both), model.excess(a) * root, root)
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
        for metric in [Metric::L2, Metric::Log, Metric::Cbrt] {
            let transform = metric.transform(0.1, 1e-6);
            for x in [-0.3_f64, 0.0, 1e-8, 1e-3, 0.5, 40.0] {
                let step = 1e-6 * (x.abs() + 1e-7);
                let (above, below) = (transform.apply(x + step).0, transform.apply(x - step).0);
                let slope = transform.apply(x).1;
                approx::assert_relative_eq!((above - below) / (2.0 * step), slope, max_relative = 1e-5);
            }
        }
    }

    /// The cost of `unbiased-cbrt` for the roots of model, measured and predicted value, and its weight.
    fn cost_and_weight(c: f64, a: f64, p: f64) -> (f64, f64) {
        let model = Root { u: c * c * c, c, per_c: 1.0 / c };
        let (cost, _, root) = unbiased::<true>(model, a, p);
        if a >= 0.0 {
            assert_eq!(cost, unbiased::<false>(model, a, p).0);
        }
        (cost, root * root)
    }

    /// The cost is 2 int (x* - t) w(t) dt, by a second way of integration.
    #[test]
    fn the_unbiased_cost_is_the_integral_of_its_weight() {
        let rule = crate::math::GaussLegendre::new(60);
        for p in [1e-3, 0.2, 1.0, 7.0] {
            for c in [0.01, 0.3, 0.999, 1.0, 4.0] {
                for a in [-3.0_f64, -0.1, 0.0, 0.02, 0.9, 1.0, 5.0] {
                    // In c, because t = c^3 - s and dt = 3 c^2 dc. In pieces, because p may be small.
                    let end = a.max(0.0);
                    let pieces = 200;
                    let piece = (end - c) / f64::from(pieces);
                    let density = |c: f64| (a.powi(3) - c.powi(3)) * cost_and_weight(c, a, p).1 * 3.0 * c * c;
                    let integral: f64 = (0..pieces)
                        .map(|k| {
                            let low = c + piece * f64::from(k);
                            piece * rule.integrate(0.0, 1.0, |t| density(low + t * piece))
                        })
                        .sum();
                    let cost = cost_and_weight(c, a, p).0;
                    approx::assert_relative_eq!(cost, 2.0 * integral, max_relative = 1e-9, epsilon = 1e-14);
                }
            }
        }
    }

    /// Where neighbours predict exactly what is measured, cost and weight are those of `cbrt` to second order, and no factor beyond.
    #[test]
    fn without_noise_the_unbiased_cost_is_close_to_that_of_cbrt() {
        for a in [1e-3, 0.4, 2.0] {
            for ratio in [0.1, 0.5, 0.999, 1.001, 2.0, 10.0] {
                let c = ratio * a;
                let cost = cost_and_weight(c, a, a).0;
                let of_cbrt = (a - c) * (a - c);
                let slack = if (0.99..1.01).contains(&ratio) { 0.01 } else { 0.2 };
                assert!((cost / of_cbrt - 1.0).abs() < slack, "{a}, {ratio}: {cost} for {of_cbrt}");
            }
        }
    }

    /// The weight does not depend on the measured value: the derivative of the cost is linear in it, so that noise has no mean effect.
    #[test]
    fn the_unbiased_slope_is_linear_in_the_measured_value() {
        let transform = Metric::UnbiasedCbrt.transform(0.1, 0.01);
        let slope = |x: f64, measured: f64| {
            let cost = |x: f64| {
                let (mut rows, mut wanted) = ([Row::filled(0.0); 3], [measured, 0.2].map(Row::filled));
                wanted.iter_mut().for_each(|row| transform.apply_to(row));
                let [difference, slope, squares] = &mut rows;
                let wanted = Wanted { measured: &wanted[0], predicted: &wanted[1] };
                assert!(transform.differences(&Row::filled(x), wanted, difference, slope, Some(squares)));
                (squares[0], difference[0] * slope[0])
            };
            let step = 1e-6;
            let by_difference = (cost(x + step).0 - cost(x - step).0) / (4.0 * step);
            approx::assert_relative_eq!(by_difference, cost(x).1, max_relative = 1e-6, epsilon = 1e-8);
            cost(x).1
        };
        for x in [0.003, 0.1, 0.9] {
            let (low, middle, high) = (slope(x, -0.3), slope(x, 0.2), slope(x, 0.7));
            approx::assert_relative_eq!(middle - low, high - middle, max_relative = 1e-12);
        }
    }
}
