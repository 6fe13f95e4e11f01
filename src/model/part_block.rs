//! The results of a part on a block.
#![allow(clippy::indexing_slicing, reason = "a kernel: the lengths that it indexes are checked at its head")]

use super::erased_part::{ErasedPart, Preparations};
use crate::geometry::Row;

/// The results of one part on a block.
#[derive(Clone, Debug)]
pub(super) struct PartBlock {
    pub(super) part: &'static ErasedPart,
    /// Index of the part's first shape among the lobe's shapes.
    pub(super) first: usize,
    /// Whether the light is mirrored.
    pub(super) mirrored: bool,
    /// Whether it was evaluated on this block; the next fields say for which shapes, and whether with derivatives.
    pub(super) evaluated: bool,
    pub(super) shapes: Vec<f64>,
    pub(super) differentiated: bool,
    /// Index of the product that it belongs to.
    pub(super) term: usize,
    /// Values: a row per function.
    pub(super) values: Vec<Row>,
    /// Derivatives: for each of the part's shapes, a row per function.
    pub(super) partials: Vec<Row>,
    pub(super) prepared: Preparations,
}

impl PartBlock {
    pub(super) fn new(part: &'static ErasedPart, first: usize, mirrored: bool) -> Self {
        Self {
            part,
            first,
            mirrored,
            evaluated: false,
            shapes: Vec::new(),
            differentiated: false,
            term: 0,
            values: Vec::new(),
            partials: Vec::new(),
            prepared: Preparations::default(),
        }
    }

    /// Whether it has a single function, which multiplies all basis functions of the lobe.
    #[inline(always)]
    pub(super) fn is_common(&self) -> bool {
        self.part.functions == 1
    }

    /// Index of the row for basis function `k`.
    #[inline(always)]
    pub(super) fn row(&self, k: usize) -> usize {
        if self.is_common() { 0 } else { k }
    }

    /// The part's factor of basis function `k`.
    #[inline(always)]
    pub(super) fn value(&self, k: usize) -> &Row {
        &self.values[self.row(k)]
    }

    /// The derivative of that factor with respect to the lobe's shape number `shape`. `None` if it does not depend on it.
    #[inline(always)]
    pub(super) fn partial(&self, shape: usize, k: usize) -> Option<&Row> {
        let j = shape.checked_sub(self.first)?;
        self.partials.get(j * self.part.functions + self.row(k))
    }

    #[inline(always)]
    pub(super) fn depends_on(&self, shape: usize) -> bool {
        self.partial(shape, 0).is_some()
    }
}
