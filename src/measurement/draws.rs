//! Draws part of the samples, such that it represents all of them.

use super::Samples;
use crate::geometry::{Directions, Pair};
use crate::math::count;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::sync::OnceLock;

/// Draws parts of a set of samples. The first draw sorts scattered samples; further draws cost little more than the
/// part itself.
#[derive(Debug)]
pub struct Draws<'a> {
    samples: &'a Samples,
    /// Indices of scattered samples, sorted by the half vector's angle to the normal.
    order: OnceLock<Vec<u32>>,
}

impl<'a> Draws<'a> {
    /// Prepares draws from `samples`.
    #[must_use]
    pub fn new(samples: &'a Samples) -> Self {
        Self { samples, order: OnceLock::new() }
    }

    /// About `wanted` of the samples, weighted to represent all of them; all samples if there are no more than that.
    ///
    /// The samples are sorted by the half vector's angle to the normal and divided into stretches that grow with that
    /// angle. One sample is drawn from each stretch and gets the weight of the stretch. A sharp peak, which may
    /// consist of a handful of samples among thousands, keeps all of them. Of a channel that was measured at few of the samples, a few
    /// values are added that stand for themselves.
    #[must_use]
    pub fn part(&self, wanted: usize, seed: u64) -> Samples {
        let all = self.samples.len();
        if wanted >= all {
            return self.samples.clone();
        }
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        // The end of stretch k, n ((k + 1)/wanted)^2, in integers.
        let square = |k: usize| (all as u128 * (k as u128).pow(2)) / (wanted as u128).pow(2);
        let end = |k: usize| usize::try_from(square(k)).unwrap_or(usize::MAX);
        let mut chosen: Vec<(usize, usize)> = Vec::with_capacity(wanted);
        let mut start = 0;
        for stretch in 1..=wanted {
            let end = end(stretch).max(start);
            if end > start
                && let Some(index) = self.at_place(rng.random_range(start..end))
            {
                chosen.push((index, end - start));
                start = end;
            }
        }
        chosen.sort_unstable();
        self.add_rare(&mut chosen);
        let indices: Vec<usize> = chosen.iter().map(|(index, _)| *index).collect();
        let mut part = self.samples.at(&indices);
        for (weight, (_, stands_for)) in part.weights.iter_mut().zip(&chosen) {
            *weight *= count(*stands_for);
        }
        part
    }

    /// Adds samples to those chosen, such that every channel has a few values among them. Each stands for itself.
    fn add_rare(&self, chosen: &mut Vec<(usize, usize)>) {
        /// The number of values that every channel has, if there are as many.
        const LEAST: usize = 32;
        for (row, missing) in self.samples.values.iter().zip(&self.samples.missing) {
            if *missing == 0 {
                continue;
            }
            let is_measured = |sample: &usize| row.get(*sample).is_some_and(|value| !value.is_nan());
            let drawn = chosen.iter().filter(|(sample, _)| is_measured(sample)).count();
            if drawn >= LEAST.min(row.len() - missing) {
                continue;
            }
            let is_drawn = |sample: &usize| chosen.binary_search_by_key(sample, |(index, _)| *index).is_ok();
            let others: Vec<usize> =
                (0..row.len()).filter(|sample| is_measured(sample) && !is_drawn(sample)).collect();
            let wanted = (LEAST - drawn).min(others.len());
            // Spread evenly over the order of the samples.
            let added = (0..wanted).filter_map(|k| others.get(k * others.len() / wanted));
            chosen.extend(added.map(|sample| (*sample, 1)));
            chosen.sort_unstable();
        }
    }

    /// The sample at a position in the order.
    fn at_place(&self, place: usize) -> Option<usize> {
        match &self.samples.directions {
            // Cells are already numbered in the order of theta_h.
            Directions::Grid { .. } => Some(place),
            Directions::Scattered(pairs) => {
                let order = self.order.get_or_init(|| by_half_angle(pairs));
                order.get(place).and_then(|index| usize::try_from(*index).ok())
            }
        }
    }
}

/// The indices of pairs of directions, sorted by the half vector's angle to the normal and then by index.
fn by_half_angle(pairs: &[Pair]) -> Vec<u32> {
    // Four thousand million pairs would take 200 GB, so the indices do not overflow.
    let numbered = pairs.par_iter().zip(0..u32::MAX);
    let mut order: Vec<(f64, u32)> =
        numbered.map(|(pair, index)| (pair.geometry().sin2_h(), index)).collect();
    // No two entries are equal, so the result does not depend on the threads.
    order.par_sort_unstable_by(|(a, i), (b, j)| a.total_cmp(b).then(i.cmp(j)));
    order.par_iter().map(|(_, index)| *index).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::{Predicted, Weighting};
    use crate::synthetic::scattered_directions;
    use std::collections::BTreeMap;

    /// Scattered samples that have distinct values, and as many more in the same directions.
    fn samples() -> Samples {
        let mut pairs = scattered_directions(3000, 80.0, 1);
        pairs.extend_from_within(..);
        let values = vec![(0..pairs.len()).map(count).collect()];
        let directions = Directions::Scattered(pairs);
        Samples {
            predicted: Predicted::new(&directions, &values, None),
            weights: vec![1.0; directions.len()],
            missing: vec![0],
            values,
            directions,
            sigma: None,
            weighting: Weighting::Uniform,
            dead: vec![false],
            dropped: BTreeMap::new(),
        }
    }

    #[test]
    fn pairs_in_the_same_directions_keep_their_order() {
        let samples = samples();
        let Directions::Scattered(pairs) = &samples.directions else { panic!("scattered") };
        let order = by_half_angle(pairs);
        let mut stable: Vec<u32> = (0..6000).collect();
        let sine = |i: &u32| pairs[*i as usize].geometry().sin2_h();
        stable.sort_by(|a, b| sine(a).total_cmp(&sine(b)));
        assert_eq!(order, stable);
        assert!(order.chunks(2).all(|twins| twins[1] == twins[0] + 3000));
    }

    #[test]
    fn a_part_stands_for_all_and_does_not_depend_on_earlier_draws() {
        let samples = samples();
        let draws = Draws::new(&samples);
        for wanted in [100, 700] {
            let part = draws.part(wanted, 5);
            assert!(part.len() <= wanted && part.len() > wanted / 2, "{}", part.len());
            assert_eq!(part.weights.iter().sum::<f64>(), 6000.0);
            assert_eq!(part.values, Draws::new(&samples).part(wanted, 5).values);
            assert!(part.values[0].is_sorted());
        }
        assert_eq!(draws.part(6000, 5).values, samples.values);
    }

    #[test]
    fn a_channel_of_few_values_keeps_some() {
        let mut samples = samples();
        let few =
            |n: usize| (0..6000).map(|k| if k % (6000 / n) == 7 { count(k) } else { f64::NAN }).collect();
        samples.values.extend([few(10), few(200)]);
        samples.missing = vec![0, 5990, 5800];
        samples.dead = vec![false; 3];
        let part = Draws::new(&samples).part(100, 5);
        let values = |channel: usize| part.values[channel].iter().filter(|value| !value.is_nan()).count();
        assert_eq!((values(1), values(2)), (10, 32));
        assert_eq!(part.missing, [0, part.len() - 10, part.len() - 32]);
        // The whole is heavier by those that were added and stand for themselves.
        assert!((6000.0..6042.0).contains(&part.weights.iter().sum::<f64>()));
        let Directions::Scattered(pairs) = &part.directions else { panic!("scattered") };
        assert!(pairs.windows(2).all(|two| two[0] != two[1]) && part.values[0].is_sorted());
    }
}
