//! MERL tables (`.binary`): Matusik et al. 2003, "A Data-Driven Reflectance Model",
//! doi:10.1145/882262.882343.
//!
//! Three little-endian 32-bit integers 90, 90, 180, then the red, green and blue planes as 64-bit floats
//! on the half/difference grid. Stored values times (1, 1.15, 1.66)/1500 are f in 1/sr. A negative cell
//! was not measured.

use super::{BinPosition, Confidence, File, Format, ReadOptions};
use crate::error::{Error, Place};
use crate::geometry::{Directions, HalfDifferenceGrid};
use crate::measurement::{Channel, Measurement, Source};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// f per stored unit, by channel.
pub const SCALES: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

const HEADER_BYTES: usize = 12;
const FILE_BYTES: usize = HEADER_BYTES + 3 * 8 * HalfDifferenceGrid::CELLS;

/// The format's line in the registry.
pub const FORMAT: Format = Format { name: "merl", summary: "a MERL table", sniff, read };

fn header(bytes: &[u8]) -> Option<[i32; 3]> {
    let mut integers =
        bytes.get(..HEADER_BYTES)?.chunks_exact(4).map(|word| word.try_into().map_or(0, i32::from_le_bytes));
    Some([integers.next()?, integers.next()?, integers.next()?])
}

fn sniff(file: &File<'_>) -> Confidence {
    let dimensions = header(file.bytes).map(|d| d.map(|n| usize::try_from(n).unwrap_or(0)));
    let named = file.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("binary"));
    if dimensions == Some(HalfDifferenceGrid::DIMENSIONS) {
        Confidence::Yes
    } else if named {
        Confidence::Maybe
    } else {
        Confidence::No
    }
}

fn read(file: &File<'_>, options: &ReadOptions) -> Result<Measurement, Error> {
    let [n_h, n_d, n_p] = HalfDifferenceGrid::DIMENSIONS;
    let expected_header = format!("the dimensions {n_h} x {n_d} x {n_p}");
    let wrong = |place, expected: String, found: String| Error::malformed(file.path, place, expected, found);
    // The header is compared, never multiplied or allocated from: it may hold anything.
    let Some(dimensions) = header(file.bytes) else {
        let found = format!("only {} bytes", file.bytes.len());
        return Err(wrong(Place::Byte(0), expected_header, found));
    };
    if dimensions.map(|n| usize::try_from(n).unwrap_or(0)) != HalfDifferenceGrid::DIMENSIONS {
        let found = dimensions.map(|n| n.to_string()).join(" x ");
        return Err(wrong(Place::Byte(0), expected_header, found));
    }
    if file.bytes.len() != FILE_BYTES {
        let problem = if file.bytes.len() < FILE_BYTES { "truncated" } else { "too long" };
        return Err(wrong(
            Place::Byte(u64::try_from(file.bytes.len().min(FILE_BYTES)).unwrap_or(u64::MAX)),
            format!("{FILE_BYTES} bytes in all"),
            format!("{} ({problem})", file.bytes.len()),
        ));
    }

    let body = file.bytes.get(HEADER_BYTES..).unwrap_or_default();
    let mut planes = body.chunks_exact(8 * HalfDifferenceGrid::CELLS);
    let mut plane = || planes.next().unwrap_or_default();
    let (red, green, blue) = (plane(), plane(), plane());
    let grid = Arc::new(HalfDifferenceGrid::merl(match options.merl_bins {
        BinPosition::Center => 0.5,
        BinPosition::Edge => 0.0,
    }));

    let mut cells: Vec<u32> = Vec::with_capacity(HalfDifferenceGrid::CELLS);
    let mut values: Vec<Vec<f64>> = (0..3).map(|_| Vec::with_capacity(HalfDifferenceGrid::CELLS)).collect();
    let mut dropped: BTreeMap<&'static str, usize> = BTreeMap::new();
    let stored = red.chunks_exact(8).zip(green.chunks_exact(8)).zip(blue.chunks_exact(8));
    for (cell, ((r, g), b)) in (0_u32..).zip(stored) {
        let rgb = [r, g, b].map(|bytes| bytes.try_into().map_or(f64::NAN, f64::from_le_bytes));
        let reason = if rgb.iter().any(|v| *v < 0.0) {
            Some("not-measured")
        } else if rgb.iter().any(|v| !v.is_finite()) {
            Some("not-finite")
        } else {
            let geometry = grid.geometry(cell);
            (geometry.cos_i() <= 0.0 || geometry.cos_o() <= 0.0).then_some("below-horizon")
        };
        if let Some(reason) = reason {
            *dropped.entry(reason).or_default() += 1;
            continue;
        }
        cells.push(cell);
        for ((plane, value), scale) in values.iter_mut().zip(rgb).zip(SCALES) {
            plane.push(value * scale);
        }
    }
    Ok(Measurement {
        source: Source::default(),
        channels: ["r", "g", "b"].map(Channel::named).to_vec(),
        directions: Directions::Grid { grid, cells },
        values,
        sigma: None,
        dropped,
        doubts: Vec::new(),
    })
}

/// The bytes of a MERL table whose cells hold `value` (RGB, 1/sr), and -1 where there is none.
///
/// # Errors
/// [`Error::Usage`] naming the file if a value is not finite.
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
            return Err(Error::Usage(format!("{}: the model is not finite in cell {cell}", path.display())));
        }
        for (plane, value) in planes.iter_mut().zip(stored) {
            plane.extend_from_slice(&value.to_le_bytes());
        }
    }
    let dimensions = [90_i32, 90, 180].map(i32::to_le_bytes).concat();
    Ok([dimensions, planes.concat()].concat())
}
