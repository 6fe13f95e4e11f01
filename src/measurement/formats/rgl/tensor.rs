//! The container: named arrays of numbers in one file, little-endian.
//!
//! | bytes | content |
//! |---|---|
//! | 12 | `tensor_file` and a zero byte |
//! | 2 | version, 1 and 0 |
//! | 4 | the number of fields |
//!
//! Each field follows as the length of its name (2 bytes), its name, the number of its dimensions (2), the type of its numbers (1), the
//! offset of its numbers in the file (8), and its size in each dimension (8 each). The last dimension is contiguous.

use crate::error::{Error, Place, excerpt};
use crate::measurement::formats::file::File;
use std::path::Path;

/// The first bytes of a file.
pub(super) const MAGIC: &[u8; 12] = b"tensor_file\0";
/// Number of bytes in which all fields must be described; those of the database need 412.
const MOST_HEADER: usize = 65536;
/// Number of bytes that may follow the last field: padding.
const MOST_PADDING: u64 = 4096;
/// The largest file that is read. The database's largest, of anisotropic materials with their spectra, are below 1 GB.
const MOST_BYTES: u64 = 4 << 30;
/// The largest number of dimensions of a field; those of the format have up to five.
const MOST_DIMENSIONS: u16 = 16;
/// Where the numbers of a field may begin, as a multiple.
const ALIGNMENT: usize = 8;

/// The type of a field's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Bytes.
    U8,
    /// 32-bit integers.
    U32,
    /// 32-bit floats.
    F32,
    /// Any other, by its number in the format and its size in bytes.
    Other(u8, u64),
}

impl Kind {
    fn of(number: u8) -> Option<Self> {
        Some(match number {
            1 => Self::U8,
            5 => Self::U32,
            10 => Self::F32,
            2 => Self::Other(number, 1),
            3 | 4 | 9 => Self::Other(number, 2),
            6 => Self::Other(number, 4),
            7 | 8 | 11 => Self::Other(number, 8),
            _ => return None,
        })
    }

    /// Its number in the format.
    fn number(self) -> u8 {
        match self {
            Self::U8 => 1,
            Self::U32 => 5,
            Self::F32 => 10,
            Self::Other(number, _) => number,
        }
    }

    /// Number of bytes of one number.
    fn size(self) -> u64 {
        match self {
            Self::U8 => 1,
            Self::U32 | Self::F32 => 4,
            Self::Other(_, size) => size,
        }
    }

    fn name(self) -> &'static str {
        match self.number() {
            1 => "8-bit unsigned integers",
            2 => "8-bit integers",
            3 => "16-bit unsigned integers",
            4 => "16-bit integers",
            5 => "32-bit unsigned integers",
            6 => "32-bit integers",
            7 => "64-bit unsigned integers",
            8 => "64-bit integers",
            9 => "16-bit floats",
            10 => "32-bit floats",
            _ => "64-bit floats",
        }
    }
}

/// What the header says about a field.
#[derive(Clone, Debug)]
pub(super) struct Field {
    /// Its name.
    pub(super) name: String,
    kind: Kind,
    shape: Vec<u64>,
    /// Where it is described in the file.
    described: u64,
    /// Where its numbers are in the file.
    offset: u64,
    /// Number of bytes of its numbers.
    bytes: u64,
}

/// The header of a file, checked against the size of the file as far as that is known.
#[derive(Debug)]
pub(super) struct Header<'a> {
    path: &'a Path,
    fields: Vec<Field>,
}

/// A place in the header that is being read.
struct Cursor<'a> {
    path: &'a Path,
    head: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn place(&self) -> Place {
        place(self.at)
    }

    fn take(&mut self, bytes: usize, what: &str) -> Result<&'a [u8], Error> {
        let taken = self.head.get(self.at..).and_then(|left| left.get(..bytes)).ok_or_else(|| {
            let end = if self.head.len() < MOST_HEADER {
                "the end of the file"
            } else {
                "more than 64 KiB of fields"
            };
            Error::malformed(self.path, self.place(), what, end)
        })?;
        self.at += bytes;
        Ok(taken)
    }

    /// The next unsigned integer of `BYTES` bytes.
    fn integer<const BYTES: usize>(&mut self, what: &str) -> Result<u64, Error> {
        let bytes = self.take(BYTES, what)?;
        Ok(bytes.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte)))
    }
}

