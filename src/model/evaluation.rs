//! Models on blocks of samples.
//!
//! A lobe's basis functions are products of [`Part`]s, each a formula with shapes of its own: a microfacet lobe
//! is a distribution times a visibility times a Fresnel reflectance. Here the parts run over a block one by one,
//! each in the loop of its [`Kernel`], over rows of known length without branches, which the compiler turns into packed
//! instructions; the product rule joins what they find. So every formula is written once, for one sample, the number of
//! compiled loops is that of the kernels, and a part whose shapes have not changed from one channel to the next is not
//! evaluated again.
//!
//! The loops are compiled for several instruction sets, of which the widest that the machine has is chosen when
//! the program runs. All round alike: none of them may fuse a product and a sum.
//!
//! Little here is generic. A model shows its parts by type; [`ErasedPart`] keeps of each the few numbers and the functions that
//! differ, and everything else is compiled once.
#![allow(clippy::indexing_slicing, reason = "a kernel: the lengths that it indexes are checked at its head")]

use super::part::{Derivatives, Kernel, Part, PreparedBy, Visitor};
use super::values::Values;
use crate::geometry::{BLOCK, Block, Row};
use crate::math::Dual;
use pulp::{Arch, Simd, WithSimd};
use std::any::{Any, TypeId};
use std::fmt;
use std::sync::Arc;

/// Basis functions of one lobe on a block, and their derivatives with respect to the lobe's shapes.
#[derive(Clone, Debug, Default)]
pub struct BasisBlock {
    /// The instruction set; `None` means the widest that the machine has.
    arch: Option<Arch>,
    parts: Vec<PartBlock>,
    values: Vec<Row>,
    /// Per shape, a row per function.
    partials: Vec<Vec<Row>>,
    /// The block with the light mirrored, once a part has asked for it.
    mirrored: Option<Box<Block>>,
}

/// One part on a block.
#[derive(Clone, Debug)]
struct PartBlock {
    part: &'static ErasedPart,
    /// Which of the lobe's shapes is the part's first.
    first: usize,
    /// Whether the light is mirrored.
    mirrored: bool,
    /// Whether it was evaluated on this block, for which shapes, and whether with derivatives.
    evaluated: bool,
    shapes: Vec<f64>,
    differentiated: bool,
    /// The product that it belongs to.
    term: usize,
    /// A row per function.
    values: Vec<Row>,
    /// For each of the part's shapes, a row per function.
    partials: Vec<Row>,
    prepared: Preparations,
}

/// A part without its type.
struct ErasedPart {
    id: TypeId,
    shapes: usize,
    functions: usize,
    prepares_long: bool,
    /// By the number of derivatives.
    rounds: [Round; ROUND + 1],
}

/// What a part does in one round of evaluation, which finds some of its derivatives.
#[derive(Clone, Copy)]
struct Round {
    derivatives: usize,
    /// Runs the kernel over a block, into rows for values and partials.
    run: fn(Place<'_>, &mut Preparations, &mut [Row], &mut [Row]),
    /// Prepares the kernel for some shapes, of which those from the given one on are differentiated.
    prepare: fn(&[f64], usize) -> Arc<dyn Any + Send + Sync>,
}

/// Where a round is evaluated.
#[derive(Clone, Copy)]
struct Place<'a> {
    arch: Arch,
    block: &'a Block,
    shapes: &'a [f64],
    /// The first of the shapes that this round differentiates by.
    offset: usize,
}

/// Derivatives that one round of evaluation finds: dual numbers with more do not fit into the registers.
const ROUND: usize = 3;

impl Round {
    const fn of<P: Part, const N: usize>() -> Self {
        Self {
            derivatives: N,
            run: run::<P, N>,
            prepare: |shapes, offset| Arc::new(prepare::<P, N>(shapes, offset)),
        }
    }
}

