//! Writes MERL tables.

use super::sizes::{FILE_BYTES, SCALES};
use crate::error::{Error, Place, excerpt};
use crate::geometry::{Directions, HalfDifferenceGrid, Pair};
use crate::measurement::formats::writing::{Subject, Written};
use crate::measurement::red_green_blue;
use std::path::Path;

/// Writes a BRDF as a table: the red, green and blue of the subject, or its only channel three times.
pub fn write(subject: &Subject<'_>) -> Result<Written, Error> {
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
