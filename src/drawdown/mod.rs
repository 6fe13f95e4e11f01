//! Paint drawdowns: K and S from reflectances over known backings (docs/use/kubelka-munk.md).
//!
//! A drawdown is a film of paint of known thickness drawn over a card that is partly black and partly white. Its
//! reflectance over two backings, or at two thicknesses, separates its absorption K from its scattering S, which no BRDF
//! of the finished surface can. This module is at the level of `report`: it reads with `measurement`, fits with `fit`,
//! and takes its formulas from `model::parts::paint_layers`.

mod closed_form;
mod fit;
mod record;
mod table;

pub use closed_form::from_two_backings;
pub use fit::{Fitted, Quantity, Remark, fit};
pub use record::{Record, SCHEMA, lines, text};
pub use table::{Drawdown, Patch, Series, read, read_file};

/// The surface of the film, Saunderson's k1 and k2. Both are 0 for a film without a reflecting surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surface {
    /// The share of light from outside that the surface reflects.
    pub k1: f64,
    /// The share of diffuse light from inside that the surface reflects, less than 1.
    pub k2: f64,
}
