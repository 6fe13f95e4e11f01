//! Images of a scene in linear RGB: radiance, differences between two images, and encoding as files.
//!
//! RGB has the primaries of ITU-R BT.709 and sRGB and the white of D65. Before an exposure is applied, 1 is the white of
//! the scene. docs/use/image.md has every formula.

#![allow(
    clippy::indexing_slicing,
    reason = "lengths are checked where they come in; an index beyond the end is a mistake in the program"
)]

mod colour;
mod colour_maps;
mod difference;
mod primaries;
mod target;
#[cfg(feature = "images")]
mod write;

pub use colour::{Illuminant, Route, ToRgb, luminance};
pub use colour_maps::{ColourMap, VIK, VIRIDIS};
pub use difference::{
    DeltaE2000, Differences, absolute_difference, ciede2000, delta_e_2000, differences, exposure, lab,
};
pub use primaries::{PRIMARIES, Primaries, REC709};
pub(crate) use target::ColourTarget;
#[cfg(feature = "plot")]
pub(crate) use write::decode;
#[cfg(feature = "images")]
pub use write::{exr, false_colour, in_rows, png, side_by_side};

use crate::error::Error;

/// An image: linear RGB per pixel, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width` times `height` pixels: red, green, blue.
    pub pixels: Vec<[f64; 3]>,
}

impl Image {
    /// Makes an image of these pixels.
    ///
    /// # Errors
    /// [`Error::Invalid`] if their number is not `width` times `height`, or if it is 0.
    pub fn new(width: usize, height: usize, pixels: Vec<[f64; 3]>) -> Result<Self, Error> {
        let image = Self { width, height, pixels };
        image.check().map(|()| image)
    }

    /// Checks that the number of pixels matches width and height, since the fields are public.
    fn check(&self) -> Result<(), Error> {
        let Self { width, height, .. } = self;
        let expected = width.checked_mul(*height).filter(|n| *n > 0);
        if expected == Some(self.pixels.len()) {
            return Ok(());
        }
        let found = self.pixels.len();
        let expected = format!("{width} x {height} pixels, at least one");
        Err(Error::invalid("image", expected, found.to_string()))
    }

    /// The image with every value multiplied by `exposure`.
    #[must_use]
    pub fn exposed(&self, exposure: f64) -> Self {
        let pixels = self.pixels.iter().map(|pixel| pixel.map(|value| value * exposure)).collect();
        Self { pixels, ..*self }
    }
}
