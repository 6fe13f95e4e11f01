//! A file that is being read.

use super::rows::Part;
use crate::error::{Error, Place};
use encoding_rs::Encoding;
use encoding_rs_io::DecodeReaderBytesBuilder;
use flate2::read::MultiGzDecoder;
use sha2::{Digest as _, Sha256};
use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::Read;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// Number of bytes that are kept to recognise the format, more than any format needs.
const HEAD_BYTES: u64 = 65536;
/// Number of bytes of a text that are read and checked at a time.
const TEXT_PIECE: u64 = 1 << 20;
/// Number of bytes of a text that are passed on at a time, if it is passed on in pieces.
const LINES_PIECE: usize = 1 << 22;

/// The first bytes of a file compressed by gzip.
const GZIP: [u8; 2] = [0x1f, 0x8b];
/// The largest number of bytes that a compressed file may hold: more than any measurement, and less than would exhaust a machine.
const MOST_UNPACKED: u64 = 1 << 30;

/// A file that is read once, from beginning to end, and hashed on the way. A file compressed by gzip is unpacked as it is read, and the
/// hash is that of the file itself.
///
/// Its first bytes are available to recognise the format. A reader then takes all of it, as text or as numbers.
pub struct File<'a> {
    /// Its name as the user gave it.
    pub path: &'a Path,
    head: Vec<u8>,
    /// Locked so that threads may share the file; only one that has it to itself reads it.
    rest: Mutex<Box<dyn Read + Send + 'a>>,
    hash: Hash,
    /// Whether it is unpacked as it is read.
    is_packed: bool,
    /// Total number of bytes; `None` if that is not known beforehand.
    length: Option<u64>,
}

impl<'a> File<'a> {
    /// Opens the file at `path`.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be opened or read.
    pub fn open(path: &'a Path) -> Result<Self, Error> {
        if path.as_os_str() == "-" {
            return Self::new(path, std::io::stdin());
        }
        let file = std::fs::File::open(path).map_err(Error::read(path))?;
        // A pipe or a device also reports a length, but not that of its output.
        let length = file.metadata().ok().filter(std::fs::Metadata::is_file).map(|meta| meta.len());
        let opened = Self::new(path, file)?;
        // The length of a compressed or recoded file is not that of its content.
        let length = if opened.hash.is_of_source() { None } else { length };
        Ok(Self { length, ..opened })
    }

    /// A file with any content, called `path` in errors.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read.
    pub fn new(path: &'a Path, mut content: impl Read + Send + 'a) -> Result<Self, Error> {
        let head = beginning(&mut content).map_err(Error::read(path))?;
        let plain = Self {
            path,
            head,
            rest: Mutex::new(Box::new(content)),
            hash: Hash::default(),
            is_packed: false,
            length: None,
        };
        let unpacked = if plain.head.starts_with(&GZIP) {
            plain.through(true, |packed| {
                Box::new(Limited { inner: MultiGzDecoder::new(packed), left: MOST_UNPACKED })
            })?
        } else {
            plain
        };
        match utf16(&unpacked.head) {
            Some(encoding) => unpacked.through(false, |recoded| {
                let decoder = DecodeReaderBytesBuilder::new().encoding(Some(encoding)).build(recoded);
                Box::new(decoder)
            }),
            None => Ok(unpacked),
        }
    }

