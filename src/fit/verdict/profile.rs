//! Intervals from profiles of the cost, for parameters in which it is no parabola.
//!
//! A parameter is held at values ever farther from its best one, and all others are fitted anew. Where the cost has risen by as much as it
//! would at the ends of the linear interval, were it the parabola that the linear model takes it for, the interval ends (Venzon and Moolgavkar
//! 1988, doi:10.2307/2347496). So noise counts as it does there, samples that err together included (Chandler and Bate 2007,
//! doi:10.1093/biomet/asm015).

use super::covariance::Covariance;
use super::profiled_interval::{OpenEnd, ProfiledInterval};
use super::result::Fit;
use crate::error::Error;
use crate::fit::problem::loss::Objective;
use crate::fit::problem::observed::Observed;
use crate::fit::task::Task;
use crate::math::count;
use crate::measurement::Samples;
use crate::parameters::ParameterTable;
use crate::progress::Progress;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Largest number of samples whose cost is followed.
const SAMPLES: usize = 20_000;
/// Largest number of iterations of each fit.
const ITERATIONS: u64 = 60;
/// The first step without a standard error, as a fraction of the range between the bounds.
const FIRST_STEP: f64 = 0.02;
/// By how much each step exceeds the one before.
const GROWTH: f64 = 1.7;
/// Largest number of steps outwards, and of those between the last two.
const MOST_STEPS: usize = 30;
/// Half of a 95 % interval in standard deviations, where the noise is that of all residuals.
pub(super) const HALF_INTERVAL: f64 = 1.96;
/// Precision of an end, as a fraction of its distance from the best value.
const PRECISION: f64 = 2e-3;

/// The cost around its minimum.
pub(super) struct Valley<'t> {
    task: &'t Task<'t>,
    observed: Arc<Observed<'t>>,
    objective: Objective,
    /// The parameters at the minimum.
    best: ParameterTable,
    pub(super) cost: f64,
}

/// A point of a profile.
struct Point {
    /// The coordinate of the parameter that is held.
    at: f64,
    /// The root of the excess of the cost over that of the minimum.
    rise: f64,
    /// All coordinates.
    coordinates: Vec<f64>,
}

impl Task<'_> {
    /// The interval of each free parameter that is not at a bound, by its profile.
    ///
    /// # Errors
    /// Those of the optimiser.
    pub(in crate::fit) fn profiled(
        &self,
        fit: &Fit,
        objective: Objective,
        progress: &Arc<dyn Progress>,
    ) -> Result<Option<Vec<ProfiledInterval>>, Error> {
        let Some(covariance) = &fit.covariance else { return Ok(None) };
        progress.stage("profiling");
        let samples = self.draws.part(SAMPLES, self.options.seed);
        let valley = self.valley(&samples, &fit.table, objective)?;
        let share = self.share_of_cost(&samples);
        let wanted = wanted_rises(fit, covariance);
        let done = AtomicU64::new(0);
        let interval = |(row, rise): &(usize, f64)| {
            let interval = valley.interval(*row, rise * share.sqrt(), covariance)?;
            progress.iteration(done.fetch_add(1, Ordering::Relaxed) + 1, valley.cost);
            Ok(interval)
        };
        wanted.par_iter().map(interval).collect::<Result<Vec<_>, Error>>().map(Some)
    }

    /// The cost around its minimum on some samples, starting from the values in `table`.
    pub(super) fn valley<'t>(
        &'t self,
        samples: &'t Samples,
        table: &ParameterTable,
        objective: Objective,
    ) -> Result<Valley<'t>, Error> {
        let observed = self.observe(samples);
        let solution = self.polish(&observed, table.clone(), objective, ITERATIONS)?;
        let mut best = table.clone();
        best.set_coordinates(solution.x.as_slice());
        Ok(Valley { task: self, observed, objective, best, cost: solution.cost })
    }
}

/// By how much the root of the cost's excess has to rise, for each row: as at the end of the linear interval of a parabola. A row without a
/// standard error takes the largest rise, in units of the linear one, of those that have one.
fn wanted_rises(fit: &Fit, covariance: &Covariance) -> Vec<(usize, f64)> {
    let linear = |row: usize| {
        let place = covariance.rows.binary_search(&row).ok()?;
        let half = covariance.half_interval(row)? * covariance.std_error(row)?;
        Some(half / covariance.unit_variances[place].sqrt())
    };
    let known: Vec<Option<f64>> = covariance.rows.iter().map(|row| linear(*row)).collect();
    let freedom = count(usize::try_from(fit.dof).unwrap_or(0).max(1));
    let by_scatter = HALF_INTERVAL * (fit.cost / freedom).sqrt();
    let largest = known.iter().flatten().copied().fold(by_scatter, f64::max);
    covariance.rows.iter().zip(known).map(|(row, rise)| (*row, rise.unwrap_or(largest))).collect()
}

