//! Numbers that count the operations on them. This gives the cost of a formula independently of machine and moment.
//!
//! Every operation on a [`Counted`] number adds to a tally of its thread. [`counting`] returns what a piece of code
//! has added. It is slow and meant for counting only.

use super::scalar::{Real, Scalar};
use serde::Serialize;
use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A double that counts the operations on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counted(f64);

/// Numbers of operations, by cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(serde::Deserialize))]
pub struct Operations {
    /// Sums, differences, changes of sign.
    pub sums: u64,
    /// Products.
    pub products: u64,
    /// Choices between two numbers, and integer parts.
    pub choices: u64,
    /// Quotients.
    pub quotients: u64,
    /// Square roots.
    pub roots: u64,
    /// Exponentials, logarithms, sines, arc tangents, error functions.
    pub transcendental: u64,
}

/// The cost of a quotient or a square root in units of a sum: about the ratio of their reciprocal throughputs on
/// processors of 2015 to 2025 (Fog, "Instruction tables", <https://agner.org/optimize>).
const QUOTIENT: u64 = 4;
/// The cost of an exponential or similar function: those of [`super::elementary`] are straight lines of 20 to 40 sums
/// and products.
const TRANSCENDENTAL: u64 = 25;

impl Operations {
    /// The total cost, in units of a sum.
    #[must_use]
    pub fn weighted(&self) -> u64 {
        self.sums
            + self.products
            + self.choices
            + QUOTIENT * (self.quotients + self.roots)
            + TRANSCENDENTAL * self.transcendental
    }

    /// The differences between these counts and `others`, with 0 in place of negative ones.
    #[must_use]
    pub fn beyond(&self, others: &Self) -> Self {
        let each = |of: fn(&Self) -> u64| of(self).saturating_sub(of(others));
        Self {
            sums: each(|o| o.sums),
            products: each(|o| o.products),
            choices: each(|o| o.choices),
            quotients: each(|o| o.quotients),
            roots: each(|o| o.roots),
            transcendental: each(|o| o.transcendental),
        }
    }
}

thread_local! {
    /// The operations counted on this thread.
    static TALLY: Cell<Operations> = const { Cell::new(Operations {
        sums: 0, products: 0, choices: 0, quotients: 0, roots: 0, transcendental: 0,
    }) };
}

/// Runs `work` and returns its result, and the operations that it does on this thread.
pub fn counting<R>(work: impl FnOnce() -> R) -> (R, Operations) {
    let before = TALLY.get();
    let result = work();
    (result, TALLY.get().beyond(&before))
}

/// Adds to the tally. It is called rather than inlined into formulas, which would grow with every operation.
#[inline(never)]
fn tally(add: fn(&mut Operations)) {
    let mut operations = TALLY.get();
    add(&mut operations);
    TALLY.set(operations);
}

fn transcendental(value: f64) -> Counted {
    tally(|o| o.transcendental += 1);
    Counted(value)
}

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        tally(|o| o.sums += 1);
        Self(-self.0)
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $count:ident) => {
        impl $trait for Counted {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                tally(|o| o.$count += 1);
                Self(self.0.$method(other.0))
            }
        }
    };
}
operator!(Add, add, sums);
operator!(Sub, sub, sums);
operator!(Mul, mul, products);
operator!(Div, div, quotients);

impl Scalar for Counted {
    type Real = Self;

    fn from_real(value: Self) -> Self {
        value
    }
    fn value(self) -> Self {
        self
    }
    fn exp(self) -> Self {
        transcendental(Scalar::exp(self.0))
    }
    fn ln(self) -> Self {
        transcendental(Scalar::ln(self.0))
    }
    fn ln_1p(self) -> Self {
        transcendental(Scalar::ln_1p(self.0))
    }
    fn sqrt(self) -> Self {
        tally(|o| o.roots += 1);
        Self(self.0.sqrt())
    }
    fn sin(self) -> Self {
        transcendental(Scalar::sin(self.0))
    }
    fn erfc(self) -> Self {
        transcendental(Scalar::erfc(self.0))
    }
    fn if_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self {
        tally(|o| o.choices += 1);
        if a.0 < b.0 { then } else { otherwise }
    }
}

impl Real for Counted {
    const TINY: Self = Self(f64::TINY);

    fn literal(value: f64) -> Self {
        Self(value)
    }
    fn ln_of_sum(self, rest: Self) -> Self {
        transcendental(Real::ln_of_sum(self.0, rest.0))
    }
    fn atan2(self, x: Self) -> Self {
        transcendental(Real::atan2(self.0, x.0))
    }
    fn whole(self) -> usize {
        tally(|o| o.choices += 1);
        self.0.whole()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_what_a_formula_does() {
        let x = Counted(2.0);
        let (value, found) = counting(|| Scalar::exp(-(x * x)) / (x + Counted(1.0)).sqrt());
        assert_eq!(value.0, Scalar::exp(-4.0_f64) / 3.0_f64.sqrt());
        let expected =
            Operations { sums: 2, products: 1, quotients: 1, roots: 1, transcendental: 1, choices: 0 };
        assert_eq!(found, expected);
        assert_eq!(found.weighted(), 2 + 1 + 4 + 4 + 25);
    }
}
