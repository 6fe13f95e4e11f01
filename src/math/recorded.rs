//! Numbers that record what is done to them. This turns a formula into the list of its steps, from which source text in any language can
//! be written.
//!
//! Between constants nothing is recorded: they are computed at once, by the functions that `f64` uses, so that the steps give the same
//! bytes as the formula. An operation that was recorded before is not recorded again.

use super::scalar::{Cell, Real, Scalar};
use std::cell::RefCell;
use std::collections::HashMap;
use std::hash::{Hash, Hasher};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A double that records the operations on it while [`record`] runs.
#[derive(Clone, Copy, Debug)]
pub struct Recorded(Operand);

/// What a step takes.
#[derive(Clone, Copy, Debug)]
pub enum Operand {
    /// A number that is known.
    Constant(f64),
    /// [`Real::TINY`] of the type that the steps will run in.
    Tiny,
    /// The result of the step with this index.
    Step(usize),
}

impl PartialEq for Operand {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            // 0 and -0 are different numbers, and NaN is the same as itself.
            (Self::Constant(a), Self::Constant(b)) => a.to_bits() == b.to_bits(),
            (Self::Step(a), Self::Step(b)) => a == b,
            (Self::Tiny, Self::Tiny) => true,
            _ => false,
        }
    }
}

impl Eq for Operand {}

impl Hash for Operand {
    fn hash<H: Hasher>(&self, state: &mut H) {
        match self {
            Self::Constant(value) => (0, value.to_bits()).hash(state),
            Self::Tiny => 1.hash(state),
            Self::Step(index) => (2, index).hash(state),
        }
    }
}

/// One of the four operations of arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operator {
    /// a + b
    Sum,
    /// a - b
    Difference,
    /// a b
    Product,
    /// a/b
    Quotient,
}

/// A function that a language must have, or be given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Function {
    /// e^x
    Exp,
    /// Natural logarithm.
    Ln,
    /// ln(1 + x), accurate near zero.
    Ln1p,
    /// Square root.
    Sqrt,
    /// Sine of an angle in radians.
    Sin,
    /// Complementary error function.
    Erfc,
    /// Angle of the point (x, y), given y and x.
    Atan2,
}

/// One step of a formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Step {
    /// A number that is given, by its index.
    Input(usize),
    /// -x
    Negative(Operand),
    /// An operation of arithmetic.
    Arithmetic(Operator, [Operand; 2]),
    /// A function; the second argument is only used by [`Function::Atan2`].
    Call(Function, [Operand; 2]),
    /// `then` if the first of `less` is less than the second, or else `otherwise`.
    Choice {
        /// The numbers that are compared.
        less: [Operand; 2],
        /// The value if the first is less.
        then: Operand,
        /// The value otherwise.
        otherwise: Operand,
    },
    /// How many whole cells lie before a place; from 0 to `last`, and 0 for NaN.
    Cell {
        /// The place, in cells.
        place: Operand,
        /// The number of the last cell.
        last: usize,
    },
    /// An entry of a table of [`Recording::tables`].
    Entry {
        /// Index of the table.
        table: usize,
        /// Number of the row, counted from `below` rows further up.
        cell: Operand,
        /// Rows to go down from there.
        below: usize,
        /// Number of the column.
        column: usize,
    },
    /// The number itself, without its derivatives.
    Held(Operand),
}

/// What the steps of a formula are recorded for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Purpose {
    /// [`Real::TINY`] of the type that the steps will run in.
    pub tiny: f64,
    /// Whether the steps will be differentiated. If not, [`Step::Held`] does not occur.
    pub differentiable: bool,
    /// The largest number of steps.
    pub most_steps: usize,
}

/// Why a formula cannot be recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// It takes more steps than were allowed.
    TooLong,
    /// It chooses a row of a table whose entries are not known, or takes the whole part of a number in another way.
    UnknownTable,
}

