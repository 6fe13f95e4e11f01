//! Paint on cards: K and S from reflectances over known backings (docs/use/kubelka-munk.md).
//!
//! A drawdown is a film of paint of known thickness drawn over a card that is black here and white there. What
//! it reflects over two backings, or at two thicknesses, tells its absorption K and scattering S apart, which no BRDF
//! of the finished surface can. Stands beside `report`: it reads with `measurement`, fits with `fit`, and takes its
//! formulas from `model::parts::paint_layers`.

mod closed_form;
mod fit;
mod record;
mod table;

pub use closed_form::from_two_backings;
pub use fit::{Fitted, Quantity, Remark, fit};
pub use record::{Record, SCHEMA, text};
pub use table::{Drawdown, Patch, Series, read, read_file};

/// The surface of the film, Saunderson's k1 and k2: 0 and 0 for none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surface {
    /// What it reflects of light from outside.
    pub k1: f64,
    /// What it reflects of diffuse light from inside, less than 1.
    pub k2: f64,
}
