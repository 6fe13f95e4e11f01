//! Where a fit starts: a scan over the shape parameters with the amplitudes solved at every point.
//!
//! For fixed shapes the model is linear, or nearly so, in its amplitudes; profiling the cost over the one
//! to four shapes alone finds the basin of the global minimum (variable projection, Golub and Pereyra
//! 1973; for reflectance Yu, Seo and Lee 2011). The amplitudes are solved in the fit's own metric, on a
//! few hundred samples.

use super::levenberg_marquardt::{Limits, Tolerances, minimise};
use super::metric::Metric;
use super::parameters::{ParameterTable, Status};
use super::problem::ReflectanceProblem;
use crate::error::Error;
use crate::math::count;
use crate::measurement::Samples;
use crate::model::{Expression, Role, Scale};
use nalgebra::DVector;
use rayon::prelude::*;

/// Points of the scan: along one shape, along each of two, and in all over three or more.
const POINTS: [usize; 3] = [24, 16, 300];

/// A place to start from.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// Shapes as scanned, amplitudes as solved.
    pub(super) table: ParameterTable,
    /// Cost on the scan's samples.
    pub(super) cost: f64,
}

/// One axis of the scan: a free shape parameter, over all channels that it has.
struct Axis {
    rows: Vec<usize>,
    scale: Scale,
    range: (f64, f64),
}

impl Axis {
    /// The value at a fraction of the range.
    fn at(&self, fraction: f64) -> f64 {
        let (low, high) = self.range;
        match self.scale {
            Scale::Linear => low + (high - low) * fraction,
            Scale::Log => (low.ln() + (high.ln() - low.ln()) * fraction).exp(),
        }
    }
}

/// The free shapes that the user gave no start for.
fn axes(table: &ParameterTable) -> Vec<Axis> {
    let mut axes: Vec<Axis> = Vec::new();
    for lobe in 0..table.lobes().len() {
        for parameter in 0.. {
            let rows: Vec<usize> = table
                .places(lobe, parameter)
                .iter()
                .copied()
                .filter(|index| {
                    table.rows().get(*index).is_some_and(|row| {
                        row.status == Status::Free && row.spec.role == Role::Shape && !row.given
                    })
                })
                .collect();
            if table.places(lobe, parameter).is_empty() {
                break;
            }
            let Some(row) = rows.first().and_then(|index| table.rows().get(*index)) else { continue };
            let (typical, bounds) = (row.spec.typical, row.bounds);
            // Bounds outside the typical range leave nothing of it; then they are the range.
            let clipped = (typical.0.max(bounds.0), typical.1.min(bounds.1));
            let range = if clipped.0 < clipped.1 { clipped } else { bounds };
            axes.push(Axis { rows, scale: row.spec.scale, range });
        }
    }
    axes
}

/// The fractions of each axis' range at each point of the scan.
fn scan_points(axes: usize) -> Vec<Vec<f64>> {
    let [line, plane, volume] = POINTS;
    let centre = |i: usize, n: usize| (count(i) + 0.5) / count(n);
    match axes {
        0 => vec![Vec::new()],
        1 => (0..line).map(|i| vec![centre(i, line)]).collect(),
        2 => (0..plane * plane).map(|i| vec![centre(i / plane, plane), centre(i % plane, plane)]).collect(),
        // Halton's sequence (1960) fills more dimensions evenly with few points.
        _ => {
            const PRIMES: [usize; 12] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];
            (1..=volume)
                .map(|i| (0..axes).map(|a| halton(i, PRIMES.get(a).copied().unwrap_or(41 + a))).collect())
                .collect()
        }
    }
}

/// The radical inverse of `index`.
fn halton(index: usize, base: usize) -> f64 {
    let (mut result, mut fraction, mut rest) = (0.0, 1.0, index);
    while rest > 0 {
        fraction /= count(base);
        result += fraction * count(rest % base);
        rest /= base;
    }
    result
}

/// The most promising starts, the best first, at most `wanted`.
///
/// # Errors
/// [`Error::Optimiser`] for a defect.
pub(super) fn search(
    expression: &Expression,
    samples: &Samples,
    table: &ParameterTable,
    metric: Metric,
    wanted: usize,
    limits: &Limits,
) -> Result<Vec<Candidate>, Error> {
    let axes = axes(table);
    let points = scan_points(axes.len());
    let candidates: Result<Vec<Candidate>, Error> = points
        .par_iter()
        .map(|point| {
            let mut table = table.clone();
            for (axis, fraction) in axes.iter().zip(point) {
                axis.rows.iter().for_each(|row| table.set_value(*row, axis.at(*fraction)));
            }
            solve_amplitudes(expression, samples, table, metric, limits)
        })
        .collect();
    let candidates = candidates?;

    let mut order: Vec<usize> = (0..candidates.len()).collect();
    let cost = |i: &usize| candidates.get(*i).map_or(f64::INFINITY, |c| c.cost);
    order.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    let spacing = count(candidates.len().max(1)).powf(-1.0 / count(axes.len().max(1)));
    let near = |i: &usize, j: &usize| {
        let (Some(a), Some(b)) = (points.get(*i), points.get(*j)) else { return false };
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1.5 * spacing)
    };
    // The profile's own minima come first, then the best of what lies away from them.
    let is_minimum = |i: &usize| order.iter().take_while(|j| j != &i).all(|j| !near(i, j));
    let minima: Vec<usize> = order.iter().copied().filter(is_minimum).collect();
    let mut chosen: Vec<usize> = minima.into_iter().take(wanted).collect();
    for index in &order {
        if chosen.len() < wanted && chosen.iter().all(|other| !near(index, other)) {
            chosen.push(*index);
        }
    }
    Ok(chosen.into_iter().filter_map(|index| candidates.get(index).cloned()).collect())
}

/// Solves the amplitudes for the shapes of `table`.
fn solve_amplitudes(
    expression: &Expression,
    samples: &Samples,
    table: ParameterTable,
    metric: Metric,
    limits: &Limits,
) -> Result<Candidate, Error> {
    let problem = ReflectanceProblem::new(expression, samples, table.with_fixed(Role::Shape), metric);
    let start = DVector::from_vec(problem.table().coordinates());
    // A scan needs to tell basins apart, no more.
    let tolerances = Tolerances { step: 1e-4, cost: 1e-4, gradient: 1e-4, refinements: 0 };
    let limits = Limits { iterations: 12, observer: None, ..limits.clone() };
    let solution = minimise(&problem, start, tolerances, limits)?;
    let mut solved = problem.table().clone();
    solved.set_coordinates(solution.x.as_slice());
    let mut table = table;
    for (index, row) in solved.rows().iter().enumerate() {
        table.set_value(index, row.value);
    }
    table.start_here();
    Ok(Candidate { table, cost: solution.cost })
}
