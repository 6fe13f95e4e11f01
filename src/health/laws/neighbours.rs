//! Pairs of directions as points, and what lies near them.

use crate::geometry::Pair;
use glam::DVec3;
use nalgebra::{SMatrix, SVector};

/// A pair of directions as a point: turned about the normal so that the light's azimuth is 0, and the viewer to one side of the plane of
/// incidence, where f of an isotropic surface is the same.
pub(crate) fn point(pair: &Pair, turned: bool) -> [f64; 6] {
    let Pair { wi, wo } = pair;
    if !turned {
        return [wi.x, wi.y, wi.z, wo.x, wo.y, wo.z];
    }
    let length = wi.x.hypot(wi.y);
    let along = if length > 1e-9 { DVec3::new(wi.x / length, wi.y / length, 0.0) } else { DVec3::X };
    let x = wo.x * along.x + wo.y * along.y;
    let y = wo.y * along.x - wo.x * along.y;
    [length, 0.0, wi.z, x, y.abs(), wo.z]
}

/// The square of the distance of two points.
pub(crate) fn distance2(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// The number of neighbours between which is interpolated.
pub(crate) const NEAREST: usize = 8;

/// The squares of the distances of the samples nearest to a point, and their indices, nearest first.
pub(crate) type Near = [(f64, usize); NEAREST];

/// The samples nearest to a point, without those for which `skip` is true.
pub(crate) fn nearest(points: &[[f64; 6]], at: &[f64; 6], skip: impl Fn(usize) -> bool) -> Near {
    let mut best = [(f64::INFINITY, usize::MAX); NEAREST];
    for (index, point) in points.iter().enumerate() {
        let distance = distance2(point, at);
        let [.., last] = &best;
        if distance < last.0 && !skip(index) {
            let mut next = (distance, index);
            for place in &mut best {
                if next.0 < place.0 {
                    std::mem::swap(place, &mut next);
                }
            }
        }
    }
    best
}

/// The value at a point by a plane through its neighbours, which count less the farther they are. Along directions in which no neighbour lies,
/// the plane is level.
pub(crate) fn between(points: &[[f64; 6]], values: &[f64], at: &[f64; 6], near: &Near) -> Option<f64> {
    /// How much the plane is held level, relative to how far the neighbours lie apart.
    const LEVEL: f64 = 1e-3;
    /// What is added to the square of a distance, so that a sample in the very place does not count for all.
    const SAME: f64 = 1e-6;
    type Vector = SVector<f64, 6>;
    let at = Vector::from(*at);
    let known = || {
        near.iter().filter_map(|(distance2, index)| {
            Some((1.0 / (distance2 + SAME), Vector::from(*points.get(*index)?) - at, *values.get(*index)?))
        })
    };
    let weights: f64 = known().map(|(weight, ..)| weight).sum();
    let place = known().map(|(weight, place, _)| place * weight).sum::<Vector>() / weights;
    let value = known().map(|(weight, _, value)| weight * value).sum::<f64>() / weights;
    let mut spread = SMatrix::<f64, 6, 6>::zeros();
    let mut slope = Vector::zeros();
    for (weight, other, other_value) in known() {
        let from = other - place;
        spread += from * from.transpose() * weight;
        slope += from * (weight * (other_value - value));
    }
    let level = LEVEL * spread.trace();
    if !level.is_finite() {
        return None;
    }
    let slope = (spread + SMatrix::identity() * level.max(f64::MIN_POSITIVE)).cholesky()?.solve(&slope);
    // Beyond its neighbours the plane says nothing.
    let (low, high) =
        known().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, _, f)| (f.min(low), f.max(high)));
    Some((value - slope.dot(&place)).clamp(low, high))
}
