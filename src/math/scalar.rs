//! The scalar that every formula is generic over.
//!
//! A formula is written once, for any [`Scalar`] `T`. It mixes two kinds of numbers: *parameters* (type `T`), which
//! may carry derivatives, and *geometry* (type `T::Real`), which never does. This avoids carrying zero derivatives
//! through arithmetic that cannot depend on a parameter.
//!
//! Formulas choose between two expressions with [`Scalar::if_less`] instead of `if`, so that the same code can run on
//! several samples at a time (lanes have no single truth value). In the same spirit they read tables by [`Scalar::look_up`], which numbers
//! that record what is done to them can follow.

use super::count;
use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// The type of a parameter: `f64`, `f32`, a [`Dual`](super::Dual), or a foreign type under test.
///
/// The four operations are available for `T` op `T::Real`; the parameter is on the left.
pub trait Scalar:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<Self::Real, Output = Self>
    + Sub<Self::Real, Output = Self>
    + Mul<Self::Real, Output = Self>
    + Div<Self::Real, Output = Self>
{
    /// The plain number underneath, without derivatives.
    type Real: Real;

    /// A constant, whose derivatives are zero.
    fn from_real(value: Self::Real) -> Self;

    /// The value without its derivatives.
    fn value(self) -> Self::Real;

    /// e^self.
    #[must_use]
    fn exp(self) -> Self;

    /// Natural logarithm.
    #[must_use]
    fn ln(self) -> Self;

    /// ln(1 + self), accurate near zero.
    #[must_use]
    #[inline(always)]
    fn ln_1p(self) -> Self {
        // self - at is 0, but carries the derivative.
        let at: Self::Real = self.value();
        let slope: Self::Real = at.plus(1.0).recip();
        (self - at) * slope + at.ln_1p()
    }

    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self;

    /// Square roots of two positive numbers, with the derivatives of both from a single division.
    #[inline(always)]
    #[must_use]
    fn sqrt_pair(a: Self, b: Self) -> (Self, Self) {
        (a.sqrt(), b.sqrt())
    }

    /// Sine of an angle in radians.
    #[must_use]
    fn sin(self) -> Self;

    /// Complementary error function, accurate where erf is close to 1.
    #[must_use]
    fn erfc(self) -> Self;

    /// `then` if `a < b`, otherwise `otherwise` (also if either is NaN).
    #[must_use]
    fn if_less(a: Self::Real, b: Self::Real, then: Self, otherwise: Self) -> Self;

    /// The cell of a table that a place falls into, counted from the first row. Places outside belong to the nearest cell, and NaN to
    /// the first.
    ///
    /// # Panics
    /// Panics if the table has fewer than two rows.
    #[must_use]
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "the cell is kept inside the table")]
    fn look_up<const N: usize>(rows: &[[Self; N]], place: Self::Real) -> Cell<Self, N> {
        let number = place.whole().min(rows.len() - 2);
        Cell { start: rows[number], end: rows[number + 1], number: Self::Real::literal(count(number)) }
    }

    /// A constant given as a literal.
    #[must_use]
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::from_real(Self::Real::literal(value))
    }

    /// self + literal.
    #[must_use]
    #[inline(always)]
    fn plus(self, literal: f64) -> Self {
        self + Self::Real::literal(literal)
    }

    /// self * literal.
    #[must_use]
    #[inline(always)]
    fn times(self, literal: f64) -> Self {
        self * Self::Real::literal(literal)
    }

    /// 1 / self.
    #[must_use]
    #[inline(always)]
    fn recip(self) -> Self {
        Self::constant(1.0) / self
    }

    /// self^2.
    #[must_use]
    #[inline(always)]
    fn squared(self) -> Self {
        self * self
    }
}

/// Two neighbouring rows of a table.
#[derive(Clone, Copy, Debug)]
pub struct Cell<T: Scalar, const N: usize> {
    /// The row at the cell's start.
    pub start: [T; N],
    /// The row at its end.
    pub end: [T; N],
    /// How many cells lie before it.
    pub number: T::Real,
}

/// A plain number: `f64` or `f32`.
pub trait Real: Scalar<Real = Self> {
    /// A number that replaces 0 if a logarithm, the derivative of a root or a quotient would be infinite. In double
    /// precision even its fifth root is negligible beside 1; in single precision it is as small as the type allows.
    const TINY: Self;

    /// The nearest representable number.
    fn literal(value: f64) -> Self;

    /// ln(self + rest) for a positive normal number and a rest that is tiny beside it, such as its own rounding error.
    #[must_use]
    fn ln_of_sum(self, rest: Self) -> Self;

    /// Angle of the point (x, self), radians in (-pi, pi].
    #[must_use]
    fn atan2(self, x: Self) -> Self;

    /// The integer part of a number; 0 if it is negative or NaN.
    #[must_use]
    fn whole(self) -> usize;

    /// The lesser of two numbers; `other` if either is NaN.
    #[must_use]
    #[inline(always)]
    fn lesser(self, other: Self) -> Self {
        Self::if_less(self, other, self, other)
    }

    /// The greater of two numbers; `self` if either is NaN.
    #[must_use]
    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        Self::if_less(self, other, other, self)
    }

    /// self^5, by three multiplications.
    #[must_use]
    #[inline(always)]
    fn fifth_power(self) -> Self {
        let square: Self = self * self;
        let fourth: Self = square * square;
        fourth * self
    }
}
