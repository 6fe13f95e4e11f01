//! Sums over groups of rows: what is needed to leave out one group at a time.

use nalgebra::{DMatrix, DVector};

/// J_g^T J_g and J_g^T r_g of each group g of the rows of one block.
///
/// The products are summed as they are, unlike in a `Triangle`: they are only ever compared with the sum over all groups, so that their
/// rounding errors matter little, and a row costs no more than its products.
#[derive(Clone, Debug)]
pub(crate) struct GroupSums {
    groups: usize,
    /// Number of columns of J.
    columns: usize,
    /// For each group, the products of each column with itself, the later ones and the residual, column by column.
    entries: Vec<f64>,
}

impl GroupSums {
    pub(crate) fn new(groups: usize, columns: usize) -> Self {
        Self { groups, columns, entries: vec![0.0; groups * Self::size(columns)] }
    }

    /// Number of entries of a group of rows with this many columns of J.
    pub(crate) fn size(columns: usize) -> usize {
        columns * (columns + 3) / 2
    }

    /// Adds rows given column by column, the residuals last; `group_of` has the group of each row. Rows beyond it are not counted.
    #[inline(always)]
    pub(crate) fn add<C: AsRef<[f64]>>(&mut self, columns: &[C], group_of: &[u32]) {
        assert_eq!(columns.len(), self.columns + 1, "columns of the rows to add");
        let size = Self::size(self.columns);
        for (s, group) in group_of.iter().enumerate() {
            let first = *group as usize * size;
            let mut entries = self.entries[first..first + size].iter_mut();
            for (k, column) in columns[..self.columns].iter().enumerate() {
                let value = column.as_ref()[s];
                for (other, entry) in columns[k..].iter().zip(entries.by_ref()) {
                    *entry += value * other.as_ref()[s];
                }
            }
        }
    }

    /// Adds the sums of other rows.
    pub(crate) fn merge(&mut self, other: &Self) {
        assert_eq!(self.entries.len(), other.entries.len(), "sums over the same groups");
        self.entries.iter_mut().zip(&other.entries).for_each(|(sum, entry)| *sum += entry);
    }

    /// Number of groups.
    pub(crate) fn groups(&self) -> usize {
        self.groups
    }

    /// J_g^T J_g and J_g^T r_g of a group.
    pub(crate) fn of_group(&self, group: usize) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.columns;
        let size = Self::size(n);
        let mut entries = self.entries[group * size..(group + 1) * size].iter();
        let (mut normal, mut slope) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for k in 0..n {
            for (j, entry) in (k..=n).zip(entries.by_ref()) {
                if j == n {
                    slope[k] = *entry;
                } else {
                    normal[(k, j)] = *entry;
                    normal[(j, k)] = *entry;
                }
            }
        }
        (normal, slope)
    }
}
