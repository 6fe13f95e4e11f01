//! How the minimum of the linear model moves when a whole group of rows is left out of it.
//!
//! Let the columns of R be such that H^-1 = R R^T, and Z = J R: orthonormal columns that span what the model can follow. With Z_g and r_g
//! the rows and residuals of group g, S_g = Z_g^T Z_g is the group's share in everything that is known, and all shares add up to 1. Without
//! the group the minimum moves by
//!
//! - R (1 - S_g)^-1 Z_g^T r_g (exact where the model is linear).
//!
//! Where a model misses its data, the curvature of the sum of squares is not that of the linear model, H, but H + C with C the sum of r
//! times the second derivatives of r (`curvature`). All moves are then multiplied by (1 + R^T C R)^-1, as the minimum of a function with
//! this curvature and this slope moves by its inverse times the slope.
//!
//! The sum of the squares of these moves over all groups is the covariance called CR3 (Bell and McCaffrey 2002, Survey Methodology 28(2),
//! 169; Cameron and Miller 2015, doi:10.3368/jhr.50.2.317), the jackknife over groups. It assumes nothing of how the rows of a group err
//! together.
//!
//! Where a group has a large share, its move is larger than its noise explains, and CR3 errs on the wide side: more than twice for a peak
//! that three groups see. For each parameter the sum of squares is therefore divided by what it would be, over the true variance, if all
//! rows had independent errors of the same size: `Knowledge::excess`. Then it is right for such errors, as CR2 is.
//!
//! A variance that few groups determine is itself uncertain. If all rows had independent normal errors of the same size, the moves of a
//! parameter would have covariances P_gh = d_gh b_g^T S_g b_g - b_g^T S_g S_h b_h, with b_g = (1 - S_g)^-1 R^T e for the unit vector e of
//! the parameter (so that the excess is tr P over |R^T e|^2), and the sum of their squares would be distributed about like chi-square with
//! (tr P)^2 / tr(P^2) degrees of freedom (Satterthwaite 1946, doi:10.2307/3002019; Bell and McCaffrey 2002). Where one group has most of the
//! share, that errs on the wide side for such errors; the exact distribution does not, but is too narrow where bright samples are noisier.
//!
//! R has the arrow's shape: columns that belong to one block, and a few that all have in common. So do S_g and 1 - S_g, which is solved by
//! eliminating the blocks' own columns.

use super::arrow::Arrow;
use super::group_sums::GroupSums;
use crate::math::half_interval_of_student;
use crate::solver::least_squares::Linearisation;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// A group's share in what is known may reach 1 in a direction that no other group determines. It is taken as this fraction less, so that
/// the moves remain finite.
const REGULARISATION: f64 = 1e-3;

/// The least curvature in any direction, as a fraction of that of the linear model. A minimum is known with difficulty where it is flatter.
const LEAST_CURVATURE: f64 = 0.01;
/// The fractions of C that are tried, until the curvature is nowhere less.
const SHARES_OF_CURVATURE: [f64; 5] = [1.0, 0.9, 0.75, 0.5, 0.25];

/// The linear model, ready to leave out one group of rows at a time.
pub(crate) struct Jackknife<'a> {
    arrow: &'a Arrow,
    /// The rows of R that belong to the columns of each block.
    roots: Vec<DMatrix<f64>>,
    groups: Vec<Group>,
    /// (1 + R^T C R)^-1 R^T e for the unit vector e of each parameter.
    directions: Vec<Split>,
}

/// What the jackknife needs beside the linear model, in its blocks.
#[derive(Clone, Copy)]
pub(crate) struct GroupedRows<'g> {
    /// The sums over the groups' rows.
    pub(crate) sums: &'g [GroupSums],
    /// C.
    pub(crate) curvature: &'g [DMatrix<f64>],
}

/// A vector over the columns of R: those of each block, then those in common.
#[derive(Clone)]
struct Split {
    own: Vec<DVector<f64>>,
    common: DVector<f64>,
}

/// A symmetric matrix A in the arrow's shape, and what solves (1 - A) b = a.
struct Part {
    /// A: for each block its own columns with themselves and with those in common, then those in common with themselves.
    own: Vec<DMatrix<f64>>,
    coupling: Vec<DMatrix<f64>>,
    common: DMatrix<f64>,
    /// (1 - A)^-1 in the own columns of each block.
    own_inverse: Vec<DMatrix<f64>>,
    /// The inverse of what remains in the columns in common once the others are eliminated.
    common_inverse: DMatrix<f64>,
}

