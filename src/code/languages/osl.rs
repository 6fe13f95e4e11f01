//! Open Shading Language: a function, and a shader that calls it.

use super::shader;
use super::text::{comment, flat, statements};
use crate::code::{Language, Program, Spelling, element};
use crate::math::recorded::Function;
use std::fmt::Write as _;

pub(crate) const LANGUAGE: Language = Language {
    name: "osl",
    summary: "Open Shading Language: a function, and a shader whose output is f, in single precision",
    extension: "osl",
    spelling: SPELLING,
    write,
};

const SPELLING: Spelling =
    Spelling { lacks: &[Function::Ln1p], component: element, function: native, native, ..shader::SPELLING };

/// It has the functions of C, apart from log1p.
fn native(function: Function) -> &'static str {
    if function == Function::Erfc { "erfc" } else { shader::native(function) }
}

fn write(program: &Program) -> String {
    let channels = program.channels.len();
    let constant = |name: &str, value: &str| format!("float {name} = {value};");
    let mut text = comment(program, "//");
    for (lacking, body) in &program.helpers {
        let statements = statements(body, "    ", constant);
        let (name, output) = (native(*lacking), body.outputs.join(", "));
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
        .map(|a| {
            format!(
                "    float {} = {},  // {} ({})\n",
                a.word,
                (SPELLING.number)(a.default),
                a.summary,
                a.unit
            )
        })
        .collect();
    let words: String = program.arguments.iter().map(|argument| format!(", {}", argument.word)).collect();
    let _ = write!(
        text,
        "}}\n\nshader brdfit(\n    vector wi = vector(0, 0, 1),\n    vector wo = vector(0, 0, 1),\n{inputs}    output float f[{channels}] = {{ {zeros} }})\n\
         {{\n    brdf(wi, wo{words}, f);\n}}\n"
    );
    text
}
