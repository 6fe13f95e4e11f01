//! The singular value decomposition of small matrices.
//!
//! nalgebra 0.35's own decomposition is sometimes wrong: for one in four random matrices with two equal columns, the
//! product of its factors differs from the matrix by more than rounding, by up to its own size (nalgebra issue 1172).
//! Such matrices decide which parameters the data do not determine, and where a sequence of nearly parallel steps
//! ends.

use nalgebra::{DMatrix, DVector};

/// Largest number of sweeps over all pairs of columns; ten are rarely needed.
const SWEEPS: usize = 60;

/// A matrix as a sum of terms, one per column, each a singular value times a left and a right vector.
pub(crate) struct Svd {
    /// The left vectors as columns, of unit length if the singular value is not 0.
    pub(super) left: DMatrix<f64>,
    pub(super) values: DVector<f64>,
    /// The right vectors as columns.
    pub(super) right: DMatrix<f64>,
}

impl Svd {
    /// Decomposes a matrix by Jacobi's method on pairs of columns (Hestenes 1958; Golub and Van Loan 2013, 8.6.3),
    /// which finds small singular values as precisely as the columns determine them. The values are not ordered. The
    /// work grows with the square of the number of columns, and it is better to reduce a tall matrix to a triangle
    /// first.
    pub(crate) fn new(matrix: DMatrix<f64>) -> Self {
        let n = matrix.ncols();
        let (mut left, mut right) = (matrix, DMatrix::identity(n, n));
        for _ in 0..SWEEPS {
            let mut turned = false;
            for q in 1..n {
                for p in 0..q {
                    if let Some((cosine, sine)) = turn(&left, p, q) {
                        rotate(&mut left, p, q, cosine, sine);
                        rotate(&mut right, p, q, cosine, sine);
                        turned = true;
                    }
                }
            }
            if !turned {
                break;
            }
        }
        let values = DVector::from_iterator(n, left.column_iter().map(|column| column.norm()));
        for (mut column, value) in left.column_iter_mut().zip(values.iter()) {
            if *value > 0.0 {
                column /= *value;
            }
        }
        Self { left, values, right }
    }

    /// The shortest x that minimises |M x - b|, ignoring directions whose singular value is at most `least`.
    pub(crate) fn solve(&self, b: &DVector<f64>, least: f64) -> DVector<f64> {
        assert_eq!(b.len(), self.left.nrows(), "entries of the right-hand side");
        let (kept, _) = self.split(least);
        self.half_inverse(&kept) * self.left.select_columns(&kept).tr_mul(b)
    }

    /// The indices of the singular values above `least`, and those of the others.
    pub(super) fn split(&self, least: f64) -> (Vec<usize>, Vec<usize>) {
        (0..self.values.len()).partition(|k| self.values[*k] > least)
    }

    /// The right vectors of `kept`, each divided by its singular value.
    pub(super) fn half_inverse(&self, kept: &[usize]) -> DMatrix<f64> {
        let mut half = self.right.select_columns(kept);
        for (mut column, value) in half.column_iter_mut().zip(self.values.select_rows(kept).iter()) {
            column /= *value;
        }
        half
    }
}

/// Cosine and sine of the rotation that makes two columns orthogonal; `None` if they are orthogonal to rounding.
fn turn(matrix: &DMatrix<f64>, p: usize, q: usize) -> Option<(f64, f64)> {
    let (a, b) = (matrix.column(p), matrix.column(q));
    let (a_a, b_b, a_b) = (a.norm_squared(), b.norm_squared(), a.dot(&b));
    let oblique = a_b.abs() > f64::EPSILON * a_a.sqrt() * b_b.sqrt();
    if !oblique {
        return None;
    }
    // The smaller root of t^2 + 2 zeta t - 1 = 0, without cancellation.
    let zeta = (b_b - a_a) / (2.0 * a_b);
    let tangent = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
    let cosine = 1.0 / tangent.hypot(1.0);
    Some((cosine, cosine * tangent))
}

/// Replaces columns (a, b) by (c a - s b, s a + c b).
fn rotate(matrix: &mut DMatrix<f64>, p: usize, q: usize, cosine: f64, sine: f64) {
    let (a, b) = (matrix.column(p).into_owned(), matrix.column(q).into_owned());
    matrix.set_column(p, &(&a * cosine - &b * sine));
    matrix.set_column(q, &(a * sine + b * cosine));
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn solutions_are_the_shortest_that_fit_best() {
        // Two equal columns share equally what one of them alone would take; the mean fits 1, 2, 3 best.
        let twins = DMatrix::from_element(3, 2, 1.0);
        let x = Svd::new(twins).solve(&DVector::from_vec(vec![1.0, 2.0, 3.0]), 1e-8);
        assert!((x - DVector::from_element(2, 1.0)).norm() < 1e-14);
        // A line through (0, 1), (1, 3) and (2, 5).
        let line = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 1.0, 1.0, 1.0, 2.0]);
        let x = Svd::new(line).solve(&DVector::from_vec(vec![1.0, 3.0, 5.0]), 1e-8);
        assert!((x - DVector::from_vec(vec![1.0, 2.0])).norm() < 1e-14);
    }

    #[test]
    fn multiplies_out() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        for n in [0, 1, 2, 3, 4, 7, 20] {
            // More rows than columns, as many rows as columns, and fewer.
            for height in [n + 3, n, n / 2] {
                for defect in 0..4 {
                    for _ in 0..50 {
                        let mut matrix = DMatrix::from_fn(height, n, |_, _| rng.random_range(-1.0..1.0));
                        let scale = 10_f64.powi(rng.random_range(-9..9));
                        match defect {
                            1 if n > 1 => matrix.set_column(n - 1, &(matrix.column(0) * 3.0)),
                            2 if n > 0 => matrix.fill_column(n / 2, 0.0),
                            3 if n > 2 => {
                                matrix.set_column(1, &(matrix.column(2) - matrix.column(0) * scale))
                            }
                            _ => {}
                        }
                        let Svd { left, values, right } = Svd::new(matrix.clone());
                        let size = matrix.norm().max(f64::MIN_POSITIVE);
                        let product = &left * DMatrix::from_diagonal(&values) * right.transpose();
                        assert!((product - &matrix).norm() < 1e-13 * size);
                        assert!((right.tr_mul(&right) - DMatrix::identity(n, n)).norm() < 1e-13);
                        let kept: Vec<usize> = (0..n).filter(|k| values[*k] > 1e-11 * size).collect();
                        let basis = left.select_columns(&kept);
                        let unit = DMatrix::identity(kept.len(), kept.len());
                        assert!((basis.tr_mul(&basis) - unit).norm() < 1e-13);
                        let lost =
                            usize::from(defect == 1 && n > 1 || defect == 2 && n > 0 || defect == 3 && n > 2);
                        assert_eq!(kept.len(), height.min(n - lost), "{height} by {n}, defect {defect}");
                    }
                }
            }
        }
    }
}
