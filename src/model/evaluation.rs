//! Models on blocks of samples.
//!
//! A lobe's basis functions are products of [`Part`]s, each a formula with shapes of its own: a microfacet lobe
//! is a distribution times a visibility times a Fresnel reflectance. Here the parts run over a block one by one,
//! each in a loop over rows of known length without branches, which the compiler turns into packed instructions;
//! the product rule joins what they find. So every formula is written once, for one sample, the number of compiled
//! loops grows with the sum of the parts and not with their combinations, and a part whose shapes have not changed
//! from one channel to the next is not evaluated again.
//!
//! The loops are compiled for several instruction sets, of which the widest that the machine has is chosen when
//! the program runs. All round alike: none of them may fuse a product and a sum.

use super::Values;
use crate::geometry::{BLOCK, Block, Geometry, Row};
use crate::math::{Dual, Scalar};
use pulp::{Arch, Simd, WithSimd};
use std::any::{Any, TypeId};
use std::fmt;
use std::sync::Arc;

/// One factor of the basis functions of a lobe.
///
/// [`Part::at`], and whatever it calls, must be `#[inline(always)]` and choose by [`Scalar::if_less`]: a call or a
/// branch would keep the loop over a block from being packed.
pub trait Part: 'static {
    /// How many shapes it takes.
    const SHAPES: usize;
    /// How many functions it has: one per basis function of the lobe, or one that multiplies them all.
    const FUNCTIONS: usize = 1;
    /// Whether it depends on the half vector and the difference angle alone: on the samples of a grid, which share
    /// these by the hundred, it is evaluated once for all that do.
    const SHARED_ON_RINGS: bool = false;
    /// Whether preparing takes longer than a block: it is then done once per pass over the samples, for all threads.
    const PREPARES_LONG: bool = false;
    /// Quantities that depend on the shapes alone, computed anew only when these have changed. Quickly cloned: what
    /// is large stands behind an `Arc`.
    type Prepared<T: Scalar>: Clone + Send + Sync + 'static;
    /// A value per function.
    type Output<T: Scalar>: AsRef<[T]>;

    /// Everything that depends on the shapes alone. Shapes come in declared order, in formula units (radians).
    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> Self::Prepared<T>;

    /// The functions at one pair of directions, both above the horizon.
    fn at<T: Scalar>(prepared: &Self::Prepared<T>, geometry: &Geometry<T::Real>) -> Self::Output<T>;
}

/// Is shown every part of a lobe in turn.
pub trait Visitor {
    /// A part whose shapes begin with the lobe's shape number `first`.
    fn part<P: Part>(&mut self, first: usize);

    /// Ends a product: the parts that follow make further basis functions, after those of the parts before.
    fn next_term(&mut self);
}

/// Basis functions of one lobe on a block, and their derivatives with respect to the lobe's shapes.
#[derive(Clone, Debug, Default)]
pub struct BasisBlock {
    /// The instruction set; none for the widest that there is.
    arch: Option<Arch>,
    parts: Vec<PartBlock>,
    values: Vec<Row>,
    /// Per shape, a row per function.
    partials: Vec<Vec<Row>>,
}

/// Which of a lobe's shapes its basis functions are differentiated by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivatives<'a> {
    /// None.
    None,
    /// All.
    All,
    /// Those that are marked, one mark per shape; others that share a part with them may be, too.
    Of(&'a [bool]),
}

impl Derivatives<'_> {
    /// Whether any shape of a part is among them, whose shapes begin at `first`.
    fn reach<P: Part>(self, first: usize) -> bool {
        match self {
            Self::None => false,
            Self::All => P::SHAPES > 0,
            Self::Of(marks) => {
                marks.get(first..first + P::SHAPES).is_some_and(|marks| marks.iter().any(|mark| *mark))
            }
        }
    }
}

