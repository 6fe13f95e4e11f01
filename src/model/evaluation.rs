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

/// One factor of the basis functions of a lobe.
///
/// Both functions, and whatever they call for each sample, must be `#[inline(always)]` and choose by
/// [`Scalar::if_less`]: a call or a branch would keep the loop over a block from being packed.
pub trait Part {
    /// How many shapes it takes.
    const SHAPES: usize;
    /// How many functions it has: one per basis function of the lobe, or one that multiplies them all.
    const FUNCTIONS: usize = 1;
    /// Quantities that depend on the shapes alone, computed once per block.
    type Prepared<T: Scalar>: Copy;
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
}

/// Basis functions of one lobe on a block, and their derivatives with respect to the lobe's shapes.
#[derive(Clone, Debug, Default)]
pub struct BasisBlock {
    parts: Vec<PartBlock>,
    values: Vec<Row>,
    /// Per shape, a row per function.
    partials: Vec<Vec<Row>>,
}

/// One part on a block.
#[derive(Clone, Debug, Default)]
struct PartBlock {
    /// The shapes that it was evaluated for; none if it was not, or on another block.
    shapes: Option<Vec<f64>>,
    first: usize,
    functions: usize,
    /// A row per function.
    values: Vec<Row>,
    /// For each of the part's shapes, a row per function.
    partials: Vec<Row>,
}

impl BasisBlock {
    /// Basis function k at every sample, 1/sr.
    #[must_use]
    pub fn values(&self) -> &[Row] {
        &self.values
    }

    /// The derivative of every basis function with respect to a shape, per formula unit (radians). Empty where
    /// only values were asked for.
    #[must_use]
    pub fn partials(&self, shape: usize) -> &[Row] {
        self.partials.get(shape).map_or(&[], Vec::as_slice)
    }

    /// Must be called when the content of the block has changed.
    pub fn forget(&mut self) {
        self.parts.iter_mut().for_each(|part| part.shapes = None);
    }

    /// Evaluates the parts that `visit` shows where their shapes have changed, and joins them.
    pub(super) fn evaluate(
        &mut self,
        block: &Block,
        shapes: &[f64],
        differentiate: bool,
        visit: impl FnOnce(&mut PartEvaluation<'_>),
    ) {
        let mut evaluation = PartEvaluation {
            block,
            shapes,
            differentiate,
            parts: &mut self.parts,
            next: 0,
            changed: false,
            arch: Arch::new(),
        };
        visit(&mut evaluation);
        if evaluation.changed {
            let arch = evaluation.arch;
            self.partials.resize(if differentiate { shapes.len() } else { 0 }, Vec::new());
            let Self { parts, values, partials } = self;
            arch.dispatch(Product { parts, values, partials });
        }
    }
}

/// Evaluates parts on a block.
pub(super) struct PartEvaluation<'a> {
    block: &'a Block,
    shapes: &'a [f64],
    differentiate: bool,
    parts: &'a mut Vec<PartBlock>,
    next: usize,
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
        if part.shapes.as_deref() == Some(shapes) {
            return;
        }
        self.changed = true;
        part.shapes = Some(shapes.to_vec());
        part.first = first;
        part.functions = P::FUNCTIONS;
        part.values.resize(P::FUNCTIONS, Row::filled(0.0));
        let derivatives = if self.differentiate { P::SHAPES } else { 0 };
        part.partials.resize(derivatives * P::FUNCTIONS, Row::filled(0.0));
        if derivatives == 0 {
            run::<P, 0>(self.arch, self.block, shapes, 0, &mut part.values, &mut part.partials);
            return;
        }
        // Dual numbers of more than three derivatives do not fit into the registers: several rounds of fewer.
        for (round, rows) in part.partials.chunks_mut(3 * P::FUNCTIONS).enumerate() {
            let (arch, block, offset, values) = (self.arch, self.block, 3 * round, &mut part.values);
            match P::SHAPES - offset {
                1 => run::<P, 1>(arch, block, shapes, offset, values, rows),
                2 => run::<P, 2>(arch, block, shapes, offset, values, rows),
                _ => run::<P, 3>(arch, block, shapes, offset, values, rows),
            }
        }
    }
}

