//! Smoothness: neighbouring directions have similar values.
//!
//! About the normal all azimuths are neighbours. Angles that were misunderstood put samples side by side that were far apart.

use super::neighbours::{between, nearest, point};
use crate::geometry::Pair;
use crate::math::count;
use crate::measurement::interpolant::spread;
use rayon::prelude::*;

/// The most samples that are compared with their neighbours.
const COMPARED: usize = 300;

/// By how much a sample differs from what its neighbours say, root mean square, relative to the standard deviation of all. The ranks of values
/// are compared, so that a peak does not decide alone. `None` where all values are alike. On an isotropic surface directions that differ by turning
/// about the normal are one.
pub(crate) fn roughness(pairs: &[Pair], ranks: &[f64], isotropic: bool) -> Option<f64> {
    let points: Vec<[f64; 6]> = pairs.iter().map(|pair| point(pair, isotropic)).collect();
    let n = count(ranks.len());
    let mean = ranks.iter().sum::<f64>() / n;
    let spread_of_all = (ranks.iter().map(|rank| (rank - mean).powi(2)).sum::<f64>() / n).sqrt();
    let square = |index: usize| {
        let at = points.get(index)?;
        let predicted = between(&points, ranks, at, &nearest(&points, at, |other| other == index))?;
        Some((ranks.get(index)? - predicted).powi(2))
    };
    let squares: Vec<f64> = spread(ranks.len(), COMPARED).filter_map(square).collect();
    let compared = count(squares.len());
    (spread_of_all > 1e-9 * mean.abs() && compared > 0.0)
        .then(|| (squares.iter().sum::<f64>() / compared).sqrt() / spread_of_all)
}

/// The places of values among all, from 0 to 1. Equal values have the same.
pub(crate) fn ranks(values: &[f64]) -> Vec<f64> {
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
