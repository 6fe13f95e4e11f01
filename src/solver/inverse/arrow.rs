//! Decomposes the linear model at the optimum, in time proportional to the number of channels.
//!
//! A block of rows, one per channel, involves parameters x of its own and a few parameters y that several blocks share, so
//! that J has the shape of an arrow. With A the block's own columns and B its shared ones, both scaled to unit length,
//!
//! - the singular value decomposition A = Q S V^T gives W = V S^-1, so that (J^T J)^-1 of the own parameters alone is
//!   W W^T, and C = W Q^T B: for given shared parameters y, the best own ones are x = -C y;
//! - the rows B - Q Q^T B of all blocks together contain what remains to determine the shared parameters. Any y moves all
//!   parameters along T y, with T = (-C; 1). In an orthonormal basis of those directions another small decomposition
//!   gives Z, and
//!
//! (J^T J)^-1 = diag(W W^T) + Z Z^T: a block per channel and a product of matrices with few columns.
//!
//! Directions that are not determined, within a block or along T y, are left out, so that the inverse is that of Moore and
//! Penrose. `bounded_step` eliminates in the same way, but from a damped model, which has no such directions.

use super::block_matrix::BlockMatrix;
use super::lanczos::largest_eigenpair;
use super::svd::Svd;
use crate::solver::least_squares::Linearisation;
use nalgebra::{DMatrix, DVector};

/// A direction is not determined in double precision if its singular value is below this fraction of the largest.
const RANK_TOLERANCE: f64 = 1e-11;

/// The decomposed linear model in some of the parameters, with its columns scaled to unit length.
///
/// Its matrices and vectors have one row per selected parameter.
pub(crate) struct Arrow {
    /// Columns of the Jacobian, ascending.
    columns: Vec<usize>,
    /// Lengths of the columns.
    pub(crate) lengths: DVector<f64>,
    /// For each parameter, the only block that involves it and its index there; `None` if several do.
    places: Vec<Option<(usize, usize)>>,
    /// One part per block of rows, then one per parameter that no block involves.
    parts: Vec<Part>,
    /// Z^T.
    common: DMatrix<f64>,
    /// Unit vectors, as rows, along the undetermined directions that involve shared parameters.
    null: DMatrix<f64>,
    /// Ratio of the largest to the smallest singular value.
    pub(crate) condition: f64,
    /// The unit vector along the direction known worst.
    pub(crate) weakest: DVector<f64>,
}

/// The parameters that only one block involves.
struct Part {
    /// The columns of these parameters, ascending.
    own: Vec<usize>,
    /// W.
    half: DMatrix<f64>,
    /// Unit vectors, as columns, along the directions that are not determined.
    null: DMatrix<f64>,
    /// The singular values of those directions.
    lost: Vec<f64>,
}

/// One block of rows; parameters are given by their index among those selected.
struct Scaled {
    own: Vec<usize>,
    shared: Vec<usize>,
    /// A.
    of_own: DMatrix<f64>,
    /// B.
    of_shared: DMatrix<f64>,
}

/// What remains of a block once its own parameters are eliminated.
struct Eliminated {
    part: Part,
    /// C.
    coupling: DMatrix<f64>,
    /// B - Q Q^T B.
    remainder: DMatrix<f64>,
}

impl Scaled {
    /// Eliminates the block's own parameters. A direction whose singular value is at most `least` counts as not
    /// determined.
    fn eliminate(&self, least: f64) -> Eliminated {
        let own = self.own.clone();
        let svd = Svd::new(self.of_own.clone());
        let (kept, dropped) = svd.split(least);
        let half = svd.half_inverse(&kept);
        let basis = svd.left.select_columns(&kept);
        let seen = basis.tr_mul(&self.of_shared);
        let mut remainder = &self.of_shared - &basis * &seen;
        // Subtracted once more: if little remains, it consists mostly of the rounding errors of what was subtracted.
        remainder -= &basis * basis.tr_mul(&remainder);
        let null = svd.right.select_columns(&dropped);
        let lost = svd.values.select_rows(&dropped).iter().copied().collect();
        let coupling = &half * seen;
        Eliminated { part: Part { own, half, null, lost }, coupling, remainder }
    }