/// A group of rows.
struct Group {
    /// S_g, a thousandth smaller than it is.
    share: Part,
    /// Z_g^T r_g.
    slope: Split,
}

/// The covariance of the parameters, in the arrow's scaled coordinates, and how well their variances are known.
pub(crate) struct Spread {
    /// Rows whose products with themselves add up to the covariance.
    pub(crate) rows: DMatrix<f64>,
    /// Half of the 95 % interval of each parameter, in standard errors.
    pub(crate) half_intervals: Vec<f64>,
    /// The largest share of a group in what is known of each parameter, 0..1.
    pub(crate) largest_shares: Vec<f64>,
    /// The variance of each parameter if the residuals have variance 1, from the curvature of the sum of squares.
    pub(crate) unit_variances: Vec<f64>,
}

/// What is known of the variance of a parameter.
#[derive(Clone, Copy, Debug)]
struct Knowledge {
    /// Degrees of freedom of the sum of squares.
    freedom: f64,
    /// The expected sum of squares for independent errors of variance 1, over the variance that the parameter then has. It is above 1.
    excess: f64,
    /// The largest share of a group in what is known of the parameter, 0..1.
    largest_share: f64,
}

impl Split {
    fn dot(&self, other: &Self) -> f64 {
        let own: f64 = self.own.iter().zip(&other.own).map(|(a, b)| a.dot(b)).sum();
        own + self.common.dot(&other.common)
    }
}

impl Part {
    /// The matrix that is the sum over the blocks of `matrices` between the rows of R that belong to the block's columns; the last `m`
    /// columns of these are in common. `None` unless 1 - A is finite and positive definite.
    fn new(roots: &[DMatrix<f64>], matrices: impl Iterator<Item = DMatrix<f64>>, m: usize) -> Option<Self> {
        let mut part = Self {
            own: Vec::with_capacity(roots.len()),
            coupling: Vec::with_capacity(roots.len()),
            common: DMatrix::zeros(m, m),
            own_inverse: Vec::with_capacity(roots.len()),
            common_inverse: DMatrix::zeros(m, m),
        };
        let mut remainder = DMatrix::identity(m, m);
        for (root, matrix) in roots.iter().zip(matrices) {
            let width = root.ncols() - m;
            let product = root.tr_mul(&(matrix * root));
            let own = product.view((0, 0), (width, width)).into_owned();
            let coupling = product.view((0, width), (width, m)).into_owned();
            let common = product.view((width, width), (m, m));
            let own_inverse = inverse(DMatrix::identity(width, width) - &own)?;
            remainder -= common + coupling.tr_mul(&(&own_inverse * &coupling));
            part.common += common;
            part.own.push(own);
            part.coupling.push(coupling);
            part.own_inverse.push(own_inverse);
        }
        part.common_inverse = inverse(remainder)?;
        Some(part)
    }

    /// (1 - A)^-1 a.
    fn solve(&self, a: &Split) -> Split {
        let solved: Vec<DVector<f64>> = self.own_inverse.iter().zip(&a.own).map(|(e, a)| e * a).collect();
        let mut right = a.common.clone();
        for (coupling, solved) in self.coupling.iter().zip(&solved) {
            right += coupling.tr_mul(solved);
        }
        let common = &self.common_inverse * right;
        let blocks = solved.into_iter().zip(&self.own_inverse).zip(&self.coupling);
        let own =
            blocks.map(|((solved, inverse), coupling)| solved + inverse * (coupling * &common)).collect();
        Split { own, common }
    }

    /// A b.
    fn times(&self, b: &Split) -> Split {
        let blocks = self.own.iter().zip(&self.coupling).zip(&b.own);
        let own = blocks.map(|((own, coupling), of_own)| own * of_own + coupling * &b.common).collect();
        let mut common = &self.common * &b.common;
        for (coupling, of_own) in self.coupling.iter().zip(&b.own) {
            common += coupling.tr_mul(of_own);
        }
        Split { own, common }
    }
}

/// The inverse of a symmetric matrix; `None` unless it is finite and positive definite.
fn inverse(matrix: DMatrix<f64>) -> Option<DMatrix<f64>> {
    if matrix.is_empty() {
        return Some(matrix);
    }
    let inverse = matrix.cholesky()?.inverse();
    inverse.iter().all(|entry| entry.is_finite()).then_some(inverse)
}

