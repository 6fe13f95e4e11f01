//! The product rule on rows: what the parts of a lobe have found makes its basis functions and their derivatives.
#![allow(clippy::indexing_slicing, reason = "a kernel: the lengths that it indexes are checked at its head")]

use super::part_block::PartBlock;
use crate::geometry::Row;
use pulp::{Simd, WithSimd};

/// Multiplies the parts of each term of a lobe, into rows of which there is one per function.
pub(super) struct Product<'a> {
    pub(super) parts: &'a [PartBlock],
    pub(super) values: &'a mut [Row],
    /// Per shape; no rows for one that is not differentiated by.
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

/// The parts of each term.
#[inline(always)]
fn terms(parts: &[PartBlock]) -> impl Iterator<Item = &[PartBlock]> {
    parts.chunk_by(|a, b| a.term == b.term)
}

/// How many functions the parts of one term have.
#[inline(always)]
fn functions(term: &[PartBlock]) -> usize {
    term.iter().map(|part| part.part.functions).max().unwrap_or(0)
}

/// How many basis functions the parts of a lobe make.
pub(super) fn basis_functions(parts: &[PartBlock]) -> usize {
    terms(parts).map(functions).sum()
}

/// Multiplies the parts of one term, whose rows of partials begin at `start`: those that multiply all functions first, and
/// once for all of them.
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
    // The first two parts are joined from where they lie: into the first row if no function tells them apart.
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
        // The first part that tells functions apart makes the other rows out of the first one.
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

/// The shapes that have rows, with these.
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

/// v f.
#[inline(always)]
fn multiply(out: &mut Row, v: &Row, f: &Row) {
    out.iter_mut().zip(v).zip(f).for_each(|((out, v), f)| *out = v * f);
}

/// (v f)' = v' f + v f', where either may not depend on the shape.
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

/// The same with v' in its place, if v `depends` on the shape.
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
