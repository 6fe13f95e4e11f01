//! MERL tables (`.binary`): Matusik et al. 2003, "A Data-Driven Reflectance Model",
//! doi:10.1145/882262.882343.
//!
//! Three little-endian 32-bit integers 90, 90, 180, then the red, green and blue planes as 64-bit floats
//! on the half/difference grid. Stored values times (1, 1.15, 1.66)/1500 are f in 1/sr. A negative cell
//! was not measured.
//!
//! Tables of other programs may have 32-bit floats or big-endian numbers, which are read, too (`numbers`). Other layouts are read as MERL's
//! and doubted (`layout`).

mod layout;
mod numbers;
mod sizes;
mod table;
mod write;

pub use sizes::SCALES;
pub use write::encode;

use super::file::File;
use super::format::{BinPosition, Confidence, Format, ReadOptions};
use crate::error::{Error, Place};
use crate::geometry::{Directions, HalfDifferenceGrid};
use crate::measurement::{Channel, Measurement, Remark, TablePart};
use numbers::{ByteOrder, Numbers, Width};
use sizes::{FILE_BYTES, HEADER_BYTES, SINGLE_FILE_BYTES};
use table::PIECE;

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "merl",
    summary: "a MERL table",
    sniff,
    read,
    directions: None,
    several_materials: false,
    own_options: &[],
    knows_angles: false,
    extensions: &["binary"],
    write: Some(write::write),
};

/// The three integers at the beginning, in a byte order. `None` if there are fewer bytes.
fn header(bytes: &[u8], order: ByteOrder) -> Option<[i32; 3]> {
    let integer = |word: &[u8]| word.try_into().map_or(0, |word| order.integer(word));
    let mut integers = bytes.get(..HEADER_BYTES)?.chunks_exact(4).map(integer);
    Some([integers.next()?, integers.next()?, integers.next()?])
}

/// The byte order in which a header has the dimensions of a table. `None` if it has other dimensions.
fn header_order(bytes: &[u8]) -> Option<ByteOrder> {
    let is_table = |order: &ByteOrder| {
        let dimensions = header(bytes, *order).map(|d| d.map(|n| usize::try_from(n).unwrap_or(0)));
        dimensions == Some(HalfDifferenceGrid::DIMENSIONS)
    };
    [ByteOrder::Little, ByteOrder::Big].into_iter().find(is_table)
}

fn sniff(file: &File<'_>) -> Confidence {
    let named = file.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("binary"));
    if header_order(file.head(HEADER_BYTES)).is_some() {
        Confidence::Yes
    } else if named {
        Confidence::Maybe
    } else {
        Confidence::No
    }
}

fn read(file: &mut File<'_>, options: &ReadOptions) -> Result<Measurement, Error> {
    let [n_h, n_d, n_p] = HalfDifferenceGrid::DIMENSIONS;
    let expected_header = format!("the dimensions {n_h} x {n_d} x {n_p}");
    let path = file.path;
    let wrong = |place, expected: String, found: String| Error::malformed(path, place, expected, found);
    // The header is only compared and never used in a multiplication or an allocation, because it may contain
    // anything.
    let head = file.head(HEADER_BYTES);
    let Some(dimensions) = header(head, ByteOrder::Little) else {
        return Err(wrong(Place::Byte(0), expected_header, format!("only {} bytes", head.len())));
    };
    let Some(header_order) = header_order(head) else {
        let found = dimensions.map(|n| n.to_string()).join(" x ");
        return Err(wrong(Place::Byte(0), expected_header, found));
    };
    let [file_bytes, single_file_bytes] =
        [FILE_BYTES, SINGLE_FILE_BYTES].map(|bytes| u64::try_from(bytes).unwrap_or(u64::MAX));
    let width_of = |bytes: u64, more: &str| {
        if bytes == file_bytes {
            return Ok(Width::Double);
        }
        if bytes == single_file_bytes {
            return Ok(Width::Single);
        }
        let problem = if bytes < file_bytes { "truncated" } else { "too long" };
        let expected = format!("{FILE_BYTES} bytes in all, or {SINGLE_FILE_BYTES} with 32-bit floats");
        Err(wrong(Place::Byte(bytes.min(file_bytes)), expected, format!("{bytes}{more} ({problem})")))
    };
    // If the length is known and wrong, the file is not read.
    let width = file.length().map(|bytes| width_of(bytes, "")).transpose()?;
    let grid = match options.merl_bins {
        BinPosition::Center => HalfDifferenceGrid::merl_centers(),
        BinPosition::Edge => HalfDifferenceGrid::merl_edges(),
    };
    // Memory for the numbers is allocated only once many of them have been read, not because of what the header says.
    let mut numbers = Numbers::new(width, &grid);
    let bytes = file.words(HEADER_BYTES, PIECE, file_bytes, |words| numbers.take(words))?;
    width_of(bytes, if bytes > file_bytes { " or more" } else { "" })?;
    let read = numbers.finish();
    let mut remarks = Vec::new();
    if read.width == Width::Single {
        remarks.push(Remark::SinglePrecision);
    }
    let part = match (header_order, read.order) {
        (ByteOrder::Little, ByteOrder::Little) => None,
        (ByteOrder::Big, ByteOrder::Little) => Some(TablePart::Header),
        (ByteOrder::Little, ByteOrder::Big) => Some(TablePart::Numbers),
        (ByteOrder::Big, ByteOrder::Big) => Some(TablePart::Whole),
    };
    remarks.extend(part.map(|part| Remark::BigEndian { part }));
    let (cells, values, dropped) = read.table;
    Ok(Measurement {
        dropped,
        doubts: read.doubts,
        remarks,
        ..Measurement::of(
            ["r", "g", "b"].map(Channel::named).to_vec(),
            Directions::Grid { grid, cells },
            values,
        )
    })
}