impl ErasedPart {
    const fn of<P: Part>() -> Self {
        // Only the loops that the part needs are compiled; in the place of the others stands the one without derivatives.
        let rounds = const {
            let plain = Round::of::<P, 0>();
            let last = P::SHAPES % ROUND;
            [
                plain,
                if last == 1 { Round::of::<P, 1>() } else { plain },
                if last == 2 { Round::of::<P, 2>() } else { plain },
                if P::SHAPES >= ROUND { Round::of::<P, 3>() } else { plain },
            ]
        };
        Self {
            id: TypeId::of::<P>(),
            shapes: P::SHAPES,
            functions: P::Kernel::FUNCTIONS,
            prepares_long: P::PREPARES_LONG,
            rounds,
        }
    }

    /// The round that finds `derivatives` derivatives.
    fn round(&self, derivatives: usize) -> Round {
        let round = self.rounds[derivatives];
        assert_eq!(round.derivatives, derivatives, "a part has the rounds that its shapes need");
        round
    }

    /// The rounds that find all derivatives, each with its first shape; or the one that finds none.
    fn rounds(&self, differentiated: bool) -> impl Iterator<Item = (usize, Round)> + '_ {
        let shapes = if differentiated { self.shapes } else { 0 };
        let offsets = (0..shapes.max(1)).step_by(ROUND);
        offsets.map(move |offset| (offset, self.round(ROUND.min(shapes - offset))))
    }
}

impl fmt::Debug for ErasedPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ErasedPart")
            .field("id", &self.id)
            .field("shapes", &self.shapes)
            .finish_non_exhaustive()
    }
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
    /// [`PreparedBy`] the part in dual numbers with as many derivatives as the round has.
    derivatives: usize,
    content: Arc<dyn Any + Send + Sync>,
}

impl Prepared {
    fn is_for(&self, shapes: &[f64], offset: usize, derivatives: usize) -> bool {
        self.shapes == shapes && self.offset == offset && self.derivatives == derivatives
    }
}

impl fmt::Debug for Prepared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Prepared").field("shapes", &self.shapes).finish_non_exhaustive()
    }
}

impl Preparations {
    /// What was prepared for the same shapes before, or is now.
    fn get<T: Clone + Send + Sync + 'static>(
        &mut self,
        shapes: &[f64],
        offset: usize,
        derivatives: usize,
        prepare: fn(&[f64], usize) -> T,
    ) -> T {
        let mut known = self.last.iter().chain(&self.lasting);
        let known = known.find(|known| known.is_for(shapes, offset, derivatives));
        if let Some(content) = known.and_then(|known| known.content.downcast_ref::<T>()) {
            return content.clone();
        }
        let content = prepare(shapes, offset);
        // The place is used again where it holds the same type and nobody shares it.
        if let Some(last) = &mut self.last
            && let Some(place) = Arc::get_mut(&mut last.content).and_then(|place| place.downcast_mut::<T>())
        {
            *place = content.clone();
            last.shapes.clear();
            last.shapes.extend(shapes);
            (last.offset, last.derivatives) = (offset, derivatives);
        } else {
            let (shapes, content) = (shapes.to_vec(), Arc::new(content.clone()));
            self.last = Some(Prepared { shapes, offset, derivatives, content });
        }
        content
    }
}

/// Prepares a kernel in dual numbers with `N` derivatives, for the shapes `offset..offset + N`.
fn prepare<P: Part, const N: usize>(shapes: &[f64], offset: usize) -> PreparedBy<P, Dual<f64, N>> {
    P::prepare(Values::new(&seeds(shapes, offset)))
}

/// The shapes as dual numbers, those from `offset` on with a derivative each.
fn seeds<const N: usize>(shapes: &[f64], offset: usize) -> Vec<Dual<f64, N>> {
    let seed = |(j, shape): (usize, &f64)| Dual::variable(*shape, j.wrapping_sub(offset));
    shapes.iter().enumerate().map(seed).collect()
}

