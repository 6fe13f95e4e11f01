//! Reads a measurement from a file.

use super::Measurement;
use super::formats::{ReadOptions, read};
use crate::error::Error;
use std::path::Path;

impl Measurement {
    /// Reads a file in any of the formats of docs/use/formats.md, such as MERL tables and CSV. The
    /// format is recognised by the content; [`formats::read`](super::formats::read) can be given one instead.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read; [`Error::Malformed`], which says where, if it is not in a known
    /// format or does not contain what its format requires.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        read(path.as_ref(), None, &ReadOptions::default())
    }
}
