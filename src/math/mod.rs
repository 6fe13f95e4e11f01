//! Numbers: the scalar trait that every formula uses, dual, wide and counting numbers, elementary functions, and
//! quadrature.

mod counted;
mod dual;
pub(crate) mod elementary;
mod gamma;
mod interval;
mod quadrature;
mod scalar;
mod wide;

pub use counted::{Counted, Operations, counting};
pub use dual::Dual;
pub use gamma::ln_gamma;
pub use interval::half_interval_of_student;
pub use quadrature::GaussLegendre;
pub use scalar::{Real, Scalar};
pub use wide::Wide;

/// Converts a count to a floating-point number.
///
/// The conversion is exact up to 2^53, far beyond any number of samples that fits in memory.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "counts stay far below 2^53")]
pub const fn count(n: usize) -> f64 {
    n as f64
}