/// One part on a block.
#[derive(Clone, Debug, Default)]
struct PartBlock {
    /// Which part it is.
    part: Option<TypeId>,
    /// Whether it was evaluated on this block, for which shapes, and whether with derivatives.
    evaluated: bool,
    shapes: Vec<f64>,
    differentiated: bool,
    first: usize,
    /// The product that it belongs to.
    term: usize,
    functions: usize,
    /// A row per function.
    values: Vec<Row>,
    /// For each of the part's shapes, a row per function.
    partials: Vec<Row>,
    prepared: Preparations,
}

/// What a part has prepared. Some prepare by quadrature, which must not be repeated for every block.
#[derive(Clone, Debug, Default)]
struct Preparations {
    /// For the shapes of the last block.
    last: Option<Prepared>,
    /// Prepared before the pass, for the shapes of every channel.
    lasting: Vec<Prepared>,
}

/// What a part has prepared for some shapes and derivatives.
#[derive(Clone)]
struct Prepared {
    shapes: Vec<f64>,
    offset: usize,
    content: Arc<dyn Any + Send + Sync>,
}

impl Prepared {
    fn new<T: Clone + Send + Sync + 'static>(shapes: &[f64], offset: usize, content: T) -> Self {
        Self { shapes: shapes.to_vec(), offset, content: Arc::new(content) }
    }

    fn of<T: Clone + 'static>(&self, shapes: &[f64], offset: usize) -> Option<T> {
        let same = self.shapes == shapes && self.offset == offset;
        self.content.downcast_ref::<T>().filter(|_| same).cloned()
    }
}

impl Preparations {
    /// What was prepared of the same shapes before, or is now.
    fn of<P: Part, const N: usize>(&mut self, shapes: &[f64], offset: usize) -> P::Prepared<Dual<f64, N>> {
        let known = self.last.iter().chain(&self.lasting).find_map(|known| known.of(shapes, offset));
        known.unwrap_or_else(|| {
            let content = prepare::<P, N>(shapes, offset);
            // The place is used again where it is one of the same kind that nobody shares.
            let place = self.last.as_mut().and_then(|last| {
                let place = Arc::get_mut(&mut last.content)?.downcast_mut::<P::Prepared<Dual<f64, N>>>()?;
                last.shapes.clear();
                last.shapes.extend(shapes);
                last.offset = offset;
                Some(place)
            });
            match place {
                Some(place) => *place = content.clone(),
                None => self.last = Some(Prepared::new(shapes, offset, content.clone())),
            }
            content
        })
    }
}

fn prepare<P: Part, const N: usize>(shapes: &[f64], offset: usize) -> P::Prepared<Dual<f64, N>> {
    let seed = |(j, shape): (usize, &f64)| Dual::<f64, N>::variable(*shape, j.wrapping_sub(offset));
    P::prepare(Values::new(&shapes.iter().enumerate().map(seed).collect::<Vec<_>>()))
}

impl fmt::Debug for Prepared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Prepared").field("shapes", &self.shapes).finish_non_exhaustive()
    }
}

impl BasisBlock {
    /// One that is evaluated with the instructions that every processor of the kind has, to see what others gain.
    #[must_use]
    pub fn portable() -> Self {
        Self { arch: Some(Arch::Scalar), ..Self::default() }
    }

    /// Basis function k at every sample, 1/sr.
    #[must_use]
    pub fn values(&self) -> &[Row] {
        &self.values
    }

    /// The derivative of every basis function with respect to a shape, per formula unit (radians). Empty where
    /// only values were asked for, 0 for shapes that were not.
    #[must_use]
    pub fn partials(&self, shape: usize) -> &[Row] {
        self.partials.get(shape).map_or(&[], Vec::as_slice)
    }

    /// Must be called when the block is another, or its content has changed.
    pub fn forget(&mut self) {
        self.parts.iter_mut().for_each(|part| part.evaluated = false);
    }