    /// Adds J^T J v to `sum`.
    fn add_normal(&self, v: &DVector<f64>, sum: &mut DVector<f64>) {
        let image = &self.of_own * v.select_rows(&self.own) + &self.of_shared * v.select_rows(&self.shared);
        for (places, matrix) in [(&self.own, &self.of_own), (&self.shared, &self.of_shared)] {
            for (place, entry) in places.iter().zip(matrix.tr_mul(&image).iter()) {
                sum[*place] += entry;
            }
        }
    }
}

impl Arrow {
    /// Decomposes the model in the parameters `columns`, ascending, out of `n`. `None` if there are none, or if the
    /// model contains a number that is not finite.
    pub(crate) fn new(model: &Linearisation, n: usize, columns: Vec<usize>) -> Option<Self> {
        let lengths = model.column_lengths(n).map(|length| if length > 0.0 { length } else { 1.0 });
        let blocks = scaled_blocks(model, &columns, &lengths);
        // Values close to the largest double overflow in the computation; then there is no covariance.
        let finite = |m: &DMatrix<f64>| m.iter().all(|v| v.is_finite());
        if !blocks.iter().all(|block| finite(&block.of_own) && finite(&block.of_shared)) {
            return None;
        }
        let normal = |v: &DVector<f64>| {
            let mut sum = DVector::zeros(v.len());
            blocks.iter().for_each(|block| block.add_normal(v, &mut sum));
            sum
        };
        let largest = largest_eigenpair(columns.len(), normal)?.0.max(0.0).sqrt();
        let least = RANK_TOLERANCE * largest;
        let eliminated: Vec<Eliminated> = blocks.iter().map(|block| block.eliminate(least)).collect();

        let mut places = vec![None; columns.len()];
        for (index, block) in blocks.iter().enumerate() {
            for (k, place) in block.own.iter().enumerate() {
                places[*place] = Some((index, k));
            }
        }
        let shared: Vec<usize> = (0..columns.len()).filter(|i| places[*i].is_none()).collect();
        let (common, null, lost) = if shared.is_empty() {
            (DMatrix::zeros(0, columns.len()), DMatrix::zeros(0, columns.len()), Vec::new())
        } else {
            tell_shared(columns.len(), &shared, &blocks, &eliminated, least)?
        };
        let parts: Vec<Part> = eliminated.into_iter().map(|block| block.part).collect();
        let lengths = lengths.select_rows(&columns);
        let condition = f64::NAN;
        let weakest = DVector::zeros(columns.len());
        let mut arrow = Self { columns, lengths, places, parts, common, null, condition, weakest };
        let (smallest, weakest) = match arrow.least_determined(&lost) {
            Some(known) => known,
            None => {
                let inverse = arrow.inverse();
                let (largest, vector) = largest_eigenpair(inverse.len(), |v| inverse.times(v))?;
                (1.0 / largest.sqrt(), vector)
            }
        };
        arrow.condition = largest / smallest;
        arrow.weakest = weakest;
        Some(arrow)
    }

    /// Number of selected parameters.
    pub(super) fn len(&self) -> usize {
        self.columns.len()
    }

    /// The only block that involves a parameter and the parameter's index there; `None` if several do.
    pub(super) fn place(&self, i: usize) -> Option<(usize, usize)> {
        self.places[i]
    }

    /// W of a block.
    pub(super) fn half(&self, block: usize) -> &DMatrix<f64> {
        &self.parts[block].half
    }

    /// Z^T.
    pub(super) fn common(&self) -> &DMatrix<f64> {
        &self.common
    }

    /// Of the directions that are not determined, the one with the smallest singular value; `lost` holds the singular
    /// values of the directions in `null`.
    fn least_determined(&self, lost: &[f64]) -> Option<(f64, DVector<f64>)> {
        let n = self.columns.len();
        let own = self.parts.iter().flat_map(|part| {
            part.lost.iter().zip(part.null.column_iter()).map(move |(value, vector)| {
                let mut whole = DVector::zeros(n);
                for (place, entry) in part.own.iter().zip(vector.iter()) {
                    whole[*place] = *entry;
                }
                (*value, whole)
            })
        });
        let shared = lost.iter().zip(self.null.row_iter()).map(|(value, row)| (*value, row.transpose()));
        own.chain(shared).min_by(|(a, _), (b, _)| a.total_cmp(b))
    }

    /// The projection onto the directions that are not determined.
    pub(crate) fn unknown(&self) -> BlockMatrix {
        let blocks = self.parts.iter().map(|part| &part.null * part.null.transpose()).collect();
        BlockMatrix::new(self.places.clone(), blocks, self.null.clone(), self.null.clone())
    }

