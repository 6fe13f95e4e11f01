//! Symmetric matrices over all parameters that take memory and time proportional to the number of parameters.

use nalgebra::{DMatrix, DVector};

/// A symmetric matrix B + L R^T: diagonal blocks plus a product of matrices with few columns.
///
/// The covariances of parameters have this form if the parameters belong to channels, apart from a few shared ones:
/// the parameters of a channel are correlated with others only through the shared ones.
#[derive(Clone, Debug)]
pub(crate) struct BlockMatrix {
    /// The block that each row belongs to and its index there; `None` for a row that only the product has.
    places: Vec<Option<(usize, usize)>>,
    blocks: Vec<DMatrix<f64>>,
    /// L^T and R^T, with one column per row of the matrix; L R^T is symmetric.
    left: DMatrix<f64>,
    right: DMatrix<f64>,
}

impl BlockMatrix {
    pub(crate) fn new(
        places: Vec<Option<(usize, usize)>>,
        blocks: Vec<DMatrix<f64>>,
        left: DMatrix<f64>,
        right: DMatrix<f64>,
    ) -> Self {
        assert_eq!(left.shape(), right.shape(), "shapes of the two factors");
        assert_eq!(places.len(), left.ncols(), "rows of the matrix");
        Self { places, blocks, left, right }
    }

    /// The matrix of the inner products of columns.
    pub(crate) fn products(columns: DMatrix<f64>) -> Self {
        Self::new(vec![None; columns.ncols()], Vec::new(), columns.clone(), columns)
    }

    /// The same plus the matrix of the inner products of columns.
    pub(crate) fn plus_products(mut self, columns: &DMatrix<f64>) -> Self {
        assert_eq!(columns.ncols(), self.len(), "a column for each row");
        let first = self.left.nrows();
        for factor in [&mut self.left, &mut self.right] {
            let mut taller = std::mem::take(factor).resize_vertically(first + columns.nrows(), 0.0);
            taller.rows_mut(first, columns.nrows()).copy_from(columns);
            *factor = taller;
        }
        self
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// A diagonal block, without the part that the product contributes.
    pub(crate) fn block(&self, index: usize) -> &DMatrix<f64> {
        &self.blocks[index]
    }

    /// L^T and R^T.
    pub(crate) fn factors(&self) -> (&DMatrix<f64>, &DMatrix<f64>) {
        (&self.left, &self.right)
    }

    /// The entry in row `i` and column `j`, the same as in row `j` and column `i`.
    pub(crate) fn entry(&self, i: usize, j: usize) -> f64 {
        let (i, j) = (i.min(j), i.max(j));
        let mut entry = self.left.column(i).iter().zip(self.right.column(j).iter()).map(|(l, r)| l * r).sum();
        if let (Some((block, row)), Some((other, column))) = (self.places[i], self.places[j])
            && block == other
        {
            entry += self.blocks[block][(row, column)];
        }
        entry
    }

    /// d^T M d for a vector d given by its nonzero entries, each with its index.
    pub(crate) fn square(&self, d: &[(usize, f64)]) -> f64 {
        let with_all = |(i, x): &(usize, f64)| {
            let with = |(j, y): &(usize, f64)| x * y * self.entry(*i, *j);
            d.iter().map(with).sum::<f64>()
        };
        d.iter().map(with_all).sum()
    }

    /// M v.
    pub(crate) fn times(&self, v: &DVector<f64>) -> DVector<f64> {
        assert_eq!(v.len(), self.len(), "entries of the vector");
        let mut result = self.left.tr_mul(&(&self.right * v));
        let mut parts: Vec<DVector<f64>> = self.blocks.iter().map(|b| DVector::zeros(b.ncols())).collect();
        for (place, value) in self.places.iter().zip(v.iter()) {
            if let Some((block, k)) = *place {
                parts[block][k] = *value;
            }
        }
        let parts: Vec<DVector<f64>> =
            self.blocks.iter().zip(parts).map(|(block, part)| block * part).collect();
        for (place, entry) in self.places.iter().zip(result.iter_mut()) {
            *entry += place.map_or(0.0, |(block, k)| parts[block][k]);
        }
        result
    }

    /// Multiplies each entry by the units of its row and of its column.
    pub(crate) fn in_units(mut self, units: &DVector<f64>) -> Self {
        assert_eq!(units.len(), self.len(), "a unit per row");
        for factor in [&mut self.left, &mut self.right] {
            factor.column_iter_mut().zip(units.iter()).for_each(|(mut column, unit)| column *= *unit);
        }
        for (place, unit) in self.places.iter().zip(units.iter()) {
            if let Some((block, k)) = *place {
                self.blocks[block].row_mut(k).scale_mut(*unit);
                self.blocks[block].column_mut(k).scale_mut(*unit);
            }
        }
        self
    }

    /// All entries as a dense matrix.
    pub(crate) fn dense(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.len(), self.len(), |i, j| self.entry(i, j))
    }
}
