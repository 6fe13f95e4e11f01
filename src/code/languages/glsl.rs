//! GLSL ES 3.00, the language of WebGL 2; it compiles as desktop GLSL 3.30 as well.

use super::shader::{Dialect, LACKS, component, constructed, function, native, number, write};
use crate::code::{Language, Spelling, ternary};

pub(crate) const LANGUAGE: Language = Language {
    name: "glsl",
    summary: "GLSL ES 3.00 (WebGL 2): brdf(wi, wo, parameters), in single precision",
    extension: "glsl",
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
    choice: ternary,
    cell: |place, last| format!("({place} > 0.0 ? floor(min({place}, {last}.0)) : 0.0)"),
    entry: |table, cell, below, column, columns| {
        format!("table_{table}[{columns} * int({cell}) + {}]", below * columns + column, table = table + 1)
    },
    held: str::to_owned,
};

const DIALECT: Dialect<'static> = Dialect {
    spelling: &SPELLING,
    float: "float",
    vector: |channels| if channels <= 4 { format!("vec{channels}") } else { format!("float[{channels}]") },
    statement: |name, value| format!("float {name} = {value};"),
    table: |index, entries, count| {
        format!("const float table_{index}[{count}] = float[{count}](\n{entries});\n")
    },
    helper: |name| format!("float {name}(float x)"),
    head: |result, has_parameters| {
        let parameters = if has_parameters { ", BrdfParameters parameters" } else { "" };
        format!("{result} brdf(vec3 wi, vec3 wo{parameters})")
    },
    structure: |given| {
        let fields: String =
            given.iter().map(|(word, _, about)| format!("    float {word};  // {about}\n")).collect();
        let values: Vec<String> = given.iter().map(|(_, value, _)| value.clone()).collect();
        format!(
            "struct BrdfParameters {{\n{fields}}};\n\nconst BrdfParameters brdf_defaults = BrdfParameters({});\n",
            values.join(", ")
        )
    },
    result: constructed,
};
