//! Interpolates a measurement to any pair of directions, as an image of the measured material requires.
//!
//! | directions | method |
//! |---|---|
//! | half/difference grid | trilinear between the eight centres around a pair, on the grid's own warped axes: `cells` |
//! | of a file that says how it is interpolated | as the file says |
//! | scattered | local linear regression on the nearest samples, which passes through every sample: `cloud` |
//!
//! Channels that were not measured at the same samples are interpolated apart, each between the samples that it has.
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

use super::missing::{Alike, alike};
use super::{Continuous, Measurement};
use crate::geometry::{Directions, Pair, gather};
pub(crate) use left_out::spread;
use left_out::summary;
use rayon::prelude::*;
use std::sync::Arc;

/// A measured BRDF, interpolated between its samples and extrapolated beyond them.
#[derive(Clone, Debug)]
pub struct Interpolant {
    channels: usize,
    parts: Vec<Part>,
}

/// Channels that have values at the same samples; all channels if none has gaps.
#[derive(Clone, Debug)]
struct Part {
    /// Those channels, ascending.
    channels: Vec<usize>,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Cells(cells::Cells),
    Cloud(cloud::Cloud),
    /// The file's own interpolation, and the samples that were drawn from it.
    Own(Arc<dyn Continuous>, cloud::Cloud),
    /// No value at all.
    Nothing,
}

/// The values of an interpolant at pairs of directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// f in 1/sr, by channel and pair; NaN above the horizon in a channel without any value.
    pub values: Vec<Vec<f64>>,
    /// Whether there are data of every channel around each pair; if not, the value is that of the nearest data.
    pub covered: Vec<bool>,
}

/// What is computed beyond the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Beyond {
    /// The value of the nearest data.
    Nearest,
    /// Nothing.
    Nothing,
}

/// Largest number of samples that are left out for a [`LeaveOut`].
const LEFT_OUT: usize = 4000;

impl Interpolant {
    /// Prepares a measurement for interpolation.
    #[must_use]
    pub fn new(measurement: &Measurement) -> Self {
        let Measurement { directions, values, continuous, .. } = measurement;
        let part = |Alike { channels, samples }: Alike| {
            let kind = if samples.is_none() && channels.len() == values.len() {
                Kind::new(directions, values, continuous.as_ref())
            } else {
                let samples = samples.unwrap_or_else(|| (0..directions.len()).collect());
                let rows = channels.iter().filter_map(|channel| values.get(*channel));
                let rows: Vec<Vec<f64>> = rows.map(|row| gather(row, &samples)).collect();
                match samples.as_slice() {
                    [] => Kind::Nothing,
                    _ => Kind::new(&directions.select(&samples), &rows, continuous.as_ref()),
                }
            };
            Part { channels, kind }
        };
        let groups = if continuous.is_some() { all_together(values) } else { alike(values) };
        Self { channels: values.len(), parts: groups.into_iter().map(part).collect() }
    }

    /// f at every pair. The result does not depend on the number of threads.
    #[must_use]
    pub fn at(&self, pairs: &[Pair]) -> Answer {
        self.answer(pairs, Beyond::Nearest)
    }

    /// f at every pair that is covered; at others it may be NaN, which saves the search for the nearest samples.
    #[must_use]
    pub fn where_covered(&self, pairs: &[Pair]) -> Answer {
        self.answer(pairs, Beyond::Nothing)
    }

    fn answer(&self, pairs: &[Pair], beyond: Beyond) -> Answer {
        /// Number of pairs that one thread computes at a time.
        const PIECE: usize = 512;
        let pieces: Vec<(Vec<f64>, Vec<bool>)> =
            pairs.par_chunks(PIECE).map(|piece| self.piece(piece, beyond)).collect();
        let mut values: Vec<Vec<f64>> = vec![Vec::with_capacity(pairs.len()); self.channels];
        let mut covered = Vec::with_capacity(pairs.len());
        for (found, inside) in pieces {
            covered.extend(inside);
            for pair in found.chunks_exact(self.channels.max(1)) {
                values.iter_mut().zip(pair).for_each(|(row, f)| row.push(*f));
            }
        }
        Answer { values, covered }
    }

