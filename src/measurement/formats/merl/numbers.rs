//! The numbers of a MERL table as they are stored: 32-bit or 64-bit floats, little-endian or big-endian.
//!
//! The length of the file decides between 32 and 64 bits. The header does not decide about the byte order, because
//! some programs write little-endian integers before big-endian numbers: the numbers themselves do. Numbers read in
//! the wrong order are absurdly large or small, or negative.

use super::layout::Layout;
use super::sizes::{HEADER_BYTES, SINGLE_FILE_BYTES};
use super::table::{Contents, PIECE, Table};
use crate::geometry::HalfDifferenceGrid;
use crate::measurement::Doubt;

/// The type of the stored numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// 32-bit floats.
    Single,
    /// 64-bit floats, MERL's.
    Double,
}

/// Which byte of a number comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ByteOrder {
    /// The least significant one, MERL's.
    Little,
    /// The most significant one.
    Big,
}

impl ByteOrder {
    /// The integer with these bytes.
    pub fn integer(self, bytes: [u8; 4]) -> i32 {
        match self {
            Self::Little => i32::from_le_bytes(bytes),
            Self::Big => i32::from_be_bytes(bytes),
        }
    }

    /// The 64-bit float of a word of the file.
    fn double(self, word: u64) -> f64 {
        f64::from_bits(match self {
            Self::Little => u64::from_le(word),
            Self::Big => u64::from_be(word),
        })
    }

    /// The two 32-bit floats of a word of the file, in their order.
    fn singles(self, word: u64) -> [f64; 2] {
        let [a, b, c, d, e, f, g, h] = word.to_ne_bytes();
        [[a, b, c, d], [e, f, g, h]].map(|bytes| {
            f64::from(match self {
                Self::Little => f32::from_le_bytes(bytes),
                Self::Big => f32::from_be_bytes(bytes),
            })
        })
    }
}

/// Number of words of 64 bits in a table of 32-bit floats.
const SINGLE_WORDS: usize = (SINGLE_FILE_BYTES - HEADER_BYTES) / 8;
/// The exponent of a usual number: f times 1500 is about 2^7.
const USUAL_EXPONENT: i32 = 7;
/// Numbers that are larger by more powers of two are all absurd.
const ABSURD: i32 = 40;
/// Numbers that are smaller by more powers of two are all equally odd, and less so: a narrow lobe has tiny ones around it.
const TINY: i32 = 20;
/// How odd a negative number is, unless it is -1, which marks gaps.
const NEGATIVE: i32 = 10;
/// The smallest number of values other than 0 that decides about the byte order before the file ends.
const LEAST: u32 = 100;

/// How odd the numbers are in either byte order.
#[derive(Clone, Copy, Default)]
struct Oddness {
    not_zero: u32,
    little: u64,
    big: u64,
}

impl Oddness {
    fn count(&mut self, words: &[u64], width: Width) {
        match width {
            Width::Double => words.iter().for_each(|word| {
                self.add(ByteOrder::Little.double(*word), ByteOrder::Big.double(*word));
            }),
            Width::Single => words.iter().for_each(|word| {
                let orders = ByteOrder::Little.singles(*word).into_iter().zip(ByteOrder::Big.singles(*word));
                orders.for_each(|(little, big)| self.add(little, big));
            }),
        }
    }

    fn add(&mut self, little: f64, big: f64) {
        self.not_zero += u32::from(little.to_bits() != 0);
        self.little += oddness(little);
        self.big += oddness(big);
    }

    /// The byte order that the numbers show: MERL's, unless they are far less odd in the other one.
    fn order(&self) -> ByteOrder {
        if 2 * self.big < self.little { ByteOrder::Big } else { ByteOrder::Little }
    }

    /// Whether the numbers are so much less odd in one order that the rest of them need not be known.
    fn is_clear(&self) -> bool {
        self.not_zero >= LEAST && 2 * self.little.min(self.big) < self.little.max(self.big)
    }
}

/// How odd a number is, from 0 to [`ABSURD`]: by how many powers of two it differs from usual ones, and its sign.
fn oddness(x: f64) -> u64 {
    let bits = x.to_bits();
    // Infinity and the NaN that arithmetic makes would be tiny numbers in the other order.
    if x == 0.0 || x == -1.0 || x.is_infinite() || bits << 1 == f64::NAN.to_bits() << 1 {
        return 0;
    }
    let powers = i32::try_from(bits >> 52 & 0x7ff).unwrap_or(0) - 1023 - USUAL_EXPONENT;
    let sign = if x < 0.0 { NEGATIVE } else { 0 };
    let distance = if powers < 0 { (-powers).min(TINY) } else { powers };
    u64::try_from((distance + sign).min(ABSURD)).unwrap_or(0)
}

