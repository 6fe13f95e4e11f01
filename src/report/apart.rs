//! Whether samples held out tell two models apart.
//!
//! Each fold was left out of both models' fits, so they are compared fold by fold: what makes a fold hard makes it hard for both, and
//! cancels in the ratio of their errors. The folds are not independent, because any two fits share most of their samples. The variance
//! of the mean over J folds is therefore not s^2/J but about s^2 (1/J + n2/n1), where n1 samples were fitted and n2 tested (Nadeau and
//! Bengio 2003, doi:10.1023/A:1024068626366, section 3.2); with J folds n2/n1 is 1/(J - 1).

use super::record::{FoldRecord, HeldOutRecord, Report};
use crate::fit::Metric;
use crate::math::{count, half_interval_of_student};

/// Whether the folds tell the models of two reports apart: the one with the larger error on all samples held out also has the larger
/// one in most folds, by a factor that chance does not explain (5 %). If the two did not leave out the same folds, or have fewer than
/// two in common, they cannot be told apart.
pub(crate) fn are_told_apart(a: &Report, b: &Report) -> bool {
    let (Some(metric), Some(of_a), Some(of_b)) =
        (a.metric.known(), &a.selection.held_out, &b.selection.held_out)
    else {
        return false;
    };
    if a.metric != b.metric {
        return false;
    }
    match (of_a.errors.of(metric), of_b.errors.of(metric)) {
        (Some(whole_a), Some(whole_b)) => {
            paired(of_a, of_b, metric).is_some_and(|ratios| differ(&ratios, whole_a - whole_b))
        }
        // A model whose error is no number is clearly worse than one whose error is.
        (found, other) => found.is_some() != other.is_some(),
    }
}

/// ln(error of a/error of b) on each fold; `None` if they are not the same folds.
fn paired(a: &HeldOutRecord, b: &HeldOutRecord, metric: Metric) -> Option<Vec<f64>> {
    let same = |(a, b): (&FoldRecord, &FoldRecord)| a.theta_i_deg == b.theta_i_deg && a.samples == b.samples;
    if a.folds.len() != b.folds.len() || !a.folds.iter().zip(&b.folds).all(same) {
        return None;
    }
    let ratio = |(a, b): (&FoldRecord, &FoldRecord)| {
        let (a, b) = (a.errors.of(metric)?, b.errors.of(metric)?);
        // Two models that are both exact are alike.
        Some(if a == b { 0.0 } else { (a / b).ln() })
    };
    Some(a.folds.iter().zip(&b.folds).filter_map(ratio).collect())
}

/// Whether the mean of `ratios` has the sign of `difference` and is larger than chance explains.
fn differ(ratios: &[f64], difference: f64) -> bool {
    let folds = count(ratios.len());
    if ratios.len() < 2 {
        return false;
    }
    let mean = ratios.iter().sum::<f64>() / folds;
    let variance = ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum::<f64>() / (folds - 1.0);
    let std_error = (variance * (1.0 / folds + 1.0 / (folds - 1.0))).sqrt();
    mean * difference > 0.0 && mean.abs() > half_interval_of_student(folds - 1.0) * std_error
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_is_that_of_the_corrected_t_test() {
        // Ratios 1 +/- s on three folds: s sqrt(1/3 + 1/2) t, t(0.975, 2) = 4.3027, is 1 at s = 0.2546.
        let ratios = |s: f64| [1.0 - s, 1.0, 1.0 + s];
        assert!(differ(&ratios(0.2540), 0.1));
        assert!(!differ(&ratios(0.2552), 0.1));
        // On two folds, whose standard deviation is s sqrt(2): s sqrt(3) 12.706 is 1 at s = 0.04544.
        assert!(differ(&[1.0 - 0.0454, 1.0 + 0.0454], 0.1));
        assert!(!differ(&[1.0 - 0.0455, 1.0 + 0.0455], 0.1));
    }

    #[test]
    fn what_contradicts_itself_tells_nothing_apart() {
        // Clearly larger on every fold, but smaller on all samples together.
        assert!(!differ(&[1.0, 1.1, 0.9], -0.1));
        assert!(!differ(&[0.0, 0.0, 0.0], 0.0));
        assert!(!differ(&[3.0], 1.0));
        assert!(!differ(&[], 1.0));
        // An infinite ratio, where one model is exact on a fold.
        assert!(!differ(&[f64::INFINITY, 1.0, 1.0], 0.1));
    }
}
