//! A model as a list of statements.

use super::body::Body;
use super::spelling::Spelling;
use crate::geometry::Geometry;
use crate::math::elementary::{erfc_by_erfcx, ln_1p_by_ln, ln_by_ln};
use crate::math::recorded::{Function, Operand, Purpose, Recorded, Recording, Refusal, record};
use crate::math::{Real as _, Scalar as _};
use crate::model::Expression;
use crate::parameters::ParameterTable;
use std::collections::HashMap;
use std::fmt;

/// Which parameters of a model become arguments of the function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arguments {
    /// None: the values are written into the function.
    Fixed,
    /// All.
    Free,
}

/// A parameter that is an argument of the function.
#[derive(Clone, Debug, PartialEq)]
pub struct Argument {
    /// Its name, as a word of letters, digits and underscores.
    pub word: String,
    /// Its full name in reports.
    pub name: String,
    /// Its meaning, in a few words.
    pub summary: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its value unless another is given.
    pub default: f64,
}

/// Why a model cannot be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NotWritten {
    /// It computes a table from its parameters.
    TableOfParameters,
    /// Two parameters have the same name when written as a word.
    SameWord(String, [String; 2]),
}

impl fmt::Display for NotWritten {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TableOfParameters => {
                f.write_str("one that makes a table from them, which only brdfit computes")
            }
            Self::SameWord(word, [a, b]) => write!(f, "'{a}' and '{b}' would both be called {word}"),
        }
    }
}

/// A model as a list of statements.
#[derive(Clone, Debug)]
pub struct Program {
    /// Lines about the model, for a comment.
    pub about: Vec<String>,
    /// Names of the channels.
    pub channels: Vec<String>,
    /// The arguments of the function.
    pub arguments: Vec<Argument>,
    /// The function, with one output per channel.
    pub(crate) body: Body,
    /// The tables that it reads, by row and column, with the numbers by which statements call them.
    pub(crate) tables: Vec<(usize, Vec<Vec<f64>>)>,
    /// Functions that the language lacks, of one number called `x`.
    pub(crate) helpers: Vec<(Function, Body)>,
}

/// Largest number of steps of a function with arguments. Beyond this it computes a table.
const MOST_STEPS: usize = 20_000;

/// Numbers that are given before parameters: the components of two directions.
const COMPONENTS: usize = 6;

impl Program {
    /// Writes the model of an expression, at the values in the table. The comment says what it is, and before that the lines `about`
    /// where it comes from.
    ///
    /// # Errors
    /// [`NotWritten`] if the parameters cannot be arguments.
    pub(crate) fn new(
        expression: &Expression,
        table: &ParameterTable,
        arguments: Arguments,
        spelling: &Spelling,
        about: &[String],
    ) -> Result<Self, NotWritten> {
        let arguments = match arguments {
            Arguments::Fixed => Vec::new(),
            Arguments::Free => words(table)?,
        };
        let are_free = !arguments.is_empty();
        let purpose = Purpose {
            tiny: if spelling.is_single { f64::from(f32::TINY) } else { f64::TINY },
            differentiable: spelling.differentiates,
            most_steps: if are_free { MOST_STEPS } else { usize::MAX },
        };
        let work = || {
            let geometry = given_geometry();
            let named = names_of(&geometry);
            (of_expression(expression, table, are_free, &geometry), named)
        };
        let refused = |_: Refusal| NotWritten::TableOfParameters;
        let ((outputs, names), recording) = record(purpose, work).map_err(refused)?;
        let words = arguments.iter().map(|argument| argument.word.clone());
        let components = ["wi", "wo"]
            .into_iter()
            .flat_map(|vector| (0..3).map(move |component| (spelling.component)(vector, component)));
        let inputs: Vec<String> = components.chain(words).collect();
        let body = Body::new(&recording, &outputs, &inputs, &names, purpose.tiny, spelling);
        let lacking = spelling.lacks.iter().copied().filter(|f| body.functions.contains(f));
        let helpers: Vec<(Function, Body)> = lacking
            .map(|function| Ok((function, helper(function, purpose, spelling)?)))
            .collect::<Result<_, _>>()
            .map_err(refused)?;
        let table_of = |index: &usize| recording.tables.get(*index).cloned().map(|table| (*index, table));
        Ok(Self {
            about: commented(about, description(expression, table, are_free)),
            channels: table.channels().iter().map(|name| name.replace(char::is_control, " ")).collect(),
            arguments,
            tables: body.tables.iter().filter_map(table_of).collect(),
            body,
            helpers,
        })
    }
}

/// Lines of a comment, each once. Control characters in names could end a comment.
fn commented(about: &[String], description: Vec<String>) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for line in about.iter().cloned().chain(description) {
        let line = line.replace(char::is_control, " ");
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    lines
}

