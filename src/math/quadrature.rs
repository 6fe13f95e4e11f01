//! Gauss-Legendre quadrature.

use super::{Scalar, count};

/// Nodes and weights of the Gauss-Legendre rule on [-1, 1]: exact for polynomials of degree 2n - 1.
#[derive(Clone, Debug)]
pub struct GaussLegendre {
    nodes: Vec<(f64, f64)>,
}

impl GaussLegendre {
    /// The rule with `n` nodes, found by Newton's method on the Legendre polynomial P_n
    /// (Abramowitz and Stegun 1964, 25.4.29).
    #[must_use]
    pub fn new(n: usize) -> Self {
        let order = count(n);
        let nodes = (0..n)
            .map(|i| {
                // Tricomi's estimate of the i-th root; six Newton steps reach the last digit.
                let mut x = (std::f64::consts::PI * (count(i) + 0.75) / (order + 0.5)).cos();
                let mut slope = 1.0;
                for _ in 0..6 {
                    let (mut previous, mut current) = (1.0, x);
                    for k in 1..n {
                        let k = count(k);
                        let next = ((2.0 * k + 1.0) * x * current - k * previous) / (k + 1.0);
                        previous = current;
                        current = next;
                    }
                    slope = order * (x * current - previous) / (x * x - 1.0);
                    x -= current / slope;
                }
                (x, 2.0 / ((1.0 - x * x) * slope * slope))
            })
            .collect();
        Self { nodes }
    }

    /// The integral of `f` from `lower` to `upper`. The limits may carry derivatives.
    pub fn integrate<T: Scalar>(&self, lower: T, upper: T, f: impl Fn(T) -> T) -> T {
        let width = upper - lower;
        // Summed from the lower limit, which is often 0 and near which the nodes are dense: measured from the middle
        // they would lose digits there.
        self.nodes
            .iter()
            .map(|&(x, w)| f(lower + width.times(0.5 * (1.0 + x))).times(w))
            .fold(T::constant(0.0), |sum, term| sum + term)
            * width.times(0.5)
    }

    /// Calls `f` with every node and its weight in the integral from `lower` to `upper`.
    pub fn for_each(&self, lower: f64, upper: f64, mut f: impl FnMut(f64, f64)) {
        let (half_width, middle) = (0.5 * (upper - lower), 0.5 * (upper + lower));
        self.nodes.iter().for_each(|&(x, w)| f(middle + half_width * x, w * half_width));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_polynomials_exactly() {
        // int_0^2 x^9 dx = 2^10 / 10; five nodes are exact up to degree nine.
        let integral = GaussLegendre::new(5).integrate(0.0, 2.0, |x: f64| x.powi(9));
        approx::assert_relative_eq!(integral, 102.4, max_relative = 1e-14);
    }

    #[test]
    fn integrates_sine() {
        let integral = GaussLegendre::new(24).integrate(0.0, std::f64::consts::PI, f64::sin);
        approx::assert_relative_eq!(integral, 2.0, max_relative = 1e-14);
    }
}
