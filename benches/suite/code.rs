//! Code that brdfit writes, against brdfit itself and against code written by hand.
//!
//! C is compiled by `gcc -O2` into a program that times itself; brdfit evaluates the same pairs one by one, in doubles. With fixed
//! parameters both have prepared what depends on them; with free ones both prepare it again for every pair. `--baseline PYTHON`, with
//! NumPy, times scripts/baseline_numpy_ggx.py as well.

use super::timing::{as_f64, median};
use super::{Setup, inputs, markdown};
use brdfit::code::{Arguments, named};
use brdfit::geometry::Geometry;
use brdfit::model::{Expression, LobeValues};
use brdfit::parameters::ParameterTable;
use std::fmt::Write as _;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Models whose costs differ in kind.
const MODELS: [&str; 6] = [
    "lambert + cook-torrance(d=ggx, g=smith, f=schlick)",
    "lambert + cook-torrance(d=ggx, g=smith, f=conductor)",
    "lambert + cook-torrance(d=beckmann, g=smith, f=dielectric)",
    "lambert + cook-torrance(d=gtr, g=smith, f=schlick)",
    "oren-nayar",
    "openpbr",
];
/// Pairs of directions.
const PAIRS: usize = 4096;

pub fn table(setup: &Setup) -> String {
    if Command::new("gcc").arg("--version").output().is_err() {
        return "gcc was not found.\n".to_owned();
    }
    let mut rows = Vec::new();
    for model in MODELS {
        let expression = Expression::parse(model).unwrap();
        let values = ParameterTable::of_one_channel(&expression).unwrap().formula_values(0);
        for (how, arguments) in [("fixed", Arguments::Fixed), ("free", Arguments::Free)] {
            let c = named("bench", "c").unwrap();
            let Ok(function) = c.write_for_one_channel(&expression, arguments, &[]).unwrap() else {
                continue;
            };
            let compiled = compiled(setup.folder(), &function);
            // In turns, so that whatever else the machine does disturbs both.
            let (mut ours, mut theirs) = (Vec::new(), Vec::new());
            for _ in 0..setup.effort.runs {
                ours.push(own(setup, &expression, &values, arguments));
                theirs.push(printed(&mut Command::new(&compiled)));
            }
            let ratio = median(ours.iter().zip(&theirs).map(|(ours, theirs)| theirs / ours));
            let figures = [median(ours), median(theirs), ratio].map(|figure| format!("{figure:.2}"));
            rows.push([vec![format!("`{model}`"), how.to_owned()], figures.to_vec()].concat());
        }
    }
    let mut text = markdown(&["model", "parameters", "brdfit, ns", "C, ns", "ratio"], &rows);
    if let Some(python) = &setup.arguments.baseline {
        text.push('\n');
        text.push_str(&numpy(setup, python));
    }
    text
}

/// Nanoseconds that brdfit takes for a pair of directions.
fn own(setup: &Setup, expression: &Expression, values: &[LobeValues], arguments: Arguments) -> f64 {
    let pairs: Vec<Geometry<f64>> = inputs::directions(PAIRS).iter().collect();
    let geometry = |pair: &Geometry<f64>| Geometry::new(pair.wi, pair.wo);
    let whole = setup.effort.nanoseconds(|| match arguments {
        Arguments::Fixed => {
            let geometries: Vec<Geometry<f64>> = black_box(&pairs).iter().map(geometry).collect();
            expression.values_in(&geometries, values).iter().sum::<f64>()
        }
        Arguments::Free => {
            black_box(&pairs).iter().map(|pair| expression.value(&geometry(pair), values)).sum::<f64>()
        }
    });
    whole / as_f64(PAIRS)
}

/// A program that prints the nanoseconds that the function takes for a pair of directions.
fn compiled(folder: &Path, function: &str) -> PathBuf {
    let mut source =
        format!("#define _POSIX_C_SOURCE 199309L\n{function}\n#include <stdio.h>\n#include <time.h>\n");
    let _ = writeln!(source, "static const double pairs[{PAIRS}][6] = {{");
    for Geometry { wi, wo, .. } in inputs::directions(PAIRS).iter() {
        let numbers: Vec<String> = wi.iter().chain(&wo).map(|x| format!("{x:?}")).collect();
        let _ = writeln!(source, "{{{}}},", numbers.join(", "));
    }
    source += "};\n\
        int main(void) {\n\
            double best = 1e300;\n\
            volatile double sum = 0.0;\n\
            for (int batch = 0; batch < 41; batch++) {\n\
                struct timespec a, b;\n\
                double total = 0.0, out;\n\
                clock_gettime(CLOCK_MONOTONIC, &a);\n\
                for (int i = 0; i < (int)(sizeof pairs / sizeof *pairs); i++) {\n\
                    brdf(pairs[i], pairs[i] + 3, brdf_parameter_defaults, &out);\n\
                    total += out;\n\
                }\n\
                clock_gettime(CLOCK_MONOTONIC, &b);\n\
                sum = sum + total;\n\
                double ns = (1e9 * (double)(b.tv_sec - a.tv_sec) + (double)(b.tv_nsec - a.tv_nsec)) / (double)(sizeof pairs / sizeof *pairs);\n\
                if (ns < best) best = ns;\n\
            }\n\
            printf(\"%.6f\\n\", best);\n\
            return 0;\n\
        }\n";
    let (file, program) = (folder.join("code.c"), folder.join("code"));
    std::fs::write(&file, source).unwrap();
    let mut gcc = Command::new("gcc");
    let output = gcc.args(["-std=c11", "-O2", "-o"]).arg(&program).arg(&file).arg("-lm").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    program
}

/// The number that a program prints.
fn printed(command: &mut Command) -> f64 {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap().trim().parse().unwrap()
}

/// NumPy that brdfit writes against NumPy that a person writes.
fn numpy(setup: &Setup, python: &Path) -> String {
    let expression = Expression::parse("cook-torrance(d=ggx, g=smith, f=schlick)").unwrap();
    let language = named("bench", "python-numpy").unwrap();
    let file = setup.folder().join("generated.py");
    let mut rows = Vec::new();
    for (how, arguments) in [("fixed", Arguments::Fixed), ("free", Arguments::Free)] {
        let text = language.write_for_one_channel(&expression, arguments, &[]).unwrap().unwrap();
        std::fs::write(&file, text).unwrap();
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/baseline_numpy_ggx.py");
        let output = Command::new(python).arg(script).arg(&file).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let number = |key: &str| found[key].as_f64().unwrap();
        let figures =
            [number("by_hand_s"), number("generated_s"), number("ratio")].map(|x| format!("{x:.3}"));
        rows.push([vec![how.to_owned()], figures.to_vec()].concat());
    }
    markdown(&["NumPy, a million pairs", "by hand, s", "written by brdfit, s", "ratio"], &rows)
}