impl<'a> Jackknife<'a> {
    /// Prepares to leave out each group of the rows of `model`, which `arrow` decomposes. `None` if a group cannot be left out.
    pub(crate) fn new(arrow: &'a Arrow, model: &Linearisation, rows: GroupedRows<'_>) -> Option<Self> {
        let GroupedRows { sums, curvature } = rows;
        assert_eq!(model.blocks.len(), sums.len(), "sums for each block");
        assert_eq!(model.blocks.len(), curvature.len(), "a curvature for each block");
        let number = sums.iter().map(GroupSums::groups).max().unwrap_or(0);
        let m = arrow.common().nrows();
        let root = |(index, columns): (usize, &[usize])| {
            let root = arrow.root(columns);
            DMatrix::from_fn(root.len(), arrow.half(index).ncols() + m, |i, k| root[i][k])
        };
        let columns = model.blocks.iter().map(|rows| rows.columns.as_slice());
        let roots: Vec<DMatrix<f64>> = columns.enumerate().map(root).collect();
        let group = |group: usize| {
            let sums: Vec<_> = sums.iter().map(|sums| sums.of_group(group)).collect();
            let keep = 1.0 - REGULARISATION;
            let share = Part::new(&roots, sums.iter().map(|(normal, _)| normal * keep), m)?;
            let mut slope = Split { own: Vec::with_capacity(roots.len()), common: DVector::zeros(m) };
            for (root, (_, of_group)) in roots.iter().zip(&sums) {
                let width = root.ncols() - m;
                let of_block = root.tr_mul(of_group);
                slope.own.push(of_block.rows(0, width).into_owned());
                slope.common += of_block.rows(width, m);
            }
            Some(Group { share, slope })
        };
        let groups: Option<Vec<Group>> = (0..number).into_par_iter().map(group).collect();
        let bent = bent(&roots, curvature, m);
        let direction = |i: usize| {
            let direction = direction(arrow, roots.len(), i);
            bent.as_ref().map_or_else(|| direction.clone(), |bent| bent.solve(&direction))
        };
        let directions = (0..arrow.len()).map(direction).collect();
        Some(Self { arrow, groups: groups?, directions, roots })
    }

    /// The covariance from the moves of each parameter when each group is left out, over the root of its excess; `scatter` has the rows of
    /// the sandwich for independent errors, in the blocks of the model, if those may be the larger ones.
    ///
    /// Where few groups decide, the moves may be small by chance. Errors within a group hardly ever make up for each other, so that no
    /// standard error is smaller than that of independent rows. Intervals allow for that chance already, and stay as the groups give them.
    pub(crate) fn spread(&self, scatter: Option<&Linearisation>) -> Spread {
        let mut rows = self.moves();
        let knowledge: Vec<Knowledge> =
            (0..self.arrow.len()).into_par_iter().map(|i| self.knowledge_of(i)).collect();
        let mut half_intervals = Vec::with_capacity(knowledge.len());
        for (i, known) in knowledge.iter().enumerate() {
            let mut column = rows.column_mut(i);
            column /= known.excess.max(1.0).sqrt();
            let independent = scatter.map_or(0.0, |scatter| self.independent_variance(i, scatter).sqrt());
            let grouped = column.norm();
            let half_interval = half_interval_of_student(known.freedom);
            if independent > grouped && grouped > 0.0 {
                column *= independent / grouped;
                half_intervals.push(half_interval * grouped / independent);
            } else {
                half_intervals.push(half_interval);
            }
        }
        let unit_variance = |i| direction(self.arrow, self.roots.len(), i).dot(&self.directions[i]);
        Spread {
            rows,
            half_intervals,
            largest_shares: knowledge.iter().map(|known| known.largest_share).collect(),
            unit_variances: (0..self.arrow.len()).map(unit_variance).collect(),
        }
    }

    /// The variance of a parameter by the sandwich around rows in the blocks of the model.
    fn independent_variance(&self, i: usize, scatter: &Linearisation) -> f64 {
        let direction = &self.directions[i];
        let of_block = |(index, root): (usize, &DMatrix<f64>)| {
            let width = root.ncols() - direction.common.len();
            let weights = root.columns(0, width) * &direction.own[index]
                + root.columns(width, direction.common.len()) * &direction.common;
            (&scatter.blocks[index].jacobian * weights).norm_squared()
        };
        self.roots.iter().enumerate().map(of_block).sum()
    }

