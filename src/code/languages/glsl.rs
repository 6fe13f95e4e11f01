//! GLSL ES 3.00, the language of WebGL 2; it compiles as desktop GLSL 3.30 as well.

use super::shader::{self, Dialect, constructed, write};
use crate::code::{Language, Spelling};
use crate::math::recorded::Function;

pub(crate) const LANGUAGE: Language = Language {
    name: "glsl",
    summary: "GLSL ES 3.00 (WebGL 2): brdf(wi, wo, parameters), in single precision",
    extension: "glsl",
    spelling: SPELLING,
    write: |program| write(program, &DIALECT),
};

const SPELLING: Spelling = Spelling {
    function: |named| if named == Function::Atan2 { "atan" } else { (shader::SPELLING.function)(named) },
    native: |named| if named == Function::Atan2 { "atan" } else { shader::native(named) },
    ..shader::SPELLING
};

const DIALECT: Dialect = Dialect {
    spelling: SPELLING,
    float: "float",
    several: |count| if count <= 4 { format!("vec{count}") } else { format!("float[{count}]") },
    declared: |kind, name| format!("{kind} {name}"),
    constant: "",
    function: |result, call| format!("{result} {call}"),
    ends: [";", "};"],
    defaults: |values| format!("const BrdfParameters brdf_defaults = BrdfParameters({values});"),
    table: |index, entries, count| {
        format!("const float table_{index}[{count}] = float[{count}](\n{entries});\n")
    },
    result: constructed,
};
