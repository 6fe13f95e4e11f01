//! What one evaluation of each model costs, on one thread.

use super::timing::as_f64;
use super::{Setup, inputs, markdown};
use brdfit::geometry::{BLOCK, Block, Directions, Geometry};
use brdfit::math::{Dual, Real, Scalar};
use brdfit::model::{AnyModel, BasisBlock, Derivatives, ModelEntry, REGISTRY, Role};
use std::hint::black_box;

/// Blocks that together fit into the second-level cache.
pub const BLOCKS: usize = 32;

/// Every model: the default, and each choice that differs from it in one option.
pub fn table(setup: &Setup) -> String {
    let directions = inputs::directions(BLOCKS * BLOCK);
    let rows: Vec<Vec<String>> = REGISTRY
        .iter()
        .flat_map(|entry| {
            variants(entry).into_iter().map(|(model, text)| row(setup, &directions, &model, text))
        })
        .collect();
    markdown(
        &[
            "model",
            "shapes",
            "values, block",
            "values and derivatives, block",
            "value, one by one, f64",
            "f32",
            "value and derivatives, one by one, f64",
            "f32",
        ],
        &rows,
    )
}

/// A model, and how an expression names it.
pub fn variants(entry: &ModelEntry) -> Vec<(AnyModel, String)> {
    let mut variants = vec![(entry.build(&[]).unwrap().0, entry.name.to_owned())];
    for option in entry.options {
        for value in (option.values)().into_iter().filter(|value| *value != option.default) {
            let choice = (option.key.to_owned(), value.to_owned());
            let text = format!("{}({}={value})", entry.name, option.key);
            variants.push((entry.build(&[choice]).unwrap().0, text));
        }
    }
    variants
}

fn row(setup: &Setup, directions: &Directions, model: &AnyModel, text: String) -> Vec<String> {
    let (shapes, amplitudes) = values(model);
    let per_sample = |nanoseconds: f64| format!("{:.1}", nanoseconds / as_f64(BLOCKS * BLOCK));

    let blocks = blocks(directions);
    let mut basis = BasisBlock::default();
    let mut in_blocks = |derivatives: Derivatives<'_>| {
        per_sample(setup.effort.nanoseconds(|| evaluate(model, &blocks, &shapes, derivatives, &mut basis)))
    };
    let (value, derivatives) = (in_blocks(Derivatives::None), in_blocks(Derivatives::All));

    let geometry: Vec<Geometry<f64>> = directions.iter().collect();
    let double = per_sample(setup.effort.nanoseconds(|| {
        for geometry in &geometry {
            black_box(model.value_in(black_box(geometry), &shapes, &amplitudes));
        }
    }));
    let seeded = seeds(&shapes);
    let constants: Vec<Dual<f64, SHAPES>> = amplitudes.iter().copied().map(Dual::from_real).collect();
    let double_slopes = per_sample(setup.effort.nanoseconds(|| {
        for geometry in &geometry {
            black_box(model.value_in(black_box(geometry), &seeded, &constants));
        }
    }));
    let geometry: Vec<Geometry<f32>> =
        geometry.iter().map(|g| Geometry::new(g.wi.map(narrow), g.wo.map(narrow))).collect();
    let shapes_f32: Vec<f32> = shapes.iter().copied().map(narrow).collect();
    let amplitudes: Vec<f32> = amplitudes.iter().copied().map(narrow).collect();
    let single = per_sample(setup.effort.nanoseconds(|| {
        for geometry in &geometry {
            black_box(model.value_in::<f32>(black_box(geometry), &shapes_f32, &amplitudes));
        }
    }));
    let seeded = seeds(&shapes_f32);
    let constants: Vec<Dual<f32, SHAPES>> = amplitudes.iter().copied().map(Dual::from_real).collect();
    let single_slopes = per_sample(setup.effort.nanoseconds(|| {
        for geometry in &geometry {
            black_box(model.value_in(black_box(geometry), &seeded, &constants));
        }
    }));
    vec![text, shapes.len().to_string(), value, derivatives, double, single, double_slopes, single_slopes]
}

/// Room for the derivatives with respect to the shapes of any model.
const SHAPES: usize = 8;

/// The shapes, each the variable of a derivative.
fn seeds<R: Real>(shapes: &[R]) -> Vec<Dual<R, SHAPES>> {
    assert!(shapes.len() <= SHAPES);
    shapes.iter().enumerate().map(|(index, shape)| Dual::variable(*shape, index)).collect()
}

/// Shapes and amplitudes where a fit begins, in formula units.
pub fn values(model: &AnyModel) -> (Vec<f64>, Vec<f64>) {
    let of_role = |role| {
        let parameters = model.parameters().into_iter().filter(move |spec| spec.role == role);
        parameters.map(|spec| spec.in_formula_units(spec.initial)).collect()
    };
    (of_role(Role::Shape), of_role(Role::Amplitude))
}

/// Evaluates a model on blocks, of which each is new to it.
pub fn evaluate(
    model: &AnyModel,
    blocks: &[Block],
    shapes: &[f64],
    derivatives: Derivatives<'_>,
    basis: &mut BasisBlock,
) {
    for block in blocks {
        basis.forget();
        model.evaluate(black_box(block), shapes, derivatives, basis);
        black_box(&mut *basis);
    }
}

/// Directions in blocks.
pub fn blocks(directions: &Directions) -> Vec<Block> {
    let filled = |range| {
        let mut block = Block::new();
        directions.fill(range, &mut block);
        block
    };
    directions.blocks().map(filled).collect()
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to the narrower type is meant")]
fn narrow(value: f64) -> f32 {
    value as f32
}
