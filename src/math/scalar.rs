//! The scalar that every formula is generic over.
//!
//! A formula is written once, for any [`Scalar`] `T`. It mixes two kinds of numbers: *parameters*
//! (type `T`), which may carry derivatives, and *geometry* (type `T::Real`), which never does. The
//! split keeps dual numbers from carrying zeros through arithmetic that cannot depend on a parameter.
//!
//! Formulas choose between two expressions with [`Scalar::if_less`] instead of `if`, so that the same
//! text can later run on several samples at a time (lanes have no single truth value).

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number that a parameter can be: `f64`, `f32`, a [`Dual`](super::Dual), or a foreign type under test.
///
/// `T` op `T::Real` is available for the four operations; the parameter stands on the left.
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

    /// A constant: its derivatives are zero.
    fn from_real(value: Self::Real) -> Self;

    /// The value without its derivatives.
    fn value(self) -> Self::Real;

    /// e^self.
    #[must_use]
    fn exp(self) -> Self;

    /// Natural logarithm.
    #[must_use]
    fn ln(self) -> Self;

    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self;

    /// Sine of an angle in radians.
    #[must_use]
    fn sin(self) -> Self;

    /// Complementary error function, accurate where erf is close to 1.
    #[must_use]
    fn erfc(self) -> Self;

    /// `then` where `a < b`, else `otherwise` (also where either is NaN).
    #[must_use]
    fn if_less(a: Self::Real, b: Self::Real, then: Self, otherwise: Self) -> Self;

    /// A literal.
    #[must_use]
    fn constant(value: f64) -> Self {
        Self::from_real(Self::Real::literal(value))
    }

    /// self + literal.
    #[must_use]
    fn plus(self, literal: f64) -> Self {
        self + Self::Real::literal(literal)
    }

    /// self * literal.
    #[must_use]
    fn times(self, literal: f64) -> Self {
        self * Self::Real::literal(literal)
    }

    /// 1 / self.
    #[must_use]
    fn recip(self) -> Self {
        Self::constant(1.0) / self
    }

    /// self^2.
    #[must_use]
    fn squared(self) -> Self {
        self * self
    }
}

/// A plain number: `f64` or `f32`.
pub trait Real: Scalar<Real = Self> {
    /// The nearest representable number.
    fn literal(value: f64) -> Self;

    /// ln(1 + self), accurate near zero.
    #[must_use]
    fn ln_1p(self) -> Self;

    /// Angle of the point (x, self), radians in (-pi, pi].
    #[must_use]
    fn atan2(self, x: Self) -> Self;

    /// The lesser of two numbers; `other` where either is NaN.
    #[must_use]
    fn lesser(self, other: Self) -> Self {
        Self::if_less(self, other, self, other)
    }

    /// The greater of two numbers; `self` where either is NaN.
    #[must_use]
    fn greater(self, other: Self) -> Self {
        Self::if_less(self, other, other, self)
    }

    /// self^5 by three multiplications.
    #[must_use]
    fn fifth_power(self) -> Self {
        let square: Self = self * self;
        let fourth: Self = square * square;
        fourth * self
    }
}

macro_rules! plain_number {
    ($float:ident, $erfc:path) => {
        impl Scalar for $float {
            type Real = $float;

            fn from_real(value: $float) -> Self {
                value
            }
            fn value(self) -> $float {
                self
            }
            fn exp(self) -> Self {
                $float::exp(self)
            }
            fn ln(self) -> Self {
                $float::ln(self)
            }
            fn sqrt(self) -> Self {
                $float::sqrt(self)
            }
            fn sin(self) -> Self {
                $float::sin(self)
            }
            fn erfc(self) -> Self {
                $erfc(self)
            }
            fn if_less(a: $float, b: $float, then: Self, otherwise: Self) -> Self {
                if a < b { then } else { otherwise }
            }
        }

        impl Real for $float {
            #[allow(
                clippy::cast_possible_truncation,
                reason = "rounding a literal to the type is what the function is for"
            )]
            fn literal(value: f64) -> Self {
                value as $float
            }
            fn ln_1p(self) -> Self {
                $float::ln_1p(self)
            }
            fn atan2(self, x: Self) -> Self {
                $float::atan2(self, x)
            }
        }
    };
}

plain_number!(f64, libm::erfc);
plain_number!(f32, libm::erfcf);
