//! Zemax's tabular BSDF (`.bsdf`), which Radiant Imaging introduced as its "BSDF data interchange format": R. Rykowski 2008, "Zemax
//! Tabular BSDF data file format", <https://support.zemax.com/hc/en-us/articles/1500005486801>.
//!
//! `#` comments, then keywords with a word or with a list of angles in degrees, then for each channel and each sample rotation and
//! angle of incidence the total integrated scatter (`TIS`) and one line per azimuth with a value per radial angle. `specular` says how
//! azimuth and radial angle are counted. Values are f in 1/sr: f cos(theta_o) over a block of a measured file sums up to its TIS, and
//! neither the values themselves nor the opposite direction of azimuth 0 do.
//!
//! | keyword | then |
//! |---|---|
//! | `Source` | `Measured`; ignored |
//! | `Symmetry` | `PlaneSymmetrical`: azimuths up to 180 degrees stand for both sides; `Asymmetrical`; `Asymmetrical4D` |
//! | `SpectralContent` | `Monochrome` or `XYZ`; `RGB` is read, too |
//! | `ScatterType` | `BRDF`; a file of `BTDF` is refused |
//! | `SampleRotation`, `AngleOfIncidence`, `ScatterAzimuth`, `ScatterRadial` | the number of angles, and the angles on the next line |
//!
//! The rotation of the sample is taken as the azimuth of the light. A direction below the horizon is left out, and so is a value of 0,
//! which fills up the places that an instrument does not reach.

mod keywords;
mod read;
mod write;

use self::keywords::{LISTS, WORDS, is};
use super::file::File;
use super::format::{Confidence, Format};

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "zemax",
    summary: "a Zemax tabular BSDF",
    sniff,
    read: read::read,
    directions: None,
    several_materials: false,
    own_options: &[],
    knows_angles: false,
    extensions: &["bsdf"],
    write: Some(write::write),
};

fn sniff(file: &File<'_>) -> Confidence {
    if file.head(65536).contains(&0) {
        return Confidence::No;
    }
    let first = file.first_line(65536);
    let words: Vec<&str> = first.as_deref().unwrap_or_default().split_whitespace().take(3).collect();
    match words.as_slice() {
        [keyword, _] if WORDS.iter().chain(&LISTS).any(|known| is(keyword, known)) => Confidence::Yes,
        _ => Confidence::No,
    }
}
