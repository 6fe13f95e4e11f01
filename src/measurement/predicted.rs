//! What the neighbours of each sample predict for it.
//!
//! A prediction does not contain the noise of its own sample. The metric `unbiased-cbrt` takes its weights from predictions, so that
//! noise does not weight itself: see `crate::fit::Metric`.
//!
//! | directions | prediction |
//! |---|---|
//! | half/difference grid | the mean of up to four cells, two on either side along phi_d |
//! | up to 50 000 scattered, or drawn from a grid | local linear regression on the nearest samples, as in [`super::interpolant`] |
//! | more | the mean of the middle two of four samples next to it on a curve through all |
//!
//! The neighbours are those that have a value in the channel.

#![allow(
    clippy::indexing_slicing,
    reason = "lengths are checked where they come in; an index beyond the end is a mistake in the program"
)]

use super::interpolant::{leave_each_out, leave_each_out_along_curve};
use super::missing::{Alike, alike};
use crate::geometry::{Azimuths, Directions, HalfDifferenceGrid, Pair, gather};
use crate::math::count;
use rayon::prelude::*;

/// What the neighbours of each sample predict for it.
#[derive(Clone, Debug, Default)]
pub struct Predicted {
    /// f, at least 0, 1/sr, by channel and sample; NaN where it was not measured.
    pub values: Vec<Vec<f64>>,
    /// The standard deviation of f, 1/sr, by channel and sample; `None` unless weights are by sigma. NaN where f was not measured.
    pub sigma: Option<Vec<Vec<f64>>>,
    /// About twice the noise of the darkest samples in x = f cos(theta_i), 1/sr, by channel: three times how far they are from their
    /// predictions, in the median.
    pub noise_floors: Vec<f64>,
}

/// One in this many samples is among the darkest.
const DARKEST: usize = 8;
/// The floor over the median distance of the darkest samples from their predictions: about two standard deviations of their noise.
const FLOOR: f64 = 3.0;
/// The least noise, relative to the mean of the predictions in the channel without the largest twentieth.
const LEAST_RELATIVE: f64 = 1e-6;
/// The least noise of a channel that is zero everywhere, 1/sr.
const LEAST: f64 = 1e-30;
/// Largest number of scattered samples of which each has its nearest sought.
const MOST_SEARCHED: usize = 50_000;
/// Number of samples whose noise is looked at.
const MOST_JUDGES: usize = 20_000;
/// Least number of cells that one thread looks at.
const PART: usize = 4096;

impl Predicted {
    /// Predicts every sample from its neighbours.
    pub(super) fn new(directions: &Directions, values: &[Vec<f64>], sigma: Option<&Vec<Vec<f64>>>) -> Self {
        let groups = alike(values);
        if groups.iter().all(|group| group.samples.is_none()) {
            return Self::without_gaps(directions, values, sigma);
        }
        let unknown = || vec![vec![f64::NAN; directions.len()]; values.len()];
        let mut all = Self {
            values: unknown(),
            sigma: sigma.map(|_| unknown()),
            noise_floors: vec![LEAST; values.len()],
        };
        for Alike { channels, samples } in groups {
            let samples = samples.unwrap_or_else(|| (0..directions.len()).collect());
            let part = |rows: &[Vec<f64>]| -> Vec<Vec<f64>> {
                channels.iter().map(|channel| gather(&rows[*channel], &samples)).collect()
            };
            let sigma = sigma.map(|sigma| part(sigma));
            let found = Self::without_gaps(&directions.select(&samples), &part(values), sigma.as_ref());
            let put = |rows: &mut [Vec<f64>], found: &[Vec<f64>]| {
                for (channel, found) in channels.iter().zip(found) {
                    samples.iter().zip(found).for_each(|(sample, f)| rows[*channel][*sample] = *f);
                }
            };
            put(&mut all.values, &found.values);
            if let (Some(rows), Some(found)) = (&mut all.sigma, &found.sigma) {
                put(rows, found);
            }
            for (channel, floor) in channels.iter().zip(found.noise_floors) {
                all.noise_floors[*channel] = floor;
            }
        }
        all
    }

    /// Predicts samples that have a value in every channel.
    fn without_gaps(directions: &Directions, values: &[Vec<f64>], sigma: Option<&Vec<Vec<f64>>>) -> Self {
        let rows: Vec<&Vec<f64>> = values.iter().chain(sigma.into_iter().flatten()).collect();
        let along =
            if let Directions::Grid { cells, .. } = directions { along_rows(cells, &rows) } else { None };
        let mut predicted = along.unwrap_or_else(|| {
            let pairs: Vec<Pair> = directions.each(|g| Pair { wi: g.wi.into(), wo: g.wo.into() });
            let isotropic = directions.azimuths() != Azimuths::Several;
            let mut predicted = if pairs.len() > MOST_SEARCHED {
                leave_each_out_along_curve(&pairs, &rows, isotropic)
            } else {
                let rows: Vec<Vec<f64>> = rows.into_iter().cloned().collect();
                leave_each_out(&pairs, &rows, isotropic)
            };
            predicted.iter_mut().flatten().for_each(|f| *f = f.max(0.0));
            predicted
        });
        let of_sigma = predicted.split_off(values.len());
        let noise_floors = noise_floors(directions, values, &predicted);
        Self { noise_floors, sigma: sigma.map(|_| of_sigma), values: predicted }
    }

