//! Parts with their types erased, and the loops of their kernels over a block.
//!
//! Everything that is compiled for each part is here: how it prepares its kernel and, for each kernel and number of
//! derivatives, the loop over a block.
#![allow(clippy::indexing_slicing, reason = "a kernel: the lengths that it indexes are checked at its head")]

use super::part::{Kernel, Part, PreparedBy};
use super::values::Values;
use crate::geometry::{BLOCK, Block, Row};
use crate::math::Dual;
use pulp::{Arch, Simd, WithSimd};
use std::any::{Any, TypeId};
use std::fmt;
use std::sync::Arc;

/// A part with its type erased.
pub(super) struct ErasedPart {
    pub(super) id: TypeId,
    pub(super) shapes: usize,
    pub(super) functions: usize,
    pub(super) prepares_long: bool,
    /// The rounds, indexed by their number of derivatives.
    rounds: [Round; ROUND + 1],
}

/// One round of evaluation of a part, which computes its values and some of its derivatives.
#[derive(Clone, Copy)]
pub(super) struct Round {
    pub(super) derivatives: usize,
    /// Runs the kernel over a block, into rows for values and partials.
    pub(super) run: fn(Place<'_>, &mut Preparations, &mut [Row], &mut [Row]),
    /// Prepares the kernel for given shapes; derivatives are with respect to those from the given index on.
    pub(super) prepare: fn(&[f64], usize) -> Arc<dyn Any + Send + Sync>,
}

/// The block and shapes at which a round is evaluated.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub(super) arch: Arch,
    pub(super) block: &'a Block,
    pub(super) shapes: &'a [f64],
    /// Index of the first shape with respect to which this round differentiates.
    pub(super) offset: usize,
}

/// Largest number of derivatives in one round: dual numbers with more do not fit into the registers.
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
    pub(super) const fn of<P: Part>() -> Self {
        // Only the loops that the part needs are compiled; the loop without derivatives takes the place of the others.
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

    /// The round that computes `derivatives` derivatives.
    #[inline]
    fn round(&self, derivatives: usize) -> Round {
        let round = self.rounds[derivatives];
        assert_eq!(round.derivatives, derivatives, "a part has the rounds that its shapes need");
        round
    }

    /// The rounds that together compute all derivatives, each with the index of its first shape; if not `differentiated`, the
    /// single round without derivatives.
    #[inline]
    pub(super) fn rounds(&self, differentiated: bool) -> impl Iterator<Item = (usize, Round)> + '_ {
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

/// What a part has prepared for its kernel. Some parts use quadrature, which must not be repeated for every block.
#[derive(Clone, Debug, Default)]
pub(super) struct Preparations {
    /// Preparation for the shapes of the last block.
    last: Option<Prepared>,
    /// Preparations made before the pass, for the shapes of every channel.
    pub(super) lasting: Vec<Prepared>,
}

/// The preparation of a part for given shapes and derivatives.
#[derive(Clone)]
pub(super) struct Prepared {
    pub(super) shapes: Vec<f64>,
    pub(super) offset: usize,
    /// Number of derivatives of the dual numbers in `content`, which is [`PreparedBy`] the part.
    pub(super) derivatives: usize,
    pub(super) content: Arc<dyn Any + Send + Sync>,
}

impl Prepared {
    pub(super) fn is_for(&self, shapes: &[f64], offset: usize, derivatives: usize) -> bool {
        self.shapes == shapes && self.offset == offset && self.derivatives == derivatives
    }
}

impl fmt::Debug for Prepared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Prepared").field("shapes", &self.shapes).finish_non_exhaustive()
    }
}

impl Preparations {
    /// The preparation for these shapes: a stored one, or a new one if there is none.
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
        // Its memory is reused if it holds the same type and is not shared.
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

/// The shapes as dual numbers; the `N` shapes from `offset` on are the variables of the derivatives.
fn seeds<const N: usize>(shapes: &[f64], offset: usize) -> Vec<Dual<f64, N>> {
    let seed = |(j, shape): (usize, &f64)| Dual::variable(*shape, j.wrapping_sub(offset));
    shapes.iter().enumerate().map(seed).collect()
}

/// Runs a part over a block with `N` derivatives, with respect to its shapes `offset..offset + N`.
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

/// Largest number of rings in a block for which evaluation per ring pays off.
pub(super) const MOST_RINGS: usize = 8;

/// Evaluates a kernel at the first sample of every ring and copies the result to all samples of the ring. There are so few
/// evaluations that packed instructions are not needed.
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
    pub(super) block: &'a Block,
    prepared: K::Prepared<Dual<f64, N>>,
    values: &'a mut [Row],
    partials: &'a mut [Row],
}

impl<K: Kernel, const N: usize> WithSimd for Run<'_, K, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { block, prepared, values, partials } = self;
        // Slices of lengths that the compiler knows, since the loop must not branch.
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
