//! Evaluates models on blocks of samples.
//!
//! A lobe's basis functions are products of [`Part`]s, each a formula with its own shapes: a microfacet lobe is a
//! distribution times a visibility times a Fresnel reflectance. Here the parts run over a block one by one, each in the
//! loop of its [`Kernel`](super::part::Kernel) over rows of known length without branches, which the compiler turns into
//! packed instructions; the product rule combines their results. So every formula is written once, for one sample; there
//! are only as many compiled loops as kernels; and a part whose shapes do not change from one channel to the next is not
//! evaluated again.
//!
//! The loops are compiled for several instruction sets, and the widest that the machine supports is chosen at run time.
//! They all round in the same way: none of them may fuse a product and a sum.
//!
//! Nothing here is compiled for each part: a model names its parts by type, and an [`ErasedPart`] keeps the few numbers and
//! functions in which they differ.
#![allow(clippy::indexing_slicing, reason = "a kernel: the lengths that it indexes are checked at its head")]

use super::erased_part::{ErasedPart, Place, Prepared};
use super::part::{Derivatives, Part, Visitor};
use super::part_block::PartBlock;
use super::product::{Product, basis_functions};
use crate::geometry::{Block, Row};
use pulp::Arch;

/// Basis functions of one lobe on a block, and their derivatives with respect to the lobe's shapes.
#[derive(Clone, Debug, Default)]
pub struct BasisBlock {
    /// The instruction set. `None` means the widest that the machine supports.
    arch: Option<Arch>,
    parts: Vec<PartBlock>,
    values: Vec<Row>,
    /// Derivatives: for each shape, a row per function.
    partials: Vec<Vec<Row>>,
    /// The block with the light mirrored. `None` until a part needs it.
    mirrored: Option<Box<Block>>,
}

impl BasisBlock {
    /// Makes one that uses only the instructions that every processor of this architecture has, to measure the gain of others.
    #[must_use]
    pub fn portable() -> Self {
        Self { arch: Some(Arch::Scalar), ..Self::default() }
    }

    /// Basis function k at every sample, 1/sr.
    #[must_use]
    pub fn values(&self) -> &[Row] {
        &self.values
    }

    /// The derivative of every basis function with respect to a shape, per formula unit (radians). Empty if it was not
    /// requested.
    #[must_use]
    pub fn partials(&self, shape: usize) -> &[Row] {
        self.partials.get(shape).map_or(&[], Vec::as_slice)
    }

    /// Discards all results. Must be called when the block or its content changes.
    pub fn forget(&mut self) {
        self.parts.iter_mut().for_each(|part| part.evaluated = false);
        self.mirrored = None;
    }

    /// Returns a visitor of the lobe's parts that makes the slow preparations for all of `shapes`, one set per channel, so that
    /// clones of this block share them.
    pub(super) fn preparation<'a>(
        &'a mut self,
        shapes: &'a [&'a [f64]],
        derivatives: Derivatives<'a>,
    ) -> PartPreparation<'a> {
        PartPreparation { shapes, derivatives, parts: PartList::new(&mut self.parts) }
    }

    /// Returns a visitor that evaluates the parts of a lobe whose shapes have changed. It must visit all of them and then be
    /// [finished](PartEvaluation::finish).
    pub(super) fn evaluation<'a>(
        &'a mut self,
        block: &'a Block,
        shapes: &'a [f64],
        derivatives: Derivatives<'a>,
    ) -> PartEvaluation<'a> {
        PartEvaluation {
            block,
            shapes,
            derivatives,
            parts: PartList::new(&mut self.parts),
            product: (&mut self.values, &mut self.partials),
            mirrored: &mut self.mirrored,
            term: 0,
            changed: false,
            arch: self.arch.unwrap_or_default(),
        }
    }
}

/// The parts of a lobe, in the order in which they are visited.
struct PartList<'a> {
    parts: &'a mut Vec<PartBlock>,
    /// Number of parts visited so far.
    shown: usize,
    mirrored: bool,
}

impl<'a> PartList<'a> {
    fn new(parts: &'a mut Vec<PartBlock>) -> Self {
        Self { parts, shown: 0, mirrored: false }
    }

    /// The slot of the next part. The results of another part in it are discarded.
    fn next(&mut self, part: &'static ErasedPart, first: usize) -> &mut PartBlock {
        let (index, mirrored) = (self.shown, self.mirrored);
        self.shown += 1;
        let same =
            |known: &PartBlock| (known.part.id, known.first, known.mirrored) == (part.id, first, mirrored);
        match self.parts.get_mut(index) {
            Some(known) if same(known) => {}
            Some(other) => *other = PartBlock::new(part, first, mirrored),
            None => self.parts.push(PartBlock::new(part, first, mirrored)),
        }
        &mut self.parts[index]
    }
}

/// A visitor that prepares parts for the shapes of all channels.
pub(super) struct PartPreparation<'a> {
    shapes: &'a [&'a [f64]],
    derivatives: Derivatives<'a>,
    parts: PartList<'a>,
}