    /// (J^T J)^-1 over the directions that are determined.
    pub(crate) fn inverse(&self) -> BlockMatrix {
        let blocks: Vec<DMatrix<f64>> =
            self.parts.iter().map(|part| &part.half * part.half.transpose()).collect();
        let (mut left, mut right) = (self.common.clone(), self.common.clone());
        if self.null.nrows() > 0 {
            // With N the directions that are not determined and D = diag(W W^T), only (1 - N N^T) D (1 - N N^T) is
            // needed of D: it is D + N M^T + M N^T with M = N N^T D N/2 - D N.
            let mut d_n = DMatrix::zeros(self.null.nrows(), self.null.ncols());
            for (part, block) in self.parts.iter().zip(&blocks) {
                let product = self.null.select_columns(&part.own) * block;
                for (place, column) in part.own.iter().zip(product.column_iter()) {
                    d_n.set_column(*place, &column);
                }
            }
            let inner = &d_n * self.null.transpose();
            let m = inner * &self.null * 0.5 - d_n;
            left = stacked(&[&left, &self.null, &m]);
            right = stacked(&[&right, &m, &self.null]);
        }
        BlockMatrix::new(self.places.clone(), blocks, left, right)
    }

    /// The sandwich around F^T F, where F has rows in the same blocks as the model.
    pub(crate) fn sandwich(&self, scatter: &Linearisation) -> BlockMatrix {
        // With the inverse written as D + L R^T, the product of a block of F with it is P + Y R^T, where P = F D in
        // the block's own columns and Y = F L. The sum of (P + Y R^T)^T (P + Y R^T) over the blocks is diag(P^T P) + E
        // R^T + R E^T + R (sum Y^T Y) R^T, where the rows of E are P^T Y.
        assert!(scatter.blocks.len() <= self.parts.len(), "the blocks of the model");
        let inverse = self.inverse();
        let (left, right) = inverse.factors();
        let mut products: Vec<DMatrix<f64>> =
            self.parts.iter().map(|part| DMatrix::zeros(part.own.len(), part.own.len())).collect();
        let mut e = DMatrix::zeros(left.nrows(), left.ncols());
        let mut y_y = DMatrix::zeros(left.nrows(), left.nrows());
        let units = &self.lengths;
        for (index, rows) in scatter.blocks.iter().enumerate() {
            let part = &self.parts[index];
            let pairs = rows.columns.iter().enumerate();
            let pairs = pairs.filter_map(|(k, column)| Some((k, self.columns.binary_search(column).ok()?)));
            let (taken, selected): (Vec<usize>, Vec<usize>) = pairs.unzip();
            let mut f = rows.jacobian.select_columns(&taken);
            for (mut column, unit) in f.column_iter_mut().zip(units.select_rows(&selected).iter()) {
                column /= *unit;
            }
            let own: Vec<usize> =
                part.own.iter().filter_map(|place| selected.iter().position(|s| s == place)).collect();
            assert_eq!(own.len(), part.own.len(), "a column of each of the block's own parameters");
            let p = f.select_columns(&own) * inverse.block(index);
            let y = &f * left.select_columns(&selected).transpose();
            for (place, column) in part.own.iter().zip(y.tr_mul(&p).column_iter()) {
                e.set_column(*place, &column);
            }
            y_y += y.tr_mul(&y);
            products[index] = p.tr_mul(&p);
        }
        let half = e + y_y * right * 0.5;
        BlockMatrix::new(self.places.clone(), products, stacked(&[&half, right]), stacked(&[right, &half]))
    }

    /// A root of the part of (J^T J)^-1 that belongs to the columns of one block, in the Jacobian's units: one row per
    /// column, with zeros for columns that are not selected.
    pub(crate) fn root(&self, columns: &[usize]) -> Vec<Vec<f64>> {
        let place = |column: &usize| self.columns.binary_search(column).ok();
        let part = columns.iter().filter_map(place).find_map(|i| self.places[i]);
        let part = part.map(|(index, _)| &self.parts[index]);
        let width = part.map_or(0, |part| part.half.ncols());
        let row = |column: &usize| {
            let mut row = vec![0.0; width + self.common.nrows()];
            let Some(i) = place(column) else { return row };
            let (of_own, of_common) = row.split_at_mut(width);
            let length = self.lengths[i];
            if let (Some(part), Some((_, k))) = (part, self.places[i]) {
                for (entry, value) in of_own.iter_mut().zip(part.half.row(k).iter()) {
                    *entry = value / length;
                }
            }
            for (entry, value) in of_common.iter_mut().zip(self.common.column(i).iter()) {
                *entry = value / length;
            }
            row
        };
        columns.iter().map(row).collect()
    }
}

