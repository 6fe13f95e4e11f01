//! How well samples are predicted from the others.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// What is left out together with a sample when its value is predicted from the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeftOut {
    /// The sample alone. This is optimistic if samples are dense along one angle and sparse along another.
    Sample,
    /// All samples with the same light direction. This is pessimistic, because light directions are then twice as far
    /// apart.
    Light,
}

/// How well samples are predicted from the others: sum_c |f - f*| / sum_c |f*| over samples left out in turn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LeaveOut {
    /// The median.
    pub median: f64,
    /// The 95th percentile.
    pub p95: f64,
    /// Number of samples that were left out, spread evenly over the measurement.
    pub samples: usize,
}

/// Summarises the errors of samples left out; `None` if there are none.
pub(super) fn summary(mut errors: Vec<f64>) -> Option<LeaveOut> {
    errors.sort_by(f64::total_cmp);
    let rank = |percent: usize| errors.get((errors.len() * percent).div_ceil(100).max(1) - 1).copied();
    Some(LeaveOut { median: rank(50)?, p95: rank(95)?, samples: errors.len() })
}

/// sum |f - f*| / sum |f*|; `None` if that is 0/0.
pub(super) fn apart(found: &[f64], measured: impl Iterator<Item = f64>) -> Option<f64> {
    let (error, size) = found.iter().zip(measured).fold((0.0, 0.0), |(error, size), (f, measured)| {
        (error + (f - measured).abs(), size + measured.abs())
    });
    (size > 0.0).then(|| error / size)
}

/// At most `most` indices below `n`, evenly spread.
pub(crate) fn spread(n: usize, most: usize) -> impl IndexedParallelIterator<Item = usize> {
    let taken = n.min(most);
    (0..taken).into_par_iter().map(move |i| i * n / taken.max(1))
}
