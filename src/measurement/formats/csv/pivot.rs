//! Tables with a row for each wavelength become channels.

use crate::geometry::Pair;
use crate::measurement::formats::rows::Rows;
use crate::measurement::{Channel, Measurement};
use std::collections::HashMap;

/// The most channels: no instrument resolves more wavelengths.
const MOST_CHANNELS: usize = 100_000;
/// A table may become so many times as large, before it is taken for one whose wavelengths have nothing in common.
const LARGEST_GROWTH: usize = 64;
/// Tables of so many values may be as sparse as they like.
const SMALL: usize = 1 << 20;

/// A pair of directions as a key.
fn key(pair: &Pair) -> [u64; 6] {
    // Adding 0 makes -0 the same as 0.
    let bits = |x: f64| (x + 0.0).to_bits();
    let Pair { wi, wo } = pair;
    [wi.x, wi.y, wi.z, wo.x, wo.y, wo.z].map(bits)
}

/// The measurement of rows that hold the values of `columns` at one wavelength each, in nanometres. A direction that was measured
/// several times at one wavelength becomes several samples; wavelengths that a direction lacks are missing.
///
/// # Errors
/// What was expected and what was found, if hardly any direction has several wavelengths.
pub(super) fn by_wavelength(
    rows: Rows,
    wavelengths: &[f64],
    columns: &[Channel],
) -> Result<Measurement, (String, String)> {
    if wavelengths.is_empty() {
        return Ok(rows.measurement(columns.to_vec()));
    }
    let mut sorted = wavelengths.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    let places: HashMap<u64, usize> =
        sorted.iter().enumerate().map(|(place, nm)| (nm.to_bits(), place)).collect();

    // The sample of each row: the directions, and how often they came at this wavelength before.
    let mut directions: HashMap<[u64; 6], usize> = HashMap::new();
    let mut times: HashMap<(usize, usize), usize> = HashMap::new();
    let mut samples: HashMap<(usize, usize), usize> = HashMap::new();
    let mut pairs: Vec<Pair> = Vec::new();
    let mut of_rows: Vec<(usize, usize)> = Vec::with_capacity(rows.pairs.len());
    for (pair, nm) in rows.pairs.iter().zip(wavelengths) {
        let next = directions.len();
        let direction = *directions.entry(key(pair)).or_insert(next);
        let wavelength = places.get(&nm.to_bits()).copied().unwrap_or_default();
        let time = times.entry((direction, wavelength)).or_default();
        let sample = *samples.entry((direction, *time)).or_insert_with(|| {
            pairs.push(*pair);
            pairs.len() - 1
        });
        *time += 1;
        of_rows.push((sample, wavelength));
    }
    let channels = sorted.len() * columns.len();
    let most = SMALL.max(LARGEST_GROWTH.saturating_mul(wavelengths.len().saturating_mul(columns.len())));
    if channels > MOST_CHANNELS || channels.saturating_mul(pairs.len()) > most {
        let found = format!(
            "{} wavelengths in {} directions over {} rows",
            sorted.len(),
            directions.len(),
            wavelengths.len()
        );
        return Err(("wavelengths that share directions".to_owned(), found));
    }
    let spread = |of: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let mut spread = vec![vec![f64::NAN; pairs.len()]; channels];
        for (column, values) in of.iter().enumerate() {
            for ((sample, wavelength), value) in of_rows.iter().zip(values) {
                let cell =
                    spread.get_mut(wavelength * columns.len() + column).and_then(|row| row.get_mut(*sample));
                if let Some(cell) = cell {
                    *cell = *value;
                }
            }
        }
        spread
    };
    let complete = !rows.pairs.is_empty() && rows.sigma.iter().all(|row| row.len() == rows.pairs.len());
    let (values, sigma) = (spread(&rows.values), complete.then(|| spread(&rows.sigma)));
    let name = |nm: &f64, column: &Channel| match columns {
        [_] => Channel::at_wavelength(*nm),
        _ => Channel { name: format!("{nm}_{}", column.name), wavelength_nm: None },
    };
    let named = sorted.iter().flat_map(|nm| columns.iter().map(move |column| name(nm, column)));
    Ok(Measurement {
        sigma,
        dropped: rows.dropped,
        ..Measurement::of(named.collect(), crate::geometry::Directions::Scattered(pairs), values)
    })
}
