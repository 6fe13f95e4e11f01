//! Which cells of a MERL table are used, and their values.

use super::sizes::SCALES;
use crate::geometry::HalfDifferenceGrid;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Number of cells that differ only in phi_d.
const ROW: usize = HalfDifferenceGrid::DIMENSIONS[2];
/// Number of cells that are read at a time: whole rows, a whole number of pieces per plane, small enough for the
/// caches.
pub const PIECE: usize = 180 * ROW;

/// Whether a cell is used, or why not. If there are several reasons to leave it out, the last in this order counts.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Verdict {
    Usable,
    BelowHorizon,
    NotFinite,
    NotMeasured,
}

impl Verdict {
    /// The verdict on a stored value, regardless of its position.
    fn of(value: f64) -> Self {
        if value < 0.0 {
            Self::NotMeasured
        } else if value.is_finite() {
            Self::Usable
        } else {
            Self::NotFinite
        }
    }
}

/// The usable cells, f in each of them by channel, and the number of cells left out by reason.
pub type Contents = (Vec<u32>, Vec<Vec<f64>>, BTreeMap<&'static str, usize>);

/// A table that is being read.
pub struct Table<'g> {
    above: &'g [bool],
    verdicts: Vec<Verdict>,
    /// f of the cells above the horizon, by channel.
    values: Vec<Vec<f64>>,
    /// Number of values read, all planes together.
    taken: usize,
}

impl<'g> Table<'g> {
    pub fn new(above: &'g [bool]) -> Self {
        let verdict = |above: &bool| if *above { Verdict::Usable } else { Verdict::BelowHorizon };
        // Exactly as many as needed: memory given back later would leave gaps that the next table does not fit into.
        let many = above.iter().filter(|above| **above).count();
        Self {
            above,
            verdicts: above.iter().map(verdict).collect(),
            values: SCALES.map(|_| Vec::with_capacity(many)).into(),
            taken: 0,
        }
    }

    /// Takes the next numbers, all of one plane. Numbers beyond the last plane are ignored.
    pub fn take(&mut self, words: &[u64]) {
        let cells = self.above.len().max(1);
        let (plane, cell) = (self.taken / cells, self.taken % cells);
        self.taken += words.len();
        let (Some(plane), Some(scale)) = (self.values.get_mut(plane), SCALES.get(plane)) else { return };
        let above = self.above.get(cell..).unwrap_or_default();
        let verdicts = self.verdicts.get_mut(cell..).unwrap_or_default();
        let value = |word: &u64| f64::from_bits(u64::from_le(*word));
        // Most rows are entirely above the horizon and contain only usable values: they are copied without checking
        // each cell.
        let rows = words.chunks(ROW).zip(above.chunks(ROW)).zip(verdicts.chunks_mut(ROW));
        for ((words, above), verdicts) in rows {
            // There is no early exit, so that several values can be compared at once.
            let usable = |all: bool, v: f64| all & (0.0..=f64::MAX).contains(&v);
            if !words.iter().map(value).fold(true, usable) {
                for (word, verdict) in words.iter().zip(verdicts) {
                    *verdict = Verdict::of(value(word)).max(*verdict);
                }
            }
            if above.iter().all(|above| *above) {
                plane.extend(words.iter().map(|word| value(word) * scale));
            } else {
                let above = words.iter().zip(above).filter(|(_, above)| **above);
                plane.extend(above.map(|(word, _)| value(word) * scale));
            }
        }
    }

    /// The usable cells, their values, and how many were left out for each reason.
    pub fn finish(self) -> Contents {
        let Self { above, verdicts, mut values, .. } = self;
        let (mut below_horizon, mut not_finite, mut not_measured) = (0, 0, 0);
        let usable = verdicts.iter().filter(|verdict| **verdict == Verdict::Usable).count();
        let mut cells = Vec::with_capacity(usable);
        for (first, verdicts) in (0_u32..).step_by(ROW).zip(verdicts.chunks(ROW)) {
            let row = (first..).zip(verdicts);
            if verdicts.iter().all(|verdict| *verdict == Verdict::Usable) {
                cells.extend(row.map(|(cell, _)| cell));
                continue;
            }
            for (cell, verdict) in row {
                match verdict {
                    Verdict::Usable => cells.push(cell),
                    Verdict::BelowHorizon => below_horizon += 1,
                    Verdict::NotFinite => not_finite += 1,
                    Verdict::NotMeasured => not_measured += 1,
                }
            }
        }
        let dropped =
            [("below-horizon", below_horizon), ("not-finite", not_finite), ("not-measured", not_measured)];
        values.par_iter_mut().for_each(|plane| {
            if plane.len() > cells.len() {
                let mut verdicts = verdicts.iter().zip(above).filter(|(_, above)| **above);
                plane.retain(|_| verdicts.next().is_some_and(|(verdict, _)| *verdict == Verdict::Usable));
            }
            plane.shrink_to_fit();
        });
        (cells, values, dropped.into_iter().filter(|(_, number)| *number > 0).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// Number of cells of a small table: some rows, the last one cut short.
    const CELLS: usize = 3 * ROW + 7;

    /// Numbers of every kind, of which `odd` in 64 are not usable.
    fn number(rng: &mut Pcg64Mcg, odd: u64) -> f64 {
        if rng.random::<u64>() % 64 >= odd {
            return rng.random::<f64>();
        }
        match rng.random::<u64>() % 8 {
            0 => -1.0,
            1 => f64::NAN,
            2 => f64::INFINITY,
            3 => f64::NEG_INFINITY,
            4 => -0.0,
            5 => f64::MAX,
            _ => f64::from_bits(rng.random()),
        }
    }

    /// A straightforward implementation of the rules in `mod.rs`, cell by cell.
    fn plainly(above: &[bool], planes: &[Vec<f64>]) -> Contents {
        let (mut cells, mut values, mut dropped) = (Vec::new(), vec![Vec::new(); 3], BTreeMap::new());
        for (cell, above) in (0_u32..).zip(above) {
            let stored: Vec<f64> = planes.iter().map(|plane| plane[cell as usize]).collect();
            let reason = if stored.iter().any(|v| *v < 0.0) {
                "not-measured"
            } else if stored.iter().any(|v| !v.is_finite()) {
                "not-finite"
            } else if !above {
                "below-horizon"
            } else {
                cells.push(cell);
                for ((row, v), scale) in values.iter_mut().zip(stored).zip(SCALES) {
                    row.push(v * scale);
                }
                continue;
            };
            *dropped.entry(reason).or_default() += 1;
        }
        (cells, values, dropped)
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// PROPTEST_CASES sets the number of cases; docs/inside/fuzzing.md says how many were once run.
        #[test]
        fn small_tables_in_pieces(seed in any::<u64>(), odd in 0_u64..20, low in 0_u64..3, rows in 1_usize..4) {
            let mut rng = Pcg64Mcg::seed_from_u64(seed);
            let above: Vec<bool> = (0..CELLS).map(|_| rng.random::<u64>() % 256 >= low).collect();
            let planes: Vec<Vec<f64>> = (0..3).map(|_| (0..CELLS).map(|_| number(&mut rng, odd)).collect()).collect();
            let mut table = Table::new(&above);
            for plane in &planes {
                let words: Vec<u64> = plane.iter().map(|v| v.to_bits().to_le()).collect();
                words.chunks(rows * ROW).for_each(|piece| table.take(piece));
            }
            // Numbers beyond the last plane are ignored.
            table.take(&[0; ROW]);
            prop_assert_eq!(table.finish(), plainly(&above, &planes));
        }
    }
}
