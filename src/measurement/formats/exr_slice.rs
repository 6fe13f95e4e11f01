//! OpenEXR images of a slice of a MERL table, as the documentation of ALTA shows them: columns are theta_h from 0 to 90 degrees,
//! rows from the bottom theta_d from 0 to 90 degrees, both linear in degrees, and phi_d is 90 degrees. Red, green and blue are
//! f in 1/sr; other channels are ignored.
//!
//! A pixel stands for the angles of its centre. That shows in ALTA's slice of red fabric: its values step where the cells of
//! the MERL table have their borders, at theta_h of i^2/90 and theta_d of j degrees, for centres of pixels alone.

use super::file::File;
use super::format::{Confidence, Format, ReadOptions};
use crate::error::{Error, Place, short};
use crate::geometry::{Directions, Pair};
use crate::measurement::{Channel, Measurement, Remark};
use exr::meta::MetaData;
use exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel, read as exr_reader};
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use std::io::Cursor;

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "exr",
    summary: "an OpenEXR slice over theta_h and theta_d",
    sniff,
    read,
    directions: None,
    several_materials: false,
    own_options: &[],
    knows_angles: false,
    extensions: &[],
    write: None,
};

/// The first bytes of an OpenEXR file.
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
/// The largest file that is read, bytes.
const MOST_BYTES: u64 = 100_000_000;
/// The largest number of pixels: 2048 x 2048, twenty for each cell of a slice in each direction.
const MOST_PIXELS: usize = 1 << 22;
/// The largest number of channels.
const MOST_CHANNELS: usize = 64;
/// How many bytes of pixels a byte of the file may stand for: no method shortens measured values that much.
const MOST_PER_BYTE: usize = 1100;

fn sniff(file: &File<'_>) -> Confidence {
    if file.head(4) == MAGIC { Confidence::Yes } else { Confidence::No }
}

/// The red, green and blue planes of an image that is being read, rows from the top.
struct Planes {
    width: usize,
    values: [Vec<f32>; 3],
}

fn read(file: &mut File<'_>, _: &ReadOptions) -> Result<Measurement, Error> {
    let bytes = file.bytes(MOST_BYTES)?;
    let wrong = |expected: String, found: String| Error::malformed(file.path, Place::File, expected, found);
    let refused = |error: exr::error::Error| {
        wrong("an OpenEXR image with channels R, G and B".to_owned(), short(&error.to_string()))
    };
    // The header is checked before anything is allocated for pixels.
    let headers = MetaData::read_from_buffered(Cursor::new(&bytes), false).map_err(refused)?.headers;
    let Some(header) = headers.first().filter(|header| headers.len() == 1 && !header.deep) else {
        return Err(wrong(
            "one layer of plain pixels".to_owned(),
            "several layers, or deep pixels".to_owned(),
        ));
    };
    let (width, height) = (header.layer_size.width(), header.layer_size.height());
    let size = format!("{width} x {height}");
    let pixels = width.saturating_mul(height);
    if pixels > MOST_PIXELS || pixels == 0 {
        return Err(wrong(format!("1 to {MOST_PIXELS} pixels"), size));
    }
    let channels = header.channels.list.len();
    if channels > MOST_CHANNELS {
        return Err(wrong(format!("at most {MOST_CHANNELS} channels"), channels.to_string()));
    }
    // Two bytes for each value at least.
    if pixels.saturating_mul(2 * channels) / MOST_PER_BYTE > bytes.len() {
        let found = format!("{size} in {} bytes", bytes.len());
        return Err(wrong(
            format!("at most {MOST_PER_BYTE} bytes of pixels for each byte of the file"),
            found,
        ));
    }
    let whole = header.shared_attributes.display_window.size;
    if (width, height) != (whole.width(), whole.height()) {
        let found = format!("{size} pixels of {} x {}", whole.width(), whole.height());
        return Err(wrong("an image of all angles".to_owned(), found));
    }
    for name in ["R", "G", "B"] {
        if !header.channels.list.iter().any(|channel| channel.name.eq(name)) {
            return Err(wrong("an OpenEXR image with channels R, G and B".to_owned(), format!("no {name}")));
        }
    }
    let image = exr_reader()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("R")
        .required("G")
        .required("B")
        .collect_pixels(
            |size, _| Planes { width: size.width(), values: std::array::from_fn(|_| vec![0.0; size.area()]) },
            |planes, at, (r, g, b): (f32, f32, f32)| {
                let index = at.y() * planes.width + at.x();
                for (plane, value) in planes.values.iter_mut().zip([r, g, b]) {
                    if let Some(pixel) = plane.get_mut(index) {
                        *pixel = value;
                    }
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(&bytes))
        .map_err(refused)?;
    let planes = image.layer_data.channel_data.pixels.values;
    for plane in &planes {
        if let Some(index) = plane.iter().position(|value| !value.is_finite()) {
            let found = format!("NaN or infinity in column {} of row {}", index % width, index / width);
            return Err(wrong("finite values".to_owned(), found));
        }
    }
    let what = "an OpenEXR image was taken as a slice of a half/difference table: columns theta_h, rows from the bottom theta_d, 0 \
                to 90 degrees, phi_d = 90 degrees, f in 1/sr";
    Ok(Measurement {
        remarks: vec![Remark::Assumed { what: what.to_owned() }],
        ..Measurement::of(
            ["r", "g", "b"].map(Channel::named).to_vec(),
            Directions::Scattered(slice(width, height)),
            planes.iter().map(|plane| plane.iter().copied().map(f64::from).collect()).collect(),
        )
    })
}

/// The directions of the pixels, rows from the top.
fn slice(width: usize, height: usize) -> Vec<Pair> {
    let halves: Vec<f64> = centres(width).collect();
    let mut differences: Vec<f64> = centres(height).collect();
    differences.reverse();
    let mut pairs = Vec::with_capacity(width.saturating_mul(height));
    for theta_d in differences {
        for theta_h in &halves {
            let ((sin_h, cos_h), (sin_d, cos_d)) = (theta_h.sin_cos(), theta_d.sin_cos());
            // Light and viewer on either side of the plane of normal and half vector.
            let wi = DVec3::new(sin_h * cos_d, sin_d, cos_h * cos_d);
            pairs.push(Pair { wi, wo: DVec3::new(wi.x, -wi.y, wi.z) });
        }
    }
    pairs
}

/// The centres of as many equal parts of a right angle.
fn centres(parts: usize) -> impl Iterator<Item = f64> {
    // An image is at most `MOST_PIXELS` wide.
    let whole = f64::from(u32::try_from(parts).unwrap_or(u32::MAX));
    (0_u32..).take(parts).map(move |part| (f64::from(part) + 0.5) / whole * FRAC_PI_2)
}
