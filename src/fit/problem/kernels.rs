//! The inner loops of a pass: what is done with one channel of one block.
//!
//! All loops run over rows of known length without branches, for [`pulp`] to compile them for several instruction
//! sets; see [`crate::model::BasisBlock`].

use super::formula::{Sums, Term};
use super::loss::{LossKind, Objective};
use super::metric::Transform;
use crate::geometry::Row;
use crate::model::BasisBlock;
use crate::solver::triangle::{Triangle, dot};
use pulp::{Simd, WithSimd};

/// Working space.
pub(super) struct Scratch {
    /// Jacobian columns, then the residuals.
    columns: Vec<Row>,
    x: Row,
    slope: Row,
}

impl Default for Scratch {
    fn default() -> Self {
        Self { columns: Vec::new(), x: Row::filled(0.0), slope: Row::filled(0.0) }
    }
}

/// Writes the rows of a channel of one block: its derivatives, then its reflectance.
pub(super) struct Evaluation<'a> {
    /// Per lobe, evaluated.
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

/// What is known of one channel of one block beside the geometry.
#[derive(Clone, Copy)]
pub(super) struct ObservedBlock<'a> {
    pub(super) transform: Transform,
    /// g(x*).
    pub(super) measured: &'a Row,
    /// Root of weight times normalisation; zero where there is no sample.
    pub(super) roots: &'a Row,
    /// What turns a residual into standard deviations.
    pub(super) precision: Option<&'a Row>,
}

/// One channel of one block.
pub(super) struct ChannelBlock<'a> {
    pub(super) observed: ObservedBlock<'a>,
    pub(super) cos_i: &'a Row,
    pub(super) objective: Objective,
    /// Per lobe.
    pub(super) bases: &'a [BasisBlock],
    /// The reflectance.
    pub(super) reflectance: &'a [Term],
    /// Its derivative with respect to each parameter.
    pub(super) columns: &'a [Vec<Term>],
    pub(super) scratch: &'a mut Scratch,
    /// For the middle of the sandwich: R with |R J_s|^2 the leverage of sample s, and the root mean square of
    /// the residuals. `None` for the linear model itself.
    pub(super) sandwich: Option<(&'a Triangle, f64)>,
}

/// Appends the weighted rows of the Jacobian, and the residuals, to a triangular factor; yields their cost.
pub(super) struct Compression<'a> {
    block: ChannelBlock<'a>,
    triangle: &'a mut Triangle,
}

/// Yields the residuals in units of a loss's scale.
pub(super) struct PlainResiduals<'a, 'b>(&'b mut ChannelBlock<'a>);

impl<'a> ChannelBlock<'a> {
    pub(super) fn compressed_into(self, triangle: &'a mut Triangle) -> Compression<'a> {
        Compression { block: self, triangle }
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
        let Scratch { x, slope, .. } = scratch;
        let mut residuals = Row::filled(0.0);
        sum(bases, reflectance, x);
        scale_each(x, cos_i);
        observed.transform.differences(x, observed.measured, &mut residuals, slope);
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
        let Self { block, triangle } = self;
        let ObservedBlock { transform, measured, roots, precision } = block.observed;
        let Scratch { columns, x, slope } = block.scratch;
        let n = block.columns.len();
        columns.resize(n + 1, Row::filled(0.0));
        let (jacobian, residual) = columns.split_at_mut(n);
        let residual = &mut residual[0];

        sum(block.bases, block.reflectance, x);
        scale_each(x, block.cos_i);
        transform.differences(x, measured, residual, slope);
        let tempered = match block.objective.loss {
            LossKind::None => None,
            loss => Some(temper(loss, block.objective.scale, precision, roots, residual, slope)),
        };
        let factors = residual.iter_mut().zip(slope.iter_mut()).zip(roots).zip(block.cos_i);
        for (((residual, slope), root), cos) in factors {
            *residual *= root;
            *slope *= root * cos;
        }
        if let Some(precision) = precision {
            scale_each(residual, precision);
            scale_each(slope, precision);
        }
        let cost = tempered.unwrap_or_else(|| dot(residual, residual));
        for (column, terms) in jacobian.iter_mut().zip(block.columns) {
            sum(block.bases, terms, column);
            scale_each(column, slope);
        }
        if let Some((root, typical)) = block.sandwich {
            // The slopes and x have done their work; their places take the leverages and products.
            leverages(root, jacobian, slope, x);
            for (entry, leverage) in residual.iter_mut().zip(slope.iter()) {
                *entry = left_out(*entry, *leverage, typical);
            }
            for column in jacobian {
                scale_each(column, residual);
            }
        }
        triangle.append(columns);
        cost
    }
}

/// Turns residuals and slopes, before their weights, into such that have the gradient and the curvature of a loss;
/// returns the cost.
#[inline(always)]
fn temper(
    loss: LossKind,
    scale: f64,
    precision: Option<&Row>,
    roots: &Row,
    residual: &mut Row,
    slope: &mut Row,
) -> f64 {
    let mut cost = 0.0;
    let ones = Row::filled(1.0);
    let samples = residual.iter_mut().zip(slope).zip(precision.unwrap_or(&ones)).zip(roots);
    for (((residual, slope), precision), root) in samples {
        let influence = loss.influence(precision * *residual, scale);
        let bend = influence.curvature.sqrt();
        *residual *= influence.slope / bend;
        *slope *= bend;
        cost += root * root * influence.cost;
    }
    cost
}

/// The sum of terms.
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

/// |R J_s|^2 per sample, its leverage; `product` is working space.
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

/// Multiplies entry by entry.
#[inline(always)]
fn scale_each(row: &mut Row, factors: &Row) {
    for (entry, factor) in row.iter_mut().zip(factors) {
        *entry *= factor;
    }
}

/// Adds `factor` times `row`.
#[inline(always)]
fn add_scaled(sum: &mut Row, row: &Row, factor: f64) {
    for (total, value) in sum.iter_mut().zip(row) {
        *total += factor * value;
    }
}

/// The residual that a sample would have in a fit without it: r/(1 - h), to first order, with h = J_s H^-1 J_s
/// its leverage. `typical` is the root mean square of the residuals.
fn left_out(r: f64, h: f64, typical: f64) -> f64 {
    // At leverage 1 a parameter follows its only sample: r is 0 whatever the noise, and r/(1 - h) rounding
    // over rounding. Under equal noise r/(1 - h) is about typical/sqrt(1 - h); beyond the limit it is taken
    // to be what that gives at the limit, or more if r asks for it.
    const LEAST: f64 = 0.01;
    let rest = 1.0 - h;
    if rest > LEAST { r / rest } else { (r.abs() / LEAST).max(typical / LEAST.sqrt()) }
}
