//! The inner loops of a pass: the work on one channel of one block.
//!
//! All loops run over rows of fixed length without branches, so that [`pulp`] can compile them for several instruction
//! sets; see [`crate::model::BasisBlock`].

use super::formula::{Sums, Term};
use super::loss::{LossKind, Objective};
use super::metric::{Transform, Wanted};
use crate::geometry::Row;
use crate::model::BasisBlock;
use crate::solver::inverse::group_sums::GroupSums;
use crate::solver::triangle::{Triangle, dot};
use pulp::{Simd, WithSimd};

/// Working space.
pub(super) struct Scratch {
    /// Jacobian columns, then the residuals.
    columns: Vec<Row>,
    x: Row,
    slope: Row,
    /// The squares of the residuals, for metrics in which they are no squares.
    squares: Row,
}

impl Default for Scratch {
    fn default() -> Self {
        let zero = Row::filled(0.0);
        Self { columns: Vec::new(), x: zero, slope: zero, squares: zero }
    }
}

/// Writes the rows of one channel of a block: its derivatives, then its reflectance.
pub(super) struct Evaluation<'a> {
    /// The evaluated basis of each lobe.
    pub(super) bases: &'a [BasisBlock],
    pub(super) sums: &'a Sums,
    pub(super) rows: &'a mut Vec<Row>,
}

impl WithSimd for Evaluation<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { bases, sums, rows } = self;
        let n = sums.columns().len();
        rows.resize(n + 1, Row::filled(0.0));
        let (columns, reflectance) = rows.split_at_mut(n);
        sum(bases, sums.reflectance(), &mut reflectance[0]);
        for (column, terms) in columns.iter_mut().zip(sums.columns()) {
            sum(bases, terms, column);
        }
    }
}

/// The measured values of one channel of one block.
#[derive(Clone, Copy)]
pub(super) struct ObservedBlock<'a> {
    pub(super) transform: Transform,
    pub(super) wanted: Wanted<'a>,
    /// Square root of weight times normalisation; 0 if there is no sample, or no value of it in the channel.
    pub(super) roots: &'a Row,
    /// The factor from a residual to standard deviations; `None` unless weights are by sigma.
    pub(super) precision: Option<&'a Row>,
    /// The given standard deviations over those that the weights are made from, times 1/g' at the prediction; `None` if they are the
    /// same.
    pub(super) noise: Option<&'a Row>,
}

/// One channel of one block, with everything needed to compute its residuals and derivatives.
pub(super) struct ChannelBlock<'a> {
    pub(super) observed: ObservedBlock<'a>,
    pub(super) cos_i: &'a Row,
    pub(super) objective: Objective,
    /// The evaluated basis of each lobe.
    pub(super) bases: &'a [BasisBlock],
    /// The terms of the reflectance.
    pub(super) reflectance: &'a [Term],
    /// The terms of its derivative with respect to each parameter.
    pub(super) columns: &'a [Vec<Term>],
    pub(super) scratch: &'a mut Scratch,
    pub(super) rows: Rows<'a>,
}

/// The rows that a pass computes.
#[derive(Clone, Copy)]
pub(super) enum Rows<'a> {
    /// The linear model, which a solver follows.
    Model,
    /// The middle factor of the sandwich, from the residuals.
    Scatter {
        /// R, for which |R J_s|^2 is the leverage of sample s.
        root: &'a Triangle,
        /// The root mean square of the residuals.
        typical: f64,
    },
    /// The middle factor of the sandwich, from the given standard deviations.
    Noise,
}

/// Combinations of the columns of a channel: the place of each among all combinations, and its weights.
pub(in crate::fit) type Combinations = Vec<(usize, Vec<f64>)>;

/// What takes up the weighted rows of the Jacobian and the residuals.
pub(super) enum Total<'a> {
    /// A triangular factor.
    Triangle(&'a mut Triangle),
    /// Sums over groups of samples, and the group of each sample of the block.
    Groups(&'a mut GroupSums, &'a [u32]),
    /// The square of each combination of columns at each sample.
    Squares(&'a Combinations, &'a mut [Row]),
}