/// The model's blocks in the selected columns, and an empty block for each column that no block involves.
fn scaled_blocks(model: &Linearisation, columns: &[usize], lengths: &DVector<f64>) -> Vec<Scaled> {
    let uses = model.uses(lengths.len());
    let uses_of = |place: &usize| uses[columns[*place]];
    let mut blocks: Vec<Scaled> = Vec::with_capacity(model.blocks.len());
    for rows in &model.blocks {
        let places = rows.columns.iter().filter_map(|column| columns.binary_search(column).ok());
        let mut places: Vec<usize> = places.collect();
        places.sort_unstable();
        let (own, shared): (Vec<usize>, Vec<usize>) =
            places.into_iter().partition(|place| uses_of(place) == 1);
        let scaled = |places: &[usize]| {
            let wanted: Vec<usize> = places.iter().map(|place| columns[*place]).collect();
            rows.scaled(&wanted, lengths)
        };
        let (of_own, of_shared) = (scaled(&own), scaled(&shared));
        blocks.push(Scaled { own, shared, of_own, of_shared });
    }
    for place in (0..columns.len()).filter(|place| uses_of(place) == 0) {
        let (of_own, of_shared) = (DMatrix::zeros(1, 1), DMatrix::zeros(1, 0));
        blocks.push(Scaled { own: vec![place], shared: Vec::new(), of_own, of_shared });
    }
    blocks
}

/// Decomposes the remaining rows in the shared parameters. Returns Z^T, the undetermined directions as rows, and their
/// singular values.
fn tell_shared(
    n: usize,
    shared: &[usize],
    blocks: &[Scaled],
    eliminated: &[Eliminated],
    least: f64,
) -> Option<(DMatrix<f64>, DMatrix<f64>, Vec<f64>)> {
    let height = eliminated.iter().map(|block| block.remainder.nrows()).sum();
    let mut rest = DMatrix::zeros(height, shared.len());
    // T, by which all parameters follow the shared ones.
    let mut follow = DMatrix::zeros(n, shared.len());
    // The column of each shared parameter; `usize::MAX` for the others.
    let mut column_of = vec![usize::MAX; n];
    for (column, place) in shared.iter().enumerate() {
        column_of[*place] = column;
        follow[(*place, column)] = 1.0;
    }
    let mut first = 0;
    for (block, Eliminated { part, coupling, remainder }) in blocks.iter().zip(eliminated) {
        for (k, column) in block.shared.iter().map(|place| column_of[*place]).enumerate() {
            rest.view_mut((first, column), (remainder.nrows(), 1)).copy_from(&remainder.column(k));
            for (place, entry) in part.own.iter().zip(coupling.column(k).iter()) {
                follow[(*place, column)] = -entry;
            }
        }
        first += remainder.nrows();
    }
    let qr = follow.qr();
    // The rows in an orthonormal basis of the directions T y.
    let rest = qr.r().tr_solve_upper_triangular(&rest.transpose())?.transpose();
    let svd = Svd::new(rest.qr().r());
    let (kept, dropped) = svd.split(least);
    let basis = qr.q();
    let common = (&basis * svd.half_inverse(&kept)).transpose();
    let null = (&basis * svd.right.select_columns(&dropped)).transpose();
    Some((common, null, svd.values.select_rows(&dropped).iter().copied().collect()))
}