/// Runs a part over a block with `N` derivatives, for its shapes `offset..offset + N`.
fn run<P: Part, const N: usize>(
    place: Place<'_>,
    preparations: &mut Preparations,
    values: &mut [Row],
    partials: &mut [Row],
) {
    let prepared = preparations.get(place.shapes, place.offset, N, prepare::<P, N>);
    run_kernel::<P::Kernel, N>(place, prepared, values, partials);
}

/// Runs a kernel over a block.
fn run_kernel<K: Kernel, const N: usize>(
    Place { arch, block, .. }: Place<'_>,
    prepared: K::Prepared<Dual<f64, N>>,
    values: &mut [Row],
    partials: &mut [Row],
) {
    assert_eq!((values.len(), partials.len()), (K::FUNCTIONS, N * K::FUNCTIONS), "a row per function");
    if K::SHARED_ON_RINGS && (1..=MOST_RINGS).contains(&block.rings().len()) {
        run_on_rings::<K, N>(block, &prepared, values, partials);
    } else {
        arch.dispatch(Run::<K, N> { block, prepared, values, partials });
    }
}

/// With more rings in a block there is little to share.
const MOST_RINGS: usize = 8;

/// Evaluates a kernel at the first sample of every ring, for all of its samples. So few evaluations need no packed
/// instructions.
fn run_on_rings<K: Kernel, const N: usize>(
    block: &Block,
    prepared: &K::Prepared<Dual<f64, N>>,
    values: &mut [Row],
    partials: &mut [Row],
) {
    let rings = block.rings();
    let ends = rings.iter().skip(1).copied().chain([BLOCK]);
    for (&start, end) in rings.iter().zip(ends).filter(|(start, _)| **start < BLOCK) {
        let output = K::at(prepared, &block.at(start));
        for (k, output) in output.as_ref().iter().take(K::FUNCTIONS).enumerate() {
            values[k][start..end].fill(output.value);
            for (j, partial) in output.partials.iter().enumerate() {
                partials[j * K::FUNCTIONS + k][start..end].fill(*partial);
            }
        }
    }
}

/// The loop of a kernel over a block, with `N` derivatives.
struct Run<'a, K: Kernel, const N: usize> {
    block: &'a Block,
    prepared: K::Prepared<Dual<f64, N>>,
    values: &'a mut [Row],
    partials: &'a mut [Row],
}

impl<K: Kernel, const N: usize> WithSimd for Run<'_, K, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { block, prepared, values, partials } = self;
        // Of lengths that the compiler knows: the loop must not branch.
        let (values, partials) = (&mut values[..K::FUNCTIONS], &mut partials[..N * K::FUNCTIONS]);
        for i in 0..BLOCK {
            let output = K::at(&prepared, &block.at(i));
            let output = output.as_ref();
            for k in 0..K::FUNCTIONS {
                values[k][i] = output[k].value;
                for j in 0..N {
                    partials[j * K::FUNCTIONS + k][i] = output[k].partials[j];
                }
            }
        }
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

    /// The derivative of every basis function with respect to a shape, per formula unit (radians). Empty where it was
    /// not asked for.
    #[must_use]
    pub fn partials(&self, shape: usize) -> &[Row] {
        self.partials.get(shape).map_or(&[], Vec::as_slice)
    }

    /// Must be called when the block is another, or its content has changed.
    pub fn forget(&mut self) {
        self.parts.iter_mut().for_each(|part| part.evaluated = false);
        self.mirrored = None;
    }

    /// Prepares what takes long for all of `shapes`, one set per channel, so that clones of this one share it. The visitor
    /// is to be shown the lobe's parts.
    pub(super) fn preparation<'a>(
        &'a mut self,
        shapes: &'a [&'a [f64]],
        derivatives: Derivatives<'a>,
    ) -> PartPreparation<'a> {
        PartPreparation { shapes, derivatives, parts: PartList::new(&mut self.parts) }
    }

    /// Evaluates the parts of a lobe where their shapes have changed. The visitor is to be shown all of them, and then
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

