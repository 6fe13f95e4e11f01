//! Pairs of samples whose values should be alike: next to each other, in the same directions, or exchanged.

use super::cloud::{SAME, Symmetry, place};
use super::tree::{Near, Tree};
use crate::geometry::{Azimuths, Directions, Pair};
use rayon::prelude::*;

/// Two samples by their indices.
pub(crate) type Twins = [usize; 2];

/// Pairs of samples of a measurement.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neighbours {
    /// Samples next to each other.
    pub(crate) near: Vec<Twins>,
    /// The first sample of each of those, and one that is farther away.
    pub(crate) far: Vec<Twins>,
    /// Samples in the same directions.
    pub(crate) repeats: Vec<Twins>,
    /// Samples with light and viewer exchanged.
    pub(crate) exchanged: Vec<Twins>,
}

/// Largest number of samples among which neighbours are sought.
const MOST_SAMPLES: usize = 20_000;
/// Largest number of samples whose neighbours are sought.
const MOST_QUERIES: usize = 2000;
/// Which of the neighbours is the one farther away.
const FAR: usize = 5;
/// Number of consecutive cells of a grid that are looked at together.
const RUN: usize = 40;

impl Neighbours {
    /// Finds neighbours among the samples in these directions.
    pub(crate) fn of(directions: &Directions) -> Self {
        match directions {
            Directions::Grid { cells, .. } => {
                let found = Self::along_rows(cells);
                // What was drawn from a grid has no neighbours in its rows.
                if found.near.len() >= MOST_QUERIES / 4 { found } else { Self::in_space(directions) }
            }
            Directions::Scattered(_) => Self::in_space(directions),
        }
    }

    /// Neighbours in phi_d, in runs of cells spread evenly over the grid.
    fn along_rows(cells: &[u32]) -> Self {
        let mut found = Self::default();
        let runs = MOST_SAMPLES / RUN;
        let starts = (0..runs).map(|run| run * cells.len() / runs);
        for start in starts {
            let end = (start + RUN).min(cells.len());
            let step = |from: usize, by: usize| {
                let cell = cells.get(from)?.checked_add(u32::try_from(by).ok()?)?;
                cells.get(from + by).filter(|other| **other == cell).map(|_| [from, from + by])
            };
            for from in start..end.saturating_sub(2) {
                if let (Some(near), Some(far)) = (step(from, 1), step(from, 2)) {
                    found.near.push(near);
                    found.far.push(far);
                }
            }
        }
        found
    }

    /// Neighbours in the coordinates of the interpolation.
    fn in_space(directions: &Directions) -> Self {
        let len = directions.len();
        let stride = len.div_ceil(MOST_SAMPLES).max(1);
        let pairs: Vec<(usize, Pair)> = directions
            .iter()
            .enumerate()
            .step_by(stride)
            .map(|(sample, g)| (sample, Pair { wi: g.wi.into(), wo: g.wo.into() }))
            .collect();
        let isotropic = directions.azimuths() != Azimuths::Several;
        let symmetry = Symmetry { isotropic, reciprocal: false };
        let tree = Tree::new(pairs.iter().map(|(sample, pair)| (place(pair, symmetry), *sample)).collect());
        let every = pairs.len().div_ceil(MOST_QUERIES).max(1);
        let queries: Vec<&(usize, Pair)> = pairs.iter().step_by(every).collect();
        let of_query = |(sample, pair): &&(usize, Pair)| {
            let sample = *sample;
            let mut near: Vec<Near> = Vec::new();
            tree.nearest(&place(pair, symmetry), FAR, |near| near.sample != sample, &mut near);
            let exchanged = Pair { wi: pair.wo, wo: pair.wi };
            let mut back: Vec<Near> = Vec::new();
            tree.nearest(&place(&exchanged, symmetry), 1, |near| near.sample != sample, &mut back);
            // Points coincide where samples are mirror images, too.
            let is_repeat = |near: &Near| {
                let other = pairs.get(near.sample / stride);
                other.is_some_and(|(_, other)| {
                    pair.wi.distance_squared(other.wi) + pair.wo.distance_squared(other.wo) < SAME
                })
            };
            let mut found = Self::default();
            match (near.first(), near.get(FAR - 1)) {
                (Some(first), _) if is_repeat(first) => found.repeats.push([sample, first.sample]),
                (Some(first), Some(last)) => {
                    found.near.push([sample, first.sample]);
                    found.far.push([sample, last.sample]);
                }
                _ => {}
            }
            let back = back.first().filter(|near| near.square < SAME);
            found.exchanged.extend(back.map(|near| [sample, near.sample]));
            found
        };
        let all: Vec<Self> = queries.par_iter().map(of_query).collect();
        let mut found = Self::default();
        for of_query in all {
            found.near.extend(of_query.near);
            found.far.extend(of_query.far);
            found.repeats.extend(of_query.repeats);
            found.exchanged.extend(of_query.exchanged);
        }
        found
    }

    /// Every sample that is part of a pair, ascending.
    pub(crate) fn samples(&self) -> Vec<usize> {
        let all = [&self.near, &self.far, &self.repeats, &self.exchanged];
        let mut samples: Vec<usize> = all.into_iter().flatten().flatten().copied().collect();
        samples.sort_unstable();
        samples.dedup();
        samples
    }
}