    /// Prepares what takes long for all of `shapes`, one set per channel, so that clones of this one share it.
    pub(super) fn prepare(
        &mut self,
        shapes: &[&[f64]],
        derivatives: Derivatives<'_>,
        visit: impl FnOnce(&mut PartPreparation<'_>),
    ) {
        visit(&mut PartPreparation { shapes, derivatives, parts: &mut self.parts, next: 0 });
    }

    /// Evaluates the parts that `visit` shows where their shapes have changed, and joins them.
    pub(super) fn evaluate(
        &mut self,
        block: &Block,
        shapes: &[f64],
        derivatives: Derivatives<'_>,
        visit: impl FnOnce(&mut PartEvaluation<'_>),
    ) {
        let mut evaluation = PartEvaluation {
            block,
            shapes,
            derivatives,
            parts: &mut self.parts,
            next: 0,
            term: 0,
            changed: false,
            arch: self.arch.unwrap_or_default(),
        };
        visit(&mut evaluation);
        // More parts than these belong to another model.
        evaluation.changed |= evaluation.parts.len() > evaluation.next;
        evaluation.parts.truncate(evaluation.next);
        if evaluation.changed {
            let arch = evaluation.arch;
            let rows = if derivatives == Derivatives::None { 0 } else { shapes.len() };
            self.partials.resize(rows, Vec::new());
            let Self { parts, values, partials, .. } = self;
            arch.dispatch(Product { parts, values, partials });
        }
    }
}

/// Derivatives that one round of evaluation finds: dual numbers with more do not fit into the registers.
const ROUND: usize = 3;

/// Prepares parts for the shapes of all channels.
pub(super) struct PartPreparation<'a> {
    shapes: &'a [&'a [f64]],
    derivatives: Derivatives<'a>,
    parts: &'a mut Vec<PartBlock>,
    next: usize,
}

impl PartPreparation<'_> {
    fn lasting<P: Part, const N: usize>(part: &PartBlock, shapes: &[f64], offset: usize) -> Prepared {
        let mut known = part.prepared.lasting.iter();
        let known = known.find(|known| known.of::<P::Prepared<Dual<f64, N>>>(shapes, offset).is_some());
        known.cloned().unwrap_or_else(|| Prepared::new(shapes, offset, prepare::<P, N>(shapes, offset)))
    }
}

impl Visitor for PartPreparation<'_> {
    fn part<P: Part>(&mut self, first: usize) {
        if self.parts.len() == self.next {
            self.parts.push(PartBlock::default());
        }
        let Some(part) = self.parts.get_mut(self.next) else { return };
        self.next += 1;
        part.claim::<P>(first);
        if const { !P::PREPARES_LONG } {
            return;
        }
        let mut lasting: Vec<Prepared> = Vec::new();
        for shapes in self.shapes {
            let shapes = shapes.get(first..first + P::SHAPES).unwrap_or_default();
            if lasting.iter().any(|known| known.shapes == shapes) {
                continue;
            }
            if !self.derivatives.reach::<P>(first) {
                lasting.push(Self::lasting::<P, 0>(part, shapes, 0));
                continue;
            }
            for offset in (0..P::SHAPES).step_by(ROUND) {
                lasting.push(match P::SHAPES - offset {
                    1 => Self::lasting::<P, 1>(part, shapes, offset),
                    2 => Self::lasting::<P, 2>(part, shapes, offset),
                    _ => Self::lasting::<P, 3>(part, shapes, offset),
                });
            }
        }
        part.prepared.lasting = lasting;
    }

    fn next_term(&mut self) {}
}

/// Evaluates parts on a block.
pub(super) struct PartEvaluation<'a> {
    block: &'a Block,
    shapes: &'a [f64],
    derivatives: Derivatives<'a>,
    parts: &'a mut Vec<PartBlock>,
    next: usize,
    term: usize,
    changed: bool,
    arch: Arch,
}