/// The parts of a lobe, in the order in which they are shown.
struct PartList<'a> {
    parts: &'a mut Vec<PartBlock>,
    /// How many were shown.
    shown: usize,
    mirrored: bool,
}

impl<'a> PartList<'a> {
    fn new(parts: &'a mut Vec<PartBlock>) -> Self {
        Self { parts, shown: 0, mirrored: false }
    }

    /// The place of the next part. What another part has left there is forgotten.
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

/// Prepares parts for the shapes of all channels.
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

/// Evaluates parts on a block.
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
    /// Evaluates a part, unless it has been for the same shapes on this block.
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

    /// Joins the parts that were shown, if any of them has changed.
    pub(super) fn finish(self) {
        let Self { parts: PartList { parts, shown, .. }, product: (values, partials), .. } = self;
        // More parts than these belong to another model.
        let changed = self.changed || parts.len() > shown;
        parts.truncate(shown);
        if changed {
            let rows = if self.derivatives == Derivatives::None { 0 } else { self.shapes.len() };
            partials.resize(rows, Vec::new());
            self.arch.dispatch(Product { parts, derivatives: self.derivatives, values, partials });
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

/// Multiplies the parts of each term of a lobe.
struct Product<'a> {
    parts: &'a [PartBlock],
    /// Those that were asked for; parts may have found more.
    derivatives: Derivatives<'a>,
    values: &'a mut Vec<Row>,
    partials: &'a mut [Vec<Row>],
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { parts: all, derivatives, values, partials } = self;
        let mut start = 0;
        for parts in all.chunk_by(|a, b| a.term == b.term) {
            let end = start + parts.iter().map(|part| part.part.functions).max().unwrap_or(0);
            values.resize(end, Row::filled(1.0));
            for (shape, rows) in partials.iter_mut().enumerate() {
                let wanted = derivatives.include_any(shape, 1);
                let known = wanted || all.iter().any(|part| part.depends_on(shape));
                rows.resize(if known { end } else { 0 }, Row::filled(0.0));
            }
            multiply_term(parts, &mut values[start..end], partials, start);
            start = end;
        }
    }
}

/// Multiplies the parts of one term, whose rows of partials begin at `start`: those that multiply all functions first, and
/// once for all of them.
#[inline(always)]
fn multiply_term(parts: &[PartBlock], values: &mut [Row], partials: &mut [Vec<Row>], start: usize) {
    let common = || parts.iter().filter(|part| part.is_common());
    let mut order = common().chain(parts.iter().filter(|part| !part.is_common()));
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
        let known = |shape| {
            let mut earlier = common().chain(parts.iter().filter(|part| !part.is_common())).take(before);
            earlier.any(|earlier| earlier.depends_on(shape))
        };
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

impl PartBlock {
    fn new(part: &'static ErasedPart, first: usize, mirrored: bool) -> Self {
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
    fn is_common(&self) -> bool {
        self.part.functions == 1
    }

    /// Which row stands for basis function `k`.
    #[inline(always)]
    fn row(&self, k: usize) -> usize {
        if self.is_common() { 0 } else { k }
    }

    /// The part's factor of basis function `k`.
    #[inline(always)]
    fn value(&self, k: usize) -> &Row {
        &self.values[self.row(k)]
    }

    /// Its derivative with respect to the lobe's shape number `shape`; `None` means that it does not depend on it.
    #[inline(always)]
    fn partial(&self, shape: usize, k: usize) -> Option<&Row> {
        let j = shape.checked_sub(self.first)?;
        self.partials.get(j * self.part.functions + self.row(k))
    }

    #[inline(always)]
    fn depends_on(&self, shape: usize) -> bool {
        self.partial(shape, 0).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::HalfDifferenceGrid;
    use crate::model::{AnyModel, REGISTRY, Role};

    fn shapes(model: &AnyModel) -> Vec<f64> {
        let shapes = model.parameters().into_iter().filter(|spec| spec.role == Role::Shape);
        shapes.map(|spec| spec.in_formula_units(spec.initial)).collect()
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
