//! What shading languages have in common: numbers of single precision, and parameters in a structure.

use super::text::{comment, flat, statements};
use crate::code::spelling::single;
use crate::code::{Program, Spelling, field, ternary};
use crate::math::recorded::Function;
use std::fmt::Write as _;

/// How steps are spelled where nothing is special.
pub(super) const SPELLING: Spelling = Spelling {
    is_single: true,
    differentiates: false,
    // A graphics processor's own logarithm has no relative accuracy near 1.
    lacks: &[Function::Erfc, Function::Ln1p, Function::Ln],
    number,
    component: field,
    function,
    native,
    choice: ternary,
    cell: |place, last| format!("({place} > 0.0 ? floor(min({place}, {last}.0)) : 0.0)"),
    entry: |table, cell, below, column, columns| {
        entry(table, &format!("int({cell})"), below * columns + column, columns)
    },
    held: str::to_owned,
};

/// A number, by the shortest text that gives the same float. These languages have no name for infinity: there the largest number stands.
fn number(value: f64) -> String {
    single(value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)), "", "0.0")
}

/// An entry of a table that lies in one array, from the cell as an integer.
pub(super) fn entry(table: usize, cell: &str, place: usize, columns: usize) -> String {
    format!("table_{}[{columns} * {cell} + {place}]", table + 1)
}

fn function(function: Function) -> &'static str {
    match function {
        Function::Exp => "exp",
        Function::Ln => "brdf_log",
        Function::Ln1p => "brdf_log1p",
        Function::Sqrt => "sqrt",
        Function::Sin => "sin",
        Function::Erfc => "brdf_erfc",
        Function::Atan2 => "atan2",
    }
}

/// The names of the languages' own functions.
pub(super) fn native(named: Function) -> &'static str {
    if named == Function::Ln { "log" } else { function(named) }
}

/// How a shading language declares things.
pub(super) struct Dialect {
    pub spelling: Spelling,
    /// The type of a number.
    pub float: &'static str,
    /// The type of so many numbers: a vector or an array.
    pub several: fn(usize) -> String,
    /// A declaration, given a type and a name.
    pub declared: fn(&str, &str) -> String,
    /// What stands before the declaration of a constant inside a function.
    pub constant: &'static str,
    /// The head of a function, given the type of its result and its name with its arguments.
    pub function: fn(&str, &str) -> String,
    /// What ends a field of a structure, and what ends the structure.
    pub ends: [&'static str; 2],
    /// A constant with the default values of the parameters, given these.
    pub defaults: fn(&str) -> String,
    /// A table, given its number, its entries and how many they are.
    pub table: fn(usize, &str, usize) -> String,
    /// A result of several channels, given its type and their values.
    pub result: fn(&str, &[String]) -> String,
}

/// Writes the whole file.
pub(super) fn write(program: &Program, dialect: &Dialect) -> String {
    let Dialect { spelling, float, declared, constant, .. } = dialect;
    let statement = |name: &str, value: &str| format!("{constant}{} = {value};", declared(float, name));
    let mut text = comment(program, "//");
    if !program.arguments.is_empty() {
        text += &structure(program, dialect);
    }
    for (index, table) in &program.tables {
        let count = table.iter().map(Vec::len).sum();
        let _ = write!(text, "\n{}", (dialect.table)(index + 1, &flat(table, spelling), count));
    }
    for (lacking, body) in &program.helpers {
        let statements = statements(body, "    ", statement);
        let head = (dialect.function)(float, &format!("{}({})", function(*lacking), declared(float, "x")));
        let _ = write!(text, "\n{head} {{\n{statements}    return {};\n}}\n", body.outputs.join(", "));
    }
    let outputs = &program.body.outputs;
    let result = if outputs.len() == 1 { (*float).to_owned() } else { (dialect.several)(outputs.len()) };
    let mut arguments = ["wi", "wo"].map(|name| declared(&(dialect.several)(3), name)).to_vec();
    if !program.arguments.is_empty() {
        arguments.push(declared("BrdfParameters", "parameters"));
    }
    let head = (dialect.function)(&result, &format!("brdf({})", arguments.join(", ")));
    let _ = write!(
        text,
        "\n// f in 1/sr of the channels {}. wi, wo: unit vectors to the light and to the viewer; the normal is (0, 0, 1).\n{head} {{\n",
        program.channels.join(", ")
    );
    for argument in &program.arguments {
        let _ = writeln!(text, "    {}", statement(&argument.word, &format!("parameters.{}", argument.word)));
    }
    text += &statements(&program.body, "    ", statement);
    let value = match outputs.as_slice() {
        [one] => one.clone(),
        several => (dialect.result)(&result, several),
    };
    let _ = write!(text, "    return {value};\n}}\n");
    text
}

/// The structure of the parameters, and their default values.
fn structure(program: &Program, dialect: &Dialect) -> String {
    let [end_of_field, end] = dialect.ends;
    let mut text = "\nstruct BrdfParameters {\n".to_owned();
    for argument in &program.arguments {
        let field = (dialect.declared)(dialect.float, &argument.word);
        let _ = writeln!(text, "    {field}{end_of_field}  // {} ({})", argument.summary, argument.unit);
    }
    let values: Vec<String> =
        program.arguments.iter().map(|argument| (dialect.spelling.number)(argument.default)).collect();
    let _ = write!(text, "{end}\n\n{}\n", (dialect.defaults)(&values.join(", ")));
    text
}

/// A constructor call with an argument per line.
pub(super) fn constructed(kind: &str, values: &[String]) -> String {
    format!("{kind}(\n        {}\n    )", values.join(",\n        "))
}