impl Valley<'_> {
    /// The interval of a row, at whose ends the root of the excess has risen by `rise`.
    pub(super) fn interval(
        &self,
        row: usize,
        rise: f64,
        covariance: &Covariance,
    ) -> Result<ProfiledInterval, Error> {
        let place = self.best.free().iter().position(|free| *free == row).unwrap_or_default();
        let (low, high) = self.best.coordinate_bounds()[place];
        let step = match (covariance.half_interval(row), covariance.std_error(row)) {
            (Some(half), Some(error)) => half * error / self.best.rows()[row].slope(),
            _ => FIRST_STEP * (high - low),
        };
        let [below, above] =
            [(low, -step), (high, step)].map(|(bound, step)| self.end(place, bound, step, rise));
        let ((low, open_below), (high, open_above)) = (below?, above?);
        Ok(ProfiledInterval {
            row,
            ends: [self.value(place, low), self.value(place, high)],
            open: [open_below, open_above],
        })
    }

    /// One end of an interval, as a coordinate, and why it is open.
    fn end(&self, place: usize, bound: f64, step: f64, rise: f64) -> Result<(f64, Option<OpenEnd>), Error> {
        let coordinates = self.best.coordinates();
        let start = coordinates[place];
        let mut inside = Point { at: start, rise: 0.0, coordinates };
        let mut step = step;
        let mut outside = None;
        // Outwards, until the cost has risen enough.
        for _ in 0..MOST_STEPS {
            let at = if step < 0.0 { (start + step).max(bound) } else { (start + step).min(bound) };
            let Some(point) = self.point(place, at, &inside)? else {
                return Ok((inside.at, Some(OpenEnd::Unfinished)));
            };
            if point.rise >= rise {
                outside = Some(point);
                break;
            }
            if at == bound {
                return Ok((bound, Some(OpenEnd::AtBound)));
            }
            inside = point;
            step *= GROWTH;
        }
        let Some(mut outside) = outside else { return Ok((inside.at, Some(OpenEnd::Unfinished))) };
        // Between the last two: the root of the excess is nearly a straight line.
        for _ in 0..MOST_STEPS {
            if (outside.at - inside.at).abs() <= PRECISION * (outside.at - start).abs() {
                break;
            }
            let share = ((rise - inside.rise) / (outside.rise - inside.rise)).clamp(0.05, 0.95);
            let at = inside.at + share * (outside.at - inside.at);
            let Some(point) = self.point(place, at, &inside)? else { break };
            if (point.rise - rise).abs() <= PRECISION * rise {
                return Ok((point.at, None));
            }
            if point.rise < rise { inside = point } else { outside = point }
        }
        Ok((outside.at, None))
    }

    /// The cost with a coordinate held, starting from the others at `from`; `None` if the fit was stopped.
    fn point(&self, place: usize, at: f64, from: &Point) -> Result<Option<Point>, Error> {
        let mut coordinates = from.coordinates.clone();
        coordinates[place] = at;
        let mut table = self.best.clone();
        table.set_coordinates(&coordinates);
        let held = table.with_fixed_row(self.best.free()[place]);
        let solution = self.task.polish(&self.observed, held, self.objective, ITERATIONS)?;
        if !solution.cost.is_finite() || self.task.is_stopped() {
            return Ok(None);
        }
        let others = (0..coordinates.len()).filter(|k| *k != place);
        others.zip(solution.x.iter()).for_each(|(k, x)| coordinates[k] = *x);
        Ok(Some(Point { at, rise: (solution.cost - self.cost).max(0.0).sqrt(), coordinates }))
    }

    /// The value of the parameter at a place among the free ones, at a coordinate.
    fn value(&self, place: usize, coordinate: f64) -> f64 {
        let mut coordinates = self.best.coordinates();
        coordinates[place] = coordinate;
        let mut table = self.best.clone();
        table.set_coordinates(&coordinates);
        table.rows()[self.best.free()[place]].value
    }
}