/// Lines about a model, its values unless they are free, its sources, and what may be done with the code.
fn description(expression: &Expression, table: &ParameterTable, are_free: bool) -> Vec<String> {
    let mut lines = vec![format!("model: {}", expression.canonical())];
    for (index, row) in table.rows().iter().enumerate().filter(|_| !are_free) {
        let unit = row.spec.unit.symbol();
        let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
        lines.push(format!("{} = {}{unit}: {}", table.name(index), row.value, row.spec.summary));
    }
    let sources = expression.lobes().iter().map(|lobe| &lobe.model);
    lines.extend(sources.map(|model| format!("source of {}: {}", model.name(), model.reference())));
    lines.push("unit: f is in 1/sr, and 0 unless both directions are above the surface".to_owned());
    lines
        .push("licence: 0BSD, which allows everything and asks for nothing; there is no warranty".to_owned());
    lines.push("SPDX-License-Identifier: 0BSD".to_owned());
    lines
}

/// The geometry of a pair of directions that is given.
fn given_geometry() -> Geometry<Recorded> {
    let [ix, iy, iz, ox, oy, oz] = std::array::from_fn(Recorded::input);
    Geometry::new([ix, iy, iz], [ox, oy, oz])
}

/// Names of steps that are quantities of the geometry.
fn names_of(geometry: &Geometry<Recorded>) -> HashMap<usize, String> {
    let Geometry { h: [x, y, z], cos_d, one_less_cos_d, .. } = *geometry;
    let named = [(x, "h_x"), (y, "h_y"), (z, "h_z"), (cos_d, "cos_d"), (one_less_cos_d, "one_less_cos_d")];
    let step = |(number, name): (Recorded, &str)| match number.operand() {
        Operand::Step(index) => Some((index, name.to_owned())),
        _ => None,
    };
    named.into_iter().filter_map(step).collect()
}

/// The model in every channel. Lobes that are absent are left out unless their strengths are free.
fn of_expression(
    expression: &Expression,
    table: &ParameterTable,
    are_free: bool,
    geometry: &Geometry<Recorded>,
) -> Vec<Operand> {
    let lobes = expression.lobes().len();
    let mut present = vec![true; lobes];
    let mut rest = expression.clone();
    for lobe in (0..lobes).rev().filter(|lobe| !are_free && table.is_absent(*lobe)) {
        if let Some(others) = rest.without(lobe) {
            rest = others;
            if let Some(is_present) = present.get_mut(lobe) {
                *is_present = false;
            }
        }
    }
    let value = |index: usize, value: f64, factor: f64| {
        if are_free {
            Recorded::input(COMPONENTS + index) * Recorded::literal(factor)
        } else {
            Recorded::literal(value * factor)
        }
    };
    let of_channel = |channel: usize| {
        let all = table.values_as(channel, value);
        let values: Vec<_> =
            all.into_iter().zip(&present).filter(|(_, present)| **present).map(|(v, _)| v).collect();
        rest.values_in(std::slice::from_ref(geometry), &values)
    };
    (0..table.channels().len()).flat_map(of_channel).map(Recorded::operand).collect()
}

/// The parameters of a table as arguments.
fn words(table: &ParameterTable) -> Result<Vec<Argument>, NotWritten> {
    let mut all: Vec<Argument> = Vec::new();
    for (index, row) in table.rows().iter().enumerate() {
        let name = table.name(index);
        let word = name.replace(|c: char| !c.is_ascii_alphanumeric(), "_");
        if let Some(same) = all.iter().find(|other| other.word == word) {
            return Err(NotWritten::SameWord(word, [same.name.clone(), name]));
        }
        let (summary, unit) = (row.spec.summary, row.spec.unit.symbol());
        all.push(Argument { word, name, summary, unit, default: row.value });
    }
    Ok(all)
}

