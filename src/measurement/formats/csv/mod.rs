//! This project's own CSV format: its reader, its writer, and the columns that both use. docs/use/formats.md documents
//! it.
//!
//! `#` comments; a header naming the columns, in any order: `theta_i, phi_i, theta_o, phi_o` in degrees,
//! one column per channel named freely, and optionally `sigma` (for all channels) or `sigma_<channel>`.

mod columns;
mod read;
mod rows;
mod write;

pub use columns::{ANGLES, BadRecord, Columns, records};
pub use read::FORMAT;
pub(super) use rows::read_rows;
pub use write::write;
