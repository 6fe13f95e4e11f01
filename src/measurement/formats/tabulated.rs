//! The samples of a table of directions, as its places are read one after the other.

use super::specular::LEAST_COSINE;
use crate::geometry::{Directions, Pair};
use crate::measurement::{Channel, Measurement};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

/// Which other places of a table have the same pair of directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Twins {
    /// None.
    None,
    /// Those of the same number.
    Numbered(usize),
    /// Any may, as their directions show.
    Unknown,
}

/// A direction in a list, some of which may be the same: about the normal a table says the same at every azimuth, and at 360 degrees what it
/// said at 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Listed {
    /// The place of the first one in the list that is the same.
    first: usize,
    /// Whether no other is the same.
    alone: bool,
}

impl Listed {
    /// The directions of a list.
    pub(super) fn all(directions: impl Iterator<Item = DVec3>) -> Vec<Self> {
        let mut first_of = HashMap::new();
        let mut list: Vec<Self> = Vec::new();
        for (place, direction) in directions.enumerate() {
            let first = *first_of.entry(rounded(direction)).or_insert(place);
            if let Some(twin) = list.get_mut(first) {
                twin.alone = false;
            }
            list.push(Self { first, alone: first == place });
        }
        list
    }

    /// The twins of a pair that has this direction of the light, and this one in another list, which has `number` directions.
    pub(super) fn with(self, other: Self, number: usize) -> Twins {
        if self.alone && other.alone {
            Twins::None
        } else {
            Twins::Numbered(self.first * number + other.first)
        }
    }

    /// Like [`Self::with`], for another list of directions that are counted from the light's azimuth. Where that is not known, neither
    /// are the twins.
    pub(super) fn turning(self, other: Self, number: usize) -> Twins {
        if self.alone { self.with(other, number) } else { Twins::Unknown }
    }
}

/// A direction whose last digits do not count.
fn rounded(v: DVec3) -> [u64; 3] {
    v.to_array().map(|x| ((x * 1e9).round() + 0.0).to_bits())
}

/// The samples that a table has so far.
///
/// A direction below the horizon is left out. So is a pair of directions that has been there with the same values: about the mirror
/// direction or the normal a table says the same at every azimuth, and at 360 degrees what it said at 0.
pub(super) struct Tabulated {
    pairs: Vec<Pair>,
    values: Vec<Vec<f64>>,
    dropped: BTreeMap<&'static str, usize>,
    /// The first sample of each pair of directions that may be there again, by its number or by itself.
    numbered: HashMap<usize, usize>,
    seen: HashMap<[[u64; 3]; 2], usize>,
}

impl Tabulated {
    pub(super) fn new(channels: usize) -> Self {
        Self {
            pairs: Vec::new(),
            values: vec![Vec::new(); channels],
            dropped: BTreeMap::new(),
            numbered: HashMap::new(),
            seen: HashMap::new(),
        }
    }

    /// Takes the values of one place, one per channel. `unmeasured` says which values mark a place that was not measured.
    pub(super) fn take(
        &mut self,
        pair: Pair,
        twins: Twins,
        sample: &[f64],
        unmeasured: impl Fn(&[f64]) -> bool,
    ) {
        if pair.wi.z <= LEAST_COSINE || pair.wo.z <= LEAST_COSINE {
            return self.drop("below-horizon");
        }
        if unmeasured(sample) {
            return self.drop("not-measured");
        }
        let next = self.pairs.len();
        let first = match twins {
            Twins::None => next,
            Twins::Numbered(number) => *self.numbered.entry(number).or_insert(next),
            Twins::Unknown => *self.seen.entry([pair.wi, pair.wo].map(rounded)).or_insert(next),
        };
        let same = |(row, value): (&Vec<f64>, &f64)| row.get(first) == Some(value);
        if first < next && self.values.iter().zip(sample).all(same) {
            return self.drop("repeated");
        }
        self.pairs.push(pair);
        self.values.iter_mut().zip(sample).for_each(|(row, value)| row.push(*value));
    }

    fn drop(&mut self, reason: &'static str) {
        *self.dropped.entry(reason).or_default() += 1;
    }

    pub(super) fn measurement(self, channels: Vec<Channel>) -> Measurement {
        let Self { pairs, values, dropped, .. } = self;
        Measurement { dropped, ..Measurement::of(channels, Directions::Scattered(pairs), values) }
    }
}
