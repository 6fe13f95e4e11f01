//! Scans the shape parameters for places to start a fit, solving for the amplitudes at every point.
//!
//! For fixed shapes the model is linear, or nearly so, in its amplitudes. Profiling the cost over the one to four
//! shapes alone finds the basin of the global minimum (variable projection, Golub and Pereyra 1973; for reflectance
//! Yu, Seo and Lee 2011). The amplitudes are solved in the fit's own metric, on a few hundred samples.

use super::absent_lobes::minimise_escaping_absent_lobes;
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
use crate::solver::in_parts::minimise_in_parts;
use crate::solver::{Limits, Tolerances};
use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::sync::Arc;

/// Number of points of a scan along one shape.
const POINTS_ON_A_LINE: usize = 30;
/// Number of points along each axis in a scan of two shapes.
const POINTS_PER_SIDE: usize = 20;
/// Total number of points in a scan of three or more shapes.
const POINTS_IN_SPACE: usize = 300;
/// Factor by which the number of points is increased if lobes of one kind are put in order, which leaves about half
/// the points.
const POINTS_PER_ORDERED_POINT: usize = 2;
/// Number of starts taken from a scan of at most one shape.
const STARTS_ON_A_LINE: usize = 5;
/// Number of starts taken from a scan of more shapes.
const STARTS_IN_SPACE: usize = 8;
/// Largest number of iterations to solve the amplitudes at a point: products of amplitudes may take this many.
const ITERATIONS: u64 = 40;
/// The same where the strength of a lobe is the product of two free amplitudes: then a point takes many iterations to
/// the last digit of a valley that the next stage follows anyway, and few to the valley.
const ITERATIONS_TO_A_VALLEY: u64 = 10;
/// Number of iterations, in a scan along one shape, after which only the promising points are continued: a line hides
/// nothing. With more shapes the way to the best minimum may begin at any point, and each gets all of [`ITERATIONS`].
const FIRST_ITERATIONS: u64 = 6;
/// One point in this many is promising and is continued.
const PROMISING: usize = 3;
/// Largest number of shapes for which the points form a lattice, so that the lowest cost along each axis is known.
const LATTICE_AXES: usize = 2;
/// Largest number of channels in which the points are compared.
const CHANNELS: usize = 4;
/// A scan only needs to tell basins apart.
const TOLERANCES: Tolerances = Tolerances { step: 1e-4, cost: 1e-4, gradient: 1e-4, refinements: 0 };

/// A place to start from.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// The parameters: shapes as scanned, amplitudes as solved.
    pub(super) table: ParameterTable,
    /// Cost on the scan's samples.
    pub(super) cost: f64,
}

/// The result of a scan.
#[derive(Clone, Debug)]
pub(super) struct Scan {
    /// Number of shapes that were scanned.
    pub(super) axes: usize,
    /// The most promising starts, the best first.
    pub(super) candidates: Vec<Candidate>,
    /// The lowest cost along each axis; empty if the points form no lattice.
    pub(super) profiles: Vec<Profile>,
}

/// The lowest cost at each value of one shape, over all values of the other shapes.
#[derive(Clone, Debug)]
pub(in crate::fit) struct Profile {
    /// The shape's first row in the parameter table.
    pub(in crate::fit) row: usize,
    /// Values of the shape, ascending, each with the lowest cost there.
    pub(in crate::fit) points: Vec<(f64, f64)>,
}

/// The samples of a scan.
pub(super) struct ScanSamples<'a> {
    /// The samples in a few channels, which are enough because the shapes are mostly the same in all.
    some: Arc<Observed<'a>>,
    /// The samples in all channels, for the amplitudes, which differ; `None` if there are only a few channels.
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

