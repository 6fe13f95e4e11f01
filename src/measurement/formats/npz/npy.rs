//! Arrays of NumPy (`.npy`): <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.
//!
//! The bytes 93 `NUMPY`, a version, the length of the header, a header that is a Python dictionary with the type of the
//! elements (`descr`), their order (`fortran_order`) and the `shape`, then the elements. Nothing is ever unpickled.

use crate::error::{excerpt, short};
use std::io::Read;

/// The first bytes of an array.
pub(super) const MAGIC: &[u8] = b"\x93NUMPY";
/// The longest header: NumPy itself refuses more than 10000 characters.
const LONGEST_HEADER: u32 = 10_000;
/// Number of bytes read at a time.
const PIECE: usize = 1 << 16;

/// What is wrong with an array: what was expected, and what was found.
pub(super) struct Wrong {
    pub expected: String,
    pub found: String,
}

fn wrong<T>(expected: &str, found: impl Into<String>) -> Result<T, Wrong> {
    Err(Wrong { expected: expected.to_owned(), found: found.into() })
}

/// What may still be read, so that a small file cannot fill the memory.
pub(super) struct Budget {
    /// Bytes after decompression.
    pub bytes: u64,
    /// Numbers or characters kept.
    pub elements: u64,
}

/// The type of elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Float,
    Signed,
    Unsigned,
    Bytes,
    Unicode,
}

/// The header of an array.
#[derive(Debug)]
struct Header {
    kind: Kind,
    /// Bytes of an element.
    size: usize,
    big_endian: bool,
    fortran: bool,
    shape: Vec<usize>,
}

/// An array of numbers.
#[derive(Debug)]
pub(super) struct Numbers {
    pub shape: Vec<usize>,
    /// Whether the first index runs fastest.
    pub fortran: bool,
    pub data: Vec<f64>,
}

/// Reads an array of numbers.
pub(super) fn numbers(source: &mut impl Read, budget: &mut Budget) -> Result<Numbers, Wrong> {
    let header = header(source, budget)?;
    let extend: fn(&mut Vec<f64>, &[u8]) = match (header.kind, header.size) {
        (Kind::Float, 4) => |to, b| extend(to, b, |b| f64::from(f32::from_le_bytes(b))),
        (Kind::Float, 8) => |to, b| extend(to, b, f64::from_le_bytes),
        (Kind::Signed, 1) => |to, b| extend(to, b, |b| f64::from(i8::from_le_bytes(b))),
        (Kind::Signed, 2) => |to, b| extend(to, b, |b| f64::from(i16::from_le_bytes(b))),
        (Kind::Signed, 4) => |to, b| extend(to, b, |b| f64::from(i32::from_le_bytes(b))),
        (Kind::Signed, 8) => |to, b| extend(to, b, |b| long(b, |high| f64::from(i32::from_le_bytes(high)))),
        (Kind::Unsigned, 1) => |to, b| extend(to, b, |b| f64::from(u8::from_le_bytes(b))),
        (Kind::Unsigned, 2) => |to, b| extend(to, b, |b| f64::from(u16::from_le_bytes(b))),
        (Kind::Unsigned, 4) => |to, b| extend(to, b, |b| f64::from(u32::from_le_bytes(b))),
        (Kind::Unsigned, 8) => |to, b| extend(to, b, |b| long(b, |high| f64::from(u32::from_le_bytes(high)))),
        _ => return wrong("numbers (f4, f8, or integers)", "another type of elements"),
    };
    let mut data = Vec::new();
    elements(source, budget, &header, |bytes| extend(&mut data, bytes))?;
    Ok(Numbers { shape: header.shape, fortran: header.fortran, data })
}

/// Appends elements of N bytes.
fn extend<const N: usize>(to: &mut Vec<f64>, bytes: &[u8], element: impl Fn([u8; N]) -> f64) {
    to.extend(bytes.as_chunks().0.iter().map(|bytes| element(*bytes)));
}

/// Reads an array of texts.
pub(super) fn texts(source: &mut impl Read, budget: &mut Budget) -> Result<Vec<String>, Wrong> {
    let header = header(source, budget)?;
    if !matches!(header.kind, Kind::Bytes | Kind::Unicode) {
        return wrong("texts (a unicode or bytes array)", "numbers");
    }
    if header.shape.len() > 1 {
        return wrong("a list of texts", format!("{} dimensions", header.shape.len()));
    }
    let mut data: Vec<Option<String>> = Vec::new();
    let text = |bytes: &[u8]| {
        let text = if header.kind == Kind::Unicode {
            let characters = bytes.as_chunks().0.iter().copied().map(u32::from_le_bytes);
            characters.map(char::from_u32).collect::<Option<String>>()
        } else {
            std::str::from_utf8(bytes).ok().map(str::to_owned)
        };
        text.map(|text| text.trim_end_matches('\0').to_owned())
    };
    elements(source, budget, &header, |bytes| data.extend(bytes.chunks(header.size).map(text)))?;
    match data.into_iter().collect() {
        Some(texts) => Ok(texts),
        None => wrong("texts", "a character that does not exist"),
    }
}