/// What was read.
pub struct Read {
    pub width: Width,
    pub order: ByteOrder,
    pub table: Contents,
    pub doubts: Vec<Doubt>,
}

/// The numbers of a table that is being read, which are held back until it is clear how they are stored.
pub struct Numbers<'g> {
    grid: &'g HalfDifferenceGrid,
    /// `None` while only the end of the file can tell.
    width: Option<Width>,
    /// `None` while too few numbers other than 0 have been read.
    order: Option<ByteOrder>,
    held: Vec<Vec<u64>>,
    /// Of the numbers held back, as numbers of 64 and of 32 bits.
    oddness: [Oddness; 2],
    /// Created with the first numbers.
    sink: Option<(Table<'g>, Layout)>,
    /// Numbers in the form in which MERL stores them.
    converted: Vec<u64>,
}

impl<'g> Numbers<'g> {
    /// Numbers of a width, or of one that depends on how many follow.
    pub fn new(width: Option<Width>, grid: &'g HalfDifferenceGrid) -> Self {
        Self {
            grid,
            width,
            order: None,
            held: Vec::new(),
            oddness: [Oddness::default(); 2],
            sink: None,
            converted: Vec::new(),
        }
    }

    /// Takes the next words of the file: [`PIECE`] of them, or fewer at its end.
    pub fn take(&mut self, words: &[u64]) {
        // Half a piece is the end of a table of 32-bit floats; any other rest is the end of a truncated file.
        if words.len() < PIECE / 2 {
            return;
        }
        if let (Some(width), Some(order)) = (self.width, self.order) {
            return self.pass(words, width, order);
        }
        for (oddness, width) in self.oddness.iter_mut().zip([Width::Double, Width::Single]) {
            if self.width.is_none_or(|known| known == width) {
                oddness.count(words, width);
            }
        }
        self.held.push(words.to_vec());
        if self.held.iter().map(Vec::len).sum::<usize>() > SINGLE_WORDS {
            self.settle(Width::Double);
        } else if let Some(width) = self.width.filter(|width| self.oddness(*width).is_clear()) {
            self.settle(width);
        }
    }

    fn oddness(&self, width: Width) -> Oddness {
        let [double, single] = self.oddness;
        match width {
            Width::Double => double,
            Width::Single => single,
        }
    }

    /// Decides how the numbers are stored, and passes on those that were held back.
    fn settle(&mut self, width: Width) {
        let width = *self.width.get_or_insert(width);
        let order = self.oddness(width).order();
        self.order = Some(order);
        for words in std::mem::take(&mut self.held) {
            self.pass(&words, width, order);
        }
    }

    fn pass(&mut self, words: &[u64], width: Width, order: ByteOrder) {
        let grid = self.grid;
        let (table, layout) =
            self.sink.get_or_insert_with(|| (Table::new(grid.above_horizon()), Layout::new()));
        let mut hand_on = |numbers: &[u64]| {
            layout.take(numbers);
            table.take(numbers);
        };
        let converted = &mut self.converted;
        match (width, order) {
            (Width::Double, ByteOrder::Little) => hand_on(words),
            (Width::Double, ByteOrder::Big) => {
                converted.clear();
                converted.extend(words.iter().map(|word| word.swap_bytes()));
                hand_on(converted);
            }
            // Half as many words at a time, so that all numbers are of one plane.
            (Width::Single, _) => words.chunks(PIECE / 2).for_each(|words| {
                converted.clear();
                let numbers = words.iter().flat_map(|word| order.singles(*word));
                converted.extend(numbers.map(|number| number.to_bits().to_le()));
                hand_on(converted);
            }),
        }
    }

    /// The table of all numbers.
    pub fn finish(mut self) -> Read {
        if self.width.is_none() || self.order.is_none() {
            // More words than those of 32-bit floats would have been settled.
            self.settle(Width::Single);
        }
        let above = self.grid.above_horizon();
        let (table, layout) = self.sink.unwrap_or_else(|| (Table::new(above), Layout::new()));
        Read {
            width: self.width.unwrap_or(Width::Double),
            order: self.order.unwrap_or(ByteOrder::Little),
            table: table.finish(),
            doubts: layout.fault(above).map(Doubt::SuspiciousTable).into_iter().collect(),
        }
    }
}
