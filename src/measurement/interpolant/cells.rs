//! Between the cells of a half/difference grid.
//!
//! f is linear in each of the grid's indices, which go with sqrt(theta_h), theta_d and phi_d: trilinear between the
//! eight centres around a pair. Towards theta_h = 0 and theta_d = 0 it is constant from the first centre on, which is
//! what the mirror image on the other side of 0 would give; phi_d returns after half a turn. Cells that the
//! measurement does not hold are left out and the weights of the others scaled to a sum of 1; a pair is covered if they
//! had at least half of it. Where none of the eight is there, the nearest cell towards theta_h = theta_d = 0 answers,
//! and the pair is not covered.

use super::{HalfDifference, apart, spread};
use crate::geometry::{HalfDifferenceGrid, Pair};
use crate::math::count;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};

#[derive(Clone, Debug)]
pub(super) struct Cells {
    channels: usize,
    /// Where in its bin a cell's value stands: 0.5 for the centre, 0 for the lower edge.
    offset: f64,
    /// Per cell of the grid, the number of its sample, or [`ABSENT`].
    samples: Vec<u32>,
    /// Cell per sample.
    cells: Vec<u32>,
    /// f, the channels of each sample together.
    values: Vec<f64>,
}

const ABSENT: u32 = u32::MAX;

/// The indices of a cell; theta_h and theta_d may lie outside the grid.
type Index = [usize; 3];

impl Cells {
    pub(super) fn new(grid: &HalfDifferenceGrid, cells: &[u32], rows: &[Vec<f64>]) -> Self {
        let mut samples = vec![ABSENT; HalfDifferenceGrid::CELLS];
        for (sample, cell) in (0..).zip(cells) {
            let place = usize::try_from(*cell).ok().and_then(|cell| samples.get_mut(cell));
            place.into_iter().for_each(|place| *place = sample);
        }
        let first = grid.geometry(0);
        let offset = if first.sin2_h() > 0.0 { 0.5 } else { 0.0 };
        Self {
            channels: rows.len(),
            offset,
            samples,
            cells: cells.to_vec(),
            values: super::cloud::by_sample(rows, cells.len(), |f| f),
        }
    }

    /// f at a pair; whether it is covered.
    pub(super) fn at(&self, pair: &Pair, f: &mut [f64]) -> bool {
        let [n_h, n_d, n_p] = HalfDifferenceGrid::DIMENSIONS;
        let q = HalfDifference::of(pair);
        let phi_d = q.across.atan2(q.along).rem_euclid(PI);
        let [h, d] =
            [((q.theta_h / FRAC_PI_2).sqrt(), n_h), (q.theta_d / FRAC_PI_2, n_d)].map(|(along, n)| {
                let last = count(n - 1);
                between((along * count(n) - self.offset).clamp(0.0, last))
            });
        // One turn more, so that what is below the first centre is not negative.
        let p = between(phi_d / PI * count(n_p) - self.offset + count(n_p));

        f.fill(0.0);
        let mut held = 0.0;
        for (h, weight_h) in h {
            for (d, weight_d) in d {
                for (p, weight_p) in p {
                    let weight = weight_h * weight_d * weight_p;
                    let Some(values) = self.value([h, d, p % n_p]).filter(|_| weight > 0.0) else { continue };
                    held += weight;
                    f.iter_mut().zip(values).for_each(|(f, value)| *f += weight * value);
                }
            }
        }
        if held > 0.0 {
            f.iter_mut().for_each(|f| *f /= held);
            return held >= 0.5;
        }
        let [(h, _), _] = h;
        let [(d, _), _] = d;
        let [(p, _), _] = p;
        let towards = |step: usize| self.value([h.saturating_sub(step), d.saturating_sub(step), p % n_p]);
        if let Some(values) = (1..n_h.max(n_d)).find_map(towards) {
            f.copy_from_slice(values);
        }
        false
    }

    /// f of a cell, if the measurement holds it.
    fn value(&self, [h, d, p]: Index) -> Option<&[f64]> {
        let [n_h, n_d, n_p] = HalfDifferenceGrid::DIMENSIONS;
        let inside = h < n_h && d < n_d;
        let sample = *self.samples.get(p + n_p * (d + n_d * h)).filter(|_| inside)?;
        let start = usize::try_from(sample).ok().filter(|_| sample != ABSENT)? * self.channels;
        self.values.get(start..start + self.channels)
    }

    /// Errors of at most `most` cells, each against the mean over the axes of the means of its two neighbours.
    pub(super) fn leave_out(&self, most: usize) -> Vec<f64> {
        let [_, n_d, n_p] = HalfDifferenceGrid::DIMENSIONS;
        let error = |sample: usize| {
            let cell = usize::try_from(*self.cells.get(sample)?).ok()?;
            let [h, d, p] = [cell / (n_d * n_p), (cell / n_p) % n_d, cell % n_p];
            let sides = [
                Some(([h + 1, d, p], h.checked_sub(1).map(|h| [h, d, p]))),
                Some(([h, d + 1, p], d.checked_sub(1).map(|d| [h, d, p]))),
                Some(([h, d, (p + 1) % n_p], Some([h, d, (p + n_p - 1) % n_p]))),
            ];
            let mut found = vec![0.0; self.channels];
            let mut axes = 0;
            for (above, below) in sides.into_iter().flatten() {
                let (Some(above), Some(below)) = (self.value(above), below.and_then(|at| self.value(at)))
                else {
                    continue;
                };
                axes += 1;
                for ((f, a), b) in found.iter_mut().zip(above).zip(below) {
                    *f += 0.5 * (a + b);
                }
            }
            found.iter_mut().for_each(|f| *f /= f64::from(axes));
            apart(&found, self.value([h, d, p])?.iter().copied()).filter(|_| axes > 0)
        };
        spread(self.cells.len(), most).filter_map(error).collect()
    }
}

/// The two whole numbers around a number that is not negative, and their weights.
fn between(x: f64) -> [(usize, f64); 2] {
    let part = x - x.floor();
    let low = whole(x);
    [(low, 1.0 - part), (low + 1, part)]
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "an index of a grid, not negative"
)]
fn whole(x: f64) -> usize {
    x as usize
}
