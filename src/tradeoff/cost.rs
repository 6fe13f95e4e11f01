//! The cost of an evaluation: operations, which depend only on the formula, and nanoseconds on this machine.

use crate::geometry::{BLOCK, Block, Directions, Geometry, Pair};
use crate::math::{Counted, Operations, Real, count, counting};
use crate::model::{BasisBlock, Derivatives, Expression, LobeValues, ModelEntry, Role};
use crate::synthetic::scattered_directions;
use serde::Serialize;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Shapes and amplitudes of every lobe.
type Values<T> = Vec<LobeValues<T>>;

/// The median of repeated timings, and the quartiles.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// Lower quartile: a quarter of the timings are below.
    pub low: f64,
    /// Upper quartile: a quarter of the timings are above.
    pub high: f64,
}

/// Nanoseconds for one evaluation: one channel at one pair of directions. The cosines of the directions and all that
/// depends only on the parameters are computed before.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Nanoseconds {
    /// One pair after another in double precision.
    pub scalar_f64: Spread,
    /// The same in single precision.
    pub scalar_f32: Spread,
    /// In blocks of 128 in double precision, with the processor's vector instructions.
    pub blocks_f64: Spread,
}

/// The cost of an evaluation.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Cost {
    /// Operations of one evaluation, by kind.
    pub operations: Operations,
    /// Their number in units of one sum: quotients and roots count 4, transcendental functions 25.
    pub weighted: u64,
    /// Operations done once per set of parameters, such as building tables, in the same units.
    pub prepared_once: u64,
    /// Times on this machine; they differ from run to run.
    pub time_ns: Nanoseconds,
}

/// Time that a fit takes to evaluate a model's basis functions, nanoseconds per pair of directions on one thread; differs
/// from run to run.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct BasisCost {
    /// For the values alone.
    pub value: f64,
    /// For the values and their derivatives with respect to every shape.
    pub with_derivatives: f64,
}

/// Shortest time for which one series of evaluations is repeated.
const SERIES: Duration = Duration::from_millis(2);
/// Number of series that are timed.
const REPEATS: usize = 9;
/// Evaluations per call: enough to make the preparation, which is timed separately, small in comparison.
const PAIRS: usize = 2048;
/// Evaluations per call if the preparation takes more operations than [`LONG`], as it does for tables.
const MORE_PAIRS: usize = 40_000;
/// Number of operations above which a preparation is long.
const LONG: u64 = 20_000;

/// Counts and times evaluations with the parameters of one channel at `pairs`.
pub(super) fn cost(expression: &Expression, values: &[LobeValues], pairs: &[Pair]) -> Cost {
    assert!(!pairs.is_empty(), "a cost is measured at one pair of directions or more");
    let (operations, once) = counted(expression, values, pairs);
    let evaluations = if once.weighted() > LONG { MORE_PAIRS } else { PAIRS };
    let pairs: Vec<Pair> = pairs.iter().copied().cycle().take(evaluations).collect();
    Cost {
        operations,
        weighted: operations.weighted(),
        prepared_once: once.weighted(),
        time_ns: Nanoseconds {
            scalar_f64: scalar::<f64>(expression, values, &pairs),
            scalar_f32: scalar::<f32>(expression, values, &pairs),
            blocks_f64: blocks(expression, values, pairs),
        },
    }
}

/// Number of blocks in which basis functions are timed: small enough for the fastest caches.
const BASIS_BLOCKS: usize = 8;
/// Number of passes over those blocks: large enough that one of them runs undisturbed. The fastest counts.
const BASIS_PASSES: usize = 20;

/// Times the basis functions of a model's default variant at the initial parameters.
#[must_use]
pub fn basis_cost(entry: &ModelEntry) -> BasisCost {
    let model = match entry.build(&[]) {
        Ok((model, _)) => model,
        Err(_) => return BasisCost { value: f64::NAN, with_derivatives: f64::NAN },
    };
    let shapes = model.parameters().into_iter().filter(|spec| spec.role == Role::Shape);
    let shapes: Vec<f64> = shapes.map(|spec| spec.in_formula_units(spec.initial)).collect();
    let pairs = BASIS_BLOCKS * BLOCK;
    let directions = Directions::Scattered(scattered_directions(pairs, 80.0, 1));
    let blocks: Vec<Block> = directions
        .blocks()
        .map(|range| {
            let mut block = Block::new();
            directions.fill(range, &mut block);
            block
        })
        .collect();
    let mut basis = BasisBlock::default();
    let mut time = |derivatives: Derivatives<'_>| {
        let mut pass = || {
            for block in &blocks {
                basis.forget();
                model.evaluate(black_box(block), &shapes, derivatives, &mut basis);
                black_box(&mut basis);
            }
        };
        let passes = (0..BASIS_PASSES).map(|_| series(&mut pass, 1));
        passes.fold(f64::INFINITY, f64::min) * 1e9 / count(pairs)
    };
    BasisCost { value: time(Derivatives::None), with_derivatives: time(Derivatives::All) }
}

