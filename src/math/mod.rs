//! Numbers: the scalar trait that every formula uses, dual, wide, counting and recording numbers, elementary functions, and
//! quadrature.

mod counted;
mod dual;
pub(crate) mod elementary;
mod gamma;
mod interval;
mod plain;
mod quadrature;
pub(crate) mod recorded;
mod scalar;
mod wide;

pub use counted::{Counted, Operations, counting};
pub use dual::Dual;
pub use gamma::ln_gamma;
pub use interval::half_interval_of_student;
pub use quadrature::GaussLegendre;
pub use scalar::{Cell, Real, Scalar};
pub use wide::Wide;

/// (sqrt 5 - 1)/2. Its multiples modulo 1 are spread most evenly, without a pattern.
pub(crate) const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The median of numbers, the larger of both in the middle; `None` if there are none.
pub(crate) fn median(mut numbers: Vec<f64>) -> Option<f64> {
    numbers.sort_unstable_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied()
}

/// Converts a count to a floating-point number.
///
/// The conversion is exact up to 2^53, far beyond any number of samples that fits in memory.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "counts stay far below 2^53")]
pub const fn count(n: usize) -> f64 {
    n as f64
}
