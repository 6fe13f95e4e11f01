//! Interpolation between the cells of a half/difference grid.
//!
//! f is linear in each of the grid's indices, which grow with sqrt(theta_h), theta_d and phi_d: trilinear between the
//! eight centres around a pair. From the first centre towards theta_h = 0 or theta_d = 0 it is constant, which is what
//! the mirror image on the other side of 0 would give; phi_d is periodic with half a turn. Cells that were not
//! measured are left out, and the weights of the others are scaled to a sum of 1. A pair is covered if the others had
//! at least half of the weight. If none of the eight was measured, the nearest cell towards theta_h = theta_d = 0
//! gives the value, and the pair is not covered.

use super::half_difference::HalfDifference;
use super::left_out::{apart, spread};
use crate::geometry::{HalfDifferenceGrid, Pair};
use crate::math::count;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};

#[derive(Clone, Debug)]
pub(super) struct Cells {
    channels: usize,
    /// Position within its bin that a cell's value stands for: 0.5 for the centre, 0 for the lower edge.
    offset: f64,
    /// For each cell of the grid, the index of its sample, or [`ABSENT`].
    samples: Vec<u32>,
    /// The cell of each sample.
    cells: Vec<u32>,
    /// f, with the channels of each sample together.
    values: Vec<f64>,
}

