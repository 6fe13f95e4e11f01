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
}

impl Text {
    fn whole(text: String) -> Self {
        Self { text, level: Level::Whole }
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
            let text = (self.spelling.number)(value);
            let level = if text.starts_with('-') { Level::Sign } else { Level::Whole };
            Text { text, level }
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
            Step::Negative(a) => Text { text: format!("-{}", at(a, Level::Whole)), level: Level::Sign },
            Step::Arithmetic(operator, [a, b]) => {
                // Operations of one level are done from the left in every language, and must be in this order to round the same.
                let (sign, level, right) = match operator {
                    Operator::Sum => ("+", Level::Sum, Level::Product),
                    Operator::Difference => ("-", Level::Sum, Level::Product),
                    Operator::Product => ("*", Level::Product, Level::Whole),
                    Operator::Quotient => ("/", Level::Product, Level::Whole),
                };
                // A sign in front of a product is done last in some languages.
                let first = if level == Level::Product {
                    let text = self.operand(a);
                    if text.level == Level::Sign { text.at(Level::Whole) } else { text.at(level) }
                } else {
                    at(a, level)
                };
                let second = self.operand(b);
                let second =
                    if second.level == Level::Sign { second.at(Level::Whole) } else { second.at(right) };
                Text { text: format!("{first} {sign} {second}"), level }
            }
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
                Text { text, level }
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