/// A recorded formula.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// The steps, each after those that it uses.
    pub steps: Vec<Step>,
    /// Tables by row and column.
    pub tables: Vec<Vec<Vec<f64>>>,
}

struct Tape {
    purpose: Purpose,
    recording: Recording,
    known: HashMap<Step, usize>,
    refusal: Option<Refusal>,
}

thread_local! {
    /// What is being recorded on this thread.
    static TAPE: RefCell<Option<Tape>> = const { RefCell::new(None) };
}

/// Runs `work`, and returns its result and what it did to numbers that are not constant. Recordings do not nest.
///
/// # Errors
/// The first [`Refusal`].
pub fn record<R>(purpose: Purpose, work: impl FnOnce() -> R) -> Result<(R, Recording), Refusal> {
    let tape = Tape { purpose, recording: Recording::default(), known: HashMap::new(), refusal: None };
    TAPE.set(Some(tape));
    let result = work();
    match TAPE.take() {
        Some(Tape { refusal: Some(refusal), .. }) => Err(refusal),
        Some(Tape { recording, .. }) => Ok((result, recording)),
        None => Err(Refusal::UnknownTable),
    }
}

/// Records a step. Nothing more is recorded after a refusal.
fn push(step: Step) -> Recorded {
    let index = TAPE.with_borrow_mut(|tape| {
        let tape = tape.as_mut().filter(|tape| tape.refusal.is_none())?;
        if let Some(known) = tape.known.get(&step) {
            return Some(*known);
        }
        let index = tape.recording.steps.len();
        if index >= tape.purpose.most_steps {
            tape.refusal = Some(Refusal::TooLong);
            return None;
        }
        tape.recording.steps.push(step);
        tape.known.insert(step, index);
        Some(index)
    });
    Recorded(index.map_or(Operand::Constant(f64::NAN), Operand::Step))
}

fn refuse(refusal: Refusal) -> Recorded {
    TAPE.with_borrow_mut(|tape| {
        if let Some(tape) = tape {
            tape.refusal.get_or_insert(refusal);
        }
    });
    Recorded(Operand::Constant(f64::NAN))
}

/// The index of a table, which is stored once.
fn table_index(rows: Vec<Vec<f64>>) -> usize {
    TAPE.with_borrow_mut(|tape| {
        let Some(tape) = tape else { return 0 };
        let bits = |rows: &[Vec<f64>]| -> Vec<u64> { rows.iter().flatten().map(|x| x.to_bits()).collect() };
        let tables = &mut tape.recording.tables;
        let wanted = bits(&rows);
        let same = |known: &Vec<Vec<f64>>| known.len() == rows.len() && bits(known) == wanted;
        tables.iter().position(same).unwrap_or_else(|| {
            tables.push(rows);
            tables.len() - 1
        })
    })
}

impl Recorded {
    /// The number that is given with this index.
    #[must_use]
    pub fn input(index: usize) -> Self {
        push(Step::Input(index))
    }

    /// What the number is.
    #[must_use]
    pub fn operand(self) -> Operand {
        self.0
    }

    /// The number, if it is known.
    fn known(self) -> Option<f64> {
        match self.0 {
            Operand::Constant(value) => Some(value),
            Operand::Tiny => {
                Some(TAPE.with_borrow(|tape| tape.as_ref().map_or(f64::TINY, |tape| tape.purpose.tiny)))
            }
            Operand::Step(_) => None,
        }
    }

    fn is(self, value: f64) -> bool {
        self.known().is_some_and(|known| known.to_bits() == value.to_bits())
    }

    fn call(self, function: Function, of_known: fn(f64) -> f64) -> Self {
        match self.known() {
            Some(value) => Self::literal(of_known(value)),
            None => push(Step::Call(function, [self.0, Operand::Constant(0.0)])),
        }
    }

