//! What an evaluation of a model costs, measured when it is asked for.

use brdfit::geometry::{BLOCK, Block, Directions};
use brdfit::math::count;
use brdfit::model::{BasisBlock, Derivatives, ModelEntry, Role};
use brdfit::synthetic::scattered_directions;
use serde::Serialize;
use std::hint::black_box;
use std::time::Instant;

/// Nanoseconds per pair of directions on one thread.
#[derive(Clone, Copy, Serialize)]
pub struct Cost {
    /// The values of the basis functions.
    pub value: f64,
    /// With their derivatives with respect to every shape.
    pub with_derivatives: f64,
}

/// Few enough blocks for the nearest caches, and rounds enough for one of them to be undisturbed.
const BLOCKS: usize = 8;
const ROUNDS: usize = 20;

/// The cost of a model's default variant where a fit begins.
pub fn cost(entry: &ModelEntry) -> Cost {
    let model = match entry.build(&[]) {
        Ok((model, _)) => model,
        Err(_) => return Cost { value: f64::NAN, with_derivatives: f64::NAN },
    };
    let shapes = model.parameters().into_iter().filter(|spec| spec.role == Role::Shape);
    let shapes: Vec<f64> = shapes.map(|spec| spec.initial * spec.unit.factor(None)).collect();
    let directions = Directions::Scattered(scattered_directions(BLOCKS * BLOCK, 80.0, 1));
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
        let mut round = || {
            let start = Instant::now();
            for block in &blocks {
                basis.forget();
                model.evaluate(black_box(block), &shapes, derivatives, &mut basis);
                black_box(&mut basis);
            }
            start.elapsed().as_secs_f64() * 1e9 / count(BLOCKS * BLOCK)
        };
        (0..ROUNDS).map(|_| round()).fold(f64::INFINITY, f64::min)
    };
    Cost { value: time(Derivatives::None), with_derivatives: time(Derivatives::All) }
}
