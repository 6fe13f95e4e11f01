//! The samples of a measurement, found by their directions.

use super::Measurement;
use crate::geometry::Pair;
use std::collections::HashMap;

/// Finds the sample at a pair of directions.
///
/// An interpolant that averages reciprocal pairs, or smooths, does not pass through every sample. What is written at the directions of a
/// sample should be that sample.
#[derive(Clone, Debug)]
pub struct KnownSamples {
    by_place: HashMap<[i64; 6], (usize, Pair)>,
}

/// Cells of this size hold one sample each.
const CELL: f64 = 1e-6;
/// Directions closer than this are the same: angles that were written as text come back with a rounding.
const CLOSE: f64 = 1e-8;

impl KnownSamples {
    /// Sorts the samples by their directions. Of several in one direction the first counts.
    #[must_use]
    pub fn new(measurement: &Measurement) -> Self {
        let mut by_place = HashMap::with_capacity(measurement.directions.len());
        for (index, g) in measurement.directions.iter().enumerate() {
            let pair = Pair { wi: g.wi.into(), wo: g.wo.into() };
            by_place.entry(place(&pair)).or_insert((index, pair));
        }
        Self { by_place }
    }

    /// Replaces the values at those pairs of directions that are a sample's own by the sample, in the channels in which that was
    /// measured. `values` are by channel and pair, and `measurement` is the one that was sorted.
    pub fn put(&self, measurement: &Measurement, pairs: &[Pair], values: &mut [Vec<f64>]) {
        for (at, sample) in pairs.iter().map(|pair| self.at(pair)).enumerate() {
            let Some(sample) = sample else { continue };
            for (row, own) in values.iter_mut().zip(&measurement.values) {
                let own = own.get(sample).filter(|f| !f.is_nan());
                if let (Some(value), Some(f)) = (row.get_mut(at), own) {
                    *value = *f;
                }
            }
        }
    }

    /// The sample at a pair of directions; `None` if there is none.
    #[must_use]
    pub fn at(&self, pair: &Pair) -> Option<usize> {
        let (index, known) = self.by_place.get(&place(pair))?;
        let is_close = known.wi.distance(pair.wi) < CLOSE && known.wo.distance(pair.wo) < CLOSE;
        is_close.then_some(*index)
    }
}

/// The cell of a pair of directions. Two that differ by a rounding lie in different ones only once in millions of pairs.
#[expect(clippy::cast_possible_truncation, reason = "components of unit vectors in millionths fit easily")]
fn place(pair: &Pair) -> [i64; 6] {
    // Off the round numbers that components of directions often are, such as 0 and 1/2.
    let cell = |x: f64| ((x + 0.318_309_886e-6) / CELL).floor() as i64;
    let Pair { wi, wo } = pair;
    [wi.x, wi.y, wi.z, wo.x, wo.y, wo.z].map(cell)
}
