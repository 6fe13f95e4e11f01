//! Writes models as code in every language, with what brdfit itself computes for 2000 pairs of directions, for
//! `scripts/check_code.py` to compare. It uses parts of the library that may change without notice.
//!
//! ```sh
//! cargo run --release --example code_cases -- FOLDER [EVERY [FIRST]]
//! ```
//!
//! Of all variants that differ in a part, every EVERY-th is written, from number FIRST on.
#![allow(clippy::print_stdout, clippy::indexing_slicing)]

use brdfit::code::{Arguments, LANGUAGES};
use brdfit::geometry::{BLOCK, Block, Geometry, Pair, direction};
use brdfit::model::{
    BasisBlock, Choices, Derivatives, Expression, LobeValues, ModelEntry, REGISTRY, Role, Scale,
};
use brdfit::parameters::ParameterTable;
use brdfit::tradeoff::in_single_precision;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use serde_json::{Value, json};
use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::fs;
use std::path::Path;

/// Number of pairs of directions.
const PAIRS: usize = 2000;

/// Sums, beside single models.
const SUMS: [&str; 3] = [
    "lambert(kd=0.3) + cook-torrance(m=0.15, f0=0.06) + cook-torrance(d=beckmann, m=0.4, f0=0.1)",
    "oren-nayar(albedo=0.5, sigma=25) + retro(ks=0.2, m=0.3) + phong(ks=0.1, n=30)",
    "blender-principled + lambert(kd=0.1)",
];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(folder) = arguments.first() else { return Err("expected a folder to write to".into()) };
    let number = |index: usize, default: usize| arguments.get(index).map_or(Ok(default), |text| text.parse());
    let (every, first) = (number(1, 1)?, number(2, 0)?);
    let mut rng = Pcg64Mcg::seed_from_u64(25);
    let pairs: Vec<Pair> = (0..PAIRS).map(|kind| pair(&mut rng, kind)).collect();
    let folder = Path::new(folder);
    fs::create_dir_all(folder)?;
    let numbers: Vec<f64> = pairs.iter().flat_map(|p| [p.wi.to_array(), p.wo.to_array()].concat()).collect();
    write(&folder.join("pairs.bin"), &numbers)?;
    let mut cases = Vec::new();
    let expressions = all(&mut rng);
    let of = expressions.len();
    for (index, expression) in expressions.into_iter().enumerate().skip(first).step_by(every.max(1)) {
        cases.push(case(folder, index, &expression, &pairs)?);
    }
    fs::write(folder.join("cases.json"), serde_json::to_string_pretty(&cases)?)?;
    println!("{} of {of} models written", cases.len());
    Ok(())
}

/// A pair of directions over the hemisphere; a quarter of them within a degree of grazing, and a quarter mirror-like.
fn pair(rng: &mut Pcg64Mcg, kind: usize) -> Pair {
    let mut within = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let (grazing, degree, turn) = (FRAC_PI_2 - 1e-5, FRAC_PI_2 / 90.0, 4.0 * FRAC_PI_2);
    let (theta_i, phi_i) = (within(0.0, 89.0 * degree), within(0.0, turn));
    let (theta_o, phi_o) = match kind % 4 {
        0 => (within(89.0 * degree, grazing), within(0.0, turn)),
        1 => ((theta_i + within(-degree, degree)).abs(), phi_i + 0.5 * turn + within(-degree, degree)),
        _ => (within(0.0, 89.0 * degree), within(0.0, turn)),
    };
    Pair { wi: direction(theta_i, phi_i), wo: direction(theta_o, phi_o) }
}

/// Every model with every choice that changes a part: one that is not the default, or a distribution and its shadowing.
fn all(rng: &mut Pcg64Mcg) -> Vec<String> {
    let changed = |entry: &ModelEntry, choices: &Choices| -> Vec<&str> {
        entry.options.iter().filter(|o| choices.get(o.key) != o.default).map(|o| o.key).collect()
    };
    let mut expressions = Vec::new();
    for entry in REGISTRY {
        for (model, choices) in entry.variants() {
            let changed = changed(entry, &choices);
            if changed.len() > 1 && changed != ["d", "g"] {
                continue;
            }
            let mut given: Vec<String> =
                entry.options.iter().map(|o| format!("{}={}", o.key, choices.get(o.key))).collect();
            for spec in model.parameters() {
                let (low, high) = match spec.role {
                    Role::Shape => spec.typical,
                    Role::Amplitude => (spec.bounds.0.max(0.05), spec.bounds.1.min(2.0) * 0.95),
                };
                let u: f64 = rng.random();
                let value = match spec.scale {
                    Scale::Linear | Scale::Square => low + (high - low) * u,
                    Scale::Log => (low.ln() + (high.ln() - low.ln()) * u).exp(),
                };
                given.push(format!("{}={value}", spec.name));
            }
            expressions.push(format!("{}({})", entry.name, given.join(", ")));
        }
    }
    expressions.extend(SUMS.map(str::to_owned));
    expressions
}

