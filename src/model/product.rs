//! The product rule on rows: multiplies the results of a lobe's parts into its basis functions and their derivatives.
#![allow(clippy::indexing_slicing, reason = "a kernel: the lengths that it indexes are checked at its head")]

use super::part_block::PartBlock;
use crate::geometry::Row;
use pulp::{Simd, WithSimd};

/// The parts of a lobe, and the rows that receive their products, one per basis function.
pub(super) struct Product<'a> {
    pub(super) parts: &'a [PartBlock],
    pub(super) values: &'a mut [Row],
    /// Rows of derivatives by shape; empty for a shape without derivatives.
    pub(super) partials: &'a mut [Vec<Row>],
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { parts, values, partials } = self;
        let mut start = 0;
        for term in terms(parts) {
            let end = start + functions(term);
            multiply_term(term, &mut values[start..end], partials, start);
            start = end;
        }
    }
}

/// Splits the parts into those of each term.
#[inline(always)]
fn terms(parts: &[PartBlock]) -> impl Iterator<Item = &[PartBlock]> {
    parts.chunk_by(|a, b| a.term == b.term)
}

/// Number of basis functions of one term.
#[inline(always)]
fn functions(term: &[PartBlock]) -> usize {
    term.iter().map(|part| part.part.functions).max().unwrap_or(0)
}

/// Number of basis functions of a lobe with these parts.
pub(super) fn basis_functions(parts: &[PartBlock]) -> usize {
    terms(parts).map(functions).sum()
}

/// Multiplies the parts of one term, whose rows of partials begin at `start`. Parts that multiply all functions come first
/// and are multiplied only once.
#[inline(always)]
fn multiply_term(parts: &[PartBlock], values: &mut [Row], partials: &mut [Vec<Row>], start: usize) {
    let common_first =
        || parts.iter().filter(|part| part.is_common()).chain(parts.iter().filter(|part| !part.is_common()));
    let mut order = common_first();
    let Some(first) = order.next() else { return };
    let Some(second) = order.next() else {
        for (k, value) in values.iter_mut().enumerate() {
            *value = *first.value(k);
            for (shape, rows) in differentiated(partials) {
                copy_or_clear(&mut rows[start + k], first.partial(shape, k));
            }
        }
        return;
    };
    // The first two parts are multiplied directly from their own rows; into the first row only, if both multiply all
    // functions.
    let joined = if second.is_common() { 1 } else { values.len() };
    for (k, value) in values[..joined].iter_mut().enumerate() {
        let (v, f) = (first.value(k), second.value(k));
        for (shape, rows) in differentiated(partials) {
            product_rule(&mut rows[start + k], (v, first.partial(shape, k)), (f, second.partial(shape, k)));
        }
        multiply(value, v, f);
    }
    let mut rows_in_use = joined;
    for (before, part) in order.enumerate().map(|(index, part)| (index + 2, part)) {
        let known = |shape| common_first().take(before).any(|earlier| earlier.depends_on(shape));
        // The first part with several functions makes the other rows from the first one.
        if !part.is_common() && rows_in_use < values.len() {
            let (product, others) = values.split_at_mut(1);
            for (k, value) in others.iter_mut().enumerate().map(|(index, value)| (index + 1, value)) {
                for (shape, rows) in differentiated(partials) {
                    let (slope, others) = rows[start..].split_at_mut(1);
                    let slope = known(shape).then_some(&slope[0]);
                    let factor = (part.value(k), part.partial(shape, k));
                    product_rule(&mut others[k - 1], (&product[0], slope), factor);
                }
                multiply(value, &product[0], part.value(k));
            }
            rows_in_use = 1;
        }
        for (k, value) in values[..rows_in_use].iter_mut().enumerate() {
            let f = part.value(k);
            for (shape, rows) in differentiated(partials) {
                let slope = &mut rows[start + k];
                product_rule_in_place(slope, known(shape), value, (f, part.partial(shape, k)));
            }
            value.iter_mut().zip(f).for_each(|(v, f)| *v *= f);
        }
        if !part.is_common() {
            rows_in_use = values.len();
        }
    }
}

/// The shapes that have rows of derivatives, with these rows.
#[inline(always)]
fn differentiated(partials: &mut [Vec<Row>]) -> impl Iterator<Item = (usize, &mut Vec<Row>)> {
    partials.iter_mut().enumerate().filter(|(_, rows)| !rows.is_empty())
}

#[inline(always)]
fn copy_or_clear(out: &mut Row, row: Option<&Row>) {
    match row {
        Some(row) => *out = *row,
        None => out.fill(0.0),
    }
}

/// Computes v f.
#[inline(always)]
fn multiply(out: &mut Row, v: &Row, f: &Row) {
    out.iter_mut().zip(v).zip(f).for_each(|((out, v), f)| *out = v * f);
}

/// Computes (v f)' = v' f + v f'. `None` for a derivative means that the factor does not depend on the shape.
#[inline(always)]
fn product_rule(out: &mut Row, (v, dv): (&Row, Option<&Row>), (f, df): (&Row, Option<&Row>)) {
    match (dv, df) {
        (Some(dv), Some(df)) => {
            let entries = out.iter_mut().zip(dv).zip(f).zip(v).zip(df);
            entries.for_each(|((((out, dv), f), v), df)| *out = dv * f + v * df);
        }
        (Some(dv), None) => multiply(out, dv, f),
        (None, Some(df)) => multiply(out, v, df),
        (None, None) => out.fill(0.0),
    }
}

/// Like [`product_rule`], but replaces v' in `slope` by the result. v' is 0 unless v `depends` on the shape.
#[inline(always)]
fn product_rule_in_place(slope: &mut Row, depends: bool, v: &Row, (f, df): (&Row, Option<&Row>)) {
    match (depends, df) {
        (true, Some(df)) => {
            let entries = slope.iter_mut().zip(f).zip(v).zip(df);
            entries.for_each(|(((slope, f), v), df)| *slope = *slope * f + v * df);
        }
        (true, None) => slope.iter_mut().zip(f).for_each(|(slope, f)| *slope *= f),
        (false, Some(df)) => multiply(slope, v, df),
        (false, None) => {}
    }
}
