//! Binary tables of the UTIA BRDF database (`.bin`): J. Filip, R. Vávra 2014, "Template-Based Sampling of Anisotropic BRDFs",
//! doi:10.1111/cgf.12477; <http://btf.utia.cas.cz/?brdf_dat_dwn>. The layout is that of A. Sztrajman's reader,
//! <https://github.com/asztr/UTIA-brdf>.
//!
//! No header: three planes (red, green, blue) of 288 x 288 little-endian 64-bit floats. A row is a direction of the light, a column one of
//! the viewer: the polar angle in steps of 15 degrees up to 75, then the azimuth in steps of 7.5 degrees, the azimuth faster. The size,
//! 1 990 656 bytes, and numbers of a plausible size are all that there is to recognise a file by.
//!
//! Readers agree that no cosine is in the numbers. They do not agree on the unit: some take them as they are, one decodes them as sRGB,
//! and `dj_brdf` (<https://github.com/jdupuy/dj_brdf>) has 100 times the decoding of a 140th, which is linear below 5. The numbers are taken
//! as f in 1/sr as they are, and a remark says so. Some are negative, which interpolation between the measured directions leaves behind;
//! they are kept.

use super::file::File;
use super::format::{Confidence, Format, ReadOptions};
use super::tabulated::{Listed, Tabulated};
use crate::error::{Error, Place};
use crate::geometry::{Pair, direction};
use crate::measurement::{Channel, Measurement, Remark};
use glam::DVec3;

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "utia",
    summary: "a UTIA table",
    sniff,
    read,
    directions: None,
    several_materials: false,
    own_options: &[],
    knows_angles: false,
    extensions: &[],
    write: None,
};

/// Number of polar angles of the light, or of the viewer, and degrees between them.
const POLAR: (u32, f64) = (6, 15.0);
/// Number of azimuths of the light, or of the viewer, and degrees between them.
const AZIMUTHS: (u32, f64) = (48, 7.5);
/// Number of directions of the light, or of the viewer.
const SIDE: usize = 288;
/// Number of values of one colour.
const PLANE: usize = SIDE * SIDE;
/// Number of bytes of a file.
const FILE_BYTES: u64 = 1_990_656;

/// Whether the beginning of a file is made of numbers that a BRDF may have.
fn plausible(head: &[u8]) -> bool {
    /// The fewest numbers that say something.
    const FEW: usize = 8;
    let mut numbers = head.chunks_exact(8).filter_map(|word| word.try_into().ok()).map(f64::from_le_bytes);
    let number = |v: f64| v == 0.0 || (1e-9..1e5).contains(&v.abs());
    head.len() >= 8 * FEW && numbers.clone().any(|v| v != 0.0) && numbers.all(number)
}

fn sniff(file: &File<'_>) -> Confidence {
    let whole = file.length() == Some(FILE_BYTES);
    let named = file.path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("bin"));
    match (plausible(file.head(65536)), whole) {
        (true, true) => Confidence::Yes,
        // Cut off, or of a length that is not known, or with a number that cannot be.
        (true, false) => Confidence::Maybe,
        (false, true) if named => Confidence::Maybe,
        _ => Confidence::No,
    }
}

fn read(file: &mut File<'_>, _: &ReadOptions) -> Result<Measurement, Error> {
    let path = file.path;
    let check = |bytes: u64| {
        let found = if bytes > FILE_BYTES { format!("{bytes} or more") } else { bytes.to_string() };
        let wrong =
            || Error::malformed(path, Place::File, format!("a UTIA table of {FILE_BYTES} bytes"), found);
        if bytes == FILE_BYTES { Ok(()) } else { Err(wrong()) }
    };
    // If the length is known and wrong, the file is not read.
    file.length().map_or(Ok(()), check)?;
    let mut values: Vec<f64> = Vec::new();
    let bytes = file.words(0, PLANE, FILE_BYTES, |words| {
        values.extend(words.iter().map(|word| f64::from_bits(u64::from_le(*word))));
    })?;
    check(bytes)?;
    if let Some(place) = values.iter().position(|value| !value.is_finite()) {
        let byte = u64::try_from(8 * place).unwrap_or(u64::MAX);
        return Err(Error::malformed(path, Place::Byte(byte), "a finite number", "NaN or infinity"));
    }
    let mut planes = values.chunks(PLANE).map(|plane| plane.iter().copied());
    let [r, g, b] = [(); 3].map(|()| planes.next().unwrap_or_default());
    let sides: Vec<DVec3> = sides().collect();
    let listed = Listed::all(sides.iter().copied());
    let lights = sides.iter().zip(&listed);
    let places = lights.flat_map(|light| sides.iter().zip(&listed).map(move |view| (light, view)));
    let mut table = Tabulated::new(3);
    for (((light, view), r), (g, b)) in places.zip(r).zip(g.zip(b)) {
        let twins = light.1.with(*view.1, SIDE);
        table.take(Pair { wi: *light.0, wo: *view.0 }, twins, &[r, g, b], |_| false);
    }
    let mut measurement = table.measurement(["r", "g", "b"].map(Channel::named).to_vec());
    let what = "the numbers of the file were taken as f in 1/sr; the database does not say their unit, so that shapes can be trusted more \
                than scales";
    measurement.remarks.push(Remark::Assumed { what: what.to_owned() });
    Ok(measurement)
}

/// The directions of one side, in the order of the file.
fn sides() -> impl Iterator<Item = DVec3> {
    let angles = |(number, step): (u32, f64)| (0..number).map(move |k| (f64::from(k) * step).to_radians());
    angles(POLAR).flat_map(move |theta| angles(AZIMUTHS).map(move |phi| direction(theta, phi)))
}
