//! The bias that noise gives a fit in a metric that bends it.
//!
//! With g the metric's transform, the mean of g(x + noise) is not g(x), so that the fit follows another curve than the data do on
//! average. That curve is known where the noise and the true model are: it is the x for which g(x) is that mean. A fit in
//! `unbiased-cbrt` stands for the true model; from there, a fit to the curve moves the parameters by the bias, also where the noise is
//! too large for an expansion.

use super::misfit::Misfit;
use super::result::Fit;
use super::warning::{Biased, Warning};
use crate::error::Error;
use crate::fit::problem::loss::{LossKind, Objective};
use crate::fit::problem::metric::Metric;
use crate::fit::problem::observed::Observed;
use crate::fit::task::Task;
use crate::math::{GaussLegendre, count};
use crate::measurement::{Draws, Samples};
use crate::parameters::ParameterTable;
use std::sync::Arc;

/// Number of samples on which the bias is found. It does not depend on how many there are.
const SAMPLES: usize = 1500;
/// Largest number of iterations of the fit to the curve.
const ITERATIONS: u64 = 30;
/// A bias is worth a warning above this many standard errors.
const LEAST_ERRORS: f64 = 0.3;
/// Without a standard error, it is above this many per cent of the value.
const LEAST_PERCENT: f64 = 10.0;
/// Number of nodes over the noise.
const NODES: usize = 32;
/// Range of the noise in standard deviations.
const RANGE: f64 = 6.0;

impl Task<'_> {
    /// Warns of parameters that noise biases by more than a part of their standard error.
    ///
    /// # Errors
    /// Those of the optimiser.
    pub(super) fn biased(&self, fit: &Fit, objective: Objective) -> Result<Option<Warning>, Error> {
        let bends = matches!(objective.metric, Metric::Cbrt | Metric::Log);
        let Some(covariance) = &fit.covariance else { return Ok(None) };
        if !bends || objective.loss != LossKind::None || fit.unusable.is_some() {
            return Ok(None);
        }
        let mut samples = self.draws.part(SAMPLES, self.options.seed);
        let polished = |samples: &Samples, table: &ParameterTable, objective: Objective| {
            let observed = Arc::new(Observed::new(samples, objective.metric));
            let solution = self.polish(&observed, table.clone(), objective, ITERATIONS)?;
            let mut table = table.clone();
            table.set_coordinates(solution.x.as_slice());
            Ok::<_, Error>(table)
        };
        let straight = polished(&samples, &fit.table, Metric::UnbiasedCbrt.into())?;
        // What the file says about its noise counts even if the fit makes no use of it; the same draw takes the same samples.
        let with_sigma = self.with_sigma.filter(|with_sigma| with_sigma.len() == self.samples.len());
        let unused =
            with_sigma.and_then(|with_sigma| Draws::new(with_sigma).part(SAMPLES, self.options.seed).sigma);
        let misfit = self.misfit(&straight, None, fit.errors.all.relative);
        if !bend(&mut samples, self, &straight, (unused, misfit), objective.metric) {
            return Ok(None);
        }
        let bent = polished(&samples, &straight, objective)?;
        let of_row = |index: &usize| {
            let (value, there) = (straight.rows()[*index].value, bent.rows()[*index].value);
            let shift = there - value;
            // A parameter that noise has driven to a bound has no standard error there.
            let row = &fit.table.rows()[*index];
            let at_bound = row.at_lower() || row.at_upper();
            let errors = covariance.std_error(*index).map(|error| shift / error);
            let percent = 100.0 * shift / value.abs();
            let worth = match errors {
                Some(errors) => errors.abs() > LEAST_ERRORS,
                None => at_bound && percent.abs() > LEAST_PERCENT,
            };
            worth.then(|| Biased { parameter: fit.table.name(*index), percent, errors })
        };
        let mut found: Vec<Biased> = fit.table.free().iter().filter_map(of_row).collect();
        let size = |biased: &Biased| biased.errors.map_or(f64::INFINITY, f64::abs);
        found.sort_by(|a, b| size(b).total_cmp(&size(a)));
        Ok((!found.is_empty()).then_some(Warning::Bias { metric: objective.metric, parameters: found }))
    }
}