impl Visitor for PartEvaluation<'_> {
    fn part<P: Part>(&mut self, first: usize) {
        let shapes = self.shapes.get(first..first + P::SHAPES).unwrap_or_default();
        if self.parts.len() == self.next {
            self.parts.push(PartBlock::default());
        }
        let Some(part) = self.parts.get_mut(self.next) else { return };
        self.next += 1;
        part.claim::<P>(first);
        let differentiated = self.derivatives.reach::<P>(first);
        let as_before = part.shapes == shapes && part.differentiated == differentiated;
        if part.evaluated && as_before && part.term == self.term {
            return;
        }
        self.changed = true;
        part.term = self.term;
        part.evaluated = true;
        part.shapes.clear();
        part.shapes.extend(shapes);
        part.differentiated = differentiated;
        part.values.resize(P::FUNCTIONS, Row::filled(0.0));
        let derivatives = if differentiated { P::SHAPES } else { 0 };
        part.partials.resize(derivatives * P::FUNCTIONS, Row::filled(0.0));
        let PartBlock { values, partials, prepared, .. } = part;
        let (arch, block) = (self.arch, self.block);
        if derivatives == 0 {
            run::<P, 0>(arch, block, shapes, 0, prepared, values, partials);
        }
        for (round, rows) in partials.chunks_mut(ROUND * P::FUNCTIONS).enumerate() {
            // Only the loops that the part needs are compiled.
            let offset = ROUND * round;
            match P::SHAPES - offset {
                1 if const { P::SHAPES % ROUND == 1 } => {
                    run::<P, 1>(arch, block, shapes, offset, prepared, values, rows);
                }
                2 if const { P::SHAPES % ROUND == 2 } => {
                    run::<P, 2>(arch, block, shapes, offset, prepared, values, rows);
                }
                _ if const { P::SHAPES >= ROUND } => {
                    run::<P, 3>(arch, block, shapes, offset, prepared, values, rows);
                }
                _ => {}
            }
        }
    }

    fn next_term(&mut self) {
        self.term += 1;
    }
}

/// Runs a part over a block with `N` derivatives, for its shapes `offset..offset + N`.
fn run<P: Part, const N: usize>(
    arch: Arch,
    block: &Block,
    shapes: &[f64],
    offset: usize,
    prepared: &mut Preparations,
    values: &mut [Row],
    partials: &mut [Row],
) {
    let prepared = prepared.of::<P, N>(shapes, offset);
    let rings = block.rings();
    if P::SHARED_ON_RINGS && (1..=MOST_RINGS).contains(&rings.len()) {
        arch.dispatch(RunOnRings::<P, N> { block, prepared, values, partials });
    } else {
        arch.dispatch(Run::<P, N> { block, prepared, values, partials });
    }
}

/// With more rings in a block there is little to share.
const MOST_RINGS: usize = 8;

struct Run<'a, P: Part, const N: usize> {
    block: &'a Block,
    prepared: P::Prepared<Dual<f64, N>>,
    values: &'a mut [Row],
    partials: &'a mut [Row],
}

impl<P: Part, const N: usize> WithSimd for Run<'_, P, N> {
    type Output = ();

    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "of lengths checked before the loop, which must not branch")]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { block, prepared, values, partials } = self;
        let (Some(values), Some(partials)) =
            (values.get_mut(..P::FUNCTIONS), partials.get_mut(..N * P::FUNCTIONS))
        else {
            return;
        };
        for i in 0..BLOCK {
            let output = P::at(&prepared, &block.at(i));
            let output = output.as_ref();
            for k in 0..P::FUNCTIONS {
                values[k][i] = output[k].value;
                for j in 0..N {
                    partials[j * P::FUNCTIONS + k][i] = output[k].partials[j];
                }
            }
        }
    }
}

/// The same for a part that is the same for all samples of a ring.
struct RunOnRings<'a, P: Part, const N: usize> {
    block: &'a Block,
    prepared: P::Prepared<Dual<f64, N>>,
    values: &'a mut [Row],
    partials: &'a mut [Row],
}

