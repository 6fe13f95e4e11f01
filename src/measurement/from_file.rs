//! A measurement from a file.

use super::Measurement;
use super::formats::{ReadOptions, read};
use crate::error::Error;
use std::path::Path;

impl Measurement {
    /// Reads a file in any of the formats that are known: MERL tables, text tables of the Cornell gonioreflectometer, CSV. The
    /// format is recognised by the content. [`formats::read`](super::formats::read) can be told one.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read; [`Error::Malformed`], which says where, if it is of no known format or does not
    /// hold what its format says.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        read(path.as_ref(), None, &ReadOptions::default())
    }
}
