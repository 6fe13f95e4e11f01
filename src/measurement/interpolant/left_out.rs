//! How well samples are predicted from the others.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// What is left out with a sample when its value is foretold from the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeftOut {
    /// The sample alone: optimistic where samples are dense along one angle and sparse along another.
    Sample,
    /// All samples with the same light: pessimistic, since lights are then twice as far apart.
    Light,
}

/// How well samples are foretold by the others: sum_c |f - f*| / sum_c |f*| over samples left out in turn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LeaveOut {
    /// Median.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Samples that were left out, evenly from the measurement's order.
    pub samples: usize,
}

/// The summary of errors of samples left out.
pub(super) fn summary(mut errors: Vec<f64>) -> Option<LeaveOut> {
    errors.sort_by(f64::total_cmp);
    let rank = |percent: usize| errors.get((errors.len() * percent).div_ceil(100).max(1) - 1).copied();
    Some(LeaveOut { median: rank(50)?, p95: rank(95)?, samples: errors.len() })
}

/// sum |f - f*| / sum |f*|, where that is not 0/0.
pub(super) fn apart(found: &[f64], measured: impl Iterator<Item = f64>) -> Option<f64> {
    let (error, size) = found.iter().zip(measured).fold((0.0, 0.0), |(error, size), (f, measured)| {
        (error + (f - measured).abs(), size + measured.abs())
    });
    (size > 0.0).then(|| error / size)
}

/// At most `most` indices below `n`, evenly spread.
pub(super) fn spread(n: usize, most: usize) -> impl IndexedParallelIterator<Item = usize> {
    let taken = n.min(most);
    (0..taken).into_par_iter().map(move |i| i * n / taken.max(1))
}