/// Writes one model, and returns what is known of it.
fn case(folder: &Path, index: usize, text: &str, pairs: &[Pair]) -> Result<Value, Box<dyn Error>> {
    let expression: Expression = text.parse()?;
    let own = folder.join(format!("{index:04}"));
    fs::create_dir_all(&own)?;
    let mut refused = None;
    for (how, arguments) in [("fixed", Arguments::Fixed), ("free", Arguments::Free)] {
        for language in LANGUAGES {
            match language.write_for_one_channel(&expression, arguments, &[])? {
                Ok(text) => {
                    let name = format!("{}_{how}.{}", language.name.replace('-', "_"), language.extension);
                    fs::write(own.join(name), text)?;
                }
                Err(reason) => refused = Some(format!("{how}: {reason}")),
            }
        }
    }
    let table = ParameterTable::of_one_channel(&expression)?;
    let values = table.formula_values(0);
    let geometry = |pair: &Pair| Geometry::new(pair.wi.to_array(), pair.wo.to_array());
    let doubles: Vec<f64> = pairs.iter().map(|pair| expression.value(&geometry(pair), &values)).collect();
    write(&own.join("double.bin"), &doubles)?;
    write(&own.join("single.bin"), &in_single_precision(&expression, &values, pairs))?;
    write(&own.join("derivatives.bin"), &derivatives(&expression, &table, &values, pairs))?;
    let names: Vec<String> = (0..table.rows().len()).map(|row| table.name(row)).collect();
    let defaults: Vec<f64> = table.rows().iter().map(|row| row.value).collect();
    Ok(json!({ "index": index, "model": text, "names": names, "values": defaults, "refused": refused }))
}

/// df/dp for every pair and parameter, per unit of the report.
fn derivatives(
    expression: &Expression,
    table: &ParameterTable,
    values: &[LobeValues],
    pairs: &[Pair],
) -> Vec<f64> {
    let mut all = Vec::new();
    for part in pairs.chunks(BLOCK) {
        let mut block = Block::new();
        block.fill_pairs(part);
        // By row of the table: the derivatives at every pair of this part.
        let mut by_row = vec![vec![0.0; part.len()]; table.rows().len()];
        for (index, (lobe, LobeValues { shapes, amplitudes })) in
            expression.lobes().iter().zip(values).enumerate()
        {
            let mut basis = BasisBlock::default();
            lobe.model.evaluate(&block, shapes, Derivatives::All, &mut basis);
            let coefficients = lobe.coefficients(amplitudes);
            let (mut shape, mut amplitude) = (0, 0);
            let rows = table.rows().iter().zip(&mut by_row).filter(|(row, _)| row.lobe == index);
            for (row, sums) in rows {
                let (functions, weights) = match row.spec.role {
                    Role::Shape => (basis.partials(shape), &coefficients.values),
                    Role::Amplitude => (basis.values(), &coefficients.partials[amplitude]),
                };
                match row.spec.role {
                    Role::Shape => shape += 1,
                    Role::Amplitude => amplitude += 1,
                }
                for (place, sum) in sums.iter_mut().enumerate() {
                    let total: f64 = functions.iter().zip(weights).map(|(f, weight)| f[place] * weight).sum();
                    *sum = total * row.spec.unit.factor(row.channel);
                }
            }
        }
        all.extend(
            (0..part.len()).flat_map(|place| by_row.iter().map(move |row| row[place]).collect::<Vec<_>>()),
        );
    }
    all
}

/// Writes doubles, the least significant byte first.
fn write(path: &Path, numbers: &[f64]) -> Result<(), Box<dyn Error>> {
    Ok(fs::write(path, numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>())?)
}