    /// How far each parameter moves when each group is left out: one row per group.
    fn moves(&self) -> DMatrix<f64> {
        let n = self.arrow.len();
        let of_group = |group: &Group| -> Vec<f64> {
            let moved = group.share.solve(&group.slope);
            self.directions.iter().map(|direction| direction.dot(&moved)).collect()
        };
        let rows: Vec<Vec<f64>> = self.groups.par_iter().map(of_group).collect();
        DMatrix::from_fn(rows.len(), n, |g, i| rows[g][i])
    }

    /// How far each parameter moves, in the arrow's scaled coordinates, when the slopes of the blocks, J^T dr for each, are added: one row
    /// for all blocks together, or one for each.
    pub(crate) fn moves_by(&self, slopes: &[DVector<f64>], each_block: bool) -> DMatrix<f64> {
        let m = self.arrow.common().nrows();
        let none = || Split {
            own: self.roots.iter().map(|root| DVector::zeros(root.ncols() - m)).collect(),
            common: DVector::zeros(m),
        };
        let mut rows = vec![none(); if each_block { self.roots.len() } else { 1 }];
        for (block, (root, slope)) in self.roots.iter().zip(slopes).enumerate() {
            let row = &mut rows[if each_block { block } else { 0 }];
            let slope = root.tr_mul(slope);
            let width = root.ncols() - m;
            row.own[block] += slope.rows(0, width);
            row.common += slope.rows(width, m);
        }
        DMatrix::from_fn(rows.len(), self.arrow.len(), |k, i| -self.directions[i].dot(&rows[k]))
    }

    fn knowledge_of(&self, i: usize) -> Knowledge {
        let direction = &self.directions[i];
        let square = direction.dot(direction);
        let mut shares = Vec::with_capacity(self.groups.len());
        let mut own = Vec::with_capacity(self.groups.len());
        let mut largest_share: f64 = 0.0;
        for group in &self.groups {
            let without = group.share.solve(direction);
            let share = group.share.times(&without);
            own.push(without.dot(&share));
            shares.push(share);
            largest_share = largest_share.max(direction.dot(&group.share.times(direction)));
        }
        let (mut trace, mut squares) = (0.0, 0.0);
        for (g, (share, own)) in shares.iter().zip(&own).enumerate() {
            let diagonal = own - share.dot(share);
            trace += diagonal;
            squares += diagonal * diagonal;
            let others: f64 = shares[..g].iter().map(|other| share.dot(other).powi(2)).sum();
            squares += 2.0 * others;
        }
        Knowledge {
            freedom: (trace * trace / squares).max(1.0),
            excess: trace / square,
            largest_share: largest_share / square,
        }
    }
}

/// R^T e for the unit vector e of a parameter.
fn direction(arrow: &Arrow, blocks: usize, i: usize) -> Split {
    let place = arrow.place(i);
    let own = (0..blocks).map(|index| match place {
        Some((block, k)) if block == index => arrow.half(index).row(k).transpose(),
        _ => DVector::zeros(arrow.half(index).ncols()),
    });
    Split { own: own.collect(), common: arrow.common().column(i).into_owned() }
}