/// One axis of the scan: a free shape parameter, with all the channels that have it.
struct Axis {
    /// Rows of the parameter table; at least one.
    rows: Vec<usize>,
    scale: Scale,
    /// The smallest and the largest value.
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

/// The free shapes for which the user gave no start value.
fn axes(table: &ParameterTable) -> Vec<Axis> {
    let mut axes: Vec<Axis> = Vec::new();
    for lobe in 0..table.lobes().len() {
        for parameter in 0..table.parameters_of(lobe) {
            let rows: Vec<usize> = table
                .places(lobe, parameter)
                .iter()
                .copied()
                .filter(|index| {
                    let row = &table.rows()[*index];
                    let open = row.status == Status::Free && !row.given;
                    open && row.spec.role == Role::Shape && row.spec.scanned
                })
                .collect();
            let Some(first) = rows.first() else { continue };
            let row = &table.rows()[*first];
            let (typical, bounds) = (row.spec.typical, row.bounds);
            // If the bounds exclude the typical range, the bounds are the range.
            let clipped = (typical.0.max(bounds.0), typical.1.min(bounds.1));
            let range = if clipped.0 < clipped.1 { clipped } else { bounds };
            axes.push(Axis { rows, scale: row.spec.scale, range });
        }
    }
    axes
}

/// The points of a scan, as fractions of each axis' range. If lobes are `ordered`, which leaves only some of the
/// points, there are more of them.
fn scan_points(axes: usize, seed: u64, ordered: bool) -> Vec<Vec<f64>> {
    let centre = |i: usize, n: usize| (count(i) + 0.5) / count(n);
    match axes {
        0 => vec![Vec::new()],
        1 => (0..POINTS_ON_A_LINE).map(|i| vec![centre(i, POINTS_ON_A_LINE)]).collect(),
        2 => {
            let side = POINTS_PER_SIDE;
            (0..side * side).map(|i| vec![centre(i / side, side), centre(i % side, side)]).collect()
        }
        // Halton's sequence (1960) fills many dimensions evenly with few points. It is shifted at random (Cranley and
        // Patterson 1976), so that another seed tries other points.
        _ => {
            let points = if ordered { POINTS_PER_ORDERED_POINT * POINTS_IN_SPACE } else { POINTS_IN_SPACE };
            let mut rng = Pcg64Mcg::seed_from_u64(seed);
            let shifts: Vec<f64> = (0..axes).map(|_| rng.random()).collect();
            let coordinate = |i: usize, axis: usize| (halton(i, halton_base(axis)) + shifts[axis]).fract();
            (1..=points).map(|i| (0..axes).map(|axis| coordinate(i, axis)).collect()).collect()
        }
    }
}

/// The base of Halton's sequence along an axis: a prime, up to the length of the table of primes.
fn halton_base(axis: usize) -> usize {
    const PRIMES: [usize; 12] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];
    PRIMES.get(axis).copied().unwrap_or(41 + axis)
}

/// The radical inverse of `index` in a base.
fn halton(index: usize, base: usize) -> f64 {
    let (mut result, mut fraction, mut rest) = (0.0, 1.0, index);
    while rest > 0 {
        fraction /= count(base);
        result += fraction * count(rest % base);
        rest /= base;
    }
    result
}

/// The inputs of a scan.
pub(super) struct Scanner<'s> {
    pub(super) expression: &'s Expression,
    pub(super) samples: &'s ScanSamples<'s>,
    pub(super) objective: Objective,
    /// The limits of each minimisation, apart from the scan's own number of iterations.
    pub(super) limits: Limits,
}

