//! Surface scattering distribution data (SSDD, `.ssdd`), versions 0.1 to 0.3, of the library libbsdf: R. Kimura 2026, "Surface scattering
//! distribution data (SSDD) file format", <https://github.com/KimuraRyo/libbsdf/blob/master/doc/SsddFileFormatSpecification.md>.
//!
//! `VERSION` and words about the file, then up to four blocks, each of lines with a keyword and its words, the last of which is `DATA
//! ascii` or `DATA binary`, and of a table: one colour per place, the first parameter fastest. Binary numbers are 32-bit floats, little
//! endian. Values of a BRDF are f in 1/sr.
//!
//! | parameterisation | light | view |
//! |---|---|---|
//! | `spherical_coordinate_system` | theta_i, phi_i | theta_o, phi_o |
//! | `specular_coordinate_system` | theta_i, phi_i | angles about the mirror direction: see `specular` |
//! | `half_difference_coordinate_system` | theta_h, phi_h | theta_d, phi_d of the light about the half vector |
//! | `distorted_spherical_coordinate_system` | theta_i, phi_i | a disk whose centre is the mirror direction and whose edge is the horizon |
//!
//! Of a surface without grain the second parameter is left out. Half of a table that follows by symmetry in the plane of incidence or by
//! reciprocity may be left out (`REDUCTION_TYPE`); the samples are those of the file, and the others are not made up.

mod parameters;
mod read;
mod write;

use super::file::File;
use super::format::{Confidence, Format};

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "ssdd",
    summary: "SSDD (VERSION 0.x)",
    sniff,
    read: read::read,
    directions: None,
    several_materials: false,
    own_options: &[],
    knows_angles: false,
    extensions: &["ssdd"],
    write: Some(write::write),
};

fn sniff(file: &File<'_>) -> Confidence {
    // A table of numbers may follow that is no text.
    let first = file.first_line(65536);
    let words: Vec<&str> = first.as_deref().unwrap_or_default().split_whitespace().take(3).collect();
    match words.as_slice() {
        ["VERSION", number] if number.starts_with(|c: char| c.is_ascii_digit()) => Confidence::Yes,
        ["VERSION", ..] => Confidence::Maybe,
        _ => Confidence::No,
    }
}