/// Replaces the values of samples by those of the curve that a fit in `metric` follows on average over the noise. Returns false if no
/// noise is known.
fn bend(
    samples: &mut Samples,
    task: &Task<'_>,
    table: &ParameterTable,
    (unused_sigma, misfit): (Option<Vec<Vec<f64>>>, Option<Misfit>),
    metric: Metric,
) -> bool {
    let parameters: Vec<_> = (0..samples.values.len()).map(|channel| table.formula_values(channel)).collect();
    let model = task.expression.values(&samples.directions, &parameters);
    let cosines: Vec<f64> = samples.directions.iter().map(|g| g.cos_i()).collect();
    let visible = misfit.and_then(|Misfit { ratio, .. }| ratio);
    let rule = GaussLegendre::new(NODES);
    let given = samples.sigma.take();
    for (channel, (row, model)) in samples.values.iter_mut().zip(&model).enumerate() {
        let x: Vec<f64> = model.iter().zip(&cosines).map(|(f, cos)| f * cos).collect();
        let sigma: Vec<f64> = match (given.as_ref().or(unused_sigma.as_ref()), visible) {
            (Some(given), _) => given[channel].iter().zip(&cosines).map(|(sigma, cos)| sigma * cos).collect(),
            (None, Some(ratio)) => {
                let noise = |((f, cos), x): ((&f64, &f64), &f64)| ((f * cos - x) / ratio.max(1.0)).powi(2);
                let measured = row.iter().zip(&cosines).zip(&x).filter(|((f, _), _)| !f.is_nan());
                let (of_measured, squares): (Vec<f64>, Vec<f64>) =
                    measured.map(|sample| (*sample.1, noise(sample))).unzip();
                let (constant, relative) = two_parts(&of_measured, &squares);
                x.iter().map(|x| (constant + relative * x * x).sqrt()).collect()
            }
            (None, None) => return false,
        };
        let of_row = row.iter_mut().zip(&x).zip(&sigma).zip(&cosines);
        for (((value, x), sigma), cos) in of_row.filter(|(((value, _), _), _)| !value.is_nan()) {
            let bent = if given.is_some() {
                bent_by_sigma(metric, *x, *sigma, &rule)
            } else {
                let root = mean(*sigma, &rule, |noise| transform(metric, x + noise));
                if metric == Metric::Log { root.exp_m1() } else { root.powi(3) }
            };
            *value = bent / cos;
        }
    }
    samples.sigma = given;
    true
}

/// g(x) of a metric that bends noise.
fn transform(metric: Metric, x: f64) -> f64 {
    if metric == Metric::Log { metric.measured(x).ln_1p() } else { x.cbrt() }
}

/// g'(x).
fn slope(metric: Metric, x: f64) -> f64 {
    if metric == Metric::Log { 1.0 / (1.0 + metric.measured(x)) } else { 1.0 / (3.0 * x.cbrt().powi(2)) }
}

/// The mean of a function of normal noise with a standard deviation.
fn mean(sigma: f64, rule: &GaussLegendre, function: impl Fn(f64) -> f64) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    rule.for_each(-RANGE, RANGE, |t, weight| {
        let density = weight * (-0.5 * t * t).exp();
        sum += density * function(sigma * t);
        total += density;
    });
    sum / total
}

