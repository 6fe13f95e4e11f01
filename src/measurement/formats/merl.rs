//! MERL tables (`.binary`): Matusik et al. 2003, "A Data-Driven Reflectance Model",
//! doi:10.1145/882262.882343.
//!
//! Three little-endian 32-bit integers 90, 90, 180, then the red, green and blue planes as 64-bit floats
//! on the half/difference grid. Stored values times (1, 1.15, 1.66)/1500 are f in 1/sr. A negative cell
//! was not measured.

use super::file::File;
use super::format::{BinPosition, Confidence, Format, ReadOptions};
use super::writing::{Subject, Written};
use crate::error::{Error, Place, excerpt};
use crate::geometry::{Directions, HalfDifferenceGrid, Pair};
use crate::measurement::{Channel, Measurement, red_green_blue};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::path::Path;

/// f per stored unit, by channel.
pub const SCALES: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

/// Number of bytes of the three integers at the beginning.
const HEADER_BYTES: usize = 12;
/// Number of bytes of a whole file.
const FILE_BYTES: usize = HEADER_BYTES + 3 * 8 * HalfDifferenceGrid::CELLS;

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "merl",
    summary: "a MERL table",
    sniff,
    read,
    directions: None,
    several_materials: false,
    own_options: &[],
    knows_angles: false,
    extensions: &["binary"],
    write: Some(write),
};

fn header(bytes: &[u8]) -> Option<[i32; 3]> {
    let mut integers =
        bytes.get(..HEADER_BYTES)?.chunks_exact(4).map(|word| word.try_into().map_or(0, i32::from_le_bytes));
    Some([integers.next()?, integers.next()?, integers.next()?])
}

fn sniff(file: &File<'_>) -> Confidence {
    let dimensions = header(file.head(HEADER_BYTES)).map(|d| d.map(|n| usize::try_from(n).unwrap_or(0)));
    let named = file.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("binary"));
    if dimensions == Some(HalfDifferenceGrid::DIMENSIONS) {
        Confidence::Yes
    } else if named {
        Confidence::Maybe
    } else {
        Confidence::No
    }
}

fn read(file: &mut File<'_>, options: &ReadOptions) -> Result<Measurement, Error> {
    let [n_h, n_d, n_p] = HalfDifferenceGrid::DIMENSIONS;
    let expected_header = format!("the dimensions {n_h} x {n_d} x {n_p}");
    let path = file.path;
    let wrong = |place, expected: String, found: String| Error::malformed(path, place, expected, found);
    // The header is only compared and never used in a multiplication or an allocation, because it may contain
    // anything.
    let head = file.head(HEADER_BYTES);
    let Some(dimensions) = header(head) else {
        return Err(wrong(Place::Byte(0), expected_header, format!("only {} bytes", head.len())));
    };
    if dimensions.map(|n| usize::try_from(n).unwrap_or(0)) != HalfDifferenceGrid::DIMENSIONS {
        let found = dimensions.map(|n| n.to_string()).join(" x ");
        return Err(wrong(Place::Byte(0), expected_header, found));
    }
    let file_bytes = u64::try_from(FILE_BYTES).unwrap_or(u64::MAX);
    let check = |bytes: u64, more: &str| {
        let problem = match bytes.cmp(&file_bytes) {
            Ordering::Equal => return Ok(()),
            Ordering::Less => "truncated",
            Ordering::Greater => "too long",
        };
        let expected = format!("{FILE_BYTES} bytes in all");
        Err(wrong(Place::Byte(bytes.min(file_bytes)), expected, format!("{bytes}{more} ({problem})")))
    };
    // If the length is known and wrong, the file is not read.
    file.length().map_or(Ok(()), |bytes| check(bytes, ""))?;
    let grid = match options.merl_bins {
        BinPosition::Center => HalfDifferenceGrid::merl_centers(),
        BinPosition::Edge => HalfDifferenceGrid::merl_edges(),
    };
    // Memory for the numbers is allocated only once a whole piece of them has been read, not because of what the
    // header says.
    let mut table = None;
    let bytes = file.words(HEADER_BYTES, PIECE, file_bytes, |words| {
        if words.len() == PIECE {
            table.get_or_insert_with(|| Table::new(grid.above_horizon())).take(words);
        }
    })?;
    check(bytes, if bytes > file_bytes { " or more" } else { "" })?;
    let (cells, values, dropped) = table.unwrap_or_else(|| Table::new(grid.above_horizon())).finish();
    Ok(Measurement {
        dropped,
        ..Measurement::of(
            ["r", "g", "b"].map(Channel::named).to_vec(),
            Directions::Grid { grid, cells },
            values,
        )
    })
}

/// Number of cells that differ only in phi_d.
const ROW: usize = HalfDifferenceGrid::DIMENSIONS[2];
/// Number of cells that are read at a time: whole rows, a whole number of pieces per plane, small enough for the
/// caches.
const PIECE: usize = 180 * ROW;

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

/// A table that is being read.
struct Table<'g> {
    above: &'g [bool],
    verdicts: Vec<Verdict>,
    /// f of the cells above the horizon, by channel.
    values: Vec<Vec<f64>>,
    /// Number of values read, all planes together.
    taken: usize,
}

