//! Where a fit starts: a scan over the shape parameters with the amplitudes solved at every point.
//!
//! For fixed shapes the model is linear, or nearly so, in its amplitudes; profiling the cost over the one
//! to four shapes alone finds the basin of the global minimum (variable projection, Golub and Pereyra
//! 1973; for reflectance Yu, Seo and Lee 2011). The amplitudes are solved in the fit's own metric, on a
//! few hundred samples.

use super::absent_lobes::past_absent_lobes;
use super::recombine::recombined;
use crate::error::Error;
use crate::fit::problem::loss::Objective;
use crate::fit::problem::metric::Metric;
use crate::fit::problem::observed::Observed;
use crate::fit::problem::reflectance::ReflectanceProblem;
use crate::math::count;
use crate::measurement::Samples;
use crate::model::{Expression, Role, Scale};
use crate::parameters::{ParameterTable, Status};
use crate::solver::{Limits, Tolerances, minimise};
use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::sync::Arc;

/// Points of the scan: along one shape, along each of two, and in all over three or more.
const POINTS: [usize; 3] = [30, 20, 300];
/// Starts that come out of it: with one shape, and with more.
const STARTS: [usize; 2] = [5, 8];
/// The amplitudes of a point are solved in as many iterations as products of amplitudes may take. Along one shape, of
/// which nothing is hidden, so many tell which third of the points is worth the rest; with more shapes the way to the
/// best minimum may begin at any point.
const ITERATIONS: u64 = 40;
const FIRST_ITERATIONS: u64 = 6;
const PROMISING: usize = 3;
/// Channels that the points are compared in.
const CHANNELS: usize = 4;
/// Of so many times as many points about one in two is left when lobes of one kind are put in order.
const ORDERED: usize = 2;

/// A place to start from.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// Shapes as scanned, amplitudes as solved.
    pub(super) table: ParameterTable,
    /// Cost on the scan's samples.
    pub(super) cost: f64,
}

/// What the scan has seen.
#[derive(Clone, Debug)]
pub(super) struct Scan {
    /// How many shapes were scanned.
    pub(super) axes: usize,
    /// The most promising starts, the best first.
    pub(super) candidates: Vec<Candidate>,
    /// The lowest cost along each axis; empty where the points form no lattice.
    pub(super) profiles: Vec<Profile>,
}

/// The lowest cost at each value of one shape, whatever the others.
#[derive(Clone, Debug)]
pub(in crate::fit) struct Profile {
    /// The shape's first row.
    pub(in crate::fit) row: usize,
    /// Values, ascending, and costs.
    pub(in crate::fit) points: Vec<(f64, f64)>,
}

/// What a scan looks at.
pub(super) struct ScanSamples<'a> {
    /// Samples in a few channels: the shapes are mostly the same in all.
    some: Arc<Observed<'a>>,
    /// The same samples in all channels, where there are more: the amplitudes are not.
    all: Option<Arc<Observed<'a>>>,
}

impl<'a> ScanSamples<'a> {
    pub(super) fn new(samples: &'a Samples, metric: Metric) -> Self {
        let some = Observed::with_some_channels(samples, metric, CHANNELS);
        let all = (samples.values.len() > CHANNELS).then(|| Arc::new(Observed::new(samples, metric)));
        Self { some: Arc::new(some), all }
    }

    /// The samples in all channels.
    pub(super) fn in_all_channels(&self) -> &Observed<'a> {
        self.all.as_deref().unwrap_or(&self.some)
    }
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
            Scale::Linear | Scale::Square => low + (high - low) * fraction,
            Scale::Log => (low.ln() + (high.ln() - low.ln()) * fraction).exp(),
        }
    }
}