/// -R^T C R, or as much of it as leaves the sum of squares a minimum; `None` if that is nothing.
fn bent(roots: &[DMatrix<f64>], curvature: &[DMatrix<f64>], m: usize) -> Option<Part> {
    SHARES_OF_CURVATURE.iter().find_map(|share| {
        let part = |by: f64| Part::new(roots, curvature.iter().map(|matrix| matrix * -by), m);
        // 1 - A c is positive definite for some c above 1 if the smallest eigenvalue of 1 - A is not below 1 - 1/c.
        part(share / (1.0 - LEAST_CURVATURE)).and_then(|_| part(*share))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::count;
    use crate::solver::least_squares::Rows;
    use approx::assert_relative_eq;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64Mcg;

    const GROUPS: usize = 6;
    const ROWS: usize = 24;

    /// Two blocks with two parameters of their own each and two that they share, in groups of four rows: the model at its minimum, the sums,
    /// and the whole matrix with the residuals beside it.
    fn problem(seed: u64) -> (Linearisation, Vec<GroupSums>, DMatrix<f64>, DVector<f64>) {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let columns = [vec![0, 1, 4, 5], vec![5, 2, 4, 3]];
        let mut whole = DMatrix::zeros(2 * ROWS, 6);
        for (block, columns) in columns.iter().enumerate() {
            for row in 0..ROWS {
                for column in columns {
                    whole[(block * ROWS + row, *column)] = rng.random_range(-1.0..1.0);
                }
            }
        }
        let noise = DVector::from_fn(2 * ROWS, |_, _| rng.sample::<f64, _>(StandardNormal));
        let svd = whole.clone().svd(true, true);
        let residuals = &noise - &whole * svd.solve(&noise, 0.0).unwrap();
        let blocks: Vec<Rows> = columns
            .iter()
            .enumerate()
            .map(|(block, columns)| Rows {
                columns: columns.clone(),
                jacobian: whole.rows(block * ROWS, ROWS).select_columns(columns),
                residual: residuals.rows(block * ROWS, ROWS).into_owned(),
            })
            .collect();
        let sums = blocks
            .iter()
            .map(|rows| {
                let mut sums = GroupSums::new(GROUPS, rows.columns.len());
                let mut columns: Vec<Vec<f64>> =
                    rows.jacobian.column_iter().map(|column| column.iter().copied().collect()).collect();
                columns.push(rows.residual.iter().copied().collect());
                let group_of: Vec<u32> = [0, 1, 2, 3, 4, 5].into_iter().cycle().take(ROWS).collect();
                sums.add(&columns, &group_of);
                sums
            })
            .collect();
        (Linearisation { cost: residuals.norm_squared(), blocks, costs: Vec::new() }, sums, whole, residuals)
    }

    /// No curvature beyond that of the linear model.
    fn flat(model: &Linearisation) -> Vec<DMatrix<f64>> {
        model.blocks.iter().map(|rows| DMatrix::zeros(rows.columns.len(), rows.columns.len())).collect()
    }

    /// Large independent errors that cancel within each group: the errors do not fall below those of independent rows.
    #[test]
    fn errors_are_no_smaller_than_independent_ones() {
        let (model, _, whole, _) = problem(1);
        let arrow = Arrow::new(&model, 6, (0..6).collect()).unwrap();
        let sums: Vec<GroupSums> = model
            .blocks
            .iter()
            .map(|rows| {
                let mut sums = GroupSums::new(GROUPS, rows.columns.len());
                let mut columns: Vec<Vec<f64>> =
                    rows.jacobian.column_iter().map(|column| column.iter().copied().collect()).collect();
                columns.push(vec![0.0; ROWS]);
                let group_of: Vec<u32> = [0, 1, 2, 3, 4, 5].into_iter().cycle().take(ROWS).collect();
                sums.add(&columns, &group_of);
                // Almost nothing is left of the residuals, but not nothing.
                let mut one = vec![vec![0.0]; rows.columns.len() + 1];
                one[0][0] = 1e-6;
                one[rows.columns.len()][0] = 1e-6;
                sums.add(&one, &[0]);
                sums
            })
            .collect();
        let rows = GroupedRows { sums: &sums, curvature: &flat(&model) };
        let spread = Jackknife::new(&arrow, &model, rows).unwrap().spread(Some(&model));
        // The rows of the model as those of the sandwich: residuals of variance 1, and the covariance (J^T J)^-1.
        let inverse = (whole.transpose() * &whole).try_inverse().unwrap();
        for i in 0..6 {
            let variance = spread.rows.column(i).norm_squared() / arrow.lengths[i].powi(2);
            assert_relative_eq!(variance, inverse[(i, i)], max_relative = 1e-9);
            assert!(spread.half_intervals[i] < 1e-3, "{}", spread.half_intervals[i]);
            assert_relative_eq!(
                spread.unit_variances[i],
                inverse[(i, i)] * arrow.lengths[i].powi(2),
                max_relative = 1e-9
            );
        }
    }

    /// With curvature, the moves are those of the function with that curvature.
    #[test]
    fn curvature_lengthens_moves() {
        let (model, sums, whole, _) = problem(3);
        let arrow = Arrow::new(&model, 6, (0..6).collect()).unwrap();
        let moves = |curvature: &[DMatrix<f64>]| {
            Jackknife::new(&arrow, &model, GroupedRows { sums: &sums, curvature }).unwrap().moves()
        };
        let straight = moves(&flat(&model));
        let curvature: Vec<DMatrix<f64>> =
            model.blocks.iter().map(|rows| rows.jacobian.tr_mul(&rows.jacobian) * -0.2).collect();
        let mut full = whole.transpose() * &whole;
        for (rows, matrix) in model.blocks.iter().zip(&curvature) {
            for (a, i) in rows.columns.iter().enumerate() {
                for (b, j) in rows.columns.iter().enumerate() {
                    full[(*i, *j)] += matrix[(a, b)];
                }
            }
        }
        let bent = moves(&curvature);
        let factor = full.try_inverse().unwrap() * (whole.transpose() * &whole);
        for group in 0..GROUPS {
            let unscaled = |moves: &DMatrix<f64>| moves.row(group).transpose().component_div(&arrow.lengths);
            assert_relative_eq!(unscaled(&bent), &factor * unscaled(&straight), max_relative = 1e-9);
        }
    }

    /// The rows of the whole matrix that do not belong to a group.
    fn others(group: usize) -> Vec<usize> {
        (0..2 * ROWS).filter(|row| row % ROWS % GROUPS != group).collect()
    }

    #[test]
    fn moves_are_those_of_the_model_without_the_group() {
        for seed in 0..5 {
            let (model, sums, whole, residuals) = problem(seed);
            let arrow = Arrow::new(&model, 6, (0..6).collect()).unwrap();
            let rows = GroupedRows { sums: &sums, curvature: &flat(&model) };
            let moves = Jackknife::new(&arrow, &model, rows).unwrap().moves();
            for group in 0..GROUPS {
                let kept = others(group);
                let svd = whole.select_rows(&kept).svd(true, true);
                let moved = svd.solve(&residuals.select_rows(&kept), 0.0).unwrap();
                for i in 0..6 {
                    // The residuals are measured less modelled, or the other way round: only the sign differs.
                    let found = moves[(group, i)] / arrow.lengths[i];
                    // What is left out counts by a thousandth.
                    assert_relative_eq!(found, -moved[i], max_relative = 0.01, epsilon = 0.01 * moved.amax());
                }
            }
        }
    }

    /// Many sets of independent residuals: the mean of the variances, and how they scatter.
    #[test]
    fn the_variance_of_independent_errors_is_foreseen() {
        let (model, sums, whole, _) = problem(0);
        let arrow = Arrow::new(&model, 6, (0..6).collect()).unwrap();
        let rows = GroupedRows { sums: &sums, curvature: &flat(&model) };
        let jackknife = Jackknife::new(&arrow, &model, rows).unwrap();
        let knowledge: Vec<Knowledge> = (0..6).map(|i| jackknife.knowledge_of(i)).collect();
        let inverse = (whole.transpose() * &whole).try_inverse().unwrap();
        let mut rng = Pcg64Mcg::seed_from_u64(9);
        let sets = 4000;
        let per_group: Vec<(DMatrix<f64>, DMatrix<f64>)> = (0..GROUPS)
            .map(|group| {
                let kept = whole.select_rows(&others(group));
                ((kept.transpose() * &kept).try_inverse().unwrap(), kept.transpose())
            })
            .collect();
        let all = &inverse * whole.transpose();
        let mut drawn = DMatrix::<f64>::zeros(sets, 6);
        for set in 0..sets {
            let noise = DVector::from_fn(2 * ROWS, |_, _| rng.sample::<f64, _>(StandardNormal));
            let best = &all * &noise;
            for (group, (inverse, transposed)) in per_group.iter().enumerate() {
                let moved = inverse * (transposed * noise.select_rows(&others(group))) - &best;
                for i in 0..6 {
                    drawn[(set, i)] += moved[i] * moved[i] / knowledge[i].excess;
                }
            }
        }
        for (i, known) in knowledge.iter().enumerate() {
            let column = drawn.column(i);
            let mean = column.mean();
            assert_relative_eq!(mean, inverse[(i, i)], max_relative = 0.06);
            // A sum of squares with k degrees of freedom scatters by 2 mean^2/k.
            assert_relative_eq!(2.0 * mean * mean / column.variance(), known.freedom, max_relative = 0.15);
            assert!((1.0 / count(GROUPS)..1.0).contains(&known.largest_share), "{}", known.largest_share);
        }
    }
}
