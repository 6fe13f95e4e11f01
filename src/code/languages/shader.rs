//! What shading languages have in common: numbers of single precision, and parameters in a structure.

use super::text::{comment, flat, statements};
use crate::code::spelling::single;
use crate::code::{Program, Spelling};
use crate::math::recorded::Function;
use std::fmt::Write as _;

/// A number, by the shortest text that gives the same float. These languages have no name for infinity: there the largest number stands.
pub(super) fn number(value: f64) -> String {
    single(value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)), "", "0.0")
}

/// Functions that shading languages lack, or promise too little accuracy of.
pub(super) const LACKS: &[Function] = &[Function::Erfc, Function::Ln1p, Function::Ln];

pub(super) fn function(function: Function) -> &'static str {
    match function {
        Function::Exp => "exp",
        Function::Ln => "brdf_log",
        Function::Ln1p => "brdf_log1p",
        Function::Sqrt => "sqrt",
        Function::Sin => "sin",
        Function::Erfc => "brdf_erfc",
        Function::Atan2 => "atan",
    }
}

/// The names of the languages' own functions.
pub(super) fn native(named: Function) -> &'static str {
    if named == Function::Ln { "log" } else { function(named) }
}

/// A component of a vector.
pub(super) fn component(vector: &str, component: usize) -> String {
    format!("{vector}.{}", ["x", "y", "z"].get(component).unwrap_or(&"x"))
}

/// How a shading language declares things.
pub(super) struct Dialect<'a> {
    pub spelling: &'a Spelling,
    /// The type of a number.
    pub float: &'static str,
    /// The type of several numbers: a vector or an array.
    pub vector: fn(usize) -> String,
    /// A constant inside a function, given its name and value.
    pub statement: fn(&str, &str) -> String,
    /// A table, given its number, its entries and how many they are.
    pub table: fn(usize, &str, usize) -> String,
    /// The head of a function of one number x with this name.
    pub helper: fn(&str) -> String,
    /// The head of the function of the model, given its result's type and whether it has parameters.
    pub head: fn(&str, bool) -> String,
    /// The structure of the parameters and a constant with their default values, from names, values and meanings.
    pub structure: fn(&[(String, String, String)]) -> String,
    /// A result of several channels, given its type and their values.
    pub result: fn(&str, &[String]) -> String,
}

/// The type of a result with so many channels: a number, a vector or an array.
pub(super) fn result_type(dialect: &Dialect, channels: usize) -> String {
    if channels == 1 { dialect.float.to_owned() } else { (dialect.vector)(channels) }
}

/// Writes the whole file.
pub(super) fn write(program: &Program, dialect: &Dialect) -> String {
    let Dialect { spelling, statement, .. } = *dialect;
    let mut text = comment(program, "//");
    let given: Vec<(String, String, String)> = program
        .arguments
        .iter()
        .map(|a| (a.word.clone(), (spelling.number)(a.default), format!("{} ({})", a.summary, a.unit)))
        .collect();
    if !given.is_empty() {
        let _ = write!(text, "\n{}", (dialect.structure)(&given));
    }
    for (index, table) in &program.tables {
        let count = table.iter().map(Vec::len).sum();
        let _ = write!(text, "\n{}", (dialect.table)(index + 1, &flat(table, spelling), count));
    }
    for (lacking, body) in &program.helpers {
        let statements = statements(body, "    ", statement);
        let head = (dialect.helper)(function(*lacking));
        let _ = write!(text, "\n{head} {{\n{statements}    return {};\n}}\n", body.outputs.join(", "));
    }
    let result = result_type(dialect, program.channels.len());
    let head = (dialect.head)(&result, !given.is_empty());
    let channels = program.channels.join(", ");
    let _ = write!(
        text,
        "\n// f in 1/sr of the channels {channels}. wi, wo: unit vectors to the light and to the viewer; the normal is (0, 0, 1).\n{head} {{\n"
    );
    for (word, ..) in &given {
        let _ = writeln!(text, "    {}", statement(word, &format!("parameters.{word}")));
    }
    text += &statements(&program.body, "    ", statement);
    let outputs = &program.body.outputs;
    let value = match outputs.as_slice() {
        [one] => one.clone(),
        several => (dialect.result)(&result, several),
    };
    let _ = write!(text, "    return {value};\n}}\n");
    text
}

/// A constructor call with an argument per line.
pub(super) fn constructed(kind: &str, values: &[String]) -> String {
    format!("{kind}(\n        {}\n    )", values.join(",\n        "))
}
