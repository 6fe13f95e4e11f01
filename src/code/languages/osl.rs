//! Open Shading Language: a function, and a shader that calls it.

use super::shader::{self, number};
use super::text::{comment, flat, statements};
use crate::code::{Language, Program, Spelling, element, ternary};
use crate::math::recorded::Function;
use std::fmt::Write as _;

pub(crate) const LANGUAGE: Language = Language {
    name: "osl",
    summary: "Open Shading Language: a function, and a shader whose output is f, in single precision",
    extension: "osl",
    spelling: SPELLING,
    write,
};

const SPELLING: Spelling = Spelling {
    is_single: true,
    differentiates: false,
    lacks: &[Function::Ln1p],
    number,
    component: element,
    function,
    native: function,
    choice: ternary,
    cell: |place, last| format!("({place} > 0.0 ? floor(min({place}, {last}.0)) : 0.0)"),
    entry: |table, cell, below, column, columns| {
        format!("table_{table}[{columns} * int({cell}) + {}]", below * columns + column, table = table + 1)
    },
    held: str::to_owned,
};

fn function(function: Function) -> &'static str {
    match function {
        Function::Atan2 => "atan2",
        Function::Erfc => "erfc",
        Function::Ln => "log",
        other => shader::function(other),
    }
}

fn write(program: &Program) -> String {
    let channels = program.channels.len();
    let constant = |name: &str, value: &str| format!("float {name} = {value};");
    let mut text = comment(program, "//");
    for (lacking, body) in &program.helpers {
        let statements = statements(body, "    ", constant);
        let (name, output) = (function(*lacking), body.outputs.join(", "));
        let _ = write!(text, "\nfloat {name}(float x)\n{{\n{statements}    return {output};\n}}\n");
    }
    let parameters: String = program.arguments.iter().map(|a| format!(", float {}", a.word)).collect();
    let _ = write!(
        text,
        "\n// f in 1/sr of the channels {}. wi, wo: unit vectors to the light and to the viewer; the normal is (0, 0, 1).\n\
         void brdf(vector wi, vector wo{parameters}, output float f[{channels}])\n{{\n",
        program.channels.join(", ")
    );
    // Arrays cannot stand outside functions.
    for (index, table) in &program.tables {
        let count: usize = table.iter().map(Vec::len).sum();
        let _ =
            write!(text, "    float table_{}[{count}] = {{\n{}    }};\n", index + 1, flat(table, &SPELLING));
    }
    text += &statements(&program.body, "    ", constant);
    for (channel, output) in program.body.outputs.iter().enumerate() {
        let _ = writeln!(text, "    f[{channel}] = {output};");
    }
    let zeros = vec!["0.0"; channels].join(", ");
    let inputs: String = program
        .arguments
        .iter()
        .map(|a| format!("    float {} = {},  // {} ({})\n", a.word, number(a.default), a.summary, a.unit))
        .collect();
    let words: String = program.arguments.iter().map(|argument| format!(", {}", argument.word)).collect();
    let _ = write!(
        text,
        "}}\n\nshader brdfit(\n    vector wi = vector(0, 0, 1),\n    vector wo = vector(0, 0, 1),\n{inputs}    output float f[{channels}] = {{ {zeros} }})\n\
         {{\n    brdf(wi, wo{words}, f);\n}}\n"
    );
    text
}
