//! What a reader did that a user should know.

use crate::error::excerpt;
use std::fmt;

/// Something that a reader did with a file and that is right, but that whoever uses the numbers should know.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Remark {
    /// The file holds Mueller matrices; the element for unpolarised light was read.
    Unpolarised,
    /// The file also holds transmission, which was left out.
    TransmissionLeftOut,
    /// The file also holds the reflectance of a perfect mirror, which was left out.
    MirrorLeftOut,
    /// The values were divided by a cosine to give f.
    CosineDividedOut {
        /// The angle whose cosine it is: `theta_i` or `theta_o`.
        angle: &'static str,
    },
    /// The file holds several materials, of which one was read.
    OneMaterial {
        /// The one that was read.
        read: String,
        /// All of them, in the order of the file.
        all: Vec<String>,
    },
    /// The samples were drawn from a BRDF that the file defines everywhere.
    Drawn {
        /// The grid on which they were drawn, in words.
        grid: String,
    },
    /// The columns of a table were understood by their names.
    Columns {
        /// What was made of them, in words.
        what: String,
    },
    /// The numbers of a MERL table are 32-bit floats.
    SinglePrecision,
    /// Something in a MERL table is big-endian.
    BigEndian {
        /// What is.
        part: TablePart,
    },
    /// The file fixes some of the four angles, or leaves them open.
    Assumed {
        /// What was assumed, in words.
        what: String,
    },
}

/// A part of a table's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TablePart {
    /// The dimensions at its beginning.
    Header,
    /// The numbers after them.
    Numbers,
    /// Both.
    Whole,
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unpolarised => {
                write!(f, "the file holds Mueller matrices: the element for unpolarised light was read")
            }
            Self::TransmissionLeftOut => write!(f, "the file also holds transmission, which was left out"),
            Self::MirrorLeftOut => {
                write!(f, "the file also holds the reflectance of a perfect mirror, which was left out")
            }
            Self::CosineDividedOut { angle } => {
                write!(f, "the file holds f cos({angle}): the cosine was divided out")
            }
            Self::OneMaterial { read, all } => {
                let all: Vec<String> = all.iter().map(|name| excerpt(name)).collect();
                write!(f, "read material {}, one of {}: {}", excerpt(read), all.len(), all.join(", "))
            }
            Self::Drawn { grid } => {
                write!(f, "the file defines f at all directions; samples were drawn on {grid}")
            }
            Self::Columns { what } => write!(f, "table: {what}"),
            Self::SinglePrecision => {
                write!(
                    f,
                    "the file's numbers are 32-bit floats, not the 64-bit floats of MERL: they were read as such"
                )
            }
            Self::BigEndian { part } => {
                let part = match part {
                    TablePart::Header => "the file's header is",
                    TablePart::Numbers => "the file's numbers are",
                    TablePart::Whole => "the file's header and numbers are",
                };
                write!(f, "{part} big-endian, not little-endian as in MERL: the bytes were swapped")
            }
            Self::Assumed { what } => write!(f, "{what}"),
        }
    }
}