/// A 64-bit integer, rounded to the nearest number that a float can be.
fn long([a, b, c, d, upper @ ..]: [u8; 8], high: impl Fn([u8; 4]) -> f64) -> f64 {
    high(upper) * 4_294_967_296.0 + f64::from(u32::from_le_bytes([a, b, c, d]))
}

/// Passes the elements to `take`, several at a time, as little-endian bytes. Memory grows with what is read.
fn elements(
    source: &mut impl Read,
    budget: &mut Budget,
    header: &Header,
    mut take: impl FnMut(&[u8]),
) -> Result<(), Wrong> {
    let number = header.shape.iter().try_fold(1_usize, |product, n| product.checked_mul(*n));
    let bytes = number.and_then(|number| number.checked_mul(header.size));
    let (Some(number), Some(total)) = (number, bytes) else {
        return wrong("an array that memory can hold", format!("shape {:?}", header.shape));
    };
    // A text keeps its characters, a number one element.
    let kept = if matches!(header.kind, Kind::Bytes | Kind::Unicode) { total } else { number };
    let (total64, kept) = (u64::try_from(total).unwrap_or(u64::MAX), u64::try_from(kept).unwrap_or(u64::MAX));
    if total64 > budget.bytes || kept > budget.elements {
        let expected = format!("at most {} more bytes and {} more elements", budget.bytes, budget.elements);
        return wrong(&expected, format!("{total64} bytes, shape {}", short(&format!("{:?}", header.shape))));
    }
    budget.bytes -= total64;
    budget.elements -= kept;
    if header.size == 0 {
        // Texts of no length take no bytes: there could be any number of them.
        return if number == 0 { at_end(source) } else { wrong("texts of at least one character", "none") };
    }
    // Whole elements, and whole characters of long ones.
    let piece = (PIECE / header.size).max(1).saturating_mul(header.size).min(total.max(1));
    let mut left = total;
    let mut buffer = Vec::new();
    while left > 0 {
        buffer.clear();
        let wanted = piece.min(left);
        let read = source.take(u64::try_from(wanted).unwrap_or(u64::MAX)).read_to_end(&mut buffer);
        if let Err(error) = read {
            return wrong("a sound array", short(&error.to_string()));
        }
        if buffer.len() < wanted {
            return wrong(&format!("{total} bytes of elements"), format!("{}", total - left + buffer.len()));
        }
        let word = if header.kind == Kind::Unicode { 4 } else { header.size };
        if header.big_endian && word > 1 && header.kind != Kind::Bytes {
            buffer.chunks_mut(word).for_each(<[u8]>::reverse);
        }
        take(&buffer);
        left -= wanted;
    }
    at_end(source)
}

/// Checks that nothing follows.
fn at_end(source: &mut impl Read) -> Result<(), Wrong> {
    match source.take(1).read_to_end(&mut Vec::new()) {
        Ok(0) => Ok(()),
        Ok(_) => wrong("the end of the array", "more bytes than its shape has"),
        Err(error) => wrong("a sound array", short(&error.to_string())),
    }
}

/// Reads as many bytes as there are in `into`.
fn exactly(source: &mut impl Read, into: &mut [u8]) -> Result<(), Wrong> {
    match source.read_exact(into) {
        Ok(()) => Ok(()),
        Err(error) => wrong("the header of a NumPy array", short(&error.to_string())),
    }
}

fn header(source: &mut impl Read, budget: &mut Budget) -> Result<Header, Wrong> {
    let mut start = [0; 8];
    exactly(source, &mut start)?;
    let [.., major, _] = start;
    if !start.starts_with(MAGIC) || !(1..=3).contains(&major) {
        return wrong("a NumPy array of version 1 to 3", "other bytes");
    }
    let length = if major == 1 {
        let mut length = [0; 2];
        exactly(source, &mut length)?;
        u32::from(u16::from_le_bytes(length))
    } else {
        let mut length = [0; 4];
        exactly(source, &mut length)?;
        u32::from_le_bytes(length)
    };
    if length > LONGEST_HEADER {
        return wrong(&format!("a header of at most {LONGEST_HEADER} bytes"), format!("{length}"));
    }
    budget.bytes = budget.bytes.saturating_sub(u64::from(length));
    let mut text = vec![0; usize::try_from(length).unwrap_or_default()];
    exactly(source, &mut text)?;
    let text = String::from_utf8_lossy(&text);
    Dictionary { rest: &text }.header()
}

/// A Python dictionary that is being read.
struct Dictionary<'t> {
    rest: &'t str,
}

impl<'t> Dictionary<'t> {
    /// The whole header.
    fn header(mut self) -> Result<Header, Wrong> {
        let whole = self.rest;
        let parsed = self.pairs();
        match parsed {
            Some((Some(descr), Some(fortran), Some(shape))) => {
                let (kind, size, big_endian) = element_type(descr)?;
                Ok(Header { kind, size, big_endian, fortran, shape })
            }
            _ if whole.contains("'descr': [") => {
                wrong("an array of one number per element", "an array of records")
            }
            _ => wrong("a header with descr, fortran_order and shape", excerpt(whole.trim())),
        }
    }