    fn arithmetic(self, operator: Operator, other: Self, of_known: fn(f64, f64) -> f64) -> Self {
        match (self.known(), other.known()) {
            (Some(a), Some(b)) => Self::literal(of_known(a, b)),
            _ => push(Step::Arithmetic(operator, [self.0, other.0])),
        }
    }
}

impl Neg for Recorded {
    type Output = Self;
    fn neg(self) -> Self {
        match self.known() {
            Some(value) => Self::literal(-value),
            None => push(Step::Negative(self.0)),
        }
    }
}

// What is left out below changes no bit of any number: multiplying or dividing by 1, subtracting 0 or adding -0.

impl Add for Recorded {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        match () {
            () if other.is(-0.0) => self,
            () if self.is(-0.0) => other,
            () => self.arithmetic(Operator::Sum, other, |a, b| a + b),
        }
    }
}

impl Sub for Recorded {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        if other.is(0.0) { self } else { self.arithmetic(Operator::Difference, other, |a, b| a - b) }
    }
}

impl Mul for Recorded {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        match () {
            () if other.is(1.0) => self,
            () if self.is(1.0) => other,
            () => self.arithmetic(Operator::Product, other, |a, b| a * b),
        }
    }
}

impl Div for Recorded {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        if other.is(1.0) { self } else { self.arithmetic(Operator::Quotient, other, |a, b| a / b) }
    }
}

impl Scalar for Recorded {
    type Real = Self;

    fn from_real(value: Self) -> Self {
        value
    }
    fn value(self) -> Self {
        let differentiable =
            TAPE.with_borrow(|tape| tape.as_ref().is_some_and(|tape| tape.purpose.differentiable));
        if differentiable && self.known().is_none() { push(Step::Held(self.0)) } else { self }
    }
    fn exp(self) -> Self {
        self.call(Function::Exp, Scalar::exp)
    }
    fn ln(self) -> Self {
        self.call(Function::Ln, Scalar::ln)
    }
    fn ln_1p(self) -> Self {
        self.call(Function::Ln1p, Scalar::ln_1p)
    }
    fn sqrt(self) -> Self {
        self.call(Function::Sqrt, f64::sqrt)
    }
    fn sin(self) -> Self {
        self.call(Function::Sin, f64::sin)
    }
    fn erfc(self) -> Self {
        self.call(Function::Erfc, Scalar::erfc)
    }
    fn if_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self {
        match (a.known(), b.known()) {
            (Some(a), Some(b)) => {
                if a < b {
                    then
                } else {
                    otherwise
                }
            }
            _ if then.0 == otherwise.0 => then,
            _ => push(Step::Choice { less: [a.0, b.0], then: then.0, otherwise: otherwise.0 }),
        }
    }
    #[expect(clippy::indexing_slicing, reason = "the cell is kept inside the table")]
    fn look_up<const N: usize>(rows: &[[Self; N]], place: Self) -> Cell<Self, N> {
        let last = rows.len() - 2;
        if let Some(place) = place.known() {
            let number = place.whole().min(last);
            return Cell {
                start: rows[number],
                end: rows[number + 1],
                number: Self::literal(super::count(number)),
            };
        }
        let entries = |row: &[Self; N]| row.iter().map(|entry| entry.known()).collect::<Option<Vec<f64>>>();
        let Some(known) = rows.iter().map(entries).collect() else {
            let unknown = refuse(Refusal::UnknownTable);
            return Cell { start: [unknown; N], end: [unknown; N], number: unknown };
        };
        let table = table_index(known);
        let number = push(Step::Cell { place: place.0, last });
        let row =
            |below| std::array::from_fn(|column| push(Step::Entry { table, cell: number.0, below, column }));
        Cell { start: row(0), end: row(1), number }
    }
}

impl Real for Recorded {
    const TINY: Self = Self(Operand::Tiny);