/// The free shapes that the user gave no start for.
fn axes(table: &ParameterTable) -> Vec<Axis> {
    let mut axes: Vec<Axis> = Vec::new();
    for lobe in 0..table.lobes().len() {
        for parameter in 0..table.parameters_of(lobe) {
            let rows: Vec<usize> = table
                .places(lobe, parameter)
                .iter()
                .copied()
                .filter(|index| {
                    table.rows().get(*index).is_some_and(|row| {
                        let open = row.status == Status::Free && !row.given;
                        open && row.spec.role == Role::Shape && row.spec.scanned
                    })
                })
                .collect();
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
fn scan_points(axes: usize, seed: u64, ordered: bool) -> Vec<Vec<f64>> {
    let [line, plane, volume] = POINTS;
    let centre = |i: usize, n: usize| (count(i) + 0.5) / count(n);
    match axes {
        0 => vec![Vec::new()],
        1 => (0..line).map(|i| vec![centre(i, line)]).collect(),
        2 => (0..plane * plane).map(|i| vec![centre(i / plane, plane), centre(i % plane, plane)]).collect(),
        // Halton's sequence (1960) fills more dimensions evenly with few points; shifted at random
        // (Cranley and Patterson 1976), another seed looks elsewhere.
        _ => {
            const PRIMES: [usize; 12] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];
            let mut rng = Pcg64Mcg::seed_from_u64(seed);
            let shifts: Vec<f64> = (0..axes).map(|_| rng.random()).collect();
            let coordinate = |i: usize, axis: usize, shift: f64| {
                (halton(i, PRIMES.get(axis).copied().unwrap_or(41 + axis)) + shift).fract()
            };
            let point = |i: usize| shifts.iter().enumerate().map(|(a, s)| coordinate(i, a, *s)).collect();
            (1..=if ordered { ORDERED * volume } else { volume }).map(point).collect()
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

/// Scans the shapes.
///
/// # Errors
/// [`Error::Optimiser`] for a defect.
pub(super) fn scan(
    expression: &Expression,
    samples: &ScanSamples<'_>,
    table: &ParameterTable,
    objective: Objective,
    seed: u64,
    limits: &Limits,
) -> Result<Scan, Error> {
    let axes = axes(table);
    let [along_a_line, in_space] = STARTS;
    let wanted = if axes.len() < 2 { along_a_line } else { in_space };
    let ordered = table.has_exchangeable_lobes();
    let place = |point: &[f64]| {
        let mut table = table.clone();
        for (axis, fraction) in axes.iter().zip(point) {
            axis.rows.iter().for_each(|row| table.set_value(*row, axis.at(*fraction)));
        }
        table
    };
    // Of points that differ only in which lobe is which, one is enough.
    let points: Vec<Vec<f64>> = scan_points(axes.len(), seed, ordered)
        .into_iter()
        .filter(|point| !ordered || place(point).is_sorted())
        .collect();
    let solve = |samples: &Arc<Observed<'_>>, table: ParameterTable, iterations: u64| {
        let limits = Limits { iterations, observer: None, ..limits.clone() };
        solve_amplitudes(expression, samples, table, objective, &limits)
    };
    let on_a_line = axes.len() == 1;
    let first_iterations = if on_a_line { FIRST_ITERATIONS } else { ITERATIONS };
    let first_look = |point: &Vec<f64>| solve(&samples.some, place(point), first_iterations);
    let candidates: Result<Vec<Candidate>, Error> = points.par_iter().map(first_look).collect();
    let mut candidates = candidates?;
    let wanting = if on_a_line { candidates.len().div_ceil(PROMISING) } else { 0 };
    let promising: Vec<usize> = ranking(&candidates).into_iter().take(wanting).collect();
    let more: Result<Vec<Candidate>, Error> = promising
        .par_iter()
        .filter_map(|index| candidates.get(*index))
        .map(|candidate| solve(&samples.some, candidate.table.clone(), ITERATIONS))
        .collect();
    for (index, candidate) in promising.into_iter().zip(more?) {
        candidates.get_mut(index).into_iter().for_each(|place| *place = candidate.clone());
    }

    let order = ranking(&candidates);
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
    let profiles = if axes.len() <= 2 { profiles(&axes, &points, &candidates) } else { Vec::new() };
    // Where channels have shapes of their own, each may start at another point.
    let tables: Vec<&ParameterTable> = candidates.iter().map(|candidate| &candidate.table).collect();
    let problem = |table: &ParameterTable| {
        ReflectanceProblem::of(expression, Arc::clone(&samples.some), table.clone(), objective)
    };
    let apart =
        recombined(&tables, problem).map(|table| solve(&samples.some, table, ITERATIONS)).transpose()?;
    let candidates = chosen.into_iter().filter_map(|index| candidates.get(index).cloned()).chain(apart);
    let candidates: Result<Vec<Candidate>, Error> = match &samples.all {
        None => Ok(candidates.collect()),
        Some(all) => candidates
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|candidate| solve(all, candidate.table, first_iterations))
            .collect(),
    };
    Ok(Scan { axes: axes.len(), candidates: candidates?, profiles })
}

/// The candidates' indices, the best first.
fn ranking(candidates: &[Candidate]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..candidates.len()).collect();
    let cost = |i: &usize| candidates.get(*i).map_or(f64::INFINITY, |c| c.cost);
    order.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    order
}

/// The lowest cost along each axis of a lattice of points.
fn profiles(axes: &[Axis], points: &[Vec<f64>], candidates: &[Candidate]) -> Vec<Profile> {
    let profile = |(index, axis): (usize, &Axis)| {
        let mut lowest: Vec<(f64, f64)> = Vec::new();
        for (point, candidate) in points.iter().zip(candidates) {
            let Some(fraction) = point.get(index) else { continue };
            match lowest.iter_mut().find(|(f, _)| f == fraction) {
                Some((_, cost)) => *cost = cost.min(candidate.cost),
                None => lowest.push((*fraction, candidate.cost)),
            }
        }
        lowest.sort_by(|a, b| a.0.total_cmp(&b.0));
        let points = lowest.into_iter().map(|(fraction, cost)| (axis.at(fraction), cost)).collect();
        Some(Profile { row: *axis.rows.first()?, points })
    };
    axes.iter().enumerate().filter_map(profile).collect()
}

/// Solves the amplitudes for the shapes of `table`.
fn solve_amplitudes(
    expression: &Expression,
    samples: &Arc<Observed<'_>>,
    table: ParameterTable,
    objective: Objective,
    limits: &Limits,
) -> Result<Candidate, Error> {
    let problem =
        ReflectanceProblem::of(expression, Arc::clone(samples), table.with_fixed(Role::Shape), objective);
    let start = DVector::from_vec(problem.table().coordinates());
    // A scan needs to tell basins apart, no more.
    let tolerances = Tolerances { step: 1e-4, cost: 1e-4, gradient: 1e-4, refinements: 0 };
    let solution = past_absent_lobes(&problem, problem.table(), start, |start| {
        minimise(&problem, start, tolerances, limits.clone())
    })?;
    let mut solved = problem.table().clone();
    solved.set_coordinates(solution.x.as_slice());
    let mut table = table;
    for (index, row) in solved.rows().iter().enumerate() {
        table.set_value(index, row.value);
    }
    table.start_here();
    Ok(Candidate { table, cost: solution.cost })
}