    /// The same file with its content passed through a decoder. The hash stays that of the bytes before.
    fn through(
        self,
        unpacks: bool,
        decoder: impl FnOnce(Box<dyn Read + Send + 'a>) -> Box<dyn Read + Send + 'a>,
    ) -> Result<Self, Error> {
        let Self { path, head, rest, hash, is_packed, length } = self;
        let rest = rest.into_inner().unwrap_or_else(PoisonError::into_inner);
        let content = std::io::Cursor::new(head).chain(rest);
        let (content, hash): (Box<dyn Read + Send + 'a>, Hash) = match hash {
            Hash::OfContent(hash) => {
                let hash = Arc::new(Mutex::new(hash));
                (Box::new(Hashed { inner: content, hash: Arc::clone(&hash) }), Hash::OfSource(hash))
            }
            of_source @ Hash::OfSource(_) => (Box::new(content), of_source),
        };
        let mut content = decoder(content);
        let is_packed = is_packed || unpacks;
        let head = beginning(&mut content).map_err(unreadable(path, is_packed))?;
        Ok(Self { path, head, rest: Mutex::new(content), hash, is_packed, length })
    }

    /// Its number of bytes; `None` if that is not known before it is read.
    #[must_use]
    pub fn length(&self) -> Option<u64> {
        self.length
    }

    /// Its first bytes, at most `most` of them.
    #[must_use]
    pub fn head(&self, most: usize) -> &[u8] {
        self.head.get(..most).unwrap_or(&self.head)
    }

    /// The first line that is neither blank nor a `#` comment, among its first bytes, at most `most` of them; trimmed, and without a
    /// byte-order mark.
    #[must_use]
    pub fn first_line(&self, most: usize) -> Option<String> {
        let head = String::from_utf8_lossy(self.head(most));
        let mut lines = head.trim_start_matches('\u{feff}').lines().map(str::trim);
        lines.find(|line| !line.is_empty() && !line.starts_with('#')).map(str::to_owned)
    }

    /// All of its content as text, without a byte-order mark.
    ///
    /// Reading stops at the first byte that cannot be text, so that a file that is not text is not read to its end.
    ///
    /// # Errors
    /// [`Error::Malformed`] at the first byte that is 0 or not UTF-8; [`Error::Io`] if the file cannot be read.
    pub fn text(&mut self) -> Result<String, Error> {
        self.with_text(|_, text| Ok(text.to_owned()))
    }

    /// What `read` makes of all of its content as text, like that of [`Self::text`]. The text is hashed meanwhile.
    ///
    /// # Errors
    /// The errors of [`Self::text`] and of `read`.
    pub fn with_text<T: Send>(
        &mut self,
        read: impl FnOnce(&Self, &str) -> Result<T, Error> + Send,
    ) -> Result<T, Error> {
        let bytes = self.checked()?;
        let text = std::str::from_utf8(&bytes).map_err(|error| self.no_text(&bytes, error.valid_up_to()))?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        self.beside_hashing(&bytes, |file| read(file, text))
    }

    /// What `read` makes of all of its content, which may be at most `most` bytes, like that of [`Self::bytes`]. The bytes are hashed
    /// meanwhile.
    ///
    /// # Errors
    /// The errors of [`Self::bytes`] and of `read`.
    pub fn with_bytes<T: Send>(
        &mut self,
        most: u64,
        read: impl FnOnce(&Self, &[u8]) -> Result<T, Error> + Send,
    ) -> Result<T, Error> {
        let bytes = self.all(most)?;
        self.beside_hashing(&bytes, |file| read(file, &bytes))
    }

    /// Passes all of its content to `take` as parts of a text that end where lines end. It is hashed meanwhile, and never in memory as a
    /// whole. A part that is not UTF-8 is taken to be in the encoding that older programs use, Windows-1252, in which every byte is a
    /// character; a CR alone ends a line, too.
    ///
    /// # Errors
    /// [`Error::Malformed`] at the first byte that is 0; [`Error::Io`] if the file cannot be read; the errors of `take`.
    pub(super) fn with_lines(
        &mut self,
        mut take: impl FnMut(Part<'_>) -> Result<(), Error> + Send,
    ) -> Result<(), Error> {
        // What was read and not yet passed on; how much of it was found to have no zero byte.
        let mut bytes = std::mem::take(&mut self.head);
        let (mut checked, mut is_end) = (0, false);
        // Where the last line that is complete ends.
        let mut last_line = None;
        let (mut line, mut is_first) = (1, true);
        loop {
            let new = bytes.get(checked..).unwrap_or_default();
            // It is faster to find out whether there is a zero byte than where it is.
            if new.contains(&0) {
                return Err(self.zero_byte(&bytes, line));
            }
            last_line = new.iter().rposition(|byte| *byte == b'\n').map(|at| checked + at + 1).or(last_line);
            checked = bytes.len();
            let end = match last_line {
                _ if is_end => bytes.len(),
                Some(end) if bytes.len() >= LINES_PIECE => end,
                _ => {
                    let room = LINES_PIECE.saturating_sub(bytes.len()).max(LINES_PIECE / 4);
                    let most = u64::try_from(room).unwrap_or(u64::MAX);
                    let (is_packed, path) = (self.is_packed, self.path);
                    self.rest().take(most).read_to_end(&mut bytes).map_err(unreadable(path, is_packed))?;
                    is_end = bytes.len() == checked;
                    continue;
                }
            };
            let whole = bytes.get(..end).unwrap_or_default();
            let text = text_of(whole);
            let text = if is_first { text.strip_prefix('\u{feff}').unwrap_or(&text) } else { &text };
            let part = Part::from_line(text, line);
            (line, is_first) = (part.next_number(), false);
            let mut hash = std::mem::take(&mut self.hash);
            let (result, ()) = rayon::join(|| take(part), || hash.update(whole));
            self.hash = hash;
            result?;
            if is_end {
                return Ok(());
            }
            bytes.drain(..end);
            (checked, last_line) = (checked - end, None);
        }
    }

    /// The error for a zero byte in lines that follow those before `line`.
    fn zero_byte(&self, bytes: &[u8], line: usize) -> Error {
        let before = bytes.iter().take_while(|byte| **byte != 0).filter(|byte| **byte == b'\n').count();
        let found = if is_utf16(bytes) { "text in UTF-16" } else { "a zero byte" };
        Error::malformed(self.path, Place::of_line(line + before), "text", found)
    }

    /// Hashes all of its content beside other work.
    fn beside_hashing<T: Send>(&mut self, bytes: &[u8], work: impl FnOnce(&Self) -> T + Send) -> T {
        let mut hash = std::mem::take(&mut self.hash);
        let file = &*self;
        let (result, ()) = rayon::join(|| work(file), || hash.update(bytes));
        self.hash = hash;
        result
    }

    /// What is left to read.
    fn rest(&mut self) -> &mut (dyn Read + Send + 'a) {
        self.rest.get_mut().unwrap_or_else(PoisonError::into_inner)
    }

    /// All of its content, each piece of which was found to be text.
    fn checked(&mut self) -> Result<Vec<u8>, Error> {
        let mut bytes = std::mem::take(&mut self.head);
        let mut checked = 0;
        loop {
            let new = bytes.get(checked..).unwrap_or_default();
            let (valid, stray) = match std::str::from_utf8(new) {
                Ok(_) => (new.len(), false),
                // A character that is cut off at the end of the piece may continue in the next one.
                Err(error) => (error.valid_up_to(), error.error_len().is_some()),
            };
            // It is faster to find out whether there is a zero byte than where it is.
            let text = new.get(..valid).filter(|text| text.contains(&0)).unwrap_or_default();
            let zero = text.iter().position(|byte| *byte == 0);
            if stray || zero.is_some() {
                return Err(self.no_text(&bytes, checked + zero.unwrap_or(valid)));
            }
            checked += valid;
            let before = bytes.len();
            let piece = self.rest().take(TEXT_PIECE).read_to_end(&mut bytes);
            piece.map_err(unreadable(self.path, self.is_packed))?;
            if bytes.len() == before {
                return Ok(bytes);
            }
        }
    }

    /// The error for a byte that cannot be part of a text.
    fn no_text(&self, bytes: &[u8], at: usize) -> Error {
        let line = bytes.iter().take(at).filter(|byte| **byte == b'\n').count() + 1;
        let found = if is_utf16(bytes) {
            "text in UTF-16".to_owned()
        } else if bytes.get(at) == Some(&0) {
            format!("a zero byte at offset {at}")
        } else {
            format!("a stray byte at offset {at}")
        };
        Error::malformed(self.path, Place::of_line(line), "text in UTF-8", found)
    }

    /// Passes what follows the first `offset` bytes to `take`, in pieces of `piece` 64-bit words as stored in the
    /// file, and returns the number of bytes in the file. An incomplete word at the end is not passed on. At most one
    /// byte more than `most` is read, which is enough to tell that the file is longer.
    ///
    /// Each piece is hashed while it is being taken and the next one is being read, so that no copy of the file is
    /// made.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read.
    pub fn words(
        &mut self,
        offset: usize,
        piece: usize,
        most: u64,
        mut take: impl FnMut(&[u64]) + Send,
    ) -> Result<u64, Error> {
        let Self { path, head, rest, hash, is_packed, .. } = self;
        let unreadable = unreadable(path, *is_packed);
        let (before, begun) = head.split_at_checked(offset).unwrap_or((head, &[]));
        hash.update(before);
        let mut length = count(before.len());
        let rest = rest.get_mut().unwrap_or_else(PoisonError::into_inner);
        let mut source = begun.chain(rest).take(most.saturating_add(1).saturating_sub(length));
        let mut current = vec![0; piece];
        let mut filled = fill(&mut source, &mut current).map_err(&unreadable)?;
        // A piece that is not full is the last one.
        let mut next = vec![0; if filled < size_of_val(current.as_slice()) { 0 } else { piece }];
        while filled > 0 {
            length += count(filled);
            let ((), read) = rayon::join(
                || hash.update(bytemuck::cast_slice(&current).get(..filled).unwrap_or_default()),
                || {
                    take(current.get(..filled / size_of::<u64>()).unwrap_or_default());
                    fill(&mut source, &mut next)
                },
            );
            filled = read.map_err(&unreadable)?;
            std::mem::swap(&mut current, &mut next);
        }
        Ok(length)
    }

    /// All of its content, which may be at most `most` bytes.
    ///
    /// Memory grows with what is read, not with what a file says about itself.
    ///
    /// # Errors
    /// [`Error::Malformed`] for a file that is longer; [`Error::Io`] if it cannot be read.
    pub fn bytes(&mut self, most: u64) -> Result<Vec<u8>, Error> {
        let bytes = self.all(most)?;
        self.hash.update(&bytes);
        Ok(bytes)
    }

    /// Like [`Self::bytes`], without the hash.
    fn all(&mut self, most: u64) -> Result<Vec<u8>, Error> {
        let mut bytes = std::mem::take(&mut self.head);
        let left = most.saturating_add(1).saturating_sub(count(bytes.len()));
        self.rest().take(left).read_to_end(&mut bytes).map_err(unreadable(self.path, self.is_packed))?;
        if count(bytes.len()) > most {
            let expected = format!("at most {most} bytes");
            return Err(Error::malformed(self.path, Place::Byte(most), expected, "more"));
        }
        Ok(bytes)
    }

    /// The SHA-256 of what was read, in hexadecimal.
    #[must_use]
    pub fn sha256(self) -> String {
        self.hash.finish().iter().fold(String::with_capacity(64), |mut text, byte| {
            // Writing to a string cannot fail.
            let _ = write!(text, "{byte:02x}");
            text
        })
    }
}

/// The first bytes of what is to be read.
fn beginning(content: &mut (impl Read + ?Sized)) -> std::io::Result<Vec<u8>> {
    let mut head = Vec::new();
    content.take(HEAD_BYTES).read_to_end(&mut head)?;
    Ok(head)
}

/// The encoding of a text that begins like UTF-16, with its byte-order mark and a character of a European alphabet.
fn utf16(head: &[u8]) -> Option<&'static Encoding> {
    match head {
        [0xff, 0xfe, low, high, ..] if *high < 5 && (*low, *high) != (0, 0) => Some(encoding_rs::UTF_16LE),
        [0xfe, 0xff, high, low, ..] if *high < 5 && (*low, *high) != (0, 0) => Some(encoding_rs::UTF_16BE),
        _ => None,
    }
}

/// The text that bytes are, with a line feed at every end of a line.
fn text_of(bytes: &[u8]) -> Cow<'_, str> {
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => encoding_rs::WINDOWS_1252.decode_without_bom_handling(bytes).0,
    };
    let has_lone_cr = text.contains('\r') && text.split('\r').skip(1).any(|after| !after.starts_with('\n'));
    if has_lone_cr { Cow::Owned(text.replace("\r\n", "\n").replace('\r', "\n")) } else { text }
}

