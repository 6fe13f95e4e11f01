//! Slang.

use super::shader::{self, Dialect, constructed, write};
use crate::code::Language;

pub(crate) const LANGUAGE: Language = Language {
    name: "slang",
    summary: "Slang: brdf(wi, wo, parameters), in single precision",
    extension: "slang",
    spelling: shader::SPELLING,
    write: |program| write(program, &DIALECT),
};

const DIALECT: Dialect = Dialect {
    spelling: shader::SPELLING,
    float: "float",
    several: |count| if count <= 4 { format!("float{count}") } else { format!("float[{count}]") },
    declared: |kind, name| format!("{kind} {name}"),
    constant: "const ",
    function: |result, call| format!("{result} {call}"),
    ends: [";", "};"],
    defaults: |values| format!("static const BrdfParameters brdf_defaults = {{ {values} }};"),
    table: |index, entries, count| format!("static const float table_{index}[{count}] = {{\n{entries}}};\n"),
    result: |kind, values| match kind.strip_prefix("float[") {
        Some(_) => format!("{{\n        {}\n    }}", values.join(",\n        ")),
        None => constructed(kind, values),
    },
};