impl<P: Part, const N: usize> WithSimd for RunOnRings<'_, P, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { block, prepared, values, partials } = self;
        let rings = block.rings();
        for (index, &start) in rings.iter().enumerate().filter(|(_, start)| **start < BLOCK) {
            let end = rings.get(index + 1).copied().unwrap_or(BLOCK);
            let output = P::at(&prepared, &block.at(start));
            let fill = |row: Option<&mut Row>, value: f64| {
                row.and_then(|row| row.get_mut(start..end)).unwrap_or_default().fill(value);
            };
            for (k, output) in output.as_ref().iter().take(P::FUNCTIONS).enumerate() {
                fill(values.get_mut(k), output.value);
                for (j, partial) in output.partials.iter().enumerate() {
                    fill(partials.get_mut(j * P::FUNCTIONS + k), *partial);
                }
            }
        }
    }
}

/// Multiplies the parts of each term of a lobe.
struct Product<'a> {
    parts: &'a [PartBlock],
    values: &'a mut Vec<Row>,
    partials: &'a mut [Vec<Row>],
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { parts, values, partials } = self;
        let mut start = 0;
        for parts in parts.chunk_by(|a, b| a.term == b.term) {
            let end = start + parts.iter().map(|part| part.functions).max().unwrap_or(0);
            values.resize(end, Row::filled(1.0));
            partials.iter_mut().for_each(|rows| rows.resize(end, Row::filled(0.0)));
            // What multiplies all functions is multiplied once.
            for index in (0..parts.len()).filter(|index| is_common(parts, *index)) {
                multiply(parts, index, 0, start, values, partials);
            }
            for rows in partials.iter_mut().chain([&mut *values]) {
                if let Some((first, others)) = rows.get_mut(start..end).and_then(<[Row]>::split_first_mut) {
                    others.fill(*first);
                }
            }
            for index in (0..parts.len()).filter(|index| !is_common(parts, *index)) {
                (0..end - start).for_each(|k| multiply(parts, index, k, start, values, partials));
            }
            start = end;
        }
    }
}

/// Whether a part multiplies all functions alike.
#[inline(always)]
fn is_common(parts: &[PartBlock], index: usize) -> bool {
    parts.get(index).is_some_and(|part| part.functions == 1)
}

/// Multiplies function `k` of a term, whose functions begin at `start`, by its factor of a part, after those that
/// come before it: common ones first.
#[inline(always)]
fn multiply(
    parts: &[PartBlock],
    index: usize,
    k: usize,
    start: usize,
    values: &mut [Row],
    partials: &mut [Vec<Row>],
) {
    let Some(part) = parts.get(index) else { return };
    let (Some(factor), Some(value)) = (part.value(k), values.get_mut(start + k)) else { return };
    let order = |index: usize| (!is_common(parts, index), index);
    let earlier = parts.iter().enumerate().filter(|(other, _)| order(*other) < order(index));
    let is_first = earlier.clone().next().is_none();
    for (shape, rows) in partials.iter_mut().enumerate() {
        let Some(partial) = rows.get_mut(start + k) else { continue };
        let before = earlier.clone().any(|(_, earlier)| earlier.depends_on(shape));
        // (v f)' = v' f + v f'
        match (before, part.partial(shape, k)) {
            (true, Some(slope)) => {
                let entries = partial.iter_mut().zip(factor).zip(value.iter()).zip(slope);
                entries.for_each(|(((p, f), v), s)| *p = *p * f + v * s);
            }
            (true, None) => partial.iter_mut().zip(factor).for_each(|(p, f)| *p *= f),
            (false, Some(slope)) if is_first => *partial = *slope,
            (false, Some(slope)) => {
                partial.iter_mut().zip(value.iter()).zip(slope).for_each(|((p, v), s)| *p = v * s);
            }
            // What another term left of a shape that this one does not know.
            (false, None) if is_first => partial.fill(0.0),
            (false, None) => {}
        }
    }
    if is_first {
        *value = *factor;
    } else {
        value.iter_mut().zip(factor).for_each(|(v, f)| *v *= f);
    }
}

