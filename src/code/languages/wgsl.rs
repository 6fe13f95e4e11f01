//! WGSL, the language of WebGPU.

use super::shader::{self, Dialect, LACKS, component, constructed, native, number, write};
use crate::code::{Language, Level, Spelling};
use crate::math::recorded::Function;

pub(crate) const LANGUAGE: Language = Language {
    name: "wgsl",
    summary: "WGSL (WebGPU): brdf(wi, wo, parameters), in single precision",
    extension: "wgsl",
    spelling: SPELLING,
    write: |program| write(program, &DIALECT),
};

const SPELLING: Spelling = Spelling {
    is_single: true,
    differentiates: false,
    lacks: LACKS,
    number,
    component,
    function,
    native,
    choice: |[a, b, then, otherwise]| (format!("select({otherwise}, {then}, {a} < {b})"), Level::Whole),
    cell: |place, last| format!("floor(clamp({place}, 0.0, {last}.0))"),
    entry: |table, cell, below, column, columns| {
        format!("table_{table}[{columns} * i32({cell}) + {}]", below * columns + column, table = table + 1)
    },
    held: str::to_owned,
};

fn function(function: Function) -> &'static str {
    if function == Function::Atan2 { "atan2" } else { shader::function(function) }
}

const DIALECT: Dialect<'static> = Dialect {
    spelling: &SPELLING,
    float: "f32",
    vector: |channels| {
        if channels <= 4 { format!("vec{channels}<f32>") } else { format!("array<f32, {channels}>") }
    },
    statement: |name, value| format!("let {name}: f32 = {value};"),
    // A constant array can be indexed by constants only, in some implementations.
    table: |index, entries, count| {
        format!("var<private> table_{index}: array<f32, {count}> = array<f32, {count}>(\n{entries});\n")
    },
    helper: |name| format!("fn {name}(x: f32) -> f32"),
    head: |result, has_parameters| {
        let parameters = if has_parameters { ", parameters: BrdfParameters" } else { "" };
        format!("fn brdf(wi: vec3<f32>, wo: vec3<f32>{parameters}) -> {result}")
    },
    structure: |given| {
        let fields: String =
            given.iter().map(|(word, _, about)| format!("    {word}: f32,  // {about}\n")).collect();
        let values: Vec<String> = given.iter().map(|(_, value, _)| value.clone()).collect();
        format!(
            "struct BrdfParameters {{\n{fields}}}\n\nconst brdf_defaults = BrdfParameters({});\n",
            values.join(", ")
        )
    },
    result: constructed,
};
