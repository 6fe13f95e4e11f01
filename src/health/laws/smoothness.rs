//! Smoothness: neighbouring directions have similar values.
//!
//! About the normal all azimuths are neighbours. Angles that were misunderstood put samples side by side that were far apart.

use super::neighbours::{between, nearest, point, some_of};
use crate::geometry::Pair;
use crate::math::count;

/// The most samples that are compared with their neighbours.
const COMPARED: usize = 300;

/// By how much a sample differs from what its neighbours say, root mean square, relative to the standard deviation of all. Their ranks
/// are compared, so that a peak does not decide alone. `None` where all values are alike. On an isotropic surface directions that differ by turning
/// about the normal are one.
pub(crate) fn roughness(pairs: &[Pair], values: &[f64], isotropic: bool) -> Option<f64> {
    let values = ranks(values);
    let points: Vec<[f64; 6]> = pairs.iter().map(|pair| point(pair, isotropic)).collect();
    let n = count(values.len());
    let mean = values.iter().sum::<f64>() / n;
    let spread = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt();
    let (mut sum, mut compared) = (0.0, 0.0);
    for index in some_of(values.len(), COMPARED) {
        let (Some(at), Some(value)) = (points.get(index), values.get(index)) else { continue };
        let predicted = between(&points, &values, at, &nearest(&points, at, |other| other == index));
        if let Some(predicted) = predicted {
            sum += (value - predicted).powi(2);
            compared += 1.0;
        }
    }
    (spread > 1e-9 * mean.abs() && compared > 0.0).then(|| (sum / compared).sqrt() / spread)
}

/// The places of values among all, from 0 to 1. Equal values have the same.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<(usize, f64)> = values.iter().copied().enumerate().collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut ranks = vec![0.0; values.len()];
    let mut before = 0;
    for equal in order.chunk_by(|a, b| a.1.total_cmp(&b.1).is_eq()) {
        let middle = count(before) + 0.5 * count(equal.len());
        for (index, _) in equal {
            if let Some(rank) = ranks.get_mut(*index) {
                *rank = middle / count(values.len());
            }
        }
        before += equal.len();
    }
    ranks
}