impl<'g> Table<'g> {
    fn new(above: &'g [bool]) -> Self {
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
    fn take(&mut self, words: &[u64]) {
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
    fn finish(self) -> (Vec<u32>, Vec<Vec<f64>>, BTreeMap<&'static str, usize>) {
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

/// Writes a BRDF as a table: the red, green and blue of the subject, or its only channel three times.
fn write(subject: &Subject<'_>) -> Result<Written, Error> {
    if subject.grid.is_some() {
        return Err(Error::invalid("--grid", "no grid for a MERL table, which has its own", "one"));
    }
    let names: Vec<&str> = subject.channels.iter().map(|c| c.name.as_str()).collect();
    let planes = red_green_blue(&names).ok_or_else(|| {
        let expected = "the channels r, g and b, or one, for a MERL table; --rgb makes them of a spectrum";
        Error::invalid("--to", expected, excerpt(&names.join(", ")))
    })?;
    let mut losses = Vec::new();
    if subject.channels.len() == 1 {
        losses.push("the only channel was written three times, as r, g and b".to_owned());
    }
    if !subject.isotropic {
        losses.push("the table has no azimuth of the surface: values are those at phi_i = 0".to_owned());
    }
    let own = subject.measurement.and_then(|measurement| match &measurement.directions {
        Directions::Grid { cells, .. } => Some((measurement, cells)),
        Directions::Scattered(_) => None,
    });
    if own.is_none() {
        subject.check_channels()?;
        losses.extend(subject.gaps());
    }
    let (cells, rows, covered) = match own {
        Some((measurement, cells)) => (cells.clone(), measurement.values.clone(), vec![true; cells.len()]),
        None => {
            let grid = HalfDifferenceGrid::merl_centers();
            let cells = (0_u32..).zip(grid.above_horizon()).filter(|(_, above)| **above);
            let cells: Vec<u32> = cells.map(|(cell, _)| cell).collect();
            let pair = |cell: &u32| {
                let g = grid.geometry(*cell);
                Pair { wi: g.wi.into(), wo: g.wo.into() }
            };
            let pairs: Vec<Pair> = cells.iter().map(pair).collect();
            (cells, (subject.at)(&pairs), (subject.covered)(&pairs))
        }
    };
    let rgb = |index: usize| -> Option<[f64; 3]> {
        let value = |plane: usize| rows.get(plane)?.get(index).copied();
        let [r, g, b] = planes;
        Some([value(r)?, value(g)?, value(b)?])
    };
    let is_negative = |index: &usize| rgb(*index).is_some_and(|rgb| rgb.iter().any(|f| *f < 0.0));
    let lacks_one = |index: &usize| rgb(*index).is_some_and(|rgb| rgb.iter().any(|f| f.is_nan()));
    let incomplete = (0..cells.len()).filter(lacks_one).count();
    if incomplete > 0 {
        losses.push(format!("{incomplete} cells that lack a channel were marked as not measured"));
    }
    let negatives = (0..cells.len()).filter(is_negative).count();
    if negatives > 0 {
        losses.push(format!("{negatives} cells with negative values were marked as not measured"));
    }
    let outside = covered.iter().filter(|covered| !**covered).count();
    if outside > 0 {
        losses.push(format!(
            "{outside} of {} cells lie outside the measured directions and were marked as not measured",
            cells.len()
        ));
    }
    let bytes = encode(Path::new("the table"), |cell| {
        let index = cells.binary_search(&cell).ok().filter(|index| covered.get(*index) == Some(&true))?;
        rgb(index).filter(|rgb| rgb.iter().all(|f| *f >= 0.0))
    })?;
    Ok(Written { bytes, losses })
}

/// The bytes of a MERL table whose cells contain `value` (RGB, 1/sr), or -1 if that is `None`.
///
/// # Errors
/// [`Error::Malformed`] naming the file if a value is not finite.
pub fn encode(path: &Path, value: impl Fn(u32) -> Option<[f64; 3]>) -> Result<Vec<u8>, Error> {
    let mut planes: [Vec<u8>; 3] = std::array::from_fn(|_| Vec::with_capacity(FILE_BYTES / 3));
    for cell in (0_u32..).take(HalfDifferenceGrid::CELLS) {
        let stored = match value(cell) {
            None => [-1.0; 3],
            Some([r, g, b]) => {
                let [scale_r, scale_g, scale_b] = SCALES;
                [r / scale_r, g / scale_g, b / scale_b]
            }
        };
        if stored.iter().any(|v| !v.is_finite()) {
            let found = format!("NaN or infinity in cell {cell}");
            return Err(Error::malformed(path, Place::File, "finite values of the model", found));
        }
        for (plane, value) in planes.iter_mut().zip(stored) {
            plane.extend_from_slice(&value.to_le_bytes());
        }
    }
    let dimensions = [90_i32, 90, 180].map(i32::to_le_bytes).concat();
    Ok([dimensions, planes.concat()].concat())
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

    /// A straightforward implementation of the rules at the head of this file, cell by cell.
    fn plainly(
        above: &[bool],
        planes: &[Vec<f64>],
    ) -> (Vec<u32>, Vec<Vec<f64>>, BTreeMap<&'static str, usize>) {
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
