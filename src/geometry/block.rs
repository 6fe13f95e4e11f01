//! A block of geometry in structure-of-arrays form: what models are evaluated on.

use super::Geometry;

/// Samples in a full block. Small enough for a block and its derivatives to stay in the first-level
/// cache, large enough to make the work per block negligible.
pub const BLOCK: usize = 128;

/// Up to [`BLOCK`] pairs of directions.
#[derive(Clone, Debug, Default)]
pub struct Block {
    samples: Vec<Geometry<f64>>,
}

impl Block {
    /// An empty block.
    #[must_use]
    pub fn new() -> Self {
        Self { samples: Vec::with_capacity(BLOCK) }
    }

    /// Replaces the content.
    pub fn fill(&mut self, samples: impl Iterator<Item = Geometry<f64>>) {
        self.samples.clear();
        self.samples.extend(samples);
    }

    /// The samples.
    #[must_use]
    pub fn samples(&self) -> &[Geometry<f64>] {
        &self.samples
    }

    /// How many samples the block holds.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether the block holds no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }
}