    /// The noise floor of a channel; next to nothing where nothing was predicted.
    pub(crate) fn noise_floor(&self, channel: usize) -> f64 {
        self.noise_floors.get(channel).copied().unwrap_or(LEAST)
    }

    /// The predictions of the samples at `indices`.
    pub(super) fn at(&self, indices: &[usize]) -> Self {
        let gather = |rows: &Vec<Vec<f64>>| rows.iter().map(|row| gather(row, indices)).collect();
        Self {
            values: gather(&self.values),
            sigma: self.sigma.as_ref().map(gather),
            noise_floors: self.noise_floors.clone(),
        }
    }
}

/// Predicts cells of a grid from those next to them in phi_d; `None` if too many have none, as in a draw from a table.
fn along_rows(cells: &[u32], rows: &[&Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    assert!(rows.iter().all(|row| row.len() == cells.len()), "a value per cell");
    let [_, _, n_p] = HalfDifferenceGrid::DIMENSIONS;
    let n_p = u32::try_from(n_p).ok()?;
    let is_near = |a: u32, b: u32| a / n_p == b / n_p && a.abs_diff(b) <= 2;
    let near = |index: usize| {
        let others = [index.checked_sub(2), index.checked_sub(1), Some(index + 1), Some(index + 2)];
        let inside = others.into_iter().flatten().filter(|other| *other < cells.len());
        inside.filter(move |other| is_near(cells[*other], cells[index]))
    };
    // Where nothing is missing, the cells on both sides are a run of five.
    let is_run = |index: usize| {
        let ends = index.checked_sub(2).and_then(|first| Some((cells.get(first)?, cells.get(index + 2)?)));
        ends.is_some_and(|(first, last)| last.wrapping_sub(*first) == 4 && first / n_p == last / n_p)
    };
    let broken: Vec<usize> =
        (0..cells.len()).into_par_iter().with_min_len(PART).filter(|index| !is_run(*index)).collect();
    if 4 * broken.iter().filter(|index| near(**index).next().is_none()).count() > cells.len() {
        return None;
    }
    let predict = |row: &&Vec<f64>| -> Vec<f64> {
        let mut predicted = vec![0.0; row.len()];
        predicted.par_chunks_mut(PART).enumerate().for_each(|(part, predicted)| {
            // The ends of the list are not runs.
            let start = (part * PART).max(2);
            let end = (part * PART + predicted.len()).min(row.len().saturating_sub(2));
            let from = |shift: usize| row.get(start + shift - 2..end + shift - 2).unwrap_or_default();
            let around = from(0).iter().zip(from(1)).zip(from(3)).zip(from(4));
            for (place, (((a, b), c), d)) in predicted.iter_mut().skip(start - part * PART).zip(around) {
                *place = (0.25 * (a + b + c + d)).max(0.0);
            }
        });
        for index in &broken {
            let (sum, n) = near(*index).fold((0.0, 0), |(sum, n), other| (sum + row[other], n + 1));
            predicted[*index] = if n == 0 { row[*index] } else { sum / count(n) }.max(0.0);
        }
        predicted
    };
    Some(rows.iter().map(predict).collect())
}

/// The noise floors by channel. The darkest samples are the darkest by prediction, so that their own
/// noise does not choose them. The values are f; at most [`MOST_JUDGES`] evenly spaced samples count.
fn noise_floors(directions: &Directions, values: &[Vec<f64>], predicted: &[Vec<f64>]) -> Vec<f64> {
    let stride = directions.len().div_ceil(MOST_JUDGES).max(1);
    let judges: Vec<usize> = (0..directions.len()).step_by(stride).collect();
    let cosines: Vec<f64> = directions.select(&judges).each(|g| g.cos_i());
    let darkest = judges.len().div_ceil(DARKEST);
    let of_channel = |(own, predicted): (&Vec<f64>, &Vec<f64>)| {
        let mut distances: Vec<(f64, f64)> = judges
            .iter()
            .zip(&cosines)
            .map(|(judge, cos)| (predicted[*judge] * cos, (own[*judge] - predicted[*judge]).abs() * cos))
            .collect();
        distances.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        // A few absurd values have no say.
        let bulk = (distances.len() * 19).div_ceil(20);
        let mean = distances.iter().take(bulk).map(|(x, _)| x).sum::<f64>() / count(bulk.max(1));
        let mut noise: Vec<f64> = distances.iter().take(darkest).map(|(_, distance)| *distance).collect();
        noise.sort_unstable_by(f64::total_cmp);
        let median = noise.get(darkest / 2).copied().unwrap_or(0.0);
        (FLOOR * median).max(LEAST_RELATIVE * mean).max(LEAST)
    };
    values.par_iter().zip(predicted).map(of_channel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::scattered_directions;
    use std::sync::Arc;

    /// Forty cells of a row, of which one is missing, and a cell alone in the next row.
    fn row_of_a_grid() -> Directions {
        let cells = (100..140).filter(|cell| *cell != 120).chain([250]).collect();
        Directions::Grid { grid: Arc::new(HalfDifferenceGrid::merl(0.5)), cells }
    }

    #[test]
    fn cells_are_predicted_from_their_row() {
        let directions = row_of_a_grid();
        let values = vec![(0..40).map(|i| f64::from(i * i)).collect::<Vec<f64>>()];
        let predicted = Predicted::new(&directions, &values, None).values;
        let mean = |of: &[i32]| of.iter().map(|i| f64::from(i * i)).sum::<f64>() / count(of.len());
        assert_eq!(predicted[0][10], mean(&[8, 9, 11, 12]));
        // At the ends of the row, beside the missing cell, and alone.
        assert_eq!(predicted[0][0], mean(&[1, 2]));
        assert_eq!(predicted[0][1], mean(&[0, 2, 3]));
        assert_eq!(predicted[0][19], mean(&[17, 18, 20]));
        assert_eq!(predicted[0][39], mean(&[39]));
        // Cells drawn from far apart have no rows.
        let apart = Directions::Grid {
            grid: Arc::new(HalfDifferenceGrid::merl(0.5)),
            cells: (0..30).map(|i| i * 5000 + 77).collect(),
        };
        assert!(along_rows(&(0..30).map(|i| i * 5000 + 77).collect::<Vec<u32>>(), &[]).is_none());
        assert_eq!(Predicted::new(&apart, &[vec![2.0; 30]], None).values, [vec![2.0_f64.cbrt().powi(3); 30]]);
    }

    /// What a sample measures changes the predictions of others, but not its own.
    #[test]
    fn no_prediction_contains_its_own_sample() {
        for directions in [Directions::Scattered(scattered_directions(300, 80.0, 1)), row_of_a_grid()] {
            let n = directions.len();
            let values = vec![directions.each(|g| 1.0 + g.cos_i())];
            let sigma = vec![vec![0.1; n]];
            let plain = Predicted::new(&directions, &values, Some(&sigma));
            let (mut other, mut other_sigma) = (values.clone(), sigma.clone());
            (other[0][7], other_sigma[0][7]) = (50.0, 3.0);
            let moved = Predicted::new(&directions, &other, Some(&other_sigma));
            assert_eq!(moved.values[0][7], plain.values[0][7]);
            assert_eq!(moved.sigma.as_ref().unwrap()[0][7], plain.sigma.as_ref().unwrap()[0][7]);
            assert_ne!(moved.values, plain.values);
            assert_ne!(moved.sigma, plain.sigma);
        }
    }

    /// A channel with gaps is predicted as if only its samples had been measured, and no gap changes another channel.
    #[test]
    fn gaps_are_no_neighbours() {
        for directions in [Directions::Scattered(scattered_directions(300, 80.0, 1)), row_of_a_grid()] {
            let n = directions.len();
            let whole = directions.each(|g| 1.0 + g.cos_i());
            let kept: Vec<usize> = (0..n).filter(|sample| sample % 3 != 1).collect();
            let with_gaps: Vec<f64> =
                (0..n).map(|k| if k % 3 == 1 { f64::NAN } else { 2.0 * whole[k] }).collect();
            let sigma = vec![whole.clone(), with_gaps.clone()];
            let both = Predicted::new(&directions, &[whole.clone(), with_gaps.clone()], Some(&sigma));
            let alone = |directions: &Directions, row: Vec<f64>| {
                Predicted::new(directions, std::slice::from_ref(&row), Some(&vec![row.clone()]))
            };
            let first = alone(&directions, whole);
            let second = alone(&directions.select(&kept), gather(&with_gaps, &kept));
            assert_eq!(both.values[0], first.values[0]);
            assert_eq!(gather(&both.values[1], &kept), second.values[0]);
            assert_eq!(gather(&both.sigma.as_ref().unwrap()[1], &kept), second.sigma.unwrap()[0]);
            assert_eq!(both.noise_floors, [first.noise_floors[0], second.noise_floors[0]]);
            assert!((0..n).all(|k| both.values[1][k].is_nan() == (k % 3 == 1)));
        }
    }

    /// Noise of a known size in the dark, which one absurd value does not change.
    #[test]
    fn the_noise_floor_is_that_of_the_darkest_samples() {
        use rand::{RngExt, SeedableRng};
        let directions = Directions::Scattered(scattered_directions(4000, 80.0, 1));
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        let cosines = directions.each(|g| g.cos_i());
        let mut noisy = || 1e-3 * rng.sample::<f64, _>(rand_distr::StandardNormal);
        let mut values = vec![cosines.iter().map(|cos| 0.1 + noisy() / cos).collect::<Vec<f64>>()];
        let floor = |values: &[Vec<f64>]| Predicted::new(&directions, values, None).noise_floor(0);
        let found = floor(&values);
        assert!((1.5e-3..3.5e-3).contains(&found), "{found}");
        values[0][11] = 1e30;
        assert!((floor(&values) / found - 1.0).abs() < 0.1);
    }
}
