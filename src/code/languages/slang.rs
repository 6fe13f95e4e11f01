//! Slang.

use super::shader::{self, Dialect, LACKS, component, constructed, native, number, write};
use crate::code::{Language, Spelling, ternary};
use crate::math::recorded::Function;

pub(crate) const LANGUAGE: Language = Language {
    name: "slang",
    summary: "Slang: brdf(wi, wo, parameters), in single precision",
    extension: "slang",
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

fn function(function: Function) -> &'static str {
    if function == Function::Atan2 { "atan2" } else { shader::function(function) }
}

const DIALECT: Dialect<'static> = Dialect {
    spelling: &SPELLING,
    float: "float",
    vector: |channels| if channels <= 4 { format!("float{channels}") } else { format!("float[{channels}]") },
    statement: |name, value| format!("const float {name} = {value};"),
    table: |index, entries, count| format!("static const float table_{index}[{count}] = {{\n{entries}}};\n"),
    helper: |name| format!("float {name}(float x)"),
    head: |result, has_parameters| {
        let parameters = if has_parameters { ", BrdfParameters parameters" } else { "" };
        format!("{result} brdf(float3 wi, float3 wo{parameters})")
    },
    structure: |given| {
        let fields: String =
            given.iter().map(|(word, _, about)| format!("    float {word};  // {about}\n")).collect();
        let values: Vec<String> = given.iter().map(|(_, value, _)| value.clone()).collect();
        format!(
            "struct BrdfParameters {{\n{fields}}};\n\nstatic const BrdfParameters brdf_defaults = {{ {} }};\n",
            values.join(", ")
        )
    },
    result: |kind, values| match kind.strip_prefix("float[") {
        Some(_) => format!("{{\n        {}\n    }}", values.join(",\n        ")),
        None => constructed(kind, values),
    },
};
