//! Distant light from all directions, given by an OpenEXR image.
//!
//! The image is a latitude-longitude map with +z at its upper edge: the centre of column i and row j of W x H pixels lies at
//!
//! ```text
//! theta = pi (j + 1/2)/H from +z        phi = pi - 2 pi (i + 1/2)/W        wi = (sin theta cos phi, sin theta sin phi, cos theta)
//! ```
//!
//! so the middle of the image is the direction +x, and +y, which is to the left when looking along +x with +z up, is to the
//! left in the image.
//!
//! The density of the directions is proportional to the mean of the three channels times the solid angle: the cumulative
//! sum of this over the rows, and over the columns within a row, is inverted at the points of a lattice. Each direction
//! represents an equal share of the map's power and has the colour of its pixel, L/(n pdf), with pdf the pixel's mean
//! divided by the map's power.

use super::lights::{Lamp, lattice, sky};
#[cfg(feature = "images")]
use crate::error::short;
use crate::error::{Error, Place};
use crate::math::count;
#[cfg(feature = "images")]
use exr::meta::MetaData;
#[cfg(feature = "images")]
use exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel, read};
use glam::DVec3;
use std::f64::consts::{PI, TAU};
#[cfg(feature = "images")]
use std::io::Cursor;
use std::path::Path;

/// Largest size of a file, bytes.
pub(super) const MOST_BYTES: u64 = 128 << 20;
/// Largest number of pixels.
#[cfg(feature = "images")]
const MOST_PIXELS: usize = 4096 * 2048;
/// Largest number of channels, including those other than red, green and blue.
#[cfg(feature = "images")]
const MOST_CHANNELS: usize = 32;

/// Radiance by row and column.
struct Map {
    width: usize,
    pixels: Vec<[f32; 3]>,
}

/// The points of light that represent the map in the bytes of an EXR file, with its values multiplied by `scale`: one
/// list for each number of points in `samples`.
pub(super) fn lamps<const N: usize>(
    bytes: &[u8],
    path: &Path,
    scale: f64,
    samples: [u32; N],
) -> Result<[Vec<Lamp>; N], Error> {
    let map = map(bytes, path)?;
    Ok(samples.map(|samples| sampled(&map, scale, samples)))
}

fn sampled(map: &Map, scale: f64, samples: u32) -> Vec<Lamp> {
    let rows = map.pixels.len() / map.width;
    let edge = |row: usize| (PI * count(row) / count(rows)).cos();
    let solid_angle = |row: usize| TAU / count(map.width) * (edge(row) - edge(row + 1));
    let power: Vec<f64> = map
        .pixels
        .chunks(map.width)
        .enumerate()
        .map(|(row, pixels)| pixels.iter().map(mean).sum::<f64>() * solid_angle(row))
        .collect();
    let total: f64 = power.iter().sum();
    let mut lamps = Vec::new();
    // The first coordinate of the lattice is in ascending order, so the rows are traversed once.
    let (mut row, mut below) = (0, 0.0);
    let mut columns = cumulative(map, row);
    for (u, v) in lattice(samples) {
        let wanted = u * total;
        while let Some(here) = power.get(row).filter(|here| row + 1 < rows && below + **here <= wanted) {
            below += here;
            row += 1;
            columns.clear();
        }
        if columns.is_empty() {
            columns = cumulative(map, row);
        }
        let of_row = columns.last().copied().unwrap_or(0.0);
        let column = columns.partition_point(|sum| *sum <= v * of_row);
        let Some(pixel) = map.pixels.get(row * map.width + column.min(map.width - 1)) else { continue };
        let value = mean(pixel);
        let here = power.get(row).copied().unwrap_or(0.0);
        // Only rounding at the end of a row can select a pixel without light.
        if value <= 0.0 || here <= 0.0 {
            continue;
        }
        let before = column.checked_sub(1).and_then(|before| columns.get(before)).copied().unwrap_or(0.0);
        let down = ((wanted - below) / here).clamp(0.0, 1.0);
        let right = ((v * of_row - before) / value).clamp(0.0, 1.0);
        let cosine = edge(row) + (edge(row + 1) - edge(row)) * down;
        let share = scale * total / (value * f64::from(samples));
        lamps.push(Lamp::Far {
            to_light: sky(cosine, (count(column) + right) / count(map.width)),
            irradiance: DVec3::from_array(pixel.map(f64::from)) * share,
        });
    }
    lamps
}

