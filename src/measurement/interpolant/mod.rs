//! A measurement as a function of any pair of directions: what an image of the measured material needs.
//!
//! | directions | method |
//! |---|---|
//! | half/difference grid | trilinear between the eight centres around a pair, on the grid's own warped axes: `cells` |
//! | scattered | local linear regression on the nearest samples, through every sample: `cloud` |
//!
//! Below the horizon f = 0. Every answer says whether data surround the pair, and
//! [`Interpolant::leave_out_error`] how well samples are foretold by the others. docs/image.md has what was
//! measured of both.

mod cells;
mod cloud;
mod tree;

pub use cloud::Symmetry;

use super::Measurement;
use crate::geometry::{Directions, Pair};
use glam::DVec3;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// A measured BRDF between its samples, and a guess beyond them.
#[derive(Clone, Debug)]
pub struct Interpolant {
    channels: usize,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Cells(cells::Cells),
    Cloud(cloud::Cloud),
}

/// What an interpolant says of pairs of directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// f per channel, per pair, 1/sr.
    pub values: Vec<Vec<f64>>,
    /// Per pair, whether there are data around it; if not, the value is that of the nearest ones.
    pub covered: Vec<bool>,
}

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

/// Samples that are left out for a [`LeaveOut`], at most.
const LEFT_OUT: usize = 4000;

impl Interpolant {
    /// Prepares a measurement.
    #[must_use]
    pub fn new(measurement: &Measurement) -> Self {
        let kind = match &measurement.directions {
            Directions::Grid { grid, cells } => {
                Kind::Cells(cells::Cells::new(grid, cells, &measurement.values))
            }
            Directions::Scattered(pairs) => Kind::Cloud(cloud::Cloud::new(pairs, &measurement.values)),
        };
        Self { channels: measurement.values.len(), kind }
    }

    /// f at every pair. The same at any number of threads.
    #[must_use]
    pub fn at(&self, pairs: &[Pair]) -> Answer {
        const PART: usize = 512;
        let parts: Vec<(Vec<f64>, Vec<bool>)> = pairs.par_chunks(PART).map(|part| self.part(part)).collect();
        let mut values: Vec<Vec<f64>> = vec![Vec::with_capacity(pairs.len()); self.channels];
        let mut covered = Vec::with_capacity(pairs.len());
        for (found, inside) in parts {
            covered.extend(inside);
            for pair in found.chunks_exact(self.channels.max(1)) {
                values.iter_mut().zip(pair).for_each(|(row, f)| row.push(*f));
            }
        }
        Answer { values, covered }
    }

    /// f at some pairs, the channels of each together.
    fn part(&self, pairs: &[Pair]) -> (Vec<f64>, Vec<bool>) {
        let mut values = vec![0.0; pairs.len() * self.channels];
        let mut room = cloud::Room::default();
        let covered = pairs.iter().zip(values.chunks_exact_mut(self.channels.max(1))).map(|(pair, f)| {
            // Nothing is reflected below the horizon, and that is known.
            if pair.wi.z <= 0.0 || pair.wo.z <= 0.0 {
                return true;
            }
            match &self.kind {
                Kind::Cells(cells) => cells.at(pair, f),
                Kind::Cloud(cloud) => cloud.at(pair, &mut room, f),
            }
        });
        let covered = covered.collect();
        (values, covered)
    }

    /// How far samples are from what the others say of them: what an image of the measurement can be trusted to.
    ///
    /// On a grid a cell is compared with the means of its neighbours on either side along each axis, which are twice as
    /// far apart as those that [`Self::at`] uses, whatever is asked to be left out. Null if no sample has neighbours, or all
    /// are 0.
    #[must_use]
    pub fn leave_out_error(&self, out: LeftOut) -> Option<LeaveOut> {
        match &self.kind {
            Kind::Cells(cells) => summary(cells.leave_out(LEFT_OUT)),
            Kind::Cloud(cloud) => summary(cloud.leave_out(out, LEFT_OUT)),
        }
    }

    /// What scattered samples are taken to be alike under; null for a grid, which has both symmetries by its making.
    #[must_use]
    pub fn symmetry(&self) -> Option<Symmetry> {
        match &self.kind {
            Kind::Cells(_) => None,
            Kind::Cloud(cloud) => Some(cloud.symmetry()),
        }
    }
}

/// The summary of errors of samples left out.
fn summary(mut errors: Vec<f64>) -> Option<LeaveOut> {
    errors.sort_by(f64::total_cmp);
    let rank = |percent: usize| errors.get((errors.len() * percent).div_ceil(100).max(1) - 1).copied();
    Some(LeaveOut { median: rank(50)?, p95: rank(95)?, samples: errors.len() })
}

/// sum |f - f*| / sum |f*|, where that is not 0/0.
fn apart(found: &[f64], measured: impl Iterator<Item = f64>) -> Option<f64> {
    let (error, size) = found.iter().zip(measured).fold((0.0, 0.0), |(error, size), (f, measured)| {
        (error + (f - measured).abs(), size + measured.abs())
    });
    (size > 0.0).then(|| error / size)
}

/// At most `most` indices below `n`, evenly spread.
fn spread(n: usize, most: usize) -> impl IndexedParallelIterator<Item = usize> {
    let taken = n.min(most);
    (0..taken).into_par_iter().map(move |i| i * n / taken.max(1))
}

/// Half/difference coordinates of a pair.
#[derive(Clone, Copy, Debug)]
struct HalfDifference {
    /// Polar angle of the half vector.
    theta_h: f64,
    /// Cosine and sine of its azimuth; (1, 0) where it has none.
    azimuth: (f64, f64),
    /// Difference angle.
    theta_d: f64,
    /// (wi - wo)/2: at right angles to the half vector, sin(theta_d) long.
    difference: DVec3,
    /// sin(theta_d) cos(phi_d): the difference along the plane of normal and half vector.
    along: f64,
    /// sin(theta_d) sin(phi_d).
    across: f64,
}

impl HalfDifference {
    fn of(pair: &Pair) -> Self {
        let (sum, difference) = (0.5 * (pair.wi + pair.wo), 0.5 * (pair.wi - pair.wo));
        // Only opposite directions, both in the horizon, have no half vector.
        let h = sum.normalize_or(DVec3::Z);
        let sin_h = h.x.hypot(h.y);
        let azimuth = if sin_h > 0.0 { (h.x / sin_h, h.y / sin_h) } else { (1.0, 0.0) };
        let (cos_phi, sin_phi) = azimuth;
        Self {
            theta_h: sin_h.atan2(h.z),
            azimuth,
            theta_d: difference.length().atan2(sum.length()),
            difference,
            along: (difference.x * cos_phi + difference.y * sin_phi) * h.z - difference.z * sin_h,
            across: difference.y * cos_phi - difference.x * sin_phi,
        }
    }
}