/// The error for a file that cannot be read, or if it is compressed, not be unpacked.
fn unreadable(path: &Path, packed: bool) -> impl Fn(std::io::Error) -> Error {
    move |error| {
        if !packed {
            return Error::read(path)(error);
        }
        let expected = format!("data compressed by gzip, at most {} GiB once unpacked", MOST_UNPACKED >> 30);
        Error::malformed(path, Place::File, expected, error.to_string())
    }
}

/// The hash of a file.
enum Hash {
    /// Of the bytes as they are read.
    OfContent(Sha256),
    /// Of the bytes before they are unpacked or recoded, which the reader below keeps up to date.
    OfSource(Arc<Mutex<Sha256>>),
}

impl Default for Hash {
    fn default() -> Self {
        Self::OfContent(Sha256::new())
    }
}

impl Hash {
    fn is_of_source(&self) -> bool {
        matches!(self, Self::OfSource(_))
    }

    fn update(&mut self, bytes: &[u8]) {
        if let Self::OfContent(hash) = self {
            hash.update(bytes);
        }
    }

    fn finish(self) -> Vec<u8> {
        match self {
            Self::OfContent(hash) => hash.finalize().to_vec(),
            // A lock is poisoned only if a thread panicked while it held it, which none does.
            Self::OfSource(hash) => {
                hash.lock().map(|hash| hash.clone()).unwrap_or_default().finalize().to_vec()
            }
        }
    }
}

/// A reader whose bytes are hashed.
struct Hashed<R> {
    inner: R,
    hash: Arc<Mutex<Sha256>>,
}

impl<R: Read> Read for Hashed<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let n = self.inner.read(buffer)?;
        if let Ok(mut hash) = self.hash.lock() {
            hash.update(buffer.get(..n).unwrap_or_default());
        }
        Ok(n)
    }
}

/// A reader that fails instead of giving more than a number of bytes, so that a small file cannot fill the memory.
struct Limited<R> {
    inner: R,
    left: u64,
}

impl<R: Read> Read for Limited<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let n = self.inner.read(buffer)?;
        self.left = self.left.checked_sub(count(n)).ok_or_else(|| {
            std::io::Error::other(format!("more than {} GiB once unpacked", MOST_UNPACKED >> 30))
        })?;
        Ok(n)
    }
}

fn count(bytes: usize) -> u64 {
    u64::try_from(bytes).unwrap_or(u64::MAX)
}

/// Whether bytes begin like a text in UTF-16, with its byte-order mark.
pub(super) fn is_utf16(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff])
}

/// Reads until `words` are full or the source ends, and returns the number of bytes read.
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