/// Adds the weighted rows of the Jacobian and the residuals to sums, and returns the cost for [`Rows::Model`].
pub(super) struct Compression<'a> {
    block: ChannelBlock<'a>,
    total: Total<'a>,
}

/// Computes the residuals in units of a loss's scale.
pub(super) struct PlainResiduals<'a, 'b>(&'b mut ChannelBlock<'a>);

impl<'a> ChannelBlock<'a> {
    pub(super) fn compressed_into(self, total: Total<'a>) -> Compression<'a> {
        Compression { block: self, total }
    }

    pub(super) fn plain(&mut self) -> PlainResiduals<'a, '_> {
        PlainResiduals(self)
    }
}

impl WithSimd for PlainResiduals<'_, '_> {
    type Output = Row;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Row {
        let ChannelBlock { observed, cos_i, bases, reflectance, scratch, .. } = self.0;
        let Scratch { x, slope, squares, .. } = scratch;
        let mut residuals = Row::filled(0.0);
        sum(bases, reflectance, x);
        scale_each(x, cos_i);
        if observed.transform.differences(x, observed.wanted, &mut residuals, slope, Some(&mut *squares)) {
            for (residual, square) in residuals.iter_mut().zip(squares.iter()) {
                *residual = square.sqrt().copysign(*residual);
            }
        }
        if let Some(precision) = observed.precision {
            scale_each(&mut residuals, precision);
        }
        residuals
    }
}

impl WithSimd for Compression<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let Self { block, total } = self;
        let ObservedBlock { transform, wanted, roots, precision, noise } = block.observed;
        let Scratch { columns, x, slope, squares } = block.scratch;
        let n = block.columns.len();
        columns.resize(n + 1, Row::filled(0.0));
        let (jacobian, residual) = columns.split_at_mut(n);
        let residual = &mut residual[0];

        sum(block.bases, block.reflectance, x);
        scale_each(x, block.cos_i);
        let is_model = matches!(block.rows, Rows::Model);
        let loss = block.objective.loss;
        let needs_squares = is_model || loss != LossKind::None;
        let own_squares =
            transform.differences(x, wanted, residual, slope, needs_squares.then_some(&mut *squares));
        let squares = (own_squares && needs_squares).then_some(squares);
        if matches!(block.rows, Rows::Noise) {
            *residual = *slope;
            scale_each(residual, noise.unwrap_or(&Row::filled(1.0)));
        }
        let tempered = match loss {
            LossKind::None => None,
            loss => {
                let squares = squares.as_deref();
                Some(temper(loss, block.objective.scale, precision, roots, residual, slope, squares))
            }
        };
        let factors = residual.iter_mut().zip(slope.iter_mut()).zip(roots).zip(block.cos_i);
        for (((residual, slope), root), cos) in factors {
            *residual *= root;
            *slope *= root * cos;
        }
        if let Some(precision) = precision {
            if !matches!(block.rows, Rows::Noise) {
                scale_each(residual, precision);
            }
            scale_each(slope, precision);
        }
        let cost = match (tempered, squares) {
            _ if !is_model => 0.0,
            (Some(cost), _) => cost,
            (None, None) => dot(residual, residual),
            (None, Some(squares)) => {
                if let Some(precision) = precision {
                    scale_each(squares, precision);
                    scale_each(squares, precision);
                }
                scale_each(squares, roots);
                dot(squares, roots)
            }
        };
        for (column, terms) in jacobian.iter_mut().zip(block.columns) {
            sum(block.bases, terms, column);
            scale_each(column, slope);
        }
        if let Rows::Scatter { root, typical } = block.rows {
            // The slopes and x are no longer needed; their rows are reused for the leverages and products.
            leverages(root, jacobian, slope, x);
            for (entry, leverage) in residual.iter_mut().zip(slope.iter()) {
                *entry = left_out(*entry, *leverage, typical);
            }
        }
        if matches!(block.rows, Rows::Scatter { .. } | Rows::Noise) {
            for column in jacobian {
                scale_each(column, residual);
            }
        }
        match total {
            Total::Triangle(triangle) => triangle.append(columns),
            Total::Groups(groups, group_of) => groups.add(columns, group_of),
            Total::Squares(combinations, squares) => {
                for ((_, weights), squares) in combinations.iter().zip(squares) {
                    x.fill(0.0);
                    for (weight, column) in weights.iter().zip(columns.iter()) {
                        add_scaled(x, column, *weight);
                    }
                    squares.iter_mut().zip(x.iter()).for_each(|(square, value)| *square = value * value);
                }
            }
        }
        cost
    }
}

