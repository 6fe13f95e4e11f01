//! The steps of a formula as statements.

use super::spelling::{Level, Spelling};
use crate::math::recorded::{Function, Operand, Operator, Recording, Step};
use std::collections::HashMap;

/// The longest text that is written in place of a name.
const LONGEST: usize = 96;

/// The statements of a formula.
#[derive(Clone, Debug, Default)]
pub(crate) struct Body {
    /// Names and their values, in order.
    pub statements: Vec<(String, String)>,
    /// The results.
    pub outputs: Vec<String>,
    /// The functions that are called.
    pub functions: Vec<Function>,
    /// The indices of the tables that are read, in order.
    pub tables: Vec<usize>,
}

/// A piece of a statement.
#[derive(Clone)]
struct Text {
    text: String,
    level: Level,
    /// What it is the negative of, as a term of a sum: x + (-y) is x - y to the last bit.
    negative_of: Option<String>,
}

impl Text {
    fn new(text: String, level: Level) -> Self {
        Self { text, level, negative_of: None }
    }

    fn whole(text: String) -> Self {
        Self::new(text, Level::Whole)
    }

    fn negative(of: &Self) -> Self {
        let text = format!("-{}", of.at(Level::Whole));
        Self { text, level: Level::Sign, negative_of: Some(of.at(Level::Product)) }
    }

    /// The text, in parentheses if it is looser than `level`.
    fn at(&self, level: Level) -> String {
        if self.level < level { format!("({})", self.text) } else { self.text.clone() }
    }
}

/// The operands of a step.
fn operands(step: &Step) -> Vec<Operand> {
    match *step {
        Step::Input(_) => Vec::new(),
        Step::Negative(a) | Step::Held(a) | Step::Cell { place: a, .. } | Step::Entry { cell: a, .. } => {
            vec![a]
        }
        Step::Call(Function::Atan2, both) | Step::Arithmetic(_, both) => both.to_vec(),
        Step::Call(_, [a, _]) => vec![a],
        Step::Choice { less: [a, b], then, otherwise } => vec![a, b, then, otherwise],
    }
}

/// How often each step is used, directly or not, to compute `outputs`.
fn uses(recording: &Recording, outputs: &[Operand]) -> Vec<usize> {
    let mut uses = vec![0_usize; recording.steps.len()];
    let count = |operand: Operand, uses: &mut Vec<usize>| {
        if let Operand::Step(index) = operand
            && let Some(count) = uses.get_mut(index)
        {
            *count += 1;
        }
    };
    outputs.iter().for_each(|output| count(*output, &mut uses));
    for (index, step) in recording.steps.iter().enumerate().rev() {
        if uses.get(index).is_some_and(|used| *used > 0) {
            operands(step).into_iter().for_each(|operand| count(operand, &mut uses));
        }
    }
    uses
}

impl Body {
    /// Writes the steps that `outputs` need. A step has a name of its own if it is used more than once, is among `names`, or would make
    /// a statement too long. `inputs` are the names of what is given.
    pub fn new(
        recording: &Recording,
        outputs: &[Operand],
        inputs: &[String],
        names: &HashMap<usize, String>,
        tiny: f64,
        spelling: &Spelling,
    ) -> Self {
        let uses = uses(recording, outputs);
        let mut body = Self::default();
        let mut writer = Writer { texts: Vec::new(), tiny, spelling };
        for (index, step) in recording.steps.iter().enumerate() {
            let used = uses.get(index).copied().unwrap_or(0);
            if used == 0 {
                writer.texts.push(Text::whole(String::new()));
                continue;
            }
            body.note(step);
            let text = writer.text(step, recording, inputs);
            let is_input = matches!(step, Step::Input(_));
            let named = used > 1 || names.contains_key(&index) || text.text.len() > LONGEST;
            writer.texts.push(if is_input || !named {
                text
            } else {
                let own = names.get(&index).cloned();
                let name = own.unwrap_or_else(|| format!("t{}", body.statements.len() + 1));
                body.statements.push((name.clone(), text.text));
                Text::whole(name)
            });
        }
        body.tables.sort_unstable();
        body.outputs = outputs.iter().map(|output| writer.operand(*output).text).collect();
        body
    }

