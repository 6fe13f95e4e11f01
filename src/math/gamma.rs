//! The gamma function.

use super::{Scalar, count};
use std::f64::consts::PI;

/// ln Gamma(x) for x > 0.
///
/// Computed by Stirling's series (Abramowitz and Stegun 1964, 6.1.41) at x + 12, and from there by the recurrence.
pub fn ln_gamma<T: Scalar>(x: T) -> T {
    /// The number that is added to the argument.
    const STEPS: usize = 12;
    /// The coefficients of the odd powers of 1/x in Stirling's series.
    const COEFFICIENTS: [f64; 6] =
        [1.0 / 12.0, -1.0 / 360.0, 1.0 / 1260.0, -1.0 / 1680.0, 1.0 / 1188.0, -691.0 / 360_360.0];
    let product =
        (0..STEPS).map(|k| x.plus(count(k))).fold(T::constant(1.0), |product, factor| product * factor);
    let far = x.plus(count(STEPS));
    let inverse = far.recip();
    let inverse2: T = inverse * inverse;
    let series =
        COEFFICIENTS.iter().rev().fold(T::constant(0.0), |sum, c| (sum * inverse2).plus(*c)) * inverse;
    far.plus(-0.5) * far.ln() - far + series.plus(0.5 * (2.0 * PI).ln()) - product.ln()
}

#[cfg(test)]
mod tests {
    use super::ln_gamma;
    use approx::assert_relative_eq;

    #[test]
    fn known_values() {
        assert_relative_eq!(ln_gamma(0.5), 0.5 * std::f64::consts::PI.ln(), max_relative = 1e-14);
        assert_relative_eq!(ln_gamma(5.0), 24f64.ln(), max_relative = 1e-14);
        for x in [0.1, 0.3, 1.7, 4.2, 11.0, 60.0] {
            assert_relative_eq!(ln_gamma(x), libm::lgamma(x), max_relative = 1e-13, epsilon = 1e-14);
        }
    }
}