impl PartBlock {
    /// Makes the place that of a part; what another has left there is forgotten.
    fn claim<P: Part>(&mut self, first: usize) {
        if self.part != Some(TypeId::of::<P>()) || self.first != first {
            *self = Self { part: Some(TypeId::of::<P>()), first, functions: P::FUNCTIONS, ..Self::default() };
        }
    }

    /// The part's factor of basis function `k`.
    #[inline(always)]
    fn value(&self, k: usize) -> Option<&Row> {
        self.values.get(if self.functions == 1 { 0 } else { k })
    }

    /// Its derivative with respect to the lobe's shape number `shape`.
    #[inline(always)]
    fn partial(&self, shape: usize, k: usize) -> Option<&Row> {
        let j = shape.checked_sub(self.first)?;
        self.partials.get(j * self.functions + if self.functions == 1 { 0 } else { k })
    }

    #[inline(always)]
    fn depends_on(&self, shape: usize) -> bool {
        self.partial(shape, 0).is_some()
    }
}

/// The basis functions at some pairs of directions, in any scalar.
pub(super) struct PointEvaluation<'a, T: Scalar> {
    geometries: &'a [Geometry<T::Real>],
    shapes: &'a [T],
    /// Of the terms before, each at all pairs.
    basis: Vec<Vec<T>>,
    /// The product of this term's parts so far; empty before the first.
    product: Vec<Vec<T>>,
}

impl<'a, T: Scalar> PointEvaluation<'a, T> {
    pub(super) fn new(geometries: &'a [Geometry<T::Real>], shapes: &'a [T]) -> Self {
        Self { geometries, shapes, basis: Vec::new(), product: Vec::new() }
    }

    /// The values of every basis function.
    pub(super) fn basis(mut self) -> Vec<Vec<T>> {
        self.next_term();
        self.basis
    }
}

impl<T: Scalar> Visitor for PointEvaluation<'_, T> {
    fn part<P: Part>(&mut self, first: usize) {
        let shapes = self.shapes.get(first..first + P::SHAPES).unwrap_or_default();
        let prepared = P::prepare(Values::new(shapes));
        let mut factors = vec![Vec::with_capacity(self.geometries.len()); P::FUNCTIONS];
        for geometry in self.geometries {
            let output = P::at(&prepared, geometry);
            factors.iter_mut().zip(output.as_ref()).for_each(|(factors, factor)| factors.push(*factor));
        }
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

    fn next_term(&mut self) {
        self.basis.append(&mut self.product);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::HalfDifferenceGrid;
    use crate::model::{AnyModel, REGISTRY, Role};

    fn shapes(model: &AnyModel) -> Vec<f64> {
        let shapes = model.parameters().into_iter().filter(|spec| spec.role == Role::Shape);
        shapes.map(|spec| spec.initial * spec.unit.factor(None)).collect()
    }

    fn bits(basis: &BasisBlock, shapes: usize) -> Vec<u64> {
        let rows = (0..shapes).flat_map(|shape| basis.partials(shape)).chain(basis.values());
        rows.flatten().map(|value| value.to_bits()).collect()
    }

    /// Cells of several rings, the last of them cut short.
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
                // The same numbers for all, so that the shapes do not tell the models apart.
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
            // Another channel with the same shapes, and one with others.
            model.evaluate(&block, &[m], Derivatives::All, &mut basis);
            assert_eq!(bits(&basis, 1), fresh(cells, m));
            model.evaluate(&block, &[0.7], Derivatives::All, &mut basis);
            assert_eq!(bits(&basis, 1), fresh(cells, 0.7));
        }
    }
}
