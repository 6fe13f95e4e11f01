//! Python with NumPy.

use super::text::{all_quoted, comment, rows, statements};
use crate::code::{Language, Level, Program, Spelling, axis, double};
use crate::math::recorded::Function;
use std::fmt::Write as _;

pub(crate) const LANGUAGE: Language = Language {
    name: "python-numpy",
    summary: "Python with NumPy: f(wi, wo, **parameters)",
    extension: "py",
    spelling: SPELLING,
    write,
};

const SPELLING: Spelling = Spelling {
    is_single: false,
    differentiates: false,
    lacks: &[Function::Erfc],
    number: |value| double(value, "np.inf", "np.nan"),
    component: |vector, component| format!("{vector}_{}", axis(component)),
    function,
    native: function,
    choice: |[a, b, then, otherwise]| (format!("np.where({a} < {b}, {then}, {otherwise})"), Level::Whole),
    cell: |place, last| format!("np.where({place} > 0, np.minimum({place}, {last}), 0).astype(int)"),
    entry,
    held: str::to_owned,
};

/// The entry of a table in Python, whose cells are integers.
pub(super) fn entry(table: usize, cell: &str, below: usize, column: usize, _: usize) -> String {
    format!("TABLE_{}[{cell} + {below}, {column}]", table + 1)
}

fn function(function: Function) -> &'static str {
    match function {
        Function::Exp => "np.exp",
        Function::Ln => "np.log",
        Function::Ln1p => "np.log1p",
        Function::Sqrt => "np.sqrt",
        Function::Sin => "np.sin",
        Function::Erfc => "_erfc",
        Function::Atan2 => "np.arctan2",
    }
}

/// What stands before the function: the comment, imports, channels, and tables.
pub(super) fn head(program: &Program, imports: &str, array: &str, spelling: &Spelling) -> String {
    let mut text = comment(program, "#");
    let comma = if program.channels.len() == 1 { "," } else { "" };
    let _ = write!(text, "\n{imports}\n\nCHANNELS = ({}{comma})\n", all_quoted(program.channels.iter()));
    for (index, table) in &program.tables {
        let rows = rows(table, spelling, "[", "]");
        let _ = write!(text, "TABLE_{} = {array}([\n{rows}])\n", index + 1);
    }
    text
}

/// The arguments of a function, each after a comma.
pub(super) fn arguments(program: &Program, with_values: bool, spelling: &Spelling) -> String {
    let argument = |argument: &crate::code::Argument| match with_values {
        true => format!(", {}={}", argument.word, (spelling.number)(argument.default)),
        false => format!(", {}", argument.word),
    };
    let all: String = program.arguments.iter().map(argument).collect();
    if with_values && !all.is_empty() { format!(", *{all}") } else { all }
}

fn write(program: &Program) -> String {
    let assigned = |name: &str, value: &str| format!("{name} = {value}");
    let mut text = head(program, "import numpy as np", "np.array", &SPELLING);
    text.push_str("# Pairs of directions that are worked on at a time: few enough to stay in a processor's cache.\nBLOCK = 4096\n");
    for (lacking, body) in &program.helpers {
        let statements = statements(body, "    ", assigned);
        let output = body.outputs.join(", ");
        let _ = write!(text, "\n\ndef {}(x):\n{statements}    return {output}\n", function(*lacking));
    }
    let words = arguments(program, false, &SPELLING);
    let _ = write!(text, "\n\ndef _block(wi_x, wi_y, wi_z, wo_x, wo_y, wo_z{words}):\n");
    text += &statements(&program.body, "    ", assigned);
    let outputs: String = program.body.outputs.iter().map(|output| format!("        {output},\n")).collect();
    let _ = write!(text, "    return (\n{outputs}    )\n");
    let _ = write!(
        text,
        "\n\ndef f(wi, wo{}):\n\
         \x20   \"\"\"f in 1/sr, of shape (n, {channels}): a column per channel.\n\n\
         \x20   wi, wo: unit vectors to the light and to the viewer, of shape (n, 3); the normal is (0, 0, 1).\n\
         \x20   \"\"\"\n\
         \x20   wi, wo = np.asarray(wi, dtype=float), np.asarray(wo, dtype=float)\n\
         \x20   out = np.empty((len(wi), {channels}))\n\
         \x20   with np.errstate(all=\"ignore\"):\n\
         \x20       for start in range(0, len(wi), BLOCK):\n\
         \x20           rows = slice(start, start + BLOCK)\n\
         \x20           columns = _block(*wi[rows].T.copy(), *wo[rows].T.copy(){})\n\
         \x20           for channel, column in enumerate(columns):\n\
         \x20               out[rows, channel] = column\n\
         \x20   return out\n",
        arguments(program, true, &SPELLING),
        if words.is_empty() {
            String::new()
        } else {
            format!(", *np.array([{}], dtype=float)", words.trim_start_matches(", "))
        },
        channels = program.channels.len(),
    );
    text
}
