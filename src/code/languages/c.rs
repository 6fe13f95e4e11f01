//! C11: one function, and arrays with the names and default values of its parameters.

use super::text::{all_quoted, rows, statements};
use crate::code::{Language, Program, Spelling, double, element, ternary};
use crate::math::recorded::Function;
use std::fmt::Write as _;

pub(crate) const LANGUAGE: Language = Language {
    name: "c",
    summary: "C11: void brdf(wi, wo, parameters, out), in double precision",
    extension: "c",
    spelling: SPELLING,
    write,
};

const SPELLING: Spelling = Spelling {
    is_single: false,
    differentiates: false,
    lacks: &[],
    number: |value| double(value, "INFINITY", "NAN"),
    component: element,
    function,
    native: function,
    choice: ternary,
    cell: |place, last| format!("({place} > 0.0 ? floor(fmin({place}, {last}.0)) : 0.0)"),
    entry: |table, cell, below, column, _| format!("table_{}[(int)({cell}) + {below}][{column}]", table + 1),
    held: str::to_owned,
};

fn function(function: Function) -> &'static str {
    match function {
        Function::Exp => "exp",
        Function::Ln => "log",
        Function::Ln1p => "log1p",
        Function::Sqrt => "sqrt",
        Function::Sin => "sin",
        Function::Erfc => "erfc",
        Function::Atan2 => "atan2",
    }
}

fn write(program: &Program) -> String {
    let comment: String = program
        .about
        .iter()
        .map(|line| format!(" * {}", line.replace("*/", "* /")).trim_end().to_owned() + "\n")
        .collect();
    let (channels, count) = (program.channels.len(), program.arguments.len());
    let names = all_quoted(program.arguments.iter().map(|argument| &argument.word));
    let defaults: Vec<String> = program.arguments.iter().map(|a| (SPELLING.number)(a.default)).collect();
    // An array of no elements is not C.
    let or_nothing = |list: String| if list.is_empty() { "0".to_owned() } else { list };
    let mut text = format!("/*\n{comment} */\n#include <math.h>\n\n");
    let _ = write!(
        text,
        "const int brdf_channel_count = {channels};\n\
         const char *const brdf_channel_names[] = {{{}}};\n\n\
         const int brdf_parameter_count = {count};\n\
         const char *const brdf_parameter_names[] = {{{}}};\n\
         const double brdf_parameter_defaults[] = {{{}}};\n",
        all_quoted(program.channels.iter()),
        or_nothing(names),
        or_nothing(defaults.join(", ")),
    );
    for (index, table) in &program.tables {
        let columns = table.first().map_or(1, Vec::len);
        let rows = rows(table, &SPELLING, "{", "}");
        let _ = write!(
            text,
            "\nstatic const double table_{}[{}][{columns}] = {{\n{rows}}};\n",
            index + 1,
            table.len()
        );
    }
    let given = if count == 0 {
        "no parameters: NULL will do".to_owned()
    } else {
        format!("{count} parameters, in the order of brdf_parameter_names")
    };
    let _ = write!(
        text,
        "\n/* f in 1/sr, one number per channel. wi, wo: unit vectors to the light and to the viewer, normal (0, 0, 1);\n   {given}. */\n\
         void brdf(const double wi[3], const double wo[3], const double *parameters, double *out) {{\n"
    );
    for (index, argument) in program.arguments.iter().enumerate() {
        let _ = writeln!(text, "    const double {} = parameters[{index}];", argument.word);
    }
    if count == 0 {
        text.push_str("    (void)parameters;\n");
    }
    text += &statements(&program.body, "    ", |name, value| format!("const double {name} = {value};"));
    for (channel, output) in program.body.outputs.iter().enumerate() {
        let _ = writeln!(text, "    out[{channel}] = {output};");
    }
    text.push_str("}\n");
    text
}
