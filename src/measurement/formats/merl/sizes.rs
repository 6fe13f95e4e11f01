//! The sizes of a MERL table, and its scales.

use crate::geometry::HalfDifferenceGrid;

/// f per stored unit, by channel.
pub const SCALES: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

/// Number of bytes of the three integers at the beginning.
pub const HEADER_BYTES: usize = 12;
/// Number of values in a table.
pub const VALUES: usize = SCALES.len() * HalfDifferenceGrid::CELLS;
/// Number of bytes of a whole file.
pub const FILE_BYTES: usize = HEADER_BYTES + 8 * VALUES;
/// Number of bytes of a whole file with 32-bit floats.
pub const SINGLE_FILE_BYTES: usize = HEADER_BYTES + 4 * VALUES;