/// Modifies residuals and slopes, before they are weighted, so that they have the gradient and the curvature of a
/// loss. Returns the cost.
#[inline(always)]
fn temper(
    loss: LossKind,
    scale: f64,
    precision: Option<&Row>,
    roots: &Row,
    residual: &mut Row,
    slope: &mut Row,
    squares: Option<&Row>,
) -> f64 {
    let mut cost = 0.0;
    let ones = Row::filled(1.0);
    let mut distances = *residual;
    if let Some(squares) = squares {
        distances.iter_mut().zip(squares).for_each(|(distance, square)| *distance = square.sqrt());
    }
    let samples = residual.iter_mut().zip(slope).zip(precision.unwrap_or(&ones)).zip(roots).zip(&distances);
    for ((((residual, slope), precision), root), distance) in samples {
        let influence = loss.influence(precision * *distance, scale);
        let bend = influence.curvature.sqrt();
        *residual *= influence.slope / bend;
        *slope *= bend;
        cost += root * root * influence.cost;
    }
    cost
}

/// Writes the sum of `terms` to `sum`.
#[inline(always)]
pub(in crate::fit) fn sum(bases: &[BasisBlock], terms: &[Term], sum: &mut Row) {
    let row = |term: &Term| {
        let basis = &bases[term.lobe];
        let rows = term.shape.map_or_else(|| basis.values(), |shape| basis.partials(shape));
        (&rows[term.function], term.factor)
    };
    let mut rows = terms.iter().map(row);
    match rows.next() {
        Some((row, factor)) => sum.iter_mut().zip(row).for_each(|(entry, value)| *entry = factor * value),
        None => sum.fill(0.0),
    }
    for (row, factor) in rows {
        add_scaled(sum, row, factor);
    }
}

/// Computes |R J_s|^2, the leverage of each sample s; `product` is working space.
#[inline(always)]
fn leverages(root: &Triangle, jacobian: &[Row], leverage: &mut Row, product: &mut Row) {
    leverage.fill(0.0);
    for (k, row) in root.rows().iter().enumerate() {
        product.fill(0.0);
        for (entry, column) in row.iter().zip(&jacobian[k..]) {
            add_scaled(product, column, *entry);
        }
        for (total, entry) in leverage.iter_mut().zip(product.iter()) {
            *total += entry * entry;
        }
    }
}

/// Multiplies each entry by the matching factor.
#[inline(always)]
fn scale_each(row: &mut Row, factors: &Row) {
    for (entry, factor) in row.iter_mut().zip(factors) {
        *entry *= factor;
    }
}

/// Adds `factor` times `row` to `sum`.
#[inline(always)]
fn add_scaled(sum: &mut Row, row: &Row, factor: f64) {
    for (total, value) in sum.iter_mut().zip(row) {
        *total += factor * value;
    }
}

/// The residual that a sample would have in a fit without it: r/(1 - h) to first order, where h = J_s H^-1 J_s is its
/// leverage. `typical` is the root mean square of the residuals.
fn left_out(r: f64, h: f64, typical: f64) -> f64 {
    // At leverage 1 a parameter follows its only sample: r is 0 however large the noise, and r/(1 - h) is a ratio of
    // rounding errors. If all samples have the same noise, r/(1 - h) is about typical/sqrt(1 - h). Beyond the limit
    // the residual is taken to be this value at the limit, or larger if r is larger.
    const LEAST: f64 = 0.01;
    let rest = 1.0 - h;
    if rest > LEAST { r / rest } else { (r.abs() / LEAST).max(typical / LEAST.sqrt()) }
}
