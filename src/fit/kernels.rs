//! The inner loops of a pass: what is done with one channel of one block.
//!
//! All loops run over rows of known length without branches, for [`pulp`] to compile them for several instruction
//! sets; see [`crate::model::BasisBlock`].

use super::loss::{LossKind, Objective};
use super::metric::Transform;
use super::triangle::{Triangle, dot};
use super::uncertainty::left_out;
use crate::geometry::{BLOCK, Row};
use crate::model::{BasisBlock, Coefficients};
use pulp::{Simd, WithSimd};

/// One summand of a reflectance or of a derivative: a factor times a row of a lobe's basis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Term {
    pub(super) lobe: usize,
    /// The shape that the basis is differentiated by; none for its value.
    pub(super) shape: Option<usize>,
    /// Which basis function.
    pub(super) function: usize,
    pub(super) factor: f64,
}

/// Working space.
#[derive(Default)]
pub(super) struct Scratch {
    /// Jacobian columns, then the residuals.
    columns: Vec<Row>,
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
    /// the residuals.
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

    /// g(x) - g(x*), and g'(x).
    #[inline(always)]
    fn differences(&self) -> (Row, Row) {
        let mut x = sum(self.bases, self.reflectance);
        scale_each(&mut x, self.cos_i);
        let (mut difference, slope) = self.observed.transform.apply_row(&x);
        for (entry, measured) in difference.iter_mut().zip(self.observed.measured) {
            *entry -= measured;
        }
        (difference, slope)
    }
}

impl WithSimd for PlainResiduals<'_, '_> {
    type Output = Row;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Row {
        let (mut residuals, _) = self.0.differences();
        if let Some(precision) = self.0.observed.precision {
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
        let (difference, mut slope) = block.differences();
        let Scratch { columns } = block.scratch;
        columns.resize(block.columns.len() + 1, [0.0; BLOCK]);
        let Some((residual, jacobian)) = columns.split_last_mut() else { return 0.0 };

        let mut root = *block.observed.roots;
        if let Some(precision) = block.observed.precision {
            scale_each(&mut root, precision);
        }
        *residual = difference;
        scale_each(residual, &root);
        scale_each(&mut slope, block.cos_i);
        scale_each(&mut slope, &root);
        let cost = match block.objective.loss {
            LossKind::None => dot(residual, residual),
            loss => {
                let unit = block.observed.precision.unwrap_or(&[1.0; BLOCK]);
                temper(
                    loss,
                    block.objective.scale,
                    unit,
                    block.observed.roots,
                    &difference,
                    residual,
                    &mut slope,
                )
            }
        };
        for (column, terms) in jacobian.iter_mut().zip(block.columns) {
            *column = sum(block.bases, terms);
            scale_each(column, &slope);
        }
        if let Some((root, typical)) = block.sandwich {
            let leverage = leverages(root, jacobian);
            for (entry, leverage) in residual.iter_mut().zip(&leverage) {
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

/// Turns weighted residuals and slopes into rows that have the gradient and the curvature of a loss; returns
/// the cost.
#[inline(always)]
fn temper(
    loss: LossKind,
    scale: f64,
    precision: &Row,
    weights: &Row,
    difference: &Row,
    residual: &mut Row,
    slope: &mut Row,
) -> f64 {
    let mut cost = 0.0;
    let samples = residual.iter_mut().zip(slope).zip(difference).zip(precision).zip(weights);
    for ((((residual, slope), difference), precision), weight) in samples {
        let influence = loss.influence(precision * difference, scale);
        let bend = influence.curvature.sqrt();
        *residual *= influence.slope / bend;
        *slope *= bend;
        cost += weight * weight * influence.cost;
    }
    cost
}

/// The terms that add up to a reflectance.
pub(super) fn reflectance(coefficients: &[Coefficients]) -> Vec<Term> {
    let of_lobe = |(lobe, of_lobe): (usize, &Coefficients)| {
        let term = |(function, factor): (usize, &f64)| Term { lobe, shape: None, function, factor: *factor };
        of_lobe.values.iter().enumerate().map(term).collect::<Vec<_>>()
    };
    coefficients.iter().enumerate().flat_map(of_lobe).collect()
}

/// The sum of terms.
#[inline(always)]
pub(super) fn sum(bases: &[BasisBlock], terms: &[Term]) -> Row {
    let mut sum = [0.0; BLOCK];
    for term in terms {
        let rows = bases.get(term.lobe).map(|basis| match term.shape {
            None => basis.values(),
            Some(shape) => basis.partials(shape),
        });
        if let Some(row) = rows.and_then(|rows| rows.get(term.function)) {
            add_scaled(&mut sum, row, term.factor);
        }
    }
    sum
}

/// |R J_s|^2 per sample, its leverage.
#[inline(always)]
fn leverages(root: &Triangle, jacobian: &[Row]) -> Row {
    let mut leverage = [0.0; BLOCK];
    for (k, row) in root.rows().iter().enumerate() {
        let mut product = [0.0; BLOCK];
        for (entry, column) in row.iter().zip(jacobian.iter().skip(k)) {
            add_scaled(&mut product, column, *entry);
        }
        for (total, entry) in leverage.iter_mut().zip(&product) {
            *total += entry * entry;
        }
    }
    leverage
}

/// Multiplies entry by entry.
#[inline(always)]
pub(super) fn scale_each(row: &mut Row, factors: &Row) {
    for (entry, factor) in row.iter_mut().zip(factors) {
        *entry *= factor;
    }
}

/// Adds `factor` times `row`.
#[inline(always)]
pub(super) fn add_scaled(sum: &mut Row, row: &Row, factor: f64) {
    for (total, value) in sum.iter_mut().zip(row) {
        *total += factor * value;
    }
}
