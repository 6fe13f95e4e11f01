//! Parts without their types, and the loops of their kernels over a block.
//!
//! All that is compiled for each part stands here: how it prepares its kernel, and, for each kernel and number of derivatives, the
//! loop over a block.
#![allow(clippy::indexing_slicing, reason = "a kernel: the lengths that it indexes are checked at its head")]

use super::part::{Kernel, Part, PreparedBy};
use super::values::Values;
use crate::geometry::{BLOCK, Block, Row};
use crate::math::Dual;
use pulp::{Arch, Simd, WithSimd};
use std::any::{Any, TypeId};
use std::fmt;
use std::sync::Arc;

/// A part without its type.
pub(super) struct ErasedPart {
    pub(super) id: TypeId,
    pub(super) shapes: usize,
    pub(super) functions: usize,
    pub(super) prepares_long: bool,
    /// By the number of derivatives.
    rounds: [Round; ROUND + 1],
}

/// What a part does in one round of evaluation, which finds some of its derivatives.
#[derive(Clone, Copy)]
pub(super) struct Round {
    pub(super) derivatives: usize,
    /// Runs the kernel over a block, into rows for values and partials.
    pub(super) run: fn(Place<'_>, &mut Preparations, &mut [Row], &mut [Row]),
    /// Prepares the kernel for some shapes, of which those from the given one on are differentiated.
    pub(super) prepare: fn(&[f64], usize) -> Arc<dyn Any + Send + Sync>,
}

/// Where a round is evaluated.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub(super) arch: Arch,
    pub(super) block: &'a Block,
    pub(super) shapes: &'a [f64],
    /// The first of the shapes that this round differentiates by.
    pub(super) offset: usize,
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
    pub(super) const fn of<P: Part>() -> Self {
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
    #[inline]
    fn round(&self, derivatives: usize) -> Round {
        let round = self.rounds[derivatives];
        assert_eq!(round.derivatives, derivatives, "a part has the rounds that its shapes need");
        round
    }

    /// The rounds that find all derivatives, each with its first shape; or the one that finds none.
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

/// What a part has prepared. Some prepare by quadrature, which must not be repeated for every block.
#[derive(Clone, Debug, Default)]
pub(super) struct Preparations {
    /// For the shapes of the last block.
    last: Option<Prepared>,
    /// Prepared before the pass, for the shapes of every channel.
    pub(super) lasting: Vec<Prepared>,
}

/// What a part has prepared for some shapes and derivatives.
#[derive(Clone)]
pub(super) struct Prepared {
    pub(super) shapes: Vec<f64>,
    pub(super) offset: usize,
    /// [`PreparedBy`] the part in dual numbers with as many derivatives as the round has.
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
pub(super) const MOST_RINGS: usize = 8;

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