/// The measured value with the same effect on a fit as x with noise has on average, if weights are by sigma.
///
/// The residual is divided by the measured slope, so that the fit follows the mean of h = (g(x*) - g(x))/g'(x*)^2.
fn bent_by_sigma(metric: Metric, x: f64, sigma: f64, rule: &GaussLegendre) -> f64 {
    /// Number of times that the range is halved.
    const HALVINGS: usize = 60;
    let h = |y: f64| {
        let slope = slope(metric, y);
        let h = (transform(metric, y) - transform(metric, x)) / (slope * slope);
        // The slope of a cube root is infinite at 0, and h is 0 there.
        if h.is_nan() { 0.0 } else { h }
    };
    let wanted = mean(sigma, rule, |noise| h(x + noise));
    let (mut low, mut high) = (x, x + 2.0 * RANGE * sigma);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if h(middle) < wanted { low = middle } else { high = middle }
    }
    low
}

/// The two parts a and b of noise whose variance is a + b x^2, from its squares at each x: least squares, weighted by the variance found
/// last, because the squares of normal noise scatter in proportion to it.
fn two_parts(x: &[f64], squares: &[f64]) -> (f64, f64) {
    /// Number of times that the weights are renewed.
    const ROUNDS: usize = 20;
    let n = count(squares.len().max(1));
    let mean_square = squares.iter().sum::<f64>() / n;
    let mean_x2 = x.iter().map(|x| x * x).sum::<f64>() / n;
    let least = 1e-12 * mean_square;
    let (mut a, mut b) = (mean_square, 0.0);
    for _ in 0..ROUNDS {
        let [mut s, mut sx, mut sxx, mut sy, mut sxy] = [0.0; 5];
        for (x, square) in x.iter().zip(squares) {
            let x2 = x * x;
            let variance = (a + b * x2).max(least).max(f64::MIN_POSITIVE);
            let weight = (mean_square / variance).powi(2);
            s += weight;
            sx += weight * x2;
            sxx += weight * x2 * x2;
            sy += weight * square;
            sxy += weight * x2 * square;
        }
        let determinant = s * sxx - sx * sx;
        let both = ((sy * sxx - sxy * sx) / determinant, (sxy * s - sy * sx) / determinant);
        (a, b) = match both {
            (a, b) if a >= 0.0 && b >= 0.0 => (a, b),
            (a, _) if a < 0.0 && sxx > 0.0 => (0.0, sxy / sxx),
            _ => (sy / s.max(f64::MIN_POSITIVE), 0.0),
        };
        // A part that seems to be 0 may return.
        a = a.max(1e-9 * mean_square);
        b = b.max(1e-9 * mean_square / mean_x2.max(f64::MIN_POSITIVE));
    }
    (a, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    #[test]
    fn both_parts_of_noise_are_found() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(1);
        let x: Vec<f64> = (0..20_000).map(|_| 10_f64.powf(3.0 * rng.random::<f64>() - 3.0)).collect();
        let squares: Vec<f64> = x
            .iter()
            .map(|x| (0.01_f64.hypot(0.1 * x) * rng.sample::<f64, _>(StandardNormal)).powi(2))
            .collect();
        let (a, b) = two_parts(&x, &squares);
        assert_relative_eq!(a.sqrt(), 0.01, max_relative = 0.03);
        assert_relative_eq!(b.sqrt(), 0.1, max_relative = 0.03);
    }

    /// docs/trust/calibration.md: a level is shifted by -s^2/3 without a sigma, and by s^2 with one.
    #[test]
    fn small_noise_bends_as_its_expansion_says() {
        let rule = GaussLegendre::new(NODES);
        for (x, s) in [(0.2_f64, 0.02), (5.0, 0.01)] {
            let root = mean(s * x, &rule, |noise| transform(Metric::Cbrt, x + noise));
            assert_relative_eq!(root.powi(3) / x - 1.0, -s * s / 3.0, max_relative = 0.01);
            let by_sigma = bent_by_sigma(Metric::Cbrt, x, s * x, &rule);
            assert_relative_eq!(by_sigma / x - 1.0, s * s, max_relative = 0.01);
            let root = mean(s * x, &rule, |noise| transform(Metric::Log, x + noise));
            assert_relative_eq!(root.exp_m1() / x - 1.0, -0.5 * s * s * x / (1.0 + x), max_relative = 0.01);
        }
    }
}