/// Runs a part over a block with `N` derivatives, for its shapes `offset..offset + N`.
fn run<P: Part, const N: usize>(
    arch: Arch,
    block: &Block,
    shapes: &[f64],
    offset: usize,
    values: &mut [Row],
    partials: &mut [Row],
) {
    let mut seeded = [Dual::from_real(0.0); MOST_SHAPES];
    for (j, (seed, shape)) in seeded.iter_mut().zip(shapes).enumerate() {
        *seed = Dual::<f64, N>::variable(*shape, j.wrapping_sub(offset));
    }
    let prepared = P::prepare(Values::new(seeded.get(..shapes.len()).unwrap_or_default()));
    arch.dispatch(Run::<P, N> { block, prepared, values, partials });
}

/// The most shapes that a part may have.
const MOST_SHAPES: usize = 16;

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

/// Multiplies the parts of a lobe.
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
        let functions = parts.iter().map(|part| part.functions).max().unwrap_or(0);
        values.resize(functions, Row::filled(1.0));
        partials.iter_mut().for_each(|rows| rows.resize(functions, Row::filled(0.0)));
        for (k, value) in values.iter_mut().enumerate() {
            for (index, part) in parts.iter().enumerate() {
                let (Some(factor), first) = (part.value(k), index == 0) else { continue };
                for (shape, rows) in partials.iter_mut().enumerate() {
                    let Some(partial) = rows.get_mut(k) else { continue };
                    let before = parts.iter().take(index).any(|earlier| earlier.depends_on(shape));
                    // (v f)' = v' f + v f'
                    match (before, part.partial(shape, k)) {
                        (true, Some(slope)) => {
                            for (((p, f), v), s) in
                                partial.iter_mut().zip(factor).zip(value.iter()).zip(slope)
                            {
                                *p = *p * f + v * s;
                            }
                        }
                        (true, None) => partial.iter_mut().zip(factor).for_each(|(p, f)| *p *= f),
                        (false, Some(slope)) if first => *partial = *slope,
                        (false, Some(slope)) => {
                            for ((p, v), s) in partial.iter_mut().zip(value.iter()).zip(slope) {
                                *p = v * s;
                            }
                        }
                        (false, None) => {}
                    }
                }
                if first {
                    *value = *factor;
                } else {
                    value.iter_mut().zip(factor).for_each(|(v, f)| *v *= f);
                }
            }
        }
    }
}

impl PartBlock {
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

/// The basis functions at one pair of directions.
pub(super) struct PointEvaluation<'a, T: Scalar> {
    geometry: &'a Geometry<T::Real>,
    shapes: &'a [T],
    /// The product of the parts so far; empty before the first.
    basis: Vec<T>,
}

impl<'a, T: Scalar> PointEvaluation<'a, T> {
    pub(super) fn new(geometry: &'a Geometry<T::Real>, shapes: &'a [T]) -> Self {
        Self { geometry, shapes, basis: Vec::new() }
    }

    /// The value of every basis function.
    pub(super) fn basis(self) -> Vec<T> {
        self.basis
    }
}

impl<T: Scalar> Visitor for PointEvaluation<'_, T> {
    fn part<P: Part>(&mut self, first: usize) {
        let shapes = self.shapes.get(first..first + P::SHAPES).unwrap_or_default();
        let output = P::at(&P::prepare(Values::new(shapes)), self.geometry);
        let factors = output.as_ref().get(..P::FUNCTIONS).unwrap_or_default();
        self.basis = match (self.basis.as_slice(), factors) {
            ([], factors) => factors.to_vec(),
            ([one], factors) => factors.iter().map(|factor| *one * *factor).collect(),
            (several, [one]) => several.iter().map(|value| *value * *one).collect(),
            (several, factors) => {
                several.iter().zip(factors).map(|(value, factor)| *value * *factor).collect()
            }
        };
    }
}