fn mean(pixel: &[f32; 3]) -> f64 {
    pixel.iter().copied().map(f64::from).sum::<f64>() / 3.0
}

/// Cumulative sums of the channel means along a row, up to and including each column.
fn cumulative(map: &Map, row: usize) -> Vec<f64> {
    let pixels = map.pixels.chunks(map.width).nth(row).unwrap_or_default();
    let sums = pixels.iter().scan(0.0, |sum, pixel| {
        *sum += mean(pixel);
        Some(*sum)
    });
    sums.collect()
}

/// Fails: a build without the feature `images` cannot read the image.
#[cfg(not(feature = "images"))]
fn map(_: &[u8], path: &Path) -> Result<Map, Error> {
    let expected = "no environment map in a build without the feature `images`";
    Err(Error::malformed(path, Place::File, expected, "one"))
}

/// Reads the image. One that is too large is rejected before much memory is allocated.
#[cfg(feature = "images")]
fn map(bytes: &[u8], path: &Path) -> Result<Map, Error> {
    let wrong = |expected: String, found: String| Error::malformed(path, Place::File, expected, found);
    let refused = |error: exr::error::Error| {
        wrong("an OpenEXR image with channels R, G and B".to_owned(), short(&error.to_string()))
    };
    let headers = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(refused)?.headers;
    let Some(header) = headers.first().filter(|header| headers.len() == 1 && !header.deep) else {
        return Err(wrong(
            "one layer of plain pixels".to_owned(),
            "several layers, or deep pixels".to_owned(),
        ));
    };
    let (width, height) = (header.layer_size.width(), header.layer_size.height());
    if width.saturating_mul(height) > MOST_PIXELS {
        return Err(wrong(format!("at most {MOST_PIXELS} pixels"), format!("{width} x {height}")));
    }
    let whole = header.shared_attributes.display_window.size;
    if (width, height) != (whole.width(), whole.height()) {
        let found = format!("{width} x {height} pixels of {} x {}", whole.width(), whole.height());
        return Err(wrong("an image of all directions".to_owned(), found));
    }
    if header.channels.list.len() > MOST_CHANNELS {
        let found = header.channels.list.len().to_string();
        return Err(wrong(format!("at most {MOST_CHANNELS} channels"), found));
    }
    for name in ["R", "G", "B"] {
        if !header.channels.list.iter().any(|channel| channel.name.eq(name)) {
            return Err(wrong("an OpenEXR image with channels R, G and B".to_owned(), format!("no {name}")));
        }
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("R")
        .required("G")
        .required("B")
        .collect_pixels(
            |size, _| Map { width: size.width(), pixels: vec![[0.0; 3]; size.area()] },
            |map, at, (r, g, b): (f32, f32, f32)| {
                if let Some(pixel) = map.pixels.get_mut(at.y() * map.width + at.x()) {
                    *pixel = [r, g, b];
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(refused)?;
    let map = image.layer_data.channel_data.pixels;
    for (index, pixel) in map.pixels.iter().enumerate() {
        if let Some(value) = pixel.iter().find(|value| !value.is_finite() || **value < 0.0) {
            let found = format!("{value} in column {} of row {}", index % map.width, index / map.width);
            return Err(wrong("finite values, none below 0".to_owned(), found));
        }
    }
    if !map.pixels.iter().any(|pixel| mean(pixel) > 0.0) {
        return Err(wrong("a value above 0".to_owned(), "only zeros".to_owned()));
    }
    Ok(map)
}
