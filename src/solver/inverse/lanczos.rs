//! The largest eigenvalue of a symmetric matrix that is only given by its product with a vector.

use crate::math::{GOLDEN, count};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Largest residual of the eigenvector, relative to its eigenvalue. The error of the eigenvalue is about the square of
/// this.
const TOLERANCE: f64 = 1e-9;
/// Largest number of steps. If the largest eigenvalues are too close to be separated in this many steps, the one found
/// is off by less than the distance between them.
const STEPS: usize = 128;
/// Limit on the iterations for the eigenvalues of the small matrix, far more than they take.
const EIGEN_ITERATIONS: usize = 10_000;

/// The largest eigenvalue of a positive semidefinite matrix with `n` rows, and its unit eigenvector.
///
/// Uses Lanczos' method with every vector kept orthogonal to all previous ones, always from the same start (Golub and
/// Van Loan 2013, 10.1 and 10.3). If there are fewer rows than steps, all eigenvalues are exact to rounding at the
/// end. `None` if `apply` returns numbers that are not finite, or if there are no rows.
pub(super) fn largest_eigenpair(
    n: usize,
    apply: impl Fn(&DVector<f64>) -> DVector<f64>,
) -> Option<(f64, DVector<f64>)> {
    // Without a pattern, so that no symmetry of the matrix hides a vector.
    let start = DVector::from_fn(n, |i, _| 0.5 + (count(i + 1) * GOLDEN).fract());
    let mut next = start.try_normalize(0.0)?;
    let mut basis: Vec<DVector<f64>> = Vec::new();
    // In this basis the matrix is tridiagonal.
    let (mut diagonal, mut beside): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut look = 4;
    loop {
        let mut image = apply(&next);
        diagonal.push(image.dot(&next));
        basis.push(next);
        // Done twice, because the first pass leaves rounding errors as large as those of what it subtracts.
        for _ in 0..2 {
            for vector in &basis {
                image.axpy(-vector.dot(&image), vector, 1.0);
            }
        }
        let length = image.norm();
        if !length.is_finite() {
            return None;
        }
        let steps = basis.len();
        let scale = diagonal.iter().fold(0.0, |a: f64, d| a.max(d.abs()));
        let complete = steps == n.min(STEPS) || length <= f64::EPSILON * scale;
        if complete || steps >= look {
            look = steps + steps.div_ceil(4);
            let (value, weights) = largest_of_tridiagonal(&diagonal, &beside)?;
            let rest = length * weights[steps - 1].abs();
            if complete || rest <= TOLERANCE * value {
                let mut vector = DVector::zeros(n);
                for (weight, direction) in weights.iter().zip(&basis) {
                    vector.axpy(*weight, direction, 1.0);
                }
                return Some((value, vector));
            }
        }
        beside.push(length);
        next = image / length;
    }
}

/// The largest eigenvalue, with its vector, of a symmetric tridiagonal matrix with this `diagonal` and the entries
/// `beside` it. `None` if an entry is not finite.
fn largest_of_tridiagonal(diagonal: &[f64], beside: &[f64]) -> Option<(f64, DVector<f64>)> {
    let n = diagonal.len();
    assert_eq!(beside.len() + 1, n, "entries beside the diagonal");
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => diagonal[i],
        1 => beside[i.min(j)],
        _ => 0.0,
    };
    let eigen = SymmetricEigen::try_new(DMatrix::from_fn(n, n, entry), f64::EPSILON, EIGEN_ITERATIONS)?;
    let (largest, value) = eigen.eigenvalues.argmax();
    Some((value, eigen.eigenvectors.column(largest).into_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn eigenvalues_of_the_second_difference() {
        // Eigenvalues 2 - 2 cos(pi k/(n + 1)) and vectors sin(pi k i/(n + 1)), from any textbook; the largest lie
        // close together.
        for n in [1, 2, 3, 10, 100] {
            let entry = |i: usize, j: usize| match i.abs_diff(j) {
                0 => 2.0,
                1 => -1.0,
                _ => 0.0,
            };
            let matrix = DMatrix::from_fn(n, n, entry);
            let (value, vector) = largest_eigenpair(n, |v| &matrix * v).unwrap();
            let angle = std::f64::consts::PI * count(n) / count(n + 1);
            assert_relative_eq!(value, 2.0 - 2.0 * angle.cos(), max_relative = 1e-13);
            assert_relative_eq!(vector.norm(), 1.0, max_relative = 1e-13);
            assert!((&matrix * &vector - &vector * value).norm() < 1e-8);
        }
    }

    #[test]
    fn many_eigenvalues_close_together() {
        // 900 eigenvalues spread evenly over 1..1.1, and one apart from them.
        let spread = |top: f64| {
            let diagonal =
                DVector::from_fn(900, |i, _| if i == 450 { top } else { 1.0 + 0.1 * count(i) / 900.0 });
            largest_eigenpair(900, |v| v.component_mul(&diagonal)).unwrap()
        };
        let (value, vector) = spread(1.2);
        assert_relative_eq!(value, 1.2, max_relative = 1e-13);
        assert!(vector[450].abs() > 1.0 - 1e-9);
        let (value, _) = spread(1.0);
        assert!((value - 1.1).abs() < 2e-4, "{value}");
    }

    #[test]
    fn nothing_to_find() {
        assert!(largest_eigenpair(0, Clone::clone).is_none());
        assert_relative_eq!(largest_eigenpair(5, |v| v * 0.0).unwrap().0, 0.0);
        assert!(largest_eigenpair(5, |v| v * f64::NAN).is_none());
    }
}