    #[expect(clippy::type_complexity, reason = "the three parts of a header, each of which may be missing")]
    fn pairs(&mut self) -> Option<(Option<&'t str>, Option<bool>, Option<Vec<usize>>)> {
        let (mut descr, mut fortran, mut shape) = (None, None, None);
        self.skip('{').then_some(())?;
        while !self.skip('}') {
            let key = self.quoted()?;
            self.skip(':').then_some(())?;
            match key {
                "descr" => descr = Some(self.quoted()?),
                "fortran_order" => fortran = Some(self.word()? == "True"),
                "shape" => shape = Some(self.tuple()?),
                _ => return None,
            }
            self.skip(',');
        }
        Some((descr, fortran, shape))
    }

    /// Passes over a character, if it comes next.
    fn skip(&mut self, character: char) -> bool {
        self.rest = self.rest.trim_start();
        self.rest.strip_prefix(character).map(|rest| self.rest = rest).is_some()
    }

    fn quoted(&mut self) -> Option<&'t str> {
        let quote = ['\'', '"'].into_iter().find(|quote| self.skip(*quote))?;
        let (text, rest) = self.rest.split_once(quote)?;
        self.rest = rest;
        Some(text)
    }

    fn word(&mut self) -> Option<&'t str> {
        self.rest = self.rest.trim_start();
        let end = self.rest.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at_checked(end)?;
        self.rest = rest;
        (!word.is_empty()).then_some(word)
    }

    fn tuple(&mut self) -> Option<Vec<usize>> {
        self.skip('(').then_some(())?;
        let mut numbers = Vec::new();
        while !self.skip(')') {
            // Python 2 wrote an L behind some integers.
            numbers.push(self.word()?.trim_end_matches('L').parse().ok()?);
            self.skip(',');
        }
        Some(numbers)
    }
}

/// The kind and size of elements, and whether they are big-endian.
fn element_type(descr: &str) -> Result<(Kind, usize, bool), Wrong> {
    let supported = "elements of type f4, f8, i1 to i8, u1 to u8, U or S";
    let mut characters = descr.chars();
    let (order, kind) = (characters.next(), characters.next());
    let size = characters.as_str().parse::<usize>().ok();
    let big_endian = order == Some('>');
    if kind == Some('O') || order == Some('O') {
        return wrong(supported, "an array of Python objects, which would have to be unpickled");
    }
    match (order, kind, size) {
        (Some('<' | '>' | '|'), Some('f'), Some(size @ (4 | 8))) => Ok((Kind::Float, size, big_endian)),
        (Some('<' | '>' | '|'), Some('i'), Some(size @ (1 | 2 | 4 | 8))) => {
            Ok((Kind::Signed, size, big_endian))
        }
        (Some('<' | '>' | '|'), Some('u'), Some(size @ (1 | 2 | 4 | 8))) => {
            Ok((Kind::Unsigned, size, big_endian))
        }
        (Some('<' | '>' | '|'), Some('S'), Some(size)) => Ok((Kind::Bytes, size, big_endian)),
        (Some('<' | '>'), Some('U'), Some(size)) if size < usize::MAX / 4 => {
            Ok((Kind::Unicode, 4 * size, big_endian))
        }
        _ => wrong(supported, excerpt(descr)),
    }
}

/// An array of this type and shape, with elements as bytes.
fn array(descr: &str, shape: &str, elements: impl Iterator<Item = u8>) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}");
    // The elements begin at a multiple of 64 bytes, a line end before them.
    let padding = (64 - (MAGIC.len() + 4 + header.len() + 1) % 64) % 64;
    let length = u16::try_from(header.len() + padding + 1).unwrap_or(u16::MAX);
    let mut bytes = [MAGIC, &[1, 0], &length.to_le_bytes(), header.as_bytes()].concat();
    bytes.resize(bytes.len() + padding, b' ');
    bytes.push(b'\n');
    bytes.extend(elements);
    bytes
}

/// An array of 64-bit floats, of that many rows and, if they are not lists, columns.
pub(super) fn floats(shape: &[usize], data: impl Iterator<Item = f64>) -> Vec<u8> {
    let shape: String = shape.iter().map(|n| format!("{n}, ")).collect();
    array("<f8", shape.trim_end(), data.flat_map(f64::to_le_bytes))
}

/// An array of texts.
pub(super) fn strings<Text: AsRef<str>>(texts: &[Text]) -> Vec<u8> {
    let longest = texts.iter().map(|text| text.as_ref().chars().count()).max().unwrap_or(0).max(1);
    let characters = |text: &str| {
        let characters: Vec<u32> = text.chars().map(u32::from).collect();
        let padding = longest - characters.len();
        characters
            .into_iter()
            .chain(std::iter::repeat_n(0, padding))
            .flat_map(u32::to_le_bytes)
            .collect::<Vec<u8>>()
    };
    let shape = format!("{},", texts.len());
    array(&format!("<U{longest}"), &shape, texts.iter().flat_map(|text| characters(text.as_ref())))
}