impl PartPreparation<'_> {
    fn prepare(&mut self, part: &'static ErasedPart, first: usize) {
        let block = self.parts.next(part, first);
        if !part.prepares_long {
            return;
        }
        let differentiated = self.derivatives.include_any(first, part.shapes);
        let mut lasting: Vec<Prepared> = Vec::new();
        for shapes in self.shapes {
            let shapes = &shapes[first..first + part.shapes];
            if lasting.iter().any(|known| known.shapes == shapes) {
                continue;
            }
            for (offset, round) in part.rounds(differentiated) {
                let mut known = block.prepared.lasting.iter();
                let known = known.find(|known| known.is_for(shapes, offset, round.derivatives)).cloned();
                lasting.push(known.unwrap_or_else(|| Prepared {
                    shapes: shapes.to_vec(),
                    offset,
                    derivatives: round.derivatives,
                    content: (round.prepare)(shapes, offset),
                }));
            }
        }
        block.prepared.lasting = lasting;
    }
}

impl Visitor for PartPreparation<'_> {
    fn part<P: Part>(&mut self, first: usize) {
        self.prepare(const { &ErasedPart::of::<P>() }, first);
    }

    fn next_term(&mut self) {}

    fn mirror_light(&mut self) {
        self.parts.mirrored = true;
    }
}

/// A visitor that evaluates parts on a block.
pub(super) struct PartEvaluation<'a> {
    block: &'a Block,
    shapes: &'a [f64],
    derivatives: Derivatives<'a>,
    parts: PartList<'a>,
    /// Values and partials of the lobe.
    product: (&'a mut Vec<Row>, &'a mut Vec<Vec<Row>>),
    mirrored: &'a mut Option<Box<Block>>,
    term: usize,
    changed: bool,
    arch: Arch,
}

impl PartEvaluation<'_> {
    /// Evaluates a part, unless it has already been evaluated for the same shapes on this block.
    fn evaluate(&mut self, part: &'static ErasedPart, first: usize) {
        let shapes = &self.shapes[first..first + part.shapes];
        let differentiated = self.derivatives.include_any(first, part.shapes);
        let state = self.parts.next(part, first);
        let as_before = state.shapes == shapes && state.differentiated == differentiated;
        if state.evaluated && as_before && state.term == self.term {
            return;
        }
        self.changed = true;
        state.term = self.term;
        state.evaluated = true;
        state.shapes.clear();
        state.shapes.extend(shapes);
        state.differentiated = differentiated;

        let functions = part.functions;
        state.values.resize(functions, Row::filled(0.0));
        let derivatives = if differentiated { part.shapes } else { 0 };
        state.partials.resize(derivatives * functions, Row::filled(0.0));
        let block = if state.mirrored {
            self.mirrored.get_or_insert_with(|| Box::new(self.block.with_light_mirrored()))
        } else {
            self.block
        };
        for (offset, round) in part.rounds(differentiated) {
            let partials = &mut state.partials[offset * functions..][..round.derivatives * functions];
            let place = Place { arch: self.arch, block, shapes, offset };
            (round.run)(place, &mut state.prepared, &mut state.values, partials);
        }
    }

    /// Multiplies the visited parts, if any of them has changed.
    pub(super) fn finish(self) {
        let Self { parts: PartList { parts, shown, .. }, product: (values, partials), .. } = self;
        // Further parts are left over from another model.
        let changed = self.changed || parts.len() > shown;
        parts.truncate(shown);
        if changed {
            let functions = basis_functions(parts);
            values.resize(functions, Row::filled(0.0));
            let shapes = if self.derivatives == Derivatives::None { 0 } else { self.shapes.len() };
            partials.resize(shapes, Vec::new());
            for (shape, rows) in partials.iter_mut().enumerate() {
                // Parts may have computed more derivatives than requested.
                let wanted = self.derivatives.include_any(shape, 1);
                let known = wanted || parts.iter().any(|part| part.depends_on(shape));
                rows.resize(if known { functions } else { 0 }, Row::filled(0.0));
            }
            self.arch.dispatch(Product { parts, values, partials });
        }
    }
}