/// A function that a language lacks.
fn helper(function: Function, purpose: Purpose, spelling: &Spelling) -> Result<Body, Refusal> {
    let work = || {
        let x = Recorded::input(0);
        match function {
            Function::Erfc => erfc_by_erfcx(x),
            Function::Ln1p => ln_1p_by_ln(x),
            Function::Exp => x.exp(),
            Function::Ln => ln_by_ln(x),
            Function::Sqrt => x.sqrt(),
            Function::Sin => x.sin(),
            Function::Atan2 => x.atan2(Recorded::literal(1.0)),
        }
        .operand()
    };
    let (output, recording): (Operand, Recording) = record(purpose, work)?;
    let spelling = Spelling { function: spelling.native, ..*spelling };
    let inputs = ["x".to_owned()];
    Ok(Body::new(&recording, &[output], &inputs, &HashMap::new(), purpose.tiny, &spelling))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::{LANGUAGES, Language};
    use crate::geometry::{Azimuths, direction};
    use crate::math::recorded::{Operator, Step};
    use crate::model::REGISTRY;
    use crate::parameters::Settings;

    fn language(name: &str) -> &'static Language {
        crate::code::named("test", name).unwrap()
    }

    /// What the steps of a recording give for these inputs, by the functions of `f64`.
    fn replayed(recording: &Recording, inputs: &[f64], outputs: &[Operand]) -> Vec<f64> {
        let mut found: Vec<f64> = Vec::new();
        let value = |operand: Operand, found: &[f64]| match operand {
            Operand::Constant(value) => value,
            Operand::Tiny => f64::TINY,
            Operand::Step(index) => found[index],
        };
        for step in &recording.steps {
            let of = |operand: Operand| value(operand, &found);
            let next = match *step {
                Step::Input(index) => inputs[index],
                Step::Negative(a) => -of(a),
                Step::Arithmetic(Operator::Sum, [a, b]) => of(a) + of(b),
                Step::Arithmetic(Operator::Difference, [a, b]) => of(a) - of(b),
                Step::Arithmetic(Operator::Product, [a, b]) => of(a) * of(b),
                Step::Arithmetic(Operator::Quotient, [a, b]) => of(a) / of(b),
                Step::Call(Function::Exp, [a, _]) => crate::math::Scalar::exp(of(a)),
                Step::Call(Function::Ln, [a, _]) => crate::math::Scalar::ln(of(a)),
                Step::Call(Function::Ln1p, [a, _]) => crate::math::Scalar::ln_1p(of(a)),
                Step::Call(Function::Sqrt, [a, _]) => of(a).sqrt(),
                Step::Call(Function::Sin, [a, _]) => of(a).sin(),
                Step::Call(Function::Erfc, [a, _]) => crate::math::Scalar::erfc(of(a)),
                Step::Call(Function::Atan2, [a, b]) => crate::math::Real::atan2(of(a), of(b)),
                Step::Choice { less: [a, b], then, otherwise } => {
                    if of(a) < of(b) {
                        of(then)
                    } else {
                        of(otherwise)
                    }
                }
                Step::Cell { place, last } => crate::math::count(of(place).whole().min(last)),
                Step::Entry { table, cell, below, column } => {
                    recording.tables[table][of(cell).whole() + below][column]
                }
                Step::Held(a) => of(a),
            };
            found.push(next);
        }
        outputs.iter().map(|output| value(*output, &found)).collect()
    }

    // Only ln(x + rest) is recorded otherwise than it is computed, as ln(x) + rest/x.
    #[test]
    fn the_steps_of_every_model_give_what_it_gives() {
        let degrees = [
            (0.0, 0.0, 0.0, 0.0),
            (40.0, 10.0, 40.5, 190.0),
            (70.0, 0.0, 15.0, 80.0),
            (89.9, 0.0, 89.0, 179.0),
        ];
        let pairs = degrees.map(|(theta_i, phi_i, theta_o, phi_o): (f64, f64, f64, f64)| {
            let unit = |theta: f64, phi: f64| direction(theta.to_radians(), phi.to_radians()).to_array();
            (unit(theta_i, phi_i), unit(theta_o, phi_o))
        });
        let purpose = Purpose { tiny: f64::TINY, differentiable: false, most_steps: MOST_STEPS };
        let (mut models, mut refused, mut same) = (0, 0, 0);
        for (model, choices) in REGISTRY.iter().flat_map(|entry| entry.variants()) {
            let expression: Expression = match choices.text() {
                none if none.is_empty() => model.name().to_owned(),
                text => format!("{}({text})", model.name()),
            }
            .parse()
            .unwrap();
            let table = ParameterTable::of_one_channel(&expression).unwrap();
            let values = table.formula_values(0);
            for are_free in [false, true] {
                let most_steps = if are_free { MOST_STEPS } else { usize::MAX };
                let work = || of_expression(&expression, &table, are_free, &given_geometry());
                let Ok((outputs, recording)) = record(Purpose { most_steps, ..purpose }, work) else {
                    assert!(are_free, "{}", expression.canonical());
                    refused += 1;
                    continue;
                };
                models += 1;
                for (wi, wo) in pairs {
                    let own = table.rows().iter().map(|row| row.value);
                    let inputs: Vec<f64> = wi.into_iter().chain(wo).chain(own).collect();
                    let found = replayed(&recording, &inputs, &outputs)[0];
                    let expected = expression.value(&Geometry::new(wi, wo), &values);
                    same += u32::from(found.to_bits() == expected.to_bits());
                    let close = (found - expected).abs() <= 1e-12 * expected.abs();
                    assert!(close, "{}: {found} for {expected}", expression.canonical());
                }
            }
        }
        assert!(same > 4 * models * 9 / 10, "{same} of {} are the same to the bit", 4 * models);
        assert!(refused * 4 < models, "{refused} refused, {models} written");
    }

    #[test]
    fn operations_keep_their_order() {
        let purpose = Purpose { tiny: 0.0, differentiable: false, most_steps: 100 };
        let text = |work: fn([Recorded; 3]) -> Recorded| {
            let given = || work(std::array::from_fn(Recorded::input)).operand();
            let (output, recording) = record(purpose, given).unwrap();
            let inputs = ["a", "b", "c"].map(str::to_owned);
            let spelling = &language("c").spelling;
            Body::new(&recording, &[output], &inputs, &HashMap::new(), 0.0, spelling).outputs.remove(0)
        };
        assert_eq!(text(|[a, b, c]| a - b - c), "a - b - c");
        assert_eq!(text(|[a, b, c]| a - (b - c)), "a - (b - c)");
        assert_eq!(text(|[a, b, c]| a / b / c), "a / b / c");
        assert_eq!(text(|[a, b, c]| a / (b * c)), "a / (b * c)");
        assert_eq!(text(|[a, b, c]| (a + b) * c), "(a + b) * c");
        assert_eq!(text(|[a, b, c]| -(a * b) - -c), "-(a * b) + c");
        assert_eq!(text(|[a, b, _]| (-a) * b), "-a * b");
        assert_eq!(text(|[a, b, _]| -(a + b)), "-(a + b)");
        assert_eq!(text(|[a, b, c]| (-(a + b)).plus(1.0) - c), "1.0 - (a + b) - c");
        assert_eq!(text(|[a, b, c]| -a + (b - c)), "b - c - a");
        assert_eq!(text(|[a, b, c]| a + -(b * c)), "a - b * c");
        assert_eq!(text(|[a, b, _]| a.plus(-0.5) * b.times(-2.0)), "(a - 0.5) * (b * (-2.0))");
        let nested =
            |[a, b, c]: [Recorded; 3]| Recorded::if_less(a, b + c, c, Recorded::if_less(b, c, a, -b));
        assert_eq!(text(nested), "a < b + c ? c : (b < c ? a : -b)");
        assert_eq!(text(|[a, b, _]| Recorded::if_less(a, b, a, b) + a), "(a < b ? a : b) + a");
    }

    #[test]
    fn numbers_are_written_with_all_their_digits() {
        let third = 1.0 / 3.0;
        let number = |name: &str, value: f64| (language(name).spelling.number)(value);
        assert_eq!(number("c", third).parse::<f64>().unwrap(), third);
        assert_eq!(number("glsl", third), "0.33333334");
        assert_eq!(number("glsl", 1e-300), "0.0");
        assert_eq!(number("glsl", f64::INFINITY), "3.4028235e38");
        assert_eq!(number("c", f64::NEG_INFINITY), "-INFINITY");
        assert_eq!(number("python-numpy", f64::INFINITY), "np.inf");
    }

    #[test]
    fn names_that_become_the_same_word_are_an_error() {
        let expression: Expression = "lambert".parse().unwrap();
        let channels = ["a b", "a-b"].map(str::to_owned);
        let table = ParameterTable::new(&expression, &channels, Azimuths::Several, &Settings::new()).unwrap();
        let free = Program::new(&expression, &table, Arguments::Free, &language("c").spelling, &[]);
        assert!(matches!(free, Err(NotWritten::SameWord(word, _)) if word == "lambert_kd_a_b"), "a clash");
        Program::new(&expression, &table, Arguments::Fixed, &language("c").spelling, &[]).unwrap();
    }

    #[test]
    fn a_lobe_without_strength_is_left_out_if_its_parameters_are_fixed() {
        let expression: Expression = "lambert(kd=0.5) + cook-torrance(ks=free)".parse().unwrap();
        let mut table = ParameterTable::of_one_channel(&expression).unwrap();
        let ks = (0..table.rows().len()).find(|row| table.name(*row) == "cook-torrance.ks").unwrap();
        table.set_value(ks, 0.0);
        assert!(table.drop_absent_lobes());
        for language in LANGUAGES {
            let written = |arguments| {
                let program = Program::new(&expression, &table, arguments, &language.spelling, &[]).unwrap();
                program.body.statements.len()
            };
            assert_eq!(written(Arguments::Fixed), 0, "{}", language.name);
            assert!(written(Arguments::Free) > 5, "{}", language.name);
        }
    }
}