/// Marks a cell that was not measured.
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

    /// Writes f at a pair, and returns whether the pair is covered.
    pub(super) fn at(&self, pair: &Pair, f: &mut [f64]) -> bool {
        let [n_h, n_d, n_p] = HalfDifferenceGrid::DIMENSIONS;
        let q = HalfDifference::of(pair);
        let phi_d = q.across.atan2(q.along).rem_euclid(PI);
        let [h, d] =
            [((q.theta_h / FRAC_PI_2).sqrt(), n_h), (q.theta_d / FRAC_PI_2, n_d)].map(|(along, n)| {
                let last = count(n - 1);
                between((along * count(n) - self.offset).clamp(0.0, last))
            });
        // One turn is added, so that values below the first centre are not negative.
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

    /// f of a cell; `None` if it was not measured.
    fn value(&self, [h, d, p]: Index) -> Option<&[f64]> {
        let [n_h, n_d, n_p] = HalfDifferenceGrid::DIMENSIONS;
        let inside = h < n_h && d < n_d;
        let sample = *self.samples.get(p + n_p * (d + n_d * h)).filter(|_| inside)?;
        let start = usize::try_from(sample).ok().filter(|_| sample != ABSENT)? * self.channels;
        self.values.get(start..start + self.channels)
    }

    /// The errors of at most `most` cells. Each is compared with the mean, over the axes, of the means of its two
    /// neighbours.
    pub(super) fn leave_out(&self, most: usize) -> Vec<f64> {
        let [_, n_d, n_p] = HalfDifferenceGrid::DIMENSIONS;
        let error = |sample: usize| {
            let cell = usize::try_from(*self.cells.get(sample)?).ok()?;
            let [h, d, p] = [cell / (n_d * n_p), (cell / n_p) % n_d, cell % n_p];
            let sides = [
                (Some([h + 1, d, p]), h.checked_sub(1).map(|h| [h, d, p])),
                (Some([h, d + 1, p]), d.checked_sub(1).map(|d| [h, d, p])),
                (Some([h, d, (p + 1) % n_p]), Some([h, d, (p + n_p - 1) % n_p])),
            ];
            let mut found = vec![0.0; self.channels];
            let mut axes = 0;
            for side in sides.map(|(above, below)| [above, below].map(|at| self.value(at?))) {
                let [Some(above), Some(below)] = side else { continue };
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

/// The two integers on either side of a number that is not negative, and their weights.
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

#[cfg(test)]
mod tests {
    use super::super::{Answer, Interpolant, LeftOut};
    use super::*;
    use crate::geometry::direction;
    use approx::{assert_abs_diff_eq, assert_relative_eq};
    use glam::{DQuat, DVec3};
    use std::sync::Arc;

    /// A table of one channel that contains f(indices) for the cells where that is `Some`.
    fn table(grid: Arc<HalfDifferenceGrid>, f: impl Fn([usize; 3]) -> Option<f64>) -> Interpolant {
        let [n_h, n_d, n_p] = HalfDifferenceGrid::DIMENSIONS;
        let (mut cells, mut values) = (Vec::new(), Vec::new());
        for (h, d, p) in (0..n_h).flat_map(|h| (0..n_d).flat_map(move |d| (0..n_p).map(move |p| (h, d, p)))) {
            if let Some(f) = f([h, d, p]) {
                cells.push(u32::try_from(p + n_p * (d + n_d * h)).unwrap());
                values.push(f);
            }
        }
        let cells = Cells::new(&grid, &cells, &[values]);
        Interpolant::of_kind(1, super::super::Kind::Cells(cells))
    }

    /// The pair at these indices, which are integers at centres, computed by rotating vectors rather than by the
    /// grid's formulas.
    fn pair([h, d, p]: [f64; 3], offset: f64, phi_h: f64) -> Pair {
        let theta_h = ((h + offset) / 90.0).powi(2) * FRAC_PI_2;
        let (theta_d, phi_d) = ((d + offset) / 90.0 * FRAC_PI_2, (p + offset) / 180.0 * PI);
        let turn = DQuat::from_rotation_z(phi_h) * DQuat::from_rotation_y(theta_h);
        Pair { wi: turn * direction(theta_d, phi_d), wo: turn * direction(theta_d, phi_d + PI) }
    }

    fn one(interpolant: &Interpolant, pair: Pair) -> (f64, bool) {
        let Answer { values, covered } = interpolant.at(&[pair]);
        (values[0][0], covered[0])
    }

    #[test]
    fn linear_between_centres() {
        let f = |h: f64, d: f64, p: f64| 3.0 + 0.1 * h - 0.02 * d + 0.005 * p + 0.001 * h * d;
        for (grid, offset) in
            [(HalfDifferenceGrid::merl_centers(), 0.5), (HalfDifferenceGrid::merl_edges(), 0.0)]
        {
            let table = table(grid, |[h, d, p]| Some(f(count(h), count(d), count(p))));
            for at in
                [[0.0; 3], [4.0, 30.0, 90.0], [4.25, 30.5, 90.75], [20.9, 5.1, 178.9], [50.3, 2.2, 33.3]]
            {
                for phi_h in [0.0, 1.0, 4.0] {
                    let [h, d, p] = at;
                    let pair = pair(at, offset, phi_h);
                    // At theta_h = theta_d = 0, phi_d is undefined.
                    if h + d + offset > 0.0 {
                        assert_relative_eq!(one(&table, pair).0, f(h, d, p), max_relative = 1e-9);
                    }
                    assert!(one(&table, pair).1);
                    // Reciprocity.
                    let exchanged = Pair { wi: pair.wo, wo: pair.wi };
                    assert_relative_eq!(one(&table, exchanged).0, one(&table, pair).0, max_relative = 1e-9);
                }
            }
        }
    }

    #[test]
    fn phi_d_returns_after_half_a_turn() {
        let table = table(HalfDifferenceGrid::merl_centers(), |[_, _, p]| {
            Some(if p == 0 {
                1.0
            } else if p == 179 {
                3.0
            } else {
                100.0
            })
        });
        assert_relative_eq!(one(&table, pair([20.0, 10.0, -0.25], 0.5, 0.0)).0, 1.5, max_relative = 1e-9);
        assert_relative_eq!(one(&table, pair([20.0, 10.0, 179.25], 0.5, 0.0)).0, 2.5, max_relative = 1e-9);
    }

    #[test]
    fn cells_that_are_not_there() {
        let f =
            |[h, d, p]: [usize; 3]| (h < 40 && d < 60 && [h, d, p] != [10, 10, 10]).then(|| 1.0 + count(h));
        let table = table(HalfDifferenceGrid::merl_centers(), f);
        // One of eight is missing: the rest of its plane replaces it.
        let (value, covered) = one(&table, pair([10.5, 10.5, 10.5], 0.5, 0.0));
        assert_relative_eq!(value, (3.0 * 11.0 + 4.0 * 12.0) / 7.0, max_relative = 1e-9);
        assert!(covered);
        // At a missing cell's own position no other cell has weight; the value is that of a neighbour towards 0.
        let (value, covered) = one(&table, pair([10.0, 10.0, 10.0], 0.5, 0.0));
        assert!((10.0 - 1e-9..=12.0).contains(&value), "{value}");
        assert!(!covered);
        // Outside all data.
        let (value, covered) = one(&table, pair([30.0, 75.0, 90.0], 0.5, 0.0));
        assert!(value > 0.0 && !covered);
        let below = Pair { wi: DVec3::Z, wo: -DVec3::Z };
        assert_eq!(one(&table, below), (0.0, true));
    }

    #[test]
    fn leave_out_sees_curvature_only() {
        // Linear along each axis, except phi_d, which is periodic.
        let straight = table(HalfDifferenceGrid::merl_centers(), |[h, d, _]| Some(count(h + 2 * d + 5)));
        let error = straight.leave_out_error(LeftOut::Sample).unwrap();
        assert_eq!(error.samples, 4000);
        assert_abs_diff_eq!(error.p95, 0.0, epsilon = 1e-12);
        let lone = table(HalfDifferenceGrid::merl_centers(), |at| (at == [3, 4, 5]).then_some(1.0));
        assert_eq!(lone.leave_out_error(LeftOut::Sample), None);
    }
}