/// Counts the operations of one evaluation, and those done once for the parameters.
pub(crate) fn counted(
    expression: &Expression,
    values: &[LobeValues],
    pairs: &[Pair],
) -> (Operations, Operations) {
    let values = converted::<Counted>(values);
    let of = |number: usize| {
        let pairs: Vec<Pair> = pairs.iter().copied().cycle().take(number).collect();
        let geometries = geometries::<Counted>(&pairs);
        counting(|| expression.values_in(&geometries, &values)).1
    };
    let (once, twice) = (of(1), of(2));
    let each = twice.beyond(&once);
    (each, once.beyond(&each))
}

/// The values of a model computed in single precision, with parameters and directions rounded to it.
#[must_use]
pub fn in_single_precision(expression: &Expression, values: &[LobeValues], pairs: &[Pair]) -> Vec<f64> {
    let found = expression.values_in(&geometries::<f32>(pairs), &converted::<f32>(values));
    found.into_iter().map(f64::from).collect()
}

fn geometries<R: Real>(pairs: &[Pair]) -> Vec<Geometry<R>> {
    let of = |pair: &Pair| [pair.wi, pair.wo].map(|w| w.to_array().map(R::literal));
    pairs.iter().map(of).map(|[wi, wo]| Geometry::new(wi, wo)).collect()
}

fn converted<R: Real>(values: &[LobeValues]) -> Values<R> {
    let each = |values: &[f64]| values.iter().map(|value| R::literal(*value)).collect();
    values
        .iter()
        .map(|of| LobeValues { shapes: each(&of.shapes), amplitudes: each(&of.amplitudes) })
        .collect()
}

fn scalar<R: Real>(expression: &Expression, values: &[LobeValues], pairs: &[Pair]) -> Spread {
    let (geometries, values) = (geometries::<R>(pairs), converted::<R>(values));
    let one = &geometries[..1];
    per_evaluation(
        geometries.len(),
        || drop(black_box(expression.values_in(black_box(&geometries), &values))),
        || drop(black_box(expression.values_in(black_box(one), &values))),
    )
}

fn blocks(expression: &Expression, values: &[LobeValues], pairs: Vec<Pair>) -> Spread {
    let parameters = [values.to_vec()];
    let few = Directions::Scattered(pairs.iter().copied().take(1).collect());
    let evaluations = pairs.len();
    let all = Directions::Scattered(pairs);
    per_evaluation(
        evaluations,
        || drop(black_box(expression.values(black_box(&all), &parameters))),
        || drop(black_box(expression.values(black_box(&few), &parameters))),
    )
}

/// Nanoseconds per evaluation. `all` makes `evaluations` of them and `one` makes one, both with the same preparation,
/// which cancels in the difference.
fn per_evaluation(evaluations: usize, mut all: impl FnMut(), mut one: impl FnMut()) -> Spread {
    let (repeats, repeats_of_one) = (enough(&mut all), enough(&mut one));
    let timed: Vec<(f64, f64)> =
        (0..REPEATS).map(|_| (series(&mut all, repeats), series(&mut one, repeats_of_one))).collect();
    // Other programs that take their turn only make a series longer: the shortest says what the preparation takes.
    let preparation = timed.iter().map(|(_, one)| *one).fold(f64::INFINITY, f64::min);
    let others = count(evaluations.saturating_sub(1).max(1));
    let mut found: Vec<f64> =
        timed.iter().map(|(all, _)| ((all - preparation) / others * 1e9).max(0.0)).collect();
    found.sort_by(f64::total_cmp);
    let at = |share: usize| found[share * (REPEATS - 1) / 4];
    Spread { median: at(2), low: at(1), high: at(3) }
}

/// Number of calls that together take [`SERIES`] or longer. A first call warms the caches.
fn enough(work: &mut impl FnMut()) -> u32 {
    work();
    let mut repeats = 1;
    while series(work, repeats) * f64::from(repeats) < SERIES.as_secs_f64() && repeats < 1 << 20 {
        repeats *= 2;
    }
    repeats
}

/// Mean time of a call over `repeats` calls, seconds.
fn series(work: &mut impl FnMut(), repeats: u32) -> f64 {
    let started = Instant::now();
    for _ in 0..repeats {
        work();
    }
    started.elapsed().as_secs_f64() / f64::from(repeats)
}
