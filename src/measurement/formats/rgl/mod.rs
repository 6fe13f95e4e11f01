//! Adaptively parameterised measurements of the EPFL RGL material database (`.bsdf`): Dupuy and Jakob 2018, "An adaptive
//! parameterization for efficient material acquisition and rendering", doi:10.1145/3272127.3275059. <https://rgl.epfl.ch/materials>
//!
//! The layout is that of the database's own reader, <https://github.com/rgl-epfl/brdf-loader>, and of Mitsuba 3's plugin `measured`.
//! A file is a container of named arrays (tensor.rs):
//!
//! | field | numbers | content |
//! |---|---|---|
//! | `description` | n bytes | the material in words |
//! | `phi_i`, `theta_i` | n floats | directions of incidence, radians; one or two azimuths if the material is isotropic |
//! | `ndf` | 2 dimensions | density of normals by azimuth and polar angle |
//! | `sigma` | 2 dimensions | projected area of the normals seen from a direction |
//! | `vndf` | phi_i x theta_i x 2 dimensions | density of visible normals, which the directions follow |
//! | `luminance` | phi_i x theta_i x n x n | what is left to a renderer's random choice of directions |
//! | `rgb`, or `spectra` with `wavelengths` (nm) | phi_i x theta_i x channels x n x n | f cos(theta_o) 4 sigma/ndf |
//! | `jacobian` | 1 byte | 0 if `spectra` is f cos(theta_o) itself |
//!
//! The database's files also have `version` and `valid`. The bits of `valid` mark the nodes below the horizon in some files and those above
//! it in others; whether a node is above the horizon follows from its directions.

mod adaptive;
mod read;
mod tensor;
mod warp;
mod write;

use super::file::File;
use super::format::{Confidence, Format};

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "rgl",
    summary: "an RGL tensor file",
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
    let head = file.head(tensor::MAGIC.len());
    // A file that is cut off within its first word is still one of these, and so is one whose word is damaged at its end.
    if head.starts_with(b"tensor_") { Confidence::Yes } else { Confidence::No }
}