fn place(at: usize) -> Place {
    Place::Byte(u64::try_from(at).unwrap_or(u64::MAX))
}

impl<'a> Header<'a> {
    /// Reads the header of a file.
    pub(super) fn read(file: &File<'a>) -> Result<Self, Error> {
        let path = file.path;
        let mut cursor = Cursor { path, head: file.head(MOST_HEADER), at: 0 };
        let magic = cursor.take(MAGIC.len(), "the 12 bytes 'tensor_file' and 0")?;
        if magic != MAGIC {
            let found = excerpt(&String::from_utf8_lossy(magic));
            return Err(Error::malformed(path, Place::Byte(0), "'tensor_file' and a zero byte", found));
        }
        let at = cursor.place();
        let version = cursor.take(2, "the version of the container")?;
        if version != [1, 0] {
            let version: Vec<String> = version.iter().map(u8::to_string).collect();
            return Err(Error::malformed(path, at, "version 1.0 of the container", version.join(".")));
        }
        let count = cursor.integer::<4>("the number of fields")?;
        let mut fields: Vec<Field> = Vec::new();
        for number in 1..=count {
            let field = field(&mut cursor, number, count)?;
            if fields.iter().any(|earlier| earlier.name == field.name) {
                let expected = "fields of different names";
                let found = format!("field {} twice", excerpt(&field.name));
                return Err(Error::malformed(path, Place::Byte(field.described), expected, found));
            }
            fields.push(field);
        }
        let end = u64::try_from(cursor.at).unwrap_or(u64::MAX);
        if let Some(field) = fields.iter().find(|field| field.bytes > 0 && field.offset < end) {
            let expected = format!("field {} behind the header, which has {end} bytes", excerpt(&field.name));
            let found = format!("offset {}", field.offset);
            return Err(Error::malformed(path, Place::Byte(field.described), expected, found));
        }
        let header = Self { path, fields };
        if let Some(bytes) = file.length() {
            header.check_length(bytes)?;
        }
        Ok(header)
    }

    /// Checks that a file of that many bytes holds all fields, and little more.
    fn check_length(&self, bytes: u64) -> Result<(), Error> {
        if let Some(field) = self.fields.iter().find(|field| field.end() > bytes) {
            let expected = format!("field {} within the {bytes} bytes of the file", excerpt(&field.name));
            let found = format!("{} bytes from byte {} (truncated)", field.bytes, field.offset);
            return Err(Error::malformed(self.path, Place::Byte(field.described), expected, found));
        }
        let end = self.end();
        if bytes > end.saturating_add(MOST_PADDING) {
            let found = format!("{bytes} or more (too long)");
            let expected = format!("a file of {end} bytes, where the last field ends");
            return Err(Error::malformed(self.path, Place::Byte(end), expected, found));
        }
        Ok(())
    }

    /// Where the last field ends.
    fn end(&self) -> u64 {
        self.fields.iter().map(Field::end).max().unwrap_or(0)
    }