    /// f at some pairs, with the channels of each pair together, and whether each pair is covered.
    fn piece(&self, pairs: &[Pair], beyond: Beyond) -> (Vec<f64>, Vec<bool>) {
        let mut values = vec![0.0; pairs.len() * self.channels];
        let mut room = cloud::Room::default();
        let mut of_part = Vec::new();
        let covered = pairs.iter().zip(values.chunks_exact_mut(self.channels.max(1))).map(|(pair, f)| {
            // It is known that nothing is reflected below the horizon.
            if pair.wi.z <= 0.0 || pair.wo.z <= 0.0 {
                return true;
            }
            if let [all] = self.parts.as_slice() {
                return all.kind.at(pair, beyond, &mut room, f);
            }
            let mut covered = true;
            for part in &self.parts {
                of_part.clear();
                of_part.resize(part.channels.len(), 0.0);
                covered &= part.kind.at(pair, beyond, &mut room, &mut of_part);
                for (channel, value) in part.channels.iter().zip(&of_part) {
                    f.iter_mut().skip(*channel).take(1).for_each(|f| *f = *value);
                }
            }
            covered
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
        let most = LEFT_OUT / self.parts.len().max(1);
        let of_part = |part: &Part| match &part.kind {
            Kind::Cells(cells) => cells.leave_out(most),
            Kind::Cloud(cloud) | Kind::Own(_, cloud) => cloud.leave_out(out, most),
            Kind::Nothing => Vec::new(),
        };
        summary(self.parts.iter().flat_map(of_part).collect())
    }

    /// The symmetries assumed for scattered samples, in all channels; `None` for a grid, which has both by construction.
    #[must_use]
    pub fn symmetry(&self) -> Option<Symmetry> {
        let mut common = Symmetry { isotropic: true, reciprocal: true };
        for part in &self.parts {
            let own = match &part.kind {
                Kind::Cells(_) => return None,
                Kind::Cloud(cloud) | Kind::Own(_, cloud) => cloud.symmetry(),
                Kind::Nothing => continue,
            };
            common.isotropic &= own.isotropic;
            common.reciprocal &= own.reciprocal;
        }
        Some(common)
    }
}

/// All channels, with the samples that have a value in every one: those of a BRDF that a file defines everywhere only show how far it
/// can be trusted.
fn all_together(values: &[Vec<f64>]) -> Vec<Alike> {
    let has_gaps = values.iter().flatten().any(|value| value.is_nan());
    let is_measured = |sample: &usize| values.iter().all(|row| row.get(*sample).is_some_and(|f| !f.is_nan()));
    let samples = has_gaps.then(|| (0..values.first().map_or(0, Vec::len)).filter(is_measured).collect());
    vec![Alike { channels: (0..values.len()).collect(), samples }]
}

impl Kind {
    /// The interpolation of rows that have all their values; `own` is that of the file, if it has one.
    fn new(directions: &Directions, rows: &[Vec<f64>], own: Option<&Arc<dyn Continuous>>) -> Self {
        match directions {
            Directions::Grid { grid, cells } => Self::Cells(cells::Cells::new(grid, cells, rows)),
            Directions::Scattered(pairs) => {
                let cloud = cloud::Cloud::new(pairs, rows);
                match own {
                    Some(own) => Self::Own(Arc::clone(own), cloud),
                    None => Self::Cloud(cloud),
                }
            }
        }
    }

    /// Writes f at a pair above the horizon, and returns whether the pair is covered.
    fn at(&self, pair: &Pair, beyond: Beyond, room: &mut cloud::Room, f: &mut [f64]) -> bool {
        match self {
            Self::Cells(cells) => cells.at(pair, f),
            Self::Cloud(cloud) if beyond == Beyond::Nothing && cloud.is_beyond(pair) => {
                f.fill(f64::NAN);
                false
            }
            Self::Cloud(cloud) => cloud.at(pair, room, f),
            Self::Own(own, _) => {
                own.at(pair, f);
                true
            }
            Self::Nothing => {
                f.fill(f64::NAN);
                false
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::HalfDifferenceGrid;
    use crate::measurement::Channel;
    use crate::synthetic::scattered_directions;

    impl Interpolant {
        /// Channels without gaps.
        pub(super) fn of_kind(channels: usize, kind: Kind) -> Self {
            Self { channels, parts: vec![Part { channels: (0..channels).collect(), kind }] }
        }
    }

    fn measured(directions: Directions, values: Vec<Vec<f64>>) -> Measurement {
        let channels = (0..values.len()).map(|index| Channel::named(&format!("c{index}")));
        Measurement::of(channels.collect(), directions, values)
    }

    /// A channel with gaps is interpolated as if only its samples had been measured, and no gap changes another channel.
    #[test]
    fn channels_with_gaps_are_interpolated_apart() {
        let grid = Directions::Grid {
            grid: HalfDifferenceGrid::merl_centers(),
            cells: (200_000..240_000).collect(),
        };
        let asked = scattered_directions(500, 80.0, 4);
        for directions in [Directions::Scattered(scattered_directions(600, 80.0, 3)), grid] {
            let n = directions.len();
            let whole = directions.each(|g| 0.1 + (g.cos_i() * g.cos_o()).abs());
            let gaps: Vec<f64> =
                (0..n).map(|k| if k % 3 == 1 { f64::NAN } else { whole[k].sqrt() }).collect();
            let kept: Vec<usize> = (0..n).filter(|k| k % 3 != 1).collect();
            let rows = vec![gaps.clone(), whole.clone(), vec![f64::NAN; n]];
            let all = Interpolant::new(&measured(directions.clone(), rows));
            let alone = |directions: &Directions, row: &[f64]| {
                Interpolant::new(&measured(directions.clone(), vec![row.to_vec()]))
            };
            let first = alone(&directions.select(&kept), &gather(&gaps, &kept));
            let second = alone(&directions, &whole);
            let [found, first, second] = [&all, &first, &second].map(|interpolant| interpolant.at(&asked));
            assert_eq!((&found.values[0], &found.values[1]), (&first.values[0], &second.values[0]));
            assert!(found.values[2].iter().all(|f| f.is_nan()) && !found.covered.contains(&true));
            assert!(all.leave_out_error(LeftOut::Sample).is_some_and(|error| error.median.is_finite()));

            let two = Interpolant::new(&measured(directions.clone(), vec![gaps, whole]));
            let covered = two.at(&asked).covered;
            let both = first.covered.iter().zip(&second.covered).map(|(a, b)| *a && *b);
            assert!(covered.iter().copied().eq(both));
        }
    }
}