    /// Notes what a step needs beside operations.
    fn note(&mut self, step: &Step) {
        match step {
            Step::Call(function, _) if !self.functions.contains(function) => self.functions.push(*function),
            Step::Entry { table, .. } if !self.tables.contains(table) => self.tables.push(*table),
            _ => {}
        }
    }
}

/// Writes steps one after another.
struct Writer<'a> {
    /// The text of every step so far.
    texts: Vec<Text>,
    tiny: f64,
    spelling: &'a Spelling,
}

impl Writer<'_> {
    fn operand(&self, operand: Operand) -> Text {
        let number = |value: f64| {
            let whole = |value: f64| Text::whole((self.spelling.number)(value));
            if value.is_sign_negative() { Text::negative(&whole(-value)) } else { whole(value) }
        };
        match operand {
            Operand::Constant(value) => number(value),
            Operand::Tiny => number(self.tiny),
            Operand::Step(index) => {
                self.texts.get(index).cloned().unwrap_or_else(|| Text::whole(String::new()))
            }
        }
    }

    fn text(&self, step: &Step, recording: &Recording, inputs: &[String]) -> Text {
        let Spelling { function: named, choice, cell: cell_of, entry, held, .. } = *self.spelling;
        let at = |operand: Operand, level: Level| self.operand(operand).at(level);
        // Inside the parentheses of a call or the brackets of an index.
        let inside = |operand: Operand| self.operand(operand).text;
        match *step {
            Step::Input(index) => Text::whole(inputs.get(index).cloned().unwrap_or_default()),
            Step::Negative(a) => Text::negative(&self.operand(a)),
            Step::Arithmetic(operator, [a, b]) => arithmetic(operator, &self.operand(a), &self.operand(b)),
            Step::Call(function, [a, b]) => {
                let arguments = match function {
                    Function::Atan2 => format!("{}, {}", inside(a), inside(b)),
                    _ => inside(a),
                };
                Text::whole(format!("{}({arguments})", named(function)))
            }
            Step::Choice { less: [a, b], then, otherwise } => {
                let [a, b, then, otherwise] = [a, b, then, otherwise].map(|operand| at(operand, Level::Sum));
                let (text, level) = choice([&a, &b, &then, &otherwise]);
                Text::new(text, level)
            }
            Step::Cell { place, last } => Text::whole(cell_of(&inside(place), last)),
            Step::Entry { table, cell, below, column } => {
                let columns = recording.tables.get(table).and_then(|rows| rows.first()).map_or(1, Vec::len);
                Text::whole(entry(table, &inside(cell), below, column, columns))
            }
            Step::Held(a) => Text::whole(held(&inside(a))),
        }
    }
}

/// Two texts joined by an operation. Operations of one level are done from the left in every language; in another order they could round
/// otherwise.
fn arithmetic(operator: Operator, a: &Text, b: &Text) -> Text {
    let sum =
        |first: String, sign: &str, second: &str| Text::new(format!("{first} {sign} {second}"), Level::Sum);
    match (operator, &a.negative_of, &b.negative_of) {
        (Operator::Sum, _, Some(b)) => sum(a.at(Level::Sum), "-", b),
        (Operator::Sum, Some(a), None) => sum(b.at(Level::Sum), "-", a),
        (Operator::Sum, None, None) => sum(a.at(Level::Sum), "+", &b.at(Level::Product)),
        (Operator::Difference, _, Some(b)) => sum(a.at(Level::Sum), "+", b),
        (Operator::Difference, _, None) => sum(a.at(Level::Sum), "-", &b.at(Level::Product)),
        (Operator::Product | Operator::Quotient, _, _) => {
            let sign = if operator == Operator::Product { "*" } else { "/" };
            let text = format!("{} {sign} {}", a.at(Level::Product), b.at(Level::Whole));
            Text::new(text, Level::Product)
        }
    }
}
