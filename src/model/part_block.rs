//! What a part has found on a block.
#![allow(clippy::indexing_slicing, reason = "a kernel: the lengths that it indexes are checked at its head")]

use super::erased_part::{ErasedPart, Preparations};
use crate::geometry::Row;

/// One part on a block.
#[derive(Clone, Debug)]
pub(super) struct PartBlock {
    pub(super) part: &'static ErasedPart,
    /// Which of the lobe's shapes is the part's first.
    pub(super) first: usize,
    /// Whether the light is mirrored.
    pub(super) mirrored: bool,
    /// Whether it was evaluated on this block, for which shapes, and whether with derivatives.
    pub(super) evaluated: bool,
    pub(super) shapes: Vec<f64>,
    pub(super) differentiated: bool,
    /// The product that it belongs to.
    pub(super) term: usize,
    /// A row per function.
    pub(super) values: Vec<Row>,
    /// For each of the part's shapes, a row per function.
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

    /// Whether one function multiplies all of the lobe's.
    #[inline(always)]
    pub(super) fn is_common(&self) -> bool {
        self.part.functions == 1
    }

    /// Which row stands for basis function `k`.
    #[inline(always)]
    pub(super) fn row(&self, k: usize) -> usize {
        if self.is_common() { 0 } else { k }
    }

    /// The part's factor of basis function `k`.
    #[inline(always)]
    pub(super) fn value(&self, k: usize) -> &Row {
        &self.values[self.row(k)]
    }

    /// Its derivative with respect to the lobe's shape number `shape`; `None` means that it does not depend on it.
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