impl Scanner<'_> {
    /// Scans the free shapes of `table`.
    ///
    /// # Errors
    /// [`Error::Optimiser`] for a bug in this crate.
    pub(super) fn scan(&self, table: &ParameterTable, seed: u64) -> Result<Scan, Error> {
        // The points to try. If points differ only in which lobe is which, one of them is enough.
        let axes = axes(table);
        let ordered = table.has_exchangeable_lobes();
        let (points, places): (Vec<Vec<f64>>, Vec<ParameterTable>) = scan_points(axes.len(), seed, ordered)
            .into_iter()
            .map(|point| {
                let place = at_point(table, &axes, &point);
                (point, place)
            })
            .filter(|(_, place)| !ordered || place.is_sorted())
            .unzip();

        // Solve the amplitudes at each point, and choose the points that are worth following.
        let on_a_line = axes.len() == 1;
        let candidates = if on_a_line {
            self.solve_the_promising(places)?
        } else {
            match (table.has_free_products(), axes.len()) {
                (true, LATTICE_AXES) => self.solve_rows(&points, places)?,
                (true, _) => self.solve_all(&self.samples.some, places, ITERATIONS_TO_A_VALLEY)?,
                (false, _) => self.solve_all(&self.samples.some, places, ITERATIONS)?,
            }
        };
        let wanted = if axes.len() < 2 { STARTS_ON_A_LINE } else { STARTS_IN_SPACE };
        let chosen = choose(&points, &candidates, axes.len(), wanted);
        let profiles =
            if axes.len() <= LATTICE_AXES { profiles(&axes, &points, &candidates) } else { Vec::new() };

        // If channels have shapes of their own, each may start at another point.
        let tables: Vec<&ParameterTable> = candidates.iter().map(|candidate| &candidate.table).collect();
        let apart = recombined(&tables, |table| self.problem(&self.samples.some, table.clone()))
            .map(|table| self.solve_amplitudes(&self.samples.some, table, ITERATIONS))
            .transpose()?;
        let mut starts: Vec<Candidate> = chosen.into_iter().map(|index| candidates[index].clone()).collect();
        starts.extend(apart);

        // The shapes are mostly the same in all channels, but the amplitudes are not.
        if let Some(all) = &self.samples.all {
            let iterations = if on_a_line { FIRST_ITERATIONS } else { ITERATIONS };
            let tables = starts.into_iter().map(|start| start.table).collect();
            starts = self.solve_all(all, tables, iterations)?;
        }
        Ok(Scan { axes: axes.len(), candidates: starts, profiles })
    }

    /// Solves the amplitudes at each place roughly, then those of the most promising places precisely.
    fn solve_the_promising(&self, places: Vec<ParameterTable>) -> Result<Vec<Candidate>, Error> {
        let mut candidates = self.solve_all(&self.samples.some, places, FIRST_ITERATIONS)?;
        let wanted = candidates.len().div_ceil(PROMISING);
        let promising: Vec<usize> = ranking(&candidates).into_iter().take(wanted).collect();
        let places = promising.iter().map(|index| candidates[*index].table.clone()).collect();
        let solved = self.solve_all(&self.samples.some, places, ITERATIONS)?;
        for (index, candidate) in promising.into_iter().zip(solved) {
            candidates[index] = candidate;
        }
        Ok(candidates)
    }

    /// Solves the amplitudes at each place of a lattice, along each row of it: the amplitudes at one place are close to those at the
    /// next.
    fn solve_rows(&self, points: &[Vec<f64>], places: Vec<ParameterTable>) -> Result<Vec<Candidate>, Error> {
        assert_eq!(points.len(), places.len(), "a place per point");
        let mut rows: Vec<Vec<ParameterTable>> = Vec::new();
        let mut last = f64::NAN;
        for (point, place) in points.iter().zip(places) {
            if point[0] != last {
                rows.push(Vec::new());
                last = point[0];
            }
            if let Some(row) = rows.last_mut() {
                row.push(place);
            }
        }
        let solve_row = |row: Vec<ParameterTable>| -> Result<Vec<Candidate>, Error> {
            let mut solved: Vec<Candidate> = Vec::new();
            for mut place in row {
                if let Some(neighbour) = solved.last() {
                    place.take_amplitudes(&neighbour.table);
                }
                solved.push(self.solve_amplitudes(&self.samples.some, place, ITERATIONS_TO_A_VALLEY)?);
            }
            Ok(solved)
        };
        let solved: Result<Vec<Vec<Candidate>>, Error> = rows.into_par_iter().map(solve_row).collect();
        Ok(solved?.concat())
    }

    /// Solves the amplitudes at each place.
    fn solve_all(
        &self,
        samples: &Arc<Observed<'_>>,
        places: Vec<ParameterTable>,
        iterations: u64,
    ) -> Result<Vec<Candidate>, Error> {
        places.into_par_iter().map(|place| self.solve_amplitudes(samples, place, iterations)).collect()
    }

    /// Solves the amplitudes for the shapes of `table`.
    fn solve_amplitudes(
        &self,
        samples: &Arc<Observed<'_>>,
        mut table: ParameterTable,
        iterations: u64,
    ) -> Result<Candidate, Error> {
        let problem = self.problem(samples, table.with_fixed(Role::Shape));
        let start = DVector::from_vec(problem.table().coordinates());
        let limits = Limits { iterations, observer: None, ..self.limits.clone() };
        let products = problem.table().free_products();
        let solution = minimise_escaping_absent_lobes(&problem, problem.table(), start, |start| {
            minimise_in_parts(&problem, &products, &start, TOLERANCES, limits.clone())
        })?;
        let mut solved = problem.table().clone();
        solved.set_coordinates(solution.x.as_slice());
        for (index, row) in solved.rows().iter().enumerate() {
            table.set_value(index, row.value);
        }
        table.start_here();
        Ok(Candidate { table, cost: solution.cost })
    }

    fn problem<'p>(&'p self, samples: &Arc<Observed<'p>>, table: ParameterTable) -> ReflectanceProblem<'p> {
        ReflectanceProblem::of(self.expression, Arc::clone(samples), table, self.objective)
    }
}