    fn literal(value: f64) -> Self {
        Self(Operand::Constant(value))
    }
    fn ln_of_sum(self, rest: Self) -> Self {
        match (self.known(), rest.known()) {
            (Some(value), Some(rest)) => Self::literal(Real::ln_of_sum(value, rest)),
            _ => self.ln() + rest / self,
        }
    }
    fn atan2(self, x: Self) -> Self {
        match (self.known(), x.known()) {
            (Some(y), Some(x)) => Self::literal(Real::atan2(y, x)),
            _ => push(Step::Call(Function::Atan2, [self.0, x.0])),
        }
    }
    fn whole(self) -> usize {
        match self.known() {
            Some(value) => value.whole(),
            None => {
                refuse(Refusal::UnknownTable);
                0
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PURPOSE: Purpose = Purpose { tiny: f64::TINY, differentiable: false, most_steps: 100 };

    #[test]
    fn constants_are_computed_and_repetitions_shared() {
        let work = || {
            let (x, two) = (Recorded::input(0), Recorded::literal(2.0));
            let a = x * Scalar::exp(two);
            let b = x * Scalar::exp(two) * Recorded::literal(1.0);
            (a + b).operand()
        };
        let (result, recording) = record(PURPOSE, work).unwrap();
        let product =
            Step::Arithmetic(Operator::Product, [Operand::Step(0), Operand::Constant(Scalar::exp(2.0_f64))]);
        let sum = Step::Arithmetic(Operator::Sum, [Operand::Step(1), Operand::Step(1)]);
        assert_eq!(recording.steps, [Step::Input(0), product, sum]);
        assert_eq!(result, Operand::Step(2));
    }

    // 0 + x is not x if that is -0, and 0 x is not 0 if x is infinite.
    #[test]
    fn nothing_is_left_out_that_could_change_a_bit() {
        let work = || {
            let (x, zero) = (Recorded::input(0), Recorded::literal(0.0));
            [zero + x, x - zero, x * zero, x + (-zero)].map(Recorded::operand)
        };
        let (result, recording) = record(PURPOSE, work).unwrap();
        assert_eq!(result, [1, 0, 2, 0].map(Operand::Step));
        assert_eq!(recording.steps.len(), 3);
    }

    #[test]
    fn tables_are_kept_once_and_unknown_ones_refused() {
        let rows = |entry: Recorded| [1.0, 2.0, 4.0].map(|x| [Recorded::literal(x), entry]);
        let known = || {
            let place = Recorded::input(0);
            let at = Recorded::look_up(&rows(Recorded::literal(0.5)), place);
            let again = Recorded::look_up(&rows(Recorded::literal(0.5)), place);
            assert_eq!(at.end[1].operand(), again.end[1].operand());
            // Where the place is known, so is the row.
            let here = Recorded::look_up(&rows(place), Recorded::literal(7.0));
            assert_eq!(here.end[0].operand(), Operand::Constant(4.0));
        };
        let ((), recording) = record(PURPOSE, known).unwrap();
        assert_eq!(recording.tables, [[[1.0, 0.5], [2.0, 0.5], [4.0, 0.5]]]);
        let unknown = || Recorded::look_up(&rows(Recorded::input(1)), Recorded::input(0));
        assert_eq!(record(PURPOSE, unknown).unwrap_err(), Refusal::UnknownTable);
        let long = || (0..200).fold(Recorded::input(0), |x, _| x.sqrt());
        assert_eq!(record(PURPOSE, long).unwrap_err(), Refusal::TooLong);
    }

    #[test]
    fn what_is_held_matters_only_to_derivatives() {
        let work = || (Recorded::input(0) - Recorded::input(0).value()).operand();
        assert_eq!(record(PURPOSE, work).unwrap().1.steps.len(), 2);
        let (_, recording) = record(Purpose { differentiable: true, ..PURPOSE }, work).unwrap();
        assert_eq!(recording.steps[1], Step::Held(Operand::Step(0)));
    }
}
