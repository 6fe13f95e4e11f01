//! A file on its way into memory.

use super::line_place;
use crate::error::Error;
use sha2::{Digest as _, Sha256};
use std::fmt::Write as _;
use std::io::Read;
use std::path::Path;

/// More than any format looks at to recognise itself.
const HEAD_BYTES: u64 = 65536;

/// A file that is read once, from its beginning to its end, and hashed on the way.
///
/// Its first bytes are there to recognise it by; a reader then takes all of it, as text or as numbers.
pub struct File<'a> {
    /// Its name as the user gave it.
    pub path: &'a Path,
    head: Vec<u8>,
    rest: Box<dyn Read + Send + 'a>,
    hash: Sha256,
}

impl<'a> File<'a> {
    /// Opens the file at `path`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn open(path: &'a Path) -> Result<Self, Error> {
        Self::new(path, std::fs::File::open(path).map_err(Error::read(path))?)
    }

    /// A file of any content, to be called `path` in errors.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read.
    pub fn new(path: &'a Path, mut content: impl Read + Send + 'a) -> Result<Self, Error> {
        let mut head = Vec::new();
        content.by_ref().take(HEAD_BYTES).read_to_end(&mut head).map_err(Error::read(path))?;
        Ok(Self { path, head, rest: Box::new(content), hash: Sha256::new() })
    }

    /// Its first bytes, at most `most` of them.
    #[must_use]
    pub fn head(&self, most: usize) -> &[u8] {
        self.head.get(..most).unwrap_or(&self.head)
    }

    /// All of it, without a byte-order mark.
    ///
    /// # Errors
    /// [`Error::Malformed`] at the first byte that is not UTF-8; [`Error::Io`].
    pub fn text(&mut self) -> Result<String, Error> {
        let mut bytes = std::mem::take(&mut self.head);
        self.rest.read_to_end(&mut bytes).map_err(Error::read(self.path))?;
        self.hash.update(&bytes);
        let text = String::from_utf8(bytes).map_err(|error| {
            let at = error.utf8_error().valid_up_to();
            let line = error.as_bytes().iter().take(at).filter(|b| **b == b'\n').count() + 1;
            let found = format!("a stray byte at offset {at}");
            Error::malformed(self.path, line_place(line), "text in UTF-8", found)
        })?;
        Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
    }

    /// Hands what follows the first `offset` bytes to `take`, `piece` words of 64 bits at a time as they stand
    /// in the file, and returns how many bytes the file has. What is left of a word at the end is not handed on.
    ///
    /// Each piece is hashed while it is taken and the next is read, so that no copy of the file is made.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn words(
        &mut self,
        offset: usize,
        piece: usize,
        mut take: impl FnMut(&[u64]) + Send,
    ) -> Result<u64, Error> {
        let Self { path, head, rest, hash } = self;
        let (before, begun) = head.split_at_checked(offset).unwrap_or((head, &[]));
        hash.update(before);
        let mut source = begun.chain(rest);
        let mut length = count(before.len());
        let (mut current, mut next) = (vec![0; piece], vec![0; piece]);
        let mut filled = fill(&mut source, &mut current).map_err(Error::read(path))?;
        while filled > 0 {
            length += count(filled);
            let ((), read) = rayon::join(
                || hash.update(bytemuck::cast_slice(&current).get(..filled).unwrap_or_default()),
                || {
                    take(current.get(..filled / size_of::<u64>()).unwrap_or_default());
                    fill(&mut source, &mut next)
                },
            );
            filled = read.map_err(Error::read(path))?;
            std::mem::swap(&mut current, &mut next);
        }
        Ok(length)
    }

    /// The SHA-256 of what was read, hexadecimal.
    #[must_use]
    pub fn sha256(self) -> String {
        self.hash.finalize().iter().fold(String::with_capacity(64), |mut text, byte| {
            // Writing to a string cannot fail.
            let _ = write!(text, "{byte:02x}");
            text
        })
    }
}

fn count(bytes: usize) -> u64 {
    u64::try_from(bytes).unwrap_or(u64::MAX)
}

/// Reads until `words` are full or the source is at its end; returns how many bytes there were.
fn fill(source: &mut impl Read, words: &mut [u64]) -> std::io::Result<usize> {
    let mut bytes: &mut [u8] = bytemuck::cast_slice_mut(words);
    let wanted = bytes.len();
    while !bytes.is_empty() {
        match source.read(bytes) {
            Ok(0) => break,
            Ok(n) => bytes = bytes.split_at_mut_checked(n).map_or(&mut [], |(_, left)| left),
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(wanted - bytes.len())
}