    /// The field of that name, if there is one.
    pub(super) fn find(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.name == name)
    }

    /// The field of that name.
    pub(super) fn any(&self, name: &str) -> Result<&Field, Error> {
        self.find(name).ok_or_else(|| self.missing(&format!("a field '{name}'")))
    }

    /// The error for a field that is not there.
    pub(super) fn missing(&self, expected: &str) -> Error {
        let names: Vec<&str> = self.fields.iter().map(|field| field.name.as_str()).collect();
        let found = if names.is_empty() { "no field".to_owned() } else { excerpt(&names.join(", ")) };
        Error::malformed(self.path, Place::File, expected, found)
    }

    /// The field of that name with numbers of that type and `N` dimensions, each at least 1.
    pub(super) fn field<const N: usize>(
        &self,
        name: &str,
        kind: Kind,
    ) -> Result<(&Field, [usize; N]), Error> {
        let field = self.any(name)?;
        if field.kind != kind {
            let expected = format!("{} in field '{name}'", kind.name());
            return Err(self.wrong(field, &expected, field.kind.name()));
        }
        let sizes: Option<Vec<usize>> = field.shape.iter().map(|size| usize::try_from(*size).ok()).collect();
        let sizes =
            sizes.and_then(|sizes| <[usize; N]>::try_from(sizes).ok()).filter(|sizes| !sizes.contains(&0));
        let dimensions = if N == 1 { "1 dimension".to_owned() } else { format!("{N} dimensions") };
        let sizes = sizes.ok_or_else(|| {
            let expected = format!("field '{name}' with {dimensions}, none of them 0");
            self.wrong(field, &expected, &field.shown())
        })?;
        Ok((field, sizes))
    }

    /// The error for a field whose description is not what it should be.
    pub(super) fn wrong(&self, field: &Field, expected: &str, found: &str) -> Error {
        Error::malformed(self.path, Place::Byte(field.described), expected, found)
    }

    /// Reads the whole file, which must hold all fields.
    pub(super) fn content(self, file: &mut File<'a>) -> Result<Content<'a>, Error> {
        let most = self.end().saturating_add(MOST_PADDING);
        if most > MOST_BYTES {
            let expected = format!("a file of at most {MOST_BYTES} bytes");
            let found = format!("fields that end at byte {}", self.end());
            return Err(Error::malformed(self.path, Place::File, expected, found));
        }
        // One byte more is enough to tell that the file is too long.
        let bytes = file.bytes(most.saturating_add(1))?;
        self.check_length(u64::try_from(bytes.len()).unwrap_or(u64::MAX))?;
        Ok(Content { header: self, bytes })
    }
}

/// Reads the description of one field.
fn field(cursor: &mut Cursor<'_>, number: u64, count: u64) -> Result<Field, Error> {
    let what = |part: &str| format!("{part} of field {number} of {count}");
    let described = u64::try_from(cursor.at).unwrap_or(u64::MAX);
    let length = cursor.integer::<2>(&what("the length of the name"))?;
    let name = cursor.take(usize::try_from(length).unwrap_or(usize::MAX), &what("the name"))?;
    let name = String::from_utf8_lossy(name).into_owned();
    let wrong = |expected: String, found: String| {
        Error::malformed(cursor.path, Place::Byte(described), expected, found)
    };
    if name.is_empty() {
        return Err(wrong(what("a name"), "an empty one".to_owned()));
    }
    let what = |part: &str| format!("{part} of field {}", excerpt(&name));
    let path = cursor.path;
    let dimensions = cursor.integer::<2>(&what("the number of dimensions"))?;
    let number = cursor.integer::<1>(&what("the type"))?;
    let wrong =
        |expected: String, found: String| Error::malformed(path, Place::Byte(described), expected, found);
    let kind = u8::try_from(number).ok().and_then(Kind::of);
    let kind = kind.ok_or_else(|| wrong(what("a type between 1 and 11"), format!("type {number}")))?;
    if dimensions > u64::from(MOST_DIMENSIONS) {
        return Err(wrong(what("at most 16 dimensions"), dimensions.to_string()));
    }
    let offset = cursor.integer::<8>(&what("the offset"))?;
    let shape: Vec<u64> =
        (0..dimensions).map(|_| cursor.integer::<8>(&what("the shape"))).collect::<Result<_, _>>()?;
    let bytes = shape.iter().try_fold(kind.size(), |bytes, size| bytes.checked_mul(*size));
    let bytes = bytes.filter(|bytes| offset.checked_add(*bytes).is_some());
    let bytes = bytes.ok_or_else(|| {
        wrong(what("a size in bytes that fits into 64 bits"), format!("{} from byte {offset}", shown(&shape)))
    })?;
    Ok(Field { name, kind, shape, described, offset, bytes })
}

fn shown(shape: &[u64]) -> String {
    let sizes: Vec<String> = shape.iter().map(u64::to_string).collect();
    if sizes.is_empty() { "no dimension".to_owned() } else { sizes.join(" x ") }
}

