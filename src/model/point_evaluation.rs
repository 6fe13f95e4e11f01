//! Evaluates models at single pairs of directions, in any scalar.
//!
//! This is the slow way, for what blocks cannot do: single precision, wide numbers, numbers that count operations, and dual
//! numbers of other crates. Every kernel is compiled once more for each scalar.
#![allow(clippy::indexing_slicing, reason = "a kernel: the lengths that it indexes are checked at its head")]

use super::part::{Kernel, Part, Visitor};
use super::values::Values;
use crate::geometry::Geometry;
use crate::math::Scalar;
use std::borrow::Cow;

/// A visitor that evaluates the basis functions of a lobe at several pairs of directions.
pub(super) struct PointEvaluation<'a, T: Scalar> {
    geometries: Cow<'a, [Geometry<T::Real>]>,
    shapes: &'a [T],
    /// Basis functions of the previous terms, each at all pairs.
    basis: Vec<Vec<T>>,
    /// The product of this term's parts so far; empty before the first part.
    product: Vec<Vec<T>>,
}

impl<'a, T: Scalar> PointEvaluation<'a, T> {
    pub(super) fn new(geometries: &'a [Geometry<T::Real>], shapes: &'a [T]) -> Self {
        Self { geometries: Cow::Borrowed(geometries), shapes, basis: Vec::new(), product: Vec::new() }
    }

    /// The values of every basis function.
    pub(super) fn basis(mut self) -> Vec<Vec<T>> {
        self.next_term();
        self.basis
    }

    /// Multiplies the term by a part's functions; a single function multiplies all functions of the term.
    fn multiply(&mut self, factors: Vec<Vec<T>>) {
        let times = |a: &Vec<T>, b: &Vec<T>| a.iter().zip(b).map(|(a, b)| *a * *b).collect();
        self.product = match (self.product.as_slice(), factors.as_slice()) {
            ([], _) => factors,
            ([one], factors) => factors.iter().map(|factor| times(one, factor)).collect(),
            (several, [one]) => several.iter().map(|value| times(value, one)).collect(),
            (several, factors) => {
                several.iter().zip(factors).map(|(value, factor)| times(value, factor)).collect()
            }
        };
    }
}

impl<T: Scalar> Visitor for PointEvaluation<'_, T> {
    fn part<P: Part>(&mut self, first: usize) {
        let prepared = P::prepare(Values::new(&self.shapes[first..first + P::SHAPES]));
        let factors = functions::<P::Kernel, T>(&prepared, &self.geometries);
        self.multiply(factors);
    }

    fn next_term(&mut self) {
        self.basis.append(&mut self.product);
    }

    fn mirror_light(&mut self) {
        self.geometries.to_mut().iter_mut().for_each(|geometry| *geometry = geometry.with_light_mirrored());
    }
}

/// Evaluates the functions of a kernel, each at all pairs of directions.
fn functions<K: Kernel, T: Scalar>(
    prepared: &K::Prepared<T>,
    geometries: &[Geometry<T::Real>],
) -> Vec<Vec<T>> {
    let mut functions = vec![Vec::with_capacity(geometries.len()); K::FUNCTIONS];
    for geometry in geometries {
        let output = K::at(prepared, geometry);
        functions.iter_mut().zip(output.as_ref()).for_each(|(function, value)| function.push(*value));
    }
    functions
}