/// The parameters of `table` with the shapes set to a point of the scan.
fn at_point(table: &ParameterTable, axes: &[Axis], point: &[f64]) -> ParameterTable {
    assert_eq!(axes.len(), point.len(), "a coordinate per axis");
    let mut table = table.clone();
    for (axis, fraction) in axes.iter().zip(point) {
        axis.rows.iter().for_each(|row| table.set_value(*row, axis.at(*fraction)));
    }
    table
}

/// The indices of up to `wanted` candidates to follow: first the local minima, then the best of those that are not
/// near one already chosen.
fn choose(points: &[Vec<f64>], candidates: &[Candidate], axes: usize, wanted: usize) -> Vec<usize> {
    assert_eq!(points.len(), candidates.len(), "a candidate per point");
    let order = ranking(candidates);
    let spacing = count(candidates.len().max(1)).powf(-1.0 / count(axes.max(1)));
    let near = |i: &usize, j: &usize| {
        points[*i].iter().zip(&points[*j]).all(|(a, b)| (a - b).abs() <= 1.5 * spacing)
    };
    let is_minimum = |i: &usize| order.iter().take_while(|j| j != &i).all(|j| !near(i, j));
    let minima = order.iter().copied().filter(is_minimum);
    let mut chosen: Vec<usize> = minima.take(wanted).collect();
    for index in &order {
        if chosen.len() < wanted && chosen.iter().all(|other| !near(index, other)) {
            chosen.push(*index);
        }
    }
    chosen
}

/// The indices of the candidates, the best first.
fn ranking(candidates: &[Candidate]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..candidates.len()).collect();
    order.sort_by(|a, b| candidates[*a].cost.total_cmp(&candidates[*b].cost));
    order
}

/// The lowest cost along each axis of a lattice of points.
fn profiles(axes: &[Axis], points: &[Vec<f64>], candidates: &[Candidate]) -> Vec<Profile> {
    let profile = |(index, axis): (usize, &Axis)| {
        let mut lowest: Vec<(f64, f64)> = Vec::new();
        for (point, candidate) in points.iter().zip(candidates) {
            let fraction = point[index];
            match lowest.iter_mut().find(|(f, _)| *f == fraction) {
                Some((_, cost)) => *cost = cost.min(candidate.cost),
                None => lowest.push((fraction, candidate.cost)),
            }
        }
        lowest.sort_by(|a, b| a.0.total_cmp(&b.0));
        let points = lowest.into_iter().map(|(fraction, cost)| (axis.at(fraction), cost)).collect();
        Profile { row: axis.rows[0], points }
    };
    axes.iter().enumerate().map(profile).collect()
}