impl Visitor for PartEvaluation<'_> {
    fn part<P: Part>(&mut self, first: usize) {
        self.evaluate(const { &ErasedPart::of::<P>() }, first);
    }

    fn next_term(&mut self) {
        self.term += 1;
    }

    fn mirror_light(&mut self) {
        self.parts.mirrored = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::BLOCK;
    use crate::geometry::HalfDifferenceGrid;
    use crate::model::erased_part::MOST_RINGS;
    use crate::model::{AnyModel, REGISTRY, Role};

    fn shapes(model: &AnyModel) -> Vec<f64> {
        let shapes = model.parameters().into_iter().filter(|spec| spec.role == Role::Shape);
        shapes.map(|spec| spec.in_formula_units(spec.initial)).collect()
    }

    fn bits(basis: &BasisBlock, shapes: usize) -> Vec<u64> {
        let rows = (0..shapes).flat_map(|shape| basis.partials(shape)).chain(basis.values());
        rows.flatten().map(|value| value.to_bits()).collect()
    }

    /// Cells of several rings, the last of which is incomplete.
    fn cells() -> Vec<u32> {
        let grid = HalfDifferenceGrid::merl_centers();
        let above = grid.above_horizon().iter().zip(0_u32..).filter(|(above, _)| **above);
        above.map(|(_, cell)| cell).skip(400_000).step_by(2).take(BLOCK - 5).collect()
    }

    #[test]
    fn every_instruction_set_gives_the_same_bytes() {
        let mut block = Block::new();
        block.fill_cells(&HalfDifferenceGrid::merl_centers(), &cells());
        for (model, _) in REGISTRY.iter().flat_map(|entry| entry.variants()) {
            let shapes = shapes(&model);
            let (mut widest, mut portable) = (BasisBlock::default(), BasisBlock::portable());
            model.evaluate(&block, &shapes, Derivatives::All, &mut widest);
            model.evaluate(&block, &shapes, Derivatives::All, &mut portable);
            assert_eq!(bits(&widest, shapes.len()), bits(&portable, shapes.len()), "{}", model.name());
        }
    }

    #[test]
    fn sharing_on_rings_changes_no_byte() {
        let grid = HalfDifferenceGrid::merl_centers();
        let rings: Vec<u32> = cells().iter().flat_map(|cell| [*cell, cell + 1]).take(BLOCK).collect();
        let (mut on_rings, mut one_by_one) = (Block::new(), Block::new());
        on_rings.fill_cells(&grid, &rings);
        one_by_one.fill(rings.iter().map(|cell| grid.geometry(*cell)));
        assert!((1..=MOST_RINGS).contains(&on_rings.rings().len()), "{:?}", on_rings.rings());
        assert!(one_by_one.rings().is_empty());
        for (model, _) in REGISTRY.iter().flat_map(|entry| entry.variants()) {
            let shapes = shapes(&model);
            let (mut shared, mut alone) = (BasisBlock::default(), BasisBlock::default());
            model.evaluate(&on_rings, &shapes, Derivatives::All, &mut shared);
            model.evaluate(&one_by_one, &shapes, Derivatives::All, &mut alone);
            assert_eq!(bits(&shared, shapes.len()), bits(&alone, shapes.len()), "{}", model.name());
        }
    }

    #[test]
    fn what_one_model_left_does_not_reach_another() {
        let grid = HalfDifferenceGrid::merl_centers();
        let mut block = Block::new();
        block.fill_cells(&grid, &cells());
        let mut reused = BasisBlock::default();
        let variants: Vec<AnyModel> =
            REGISTRY.iter().flat_map(|entry| entry.variants()).map(|(model, _)| model).collect();
        for model in variants.iter().chain(variants.iter().rev()) {
            for derivatives in [Derivatives::All, Derivatives::None, Derivatives::All] {
                // All models get the same numbers, so that their shapes do not distinguish them.
                let shapes = vec![0.5; shapes(model).len()];
                let mut fresh = BasisBlock::default();
                model.evaluate(&block, &shapes, derivatives, &mut fresh);
                model.evaluate(&block, &shapes, derivatives, &mut reused);
                assert_eq!(bits(&reused, shapes.len()), bits(&fresh, shapes.len()), "{}", model.name());
            }
        }
    }

    #[test]
    fn a_part_is_evaluated_again_when_its_shapes_or_the_block_change() {
        let grid = HalfDifferenceGrid::merl_centers();
        let cells = cells();
        let (first, second) = cells.split_at(50);
        let (model, _) =
            REGISTRY.iter().find(|entry| entry.name == "cook-torrance").unwrap().build(&[]).unwrap();
        let fresh = |cells: &[u32], m: f64| {
            let (mut block, mut basis) = (Block::new(), BasisBlock::default());
            block.fill_cells(&grid, cells);
            model.evaluate(&block, &[m], Derivatives::All, &mut basis);
            bits(&basis, 1)
        };
        let (mut block, mut basis) = (Block::new(), BasisBlock::default());
        for (cells, m) in [(first, 0.2), (first, 0.3), (second, 0.3), (first, 0.2)] {
            block.fill_cells(&grid, cells);
            basis.forget();
            model.evaluate(&block, &[m], Derivatives::All, &mut basis);
            assert_eq!(bits(&basis, 1), fresh(cells, m));
            // Another channel with the same shapes, and one with different shapes.
            model.evaluate(&block, &[m], Derivatives::All, &mut basis);
            assert_eq!(bits(&basis, 1), fresh(cells, m));
            model.evaluate(&block, &[0.7], Derivatives::All, &mut basis);
            assert_eq!(bits(&basis, 1), fresh(cells, 0.7));
        }
    }
}
