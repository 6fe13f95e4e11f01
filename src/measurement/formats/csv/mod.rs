//! Tables of text whose columns have names: their reader, and the writer of this project's own CSV. docs/use/formats.md documents both.
//!
//! What this project writes: `#` comments; a header naming the columns, `theta_i, phi_i, theta_o, phi_o` in degrees, one column per channel,
//! and optionally `sigma` (for all channels) or `sigma_<channel>`. What it reads is as people write it: other names, separators and
//! orders, units in names, wavelengths in rows.

mod columns;
mod dialect;
mod names;
mod number;
mod pivot;
mod read;
mod records;
mod rows;
mod table;
mod write;

pub use columns::ANGLES;
pub use read::FORMAT;
pub use records::{BadRecord, records};
pub(super) use rows::read_rows;
pub use write::write;
