//! What the files of several languages have in common.

use crate::code::program::Program;
use crate::code::{Body, Spelling};

/// The lines about a program as comments that begin with `mark`.
pub(crate) fn comment(program: &Program, mark: &str) -> String {
    let line = |line: &String| format!("{mark} {line}").trim_end().to_owned() + "\n";
    program.about.iter().map(line).collect()
}

/// A text in double quotes, with escapes that C, JavaScript and Python share.
pub(crate) fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// Texts in double quotes, with commas between them.
pub(crate) fn all_quoted<'a>(texts: impl Iterator<Item = &'a String>) -> String {
    texts.map(|text| quoted(text)).collect::<Vec<_>>().join(", ")
}

/// Statements, each made from a name and its value.
pub(crate) fn statements(body: &Body, indent: &str, statement: impl Fn(&str, &str) -> String) -> String {
    let line = |(name, value): &(String, String)| format!("{indent}{}\n", statement(name, value));
    body.statements.iter().map(line).collect()
}

/// The rows of a table, each between `open` and `close`.
pub(crate) fn rows(table: &[Vec<f64>], spelling: &Spelling, open: &str, close: &str) -> String {
    let row = |row: &Vec<f64>| {
        let numbers: Vec<String> = row.iter().map(|value| (spelling.number)(*value)).collect();
        format!("    {open}{}{close},\n", numbers.join(", "))
    };
    table.iter().map(row).collect()
}

/// The numbers of a table in one list, row after row.
pub(crate) fn flat(table: &[Vec<f64>], spelling: &Spelling) -> String {
    let row = |row: &Vec<f64>| {
        let numbers: Vec<String> = row.iter().map(|value| (spelling.number)(*value)).collect();
        format!("    {}", numbers.join(", "))
    };
    format!("{}\n", table.iter().map(row).collect::<Vec<_>>().join(",\n"))
}
