//! How the steps of a formula are spelled in a language.

use crate::math::recorded::Function;
use std::fmt;

/// How tightly the parts of a text hold together: a looser text stands in parentheses inside a tighter one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Level {
    /// A choice between two values.
    Choice,
    /// A sum or a difference.
    Sum,
    /// A product or a quotient.
    Product,
    /// A change of sign.
    Sign,
    /// A name, a number or a call.
    Whole,
}

/// How the steps of a formula are spelled in a language.
#[derive(Clone, Copy)]
pub(crate) struct Spelling {
    /// Whether numbers have single precision.
    pub is_single: bool,
    /// Whether the language differentiates programs itself.
    pub differentiates: bool,
    /// Functions that the language does not have: they are written before the program, as far as it uses them.
    pub lacks: &'static [Function],
    /// A number.
    pub number: fn(f64) -> String,
    /// A component of a direction, given the name of the vector and the number of the component.
    pub component: fn(&str, usize) -> String,
    /// The name of a function.
    pub function: fn(Function) -> &'static str,
    /// The language's own function, where `function` names one that is written before the program.
    pub native: fn(Function) -> &'static str,
    /// The choice of the third text if the first is less than the second, or else of the fourth. All are at least sums.
    pub choice: fn([&str; 4]) -> (String, Level),
    /// The number of the cell at a place, given the number of the last.
    pub cell: fn(&str, usize) -> String,
    /// The entry of a table: its number, the cell, rows below it, the column, and the number of columns.
    pub entry: fn(usize, &str, usize, usize, usize) -> String,
    /// A value without its derivatives.
    pub held: fn(&str) -> String,
}

impl fmt::Debug for Spelling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Spelling").finish_non_exhaustive()
    }
}

/// A component as an element of an array.
pub(crate) fn element(vector: &str, component: usize) -> String {
    format!("{vector}[{component}]")
}

/// A component as a field of a structure.
pub(crate) fn field(vector: &str, component: usize) -> String {
    format!("{vector}.{}", axis(component))
}

/// The name of a component.
pub(crate) fn axis(component: usize) -> &'static str {
    ["x", "y", "z"].get(component).copied().unwrap_or("x")
}

/// A choice as most languages write it.
pub(crate) fn ternary([a, b, then, otherwise]: [&str; 4]) -> (String, Level) {
    (format!("{a} < {b} ? {then} : {otherwise}"), Level::Choice)
}

/// A number in the fewest digits that give the same double. Infinities and NaN have the names that are given.
pub(crate) fn double(value: f64, infinity: &str, nan: &str) -> String {
    finite(value, infinity, nan).unwrap_or_else(|| format!("{value:?}"))
}

/// A number in the fewest digits that give the same single-precision number.
pub(crate) fn single(value: f64, infinity: &str, nan: &str) -> String {
    #[expect(clippy::cast_possible_truncation, reason = "rounding to the type is the point")]
    let rounded = value as f32;
    finite(f64::from(rounded), infinity, nan).unwrap_or_else(|| format!("{rounded:?}"))
}

/// The name of a number that is not finite.
fn finite(value: f64, infinity: &str, nan: &str) -> Option<String> {
    match value {
        _ if value.is_nan() => Some(nan.to_owned()),
        f64::INFINITY => Some(infinity.to_owned()),
        f64::NEG_INFINITY => Some(format!("-{infinity}")),
        _ => None,
    }
}
