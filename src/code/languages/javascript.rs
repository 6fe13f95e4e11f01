//! JavaScript: a module with one function.

use super::text::{all_quoted, comment, rows, statements};
use crate::code::{Language, Program, Spelling, double, element, ternary};
use crate::math::recorded::Function;
use std::fmt::Write as _;

pub(crate) const LANGUAGE: Language = Language {
    name: "javascript",
    summary: "JavaScript: a module that exports brdf(wi, wo, parameters)",
    extension: "mjs",
    spelling: SPELLING,
    write,
};

const SPELLING: Spelling = Spelling {
    is_single: false,
    differentiates: false,
    lacks: &[Function::Erfc],
    number: |value| double(value, "Infinity", "NaN"),
    component: element,
    function,
    native: function,
    choice: ternary,
    cell: |place, last| format!("({place} > 0 ? Math.floor(Math.min({place}, {last})) : 0)"),
    entry: |table, cell, below, column, _| format!("table{}[{cell} + {below}][{column}]", table + 1),
    held: str::to_owned,
};

fn function(function: Function) -> &'static str {
    match function {
        Function::Exp => "Math.exp",
        Function::Ln => "Math.log",
        Function::Ln1p => "Math.log1p",
        Function::Sqrt => "Math.sqrt",
        Function::Sin => "Math.sin",
        Function::Erfc => "erfc",
        Function::Atan2 => "Math.atan2",
    }
}

fn write(program: &Program) -> String {
    let mut text = comment(program, "//");
    let _ = write!(text, "\nexport const channels = [{}];\n", all_quoted(program.channels.iter()));
    text.push_str(
        "\n/** The parameters and their values unless others are given. */\nexport const defaults = {\n",
    );
    for argument in &program.arguments {
        let _ = writeln!(text, "  {}: {},", argument.word, (SPELLING.number)(argument.default));
    }
    text.push_str("};\n");
    for (index, table) in &program.tables {
        let _ = write!(text, "\nconst table{} = [\n{}];\n", index + 1, rows(table, &SPELLING, "[", "]"));
    }
    let constant = |name: &str, value: &str| format!("const {name} = {value};");
    for (lacking, body) in &program.helpers {
        let statements = statements(body, "  ", constant);
        let output = body.outputs.join(", ");
        let _ = write!(text, "\nfunction {}(x) {{\n{statements}  return {output};\n}}\n", function(*lacking));
    }
    text.push_str(
        "\n/**\n * f in 1/sr, one number per channel. wi, wo: unit vectors to the light and to the viewer as arrays [x, y, z], normal [0, 0, 1].\n */\n\
         export function brdf(wi, wo, parameters = defaults) {\n",
    );
    for argument in &program.arguments {
        let _ = writeln!(text, "  const {0} = parameters.{0} ?? defaults.{0};", argument.word);
    }
    text += &statements(&program.body, "  ", constant);
    let outputs: Vec<String> = program.body.outputs.iter().map(|output| format!("    {output},\n")).collect();
    let _ = write!(text, "  return [\n{}  ];\n}}\n", outputs.concat());
    text
}