impl Field {
    fn end(&self) -> u64 {
        self.offset.saturating_add(self.bytes)
    }

    /// Its sizes, for a message.
    pub(super) fn shown(&self) -> String {
        shown(&self.shape)
    }
}

/// A file that was read.
#[derive(Debug)]
pub(super) struct Content<'a> {
    pub(super) header: Header<'a>,
    bytes: Vec<u8>,
}

impl Content<'_> {
    /// The bytes of a field.
    pub(super) fn bytes(&self, field: &Field) -> &[u8] {
        let range = usize::try_from(field.offset).ok().zip(usize::try_from(field.end()).ok());
        // That they are within the file was checked when it was read.
        range.and_then(|(begin, end)| self.bytes.get(begin..end)).unwrap_or_default()
    }

    /// The numbers of a field of 32-bit floats, all of them finite.
    pub(super) fn floats(&self, field: &Field) -> Result<Vec<f32>, Error> {
        let bytes = self.bytes(field);
        let number = |word: &[u8]| f32::from_le_bytes(word.try_into().unwrap_or_default());
        let numbers: Vec<f32> = bytes.chunks_exact(4).map(number).collect();
        match numbers.iter().position(|number| !number.is_finite()) {
            None => Ok(numbers),
            Some(at) => {
                let expected = format!("finite numbers in field {}", excerpt(&field.name));
                let found = numbers.get(at).map_or_else(String::new, f32::to_string);
                Err(self.wrong(field, at, &expected, &found))
            }
        }
    }

    /// The error for one number of a field of 32-bit floats.
    pub(super) fn wrong(&self, field: &Field, at: usize, expected: &str, found: &str) -> Error {
        let at = u64::try_from(at).unwrap_or(u64::MAX).saturating_mul(4);
        Error::malformed(self.header.path, Place::Byte(field.offset.saturating_add(at)), expected, found)
    }
}

/// A field to be written.
pub(super) struct NewField<'a> {
    name: &'a str,
    kind: Kind,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl<'a> NewField<'a> {
    pub(super) fn bytes(name: &'a str, bytes: &[u8]) -> Self {
        Self { name, kind: Kind::U8, shape: vec![bytes.len()], bytes: bytes.to_owned() }
    }

    pub(super) fn integers(name: &'a str, numbers: &[u32]) -> Self {
        let bytes = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        Self { name, kind: Kind::U32, shape: vec![numbers.len()], bytes }
    }

    pub(super) fn floats(name: &'a str, shape: &[usize], numbers: &[f32]) -> Self {
        let bytes = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        Self { name, kind: Kind::F32, shape: shape.to_owned(), bytes }
    }
}

/// The bytes of a file with these fields.
pub(super) fn encode(fields: &[NewField<'_>]) -> Vec<u8> {
    let wide = |number: usize| u64::try_from(number).unwrap_or(u64::MAX).to_le_bytes();
    let short = |number: usize| u16::try_from(number).unwrap_or(u16::MAX).to_le_bytes();
    let described: usize = fields.iter().map(|field| 13 + field.name.len() + 8 * field.shape.len()).sum();
    let mut header = [MAGIC.as_slice(), &[1, 0]].concat();
    header.extend(u32::try_from(fields.len()).unwrap_or(u32::MAX).to_le_bytes());
    let mut offset = (header.len() + described).next_multiple_of(ALIGNMENT);
    let mut places = Vec::new();
    for field in fields {
        header.extend(short(field.name.len()));
        header.extend(field.name.as_bytes());
        header.extend(short(field.shape.len()));
        header.push(field.kind.number());
        header.extend(wide(offset));
        header.extend(field.shape.iter().flat_map(|size| wide(*size)));
        places.push(offset);
        offset = (offset + field.bytes.len()).next_multiple_of(ALIGNMENT);
    }
    let mut file = header;
    for (place, field) in places.into_iter().zip(fields) {
        file.resize(place, 0);
        file.extend(&field.bytes);
    }
    file
}
