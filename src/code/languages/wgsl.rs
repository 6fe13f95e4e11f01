//! WGSL, the language of WebGPU.

use super::shader::{self, Dialect, constructed, write};
use crate::code::{Language, Level, Spelling};

pub(crate) const LANGUAGE: Language = Language {
    name: "wgsl",
    summary: "WGSL (WebGPU): brdf(wi, wo, parameters), in single precision",
    extension: "wgsl",
    spelling: SPELLING,
    write: |program| write(program, &DIALECT),
};

const SPELLING: Spelling = Spelling {
    choice: |[a, b, then, otherwise]| (format!("select({otherwise}, {then}, {a} < {b})"), Level::Whole),
    cell: |place, last| format!("floor(clamp({place}, 0.0, {last}.0))"),
    entry: |table, cell, below, column, columns| {
        shader::entry(table, &format!("i32({cell})"), below * columns + column, columns)
    },
    ..shader::SPELLING
};

const DIALECT: Dialect = Dialect {
    spelling: SPELLING,
    float: "f32",
    several: |count| if count <= 4 { format!("vec{count}<f32>") } else { format!("array<f32, {count}>") },
    declared: |kind, name| format!("{name}: {kind}"),
    constant: "let ",
    function: |result, call| format!("fn {call} -> {result}"),
    ends: [",", "}"],
    defaults: |values| format!("const brdf_defaults = BrdfParameters({values});"),
    // A constant array can be indexed by constants only, in some implementations.
    table: |index, entries, count| {
        format!("var<private> table_{index}: array<f32, {count}> = array<f32, {count}>(\n{entries});\n")
    },
    result: constructed,
};
