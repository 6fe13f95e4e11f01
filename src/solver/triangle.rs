//! Compresses a stream of Jacobian rows into a triangular factor.

use super::least_squares::Rows;
use nalgebra::{DMatrix, DVector};

/// The upper triangular factor of all rows appended so far, computed by Householder reflections.
///
/// However many rows a matrix with `n` columns has, only R with R^T R = J^T J is kept. Its entries keep twice the
/// digits of the normal matrix J^T J (Golub and Van Loan 2013, 5.2 and 6.5).
#[derive(Clone, Debug)]
pub(crate) struct Triangle {
    columns: usize,
    /// Row k holds columns k..n.
    rows: Vec<Vec<f64>>,
}

impl Triangle {
    pub(crate) fn new(columns: usize) -> Self {
        Self { columns, rows: (0..columns).map(|k| vec![0.0; columns - k]).collect() }
    }

    /// The rows; row `k` begins at its diagonal entry.
    pub(crate) fn rows(&self) -> &[Vec<f64>] {
        &self.rows
    }

    /// Appends rows given column by column. The columns are also used as working space.
    #[inline(always)]
    pub(crate) fn append<C: AsRef<[f64]> + AsMut<[f64]>>(&mut self, columns: &mut [C]) {
        assert_eq!(columns.len(), self.columns, "columns of the rows to append");
        for (k, row) in self.rows.iter_mut().enumerate() {
            let (current, later) = columns[k..].split_at_mut(1);
            let current = current[0].as_ref();
            let (diagonal, rest) = row.split_at_mut(1);
            let diagonal = &mut diagonal[0];
            let below = dot(current, current);
            if below == 0.0 {
                continue;
            }
            // Reflects (diagonal, current) to (-sign(diagonal) length, 0).
            let length = (*diagonal * *diagonal + below).sqrt();
            let target = if *diagonal > 0.0 { -length } else { length };
            let head = *diagonal - target;
            // v^T v / 2 with v = (head, current)
            let half_norm = target * (target - *diagonal);
            *diagonal = target;
            for (entry, column) in rest.iter_mut().zip(later) {
                let column = column.as_mut();
                let factor = (head * *entry + dot(current, column)) / half_norm;
                *entry -= factor * head;
                for (value, reflected) in column.iter_mut().zip(current.iter()) {
                    *value -= factor * reflected;
                }
            }
        }
    }

    /// The entry in a row and a column; 0 below the diagonal.
    fn entry(&self, row: usize, column: usize) -> f64 {
        if column < row { 0.0 } else { self.rows[row][column - row] }
    }

    /// The factor as rows of a Jacobian, whose parameters are `columns`, with the residuals in the last column.
    pub(crate) fn as_rows(&self, columns: &[usize]) -> Rows {
        let n = columns.len();
        assert_eq!(self.columns, n + 1, "columns of the Jacobian and one of residuals");
        Rows {
            columns: columns.to_vec(),
            jacobian: DMatrix::from_fn(n, n, |row, column| self.entry(row, column)),
            residual: DVector::from_fn(n, |row, _| self.entry(row, n)),
        }
    }

    /// Appends the rows of another factor.
    pub(crate) fn merge(&mut self, other: &Self) {
        let of_column = |column| (0..other.columns).map(|row| other.entry(row, column)).collect();
        let mut columns: Vec<Vec<f64>> = (0..other.columns).map(of_column).collect();
        self.append(&mut columns);
    }
}

/// Inner product in sixteen partial sums, which the compiler can keep in vector registers. The order of summation is
/// fixed.
#[inline(always)]
pub(crate) fn dot(a: &(impl AsRef<[f64]> + ?Sized), b: &(impl AsRef<[f64]> + ?Sized)) -> f64 {
    let (a, b) = (a.as_ref(), b.as_ref());
    assert_eq!(a.len(), b.len(), "lengths of two vectors");
    let (a_chunks, a_rest) = a.as_chunks::<16>();
    let (b_chunks, b_rest) = b.as_chunks::<16>();
    let mut strands = [0.0; 16];
    for (x, y) in a_chunks.iter().zip(b_chunks) {
        for ((strand, x), y) in strands.iter_mut().zip(x).zip(y) {
            *strand += x * y;
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    // Summed in pairs, because in a chain each sum would wait for the previous one.
    let mut half = strands.len() / 2;
    while half > 0 {
        let (low, high) = strands.split_at_mut(half);
        low.iter_mut().zip(high).for_each(|(low, high)| *low += *high);
        half /= 2;
    }
    strands[0] + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::count;
    use nalgebra::DMatrix;

    #[test]
    fn keeps_the_normal_matrix() {
        let rows = 37;
        let entry = |i: usize, j: usize| count((i * 7 + j * 13) % 11) - 4.0 + 0.1 * count(j);
        let full = DMatrix::from_fn(rows, 4, entry);
        let (mut first, mut second) = (Triangle::new(4), Triangle::new(4));
        let columns = |range: std::ops::Range<usize>| -> Vec<Vec<f64>> {
            (0..4).map(|j| range.clone().map(|i| entry(i, j)).collect()).collect()
        };
        first.append(&mut columns(0..10));
        first.append(&mut columns(10..11));
        second.append(&mut columns(11..rows));
        first.merge(&second);
        let r = DMatrix::from_fn(4, 4, |i, j| if j >= i { first.rows()[i][j - i] } else { 0.0 });
        let difference = r.transpose() * r - full.transpose() * full;
        assert!(difference.amax() < 1e-11, "{difference}");
    }
}