/// Stacks matrices of the same width on top of each other.
fn stacked(matrices: &[&DMatrix<f64>]) -> DMatrix<f64> {
    let rows: Vec<_> = matrices.iter().flat_map(|matrix| matrix.row_iter()).collect();
    if rows.is_empty() {
        return DMatrix::zeros(0, matrices.first().map_or(0, |matrix| matrix.ncols()));
    }
    DMatrix::from_rows(&rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::count;
    use crate::solver::least_squares::Rows;
    use approx::assert_relative_eq;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// What makes some parameters undetermined.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Defect {
        None,
        /// A column of zeros, for a block's own parameter and for a shared one.
        Zeros,
        /// Two equal columns of a block.
        Twins,
        /// A shared column that is a combination of each block's own columns.
        Covered,
        /// Two shared columns that differ only by a combination of the own columns.
        SharedTwins,
        /// A parameter that no block involves.
        Orphan,
        /// One of each kind that can occur together.
        Several,
    }

    const DEFECTS: [Defect; 7] = [
        Defect::None,
        Defect::Zeros,
        Defect::Twins,
        Defect::Covered,
        Defect::SharedTwins,
        Defect::Orphan,
        Defect::Several,
    ];

    /// Blocks of 6 rows with 3 parameters of their own each, followed by the shared parameters and possibly one that
    /// no block involves. Some blocks do not involve the first shared one.
    fn random(blocks: usize, shared: usize, defect: Defect, rng: &mut Pcg64Mcg) -> (Linearisation, usize) {
        let first = 3 * blocks;
        let has = |kind: Defect| defect == kind || defect == Defect::Several;
        let of_block = |block: usize| {
            let mut columns: Vec<usize> = (3 * block..3 * block + 3).collect();
            columns.extend((first..first + shared).filter(|k| *k > first || block % 3 < 2));
            let mut jacobian = DMatrix::from_fn(6, columns.len(), |_, k| {
                10_f64.powi(i32::try_from(k).unwrap() - 2) * rng.random_range(-1.0..1.0)
            });
            let last = columns.len() - 1;
            if has(Defect::Zeros) && block == 1 {
                jacobian.fill_column(1, 0.0);
            }
            if has(Defect::Twins) && block == 2 {
                let twin = jacobian.column(0) * 3.0;
                jacobian.set_column(2, &twin);
            }
            if has(Defect::Covered) {
                let sum = jacobian.column(0) - jacobian.column(2) * 0.3;
                jacobian.set_column(last, &sum);
            }
            if defect == Defect::SharedTwins && shared > 1 {
                let sum = jacobian.column(last) * 0.7 + jacobian.column(1) * 5.0;
                jacobian.set_column(last - 1, &sum);
            }
            if defect == Defect::Zeros && shared > 2 {
                jacobian.fill_column(last, 0.0);
            }
            Rows { columns, jacobian, residual: DVector::zeros(6) }
        };
        let blocks: Vec<Rows> = (0..blocks).map(of_block).collect();
        (
            Linearisation { cost: 1.0, blocks, costs: Vec::new() },
            first + shared + usize::from(has(Defect::Orphan)),
        )
    }

    /// The selected columns of the whole Jacobian, or of other rows, in units of `lengths`.
    fn selected(matrix: &DMatrix<f64>, columns: &[usize], lengths: &DVector<f64>) -> DMatrix<f64> {
        let mut selected = matrix.select_columns(columns);
        selected.column_iter_mut().zip(lengths.iter()).for_each(|(mut column, length)| column /= *length);
        selected
    }

    #[track_caller]
    fn assert_alike(found: &DMatrix<f64>, expected: &DMatrix<f64>, tolerance: f64, label: &str) {
        let apart = (found - expected).amax();
        assert!(apart < tolerance * expected.amax().max(1.0), "{label}: {apart:e} of {:e}", expected.amax());
    }

    /// The rank of the whole matrix, by its singular values.
    fn rank(design: &DMatrix<f64>) -> usize {
        let values = Svd::new(design.clone()).values;
        values.iter().filter(|value| **value > RANK_TOLERANCE * values.max()).count()
    }

    /// The conditions of Moore and Penrose, which only one matrix meets, and other properties that follow from the
    /// whole matrix.
    #[test]
    fn as_the_whole_would_be() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let mut unknown_directions = 0;
        for (blocks, shared) in [(1, 0), (4, 0), (4, 1), (5, 2), (12, 3), (4, 12)] {
            for defect in DEFECTS {
                for held in [0, 1, 2] {
                    let (model, n) = random(blocks, shared, defect, &mut rng);
                    let (scatter, _) = random(blocks, shared, Defect::None, &mut rng);
                    // Parameters that are held take no part: none, some, or all of a block's and some of the shared
                    // ones.
                    let kept = |k: &usize| match held {
                        0 => true,
                        1 => k % 4 != 1,
                        _ => !(3..6).contains(k) && k % 7 != 5,
                    };
                    let columns: Vec<usize> = (0..n).filter(kept).collect();
                    let label = format!("{blocks} blocks, {shared} shared, {defect:?}, held {held}");
                    let arrow = Arrow::new(&model, n, columns.clone()).expect(&label);
                    let design = selected(&model.matrix(n), &columns, &arrow.lengths);
                    let normal = design.tr_mul(&design);
                    let (inverse, unknown) = (arrow.inverse().dense(), arrow.unknown().dense());
                    let size = inverse.amax().max(1.0);
                    let one = DMatrix::identity(columns.len(), columns.len());
                    assert_alike(
                        &(&design * &unknown),
                        &DMatrix::zeros(design.nrows(), columns.len()),
                        1e-11,
                        &label,
                    );
                    assert_alike(&(&unknown * &unknown), &unknown, 1e-12, &label);
                    assert_alike(&(&normal * &inverse), &(one - &unknown), 1e-12 * size, &label);
                    assert_alike(
                        &(&inverse * &unknown),
                        &DMatrix::zeros(columns.len(), columns.len()),
                        1e-12 * size,
                        &label,
                    );
                    let lost = columns.len() - rank(&design);
                    assert_relative_eq!(unknown.trace(), count(lost), epsilon = 1e-9);
                    unknown_directions += lost;

                    let spread = selected(&scatter.matrix(n), &columns, &arrow.lengths) * &inverse;
                    assert_alike(
                        &arrow.sandwich(&scatter).dense(),
                        &spread.tr_mul(&spread),
                        1e-12 * size,
                        &label,
                    );

                    assert_relative_eq!(arrow.weakest.norm(), 1.0, max_relative = 1e-12);
                    let values = Svd::new(design.clone()).values;
                    if lost == 0 {
                        assert_relative_eq!(
                            arrow.condition,
                            values.max() / values.min(),
                            max_relative = 1e-9
                        );
                        let least = (&design * &arrow.weakest).norm();
                        assert_relative_eq!(least, values.min(), max_relative = 1e-6);
                    } else {
                        assert!(arrow.condition >= 1e11, "{label}: {}", arrow.condition);
                        assert!((&design * &arrow.weakest).norm() < 1e-11, "{label}");
                    }
                }
            }
        }
        assert!(unknown_directions > 50, "a test of what is unknown needs some of it: {unknown_directions}");
    }

    #[test]
    fn roots_tell_leverages() {
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        for defect in DEFECTS {
            let (model, n) = random(6, 3, defect, &mut rng);
            let columns: Vec<usize> = (0..n).filter(|k| k % 5 != 3).collect();
            let arrow = Arrow::new(&model, n, columns.clone()).unwrap();
            let inverse = arrow.inverse().dense();
            let design = selected(&model.matrix(n), &columns, &arrow.lengths);
            let mut rows_before = 0;
            for rows in &model.blocks {
                let root = arrow.root(&rows.columns);
                let root = DMatrix::from_fn(root.len(), root[0].len(), |i, k| root[i][k]);
                for (k, row) in (&rows.jacobian * root).row_iter().enumerate() {
                    let whole = design.row(rows_before + k);
                    let leverage = (whole * &inverse * whole.transpose())[0];
                    assert_relative_eq!(row.norm_squared(), leverage, epsilon = 1e-9);
                }
                rows_before += rows.jacobian.nrows();
            }
        }
    }

    #[test]
    fn times_and_square_are_those_of_the_whole() {
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        let (model, n) = random(5, 2, Defect::Several, &mut rng);
        let arrow = Arrow::new(&model, n, (0..n).collect()).unwrap();
        let units = DVector::from_fn(n, |_, _| rng.random_range(0.1..10.0));
        let matrix = arrow.sandwich(&model);
        let whole = matrix.dense().component_mul(&(&units * units.transpose()));
        let matrix = matrix.in_units(&units);
        assert_alike(&matrix.dense(), &whole, 1e-13, "units");
        assert_alike(&whole.transpose(), &whole, 1e-15, "symmetry");
        let v = DVector::from_fn(n, |_, _| rng.random_range(-1.0..1.0));
        assert!((matrix.times(&v) - &whole * &v).amax() < 1e-12 * whole.amax());
        let sparse = [(1, 0.3), (n - 2, -2.0), (1, 0.5), (7, 1.0)];
        let mut d = DVector::zeros(n);
        sparse.iter().for_each(|(i, x)| d[*i] += x);
        assert!((matrix.square(&sparse) - d.dot(&(&whole * &d))).abs() < 1e-12 * whole.amax());
    }
}
