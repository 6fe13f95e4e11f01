//! Interpolates a measurement to any pair of directions, as an image of the measured material requires.
//!
//! | directions | method |
//! |---|---|
//! | half/difference grid | trilinear between the eight centres around a pair, on the grid's own warped axes: `cells` |
//! | of a file that says how it is interpolated | as the file says |
//! | scattered | local linear regression on the nearest samples, which passes through every sample: `cloud` |
//!
//! Below the horizon f = 0. Every value comes with whether data surround the pair, and
//! [`Interpolant::leave_out_error`] says how well samples are predicted from the others. docs/use/image.md reports
//! measurements of both.

mod cells;
mod cloud;
mod curve;
mod half_difference;
mod left_out;
mod neighbours;
mod tree;

pub use cloud::Symmetry;
pub(super) use cloud::leave_each_out;
pub(super) use curve::leave_each_out_along_curve;
pub use left_out::{LeaveOut, LeftOut};
pub(crate) use neighbours::{Neighbours, Twins};

use super::{Continuous, Measurement};
use crate::geometry::{Directions, Pair};
use left_out::summary;
use rayon::prelude::*;
use std::sync::Arc;

/// A measured BRDF, interpolated between its samples and extrapolated beyond them.
#[derive(Clone, Debug)]
pub struct Interpolant {
    channels: usize,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Cells(cells::Cells),
    Cloud(cloud::Cloud),
    /// The file's own interpolation, and the samples that were drawn from it.
    Own(Arc<dyn Continuous>, cloud::Cloud),
}

/// The values of an interpolant at pairs of directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// f in 1/sr, by channel and pair.
    pub values: Vec<Vec<f64>>,
    /// Whether there are data around each pair; if not, the value is that of the nearest data.
    pub covered: Vec<bool>,
}

/// Largest number of samples that are left out for a [`LeaveOut`].
const LEFT_OUT: usize = 4000;

impl Interpolant {
    /// Prepares a measurement for interpolation.
    #[must_use]
    pub fn new(measurement: &Measurement) -> Self {
        let kind = match &measurement.directions {
            Directions::Grid { grid, cells } => {
                Kind::Cells(cells::Cells::new(grid, cells, &measurement.values))
            }
            Directions::Scattered(pairs) => {
                let cloud = cloud::Cloud::new(pairs, &measurement.values);
                match &measurement.continuous {
                    Some(own) => Kind::Own(Arc::clone(own), cloud),
                    None => Kind::Cloud(cloud),
                }
            }
        };
        Self { channels: measurement.values.len(), kind }
    }

    /// f at every pair. The result does not depend on the number of threads.
    #[must_use]
    pub fn at(&self, pairs: &[Pair]) -> Answer {
        /// Number of pairs that one thread computes at a time.
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

    /// f at some pairs, with the channels of each pair together, and whether each pair is covered.
    fn part(&self, pairs: &[Pair]) -> (Vec<f64>, Vec<bool>) {
        let mut values = vec![0.0; pairs.len() * self.channels];
        let mut room = cloud::Room::default();
        let covered = pairs.iter().zip(values.chunks_exact_mut(self.channels.max(1))).map(|(pair, f)| {
            // It is known that nothing is reflected below the horizon.
            if pair.wi.z <= 0.0 || pair.wo.z <= 0.0 {
                return true;
            }
            match &self.kind {
                Kind::Cells(cells) => cells.at(pair, f),
                Kind::Cloud(cloud) => cloud.at(pair, &mut room, f),
                Kind::Own(own, _) => {
                    own.at(pair, f);
                    true
                }
            }
        });
        let covered = covered.collect();
        (values, covered)
    }

    /// How far samples are from their predictions by the others, which limits how far an image of the measurement can
    /// be trusted.
    ///
    /// On a grid, a cell is compared with the means of its neighbours on either side along each axis, whatever `out`
    /// says. These are twice as far apart as those that [`Self::at`] uses. `None` if no sample has neighbours, or if
    /// all are 0.
    #[must_use]
    pub fn leave_out_error(&self, out: LeftOut) -> Option<LeaveOut> {
        match &self.kind {
            Kind::Cells(cells) => summary(cells.leave_out(LEFT_OUT)),
            Kind::Cloud(cloud) | Kind::Own(_, cloud) => summary(cloud.leave_out(out, LEFT_OUT)),
        }
    }

    /// The symmetries assumed for scattered samples; `None` for a grid, which has both by construction.
    #[must_use]
    pub fn symmetry(&self) -> Option<Symmetry> {
        match &self.kind {
            Kind::Cells(_) => None,
            Kind::Cloud(cloud) | Kind::Own(_, cloud) => Some(cloud.symmetry()),
        }
    }
}
