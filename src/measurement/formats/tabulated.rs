//! The samples of a table of directions, as its places are read one after the other.

use super::specular::LEAST_COSINE;
use crate::geometry::{Directions, Pair};
use crate::measurement::{Channel, Measurement};
use std::collections::{BTreeMap, HashMap};

/// The samples that a table has so far.
///
/// A direction below the horizon is left out. So is a pair of directions that has been there with the same values: about the mirror
/// direction or the normal a table says the same at every azimuth, and at 360 degrees what it said at 0.
pub(super) struct Tabulated {
    pairs: Vec<Pair>,
    values: Vec<Vec<f64>>,
    dropped: BTreeMap<&'static str, usize>,
    /// The first sample of each pair of directions.
    seen: HashMap<[u64; 6], usize>,
}

impl Tabulated {
    pub(super) fn new(channels: usize) -> Self {
        Self {
            pairs: Vec::new(),
            values: vec![Vec::new(); channels],
            dropped: BTreeMap::new(),
            seen: HashMap::new(),
        }
    }

    /// Takes the values of one place, one per channel. `unmeasured` says which values mark a place that was not measured.
    pub(super) fn take(&mut self, pair: Pair, sample: &[f64], unmeasured: impl Fn(&[f64]) -> bool) {
        if pair.wi.z <= LEAST_COSINE || pair.wo.z <= LEAST_COSINE {
            return self.drop("below-horizon");
        }
        if unmeasured(sample) {
            return self.drop("not-measured");
        }
        // Rounded, so that directions that differ only in their last digits are one.
        let key = [pair.wi.x, pair.wi.y, pair.wi.z, pair.wo.x, pair.wo.y, pair.wo.z];
        let first =
            *self.seen.entry(key.map(|x| ((x * 1e9).round() + 0.0).to_bits())).or_insert(self.pairs.len());
        let same = |(row, value): (&Vec<f64>, &f64)| row.get(first) == Some(value);
        if first < self.pairs.len() && self.values.iter().zip(sample).all(same) {
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
