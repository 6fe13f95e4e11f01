//! Dual numbers: values that carry their derivatives.
//!
//! A dual number a + sum_j a_j e_j with e_j e_k = 0 represents a value and its first derivatives with respect to N
//! parameters. Evaluating a formula on duals whose inputs are created by [`Dual::variable`] gives the exact
//! derivatives of that formula by the chain rule: there is no step size, and no second, hand-written derivative that
//! could differ from the value (forward-mode automatic differentiation; Griewank and Walther 2008, ch. 3).

use super::scalar::{Real, Scalar};
use std::array;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value and its derivatives with respect to `N` parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<R, const N: usize> {
    /// The value.
    pub value: R,
    /// The derivative with respect to each parameter, in the parameter's own unit.
    pub partials: [R; N],
}

impl<R: Real, const N: usize> Dual<R, N> {
    /// The `index`-th of the `N` parameters, at `value`. An index of `N` or more makes it a constant.
    #[must_use]
    #[inline(always)]
    pub fn variable(value: R, index: usize) -> Self {
        Self { value, partials: array::from_fn(|j| R::literal(if j == index { 1.0 } else { 0.0 })) }
    }

    /// Applies the chain rule, given the value and the derivative of a function at this point.
    #[must_use]
    #[inline(always)]
    fn chain(self, value: R, slope: R) -> Self {
        Self { value, partials: self.partials.map(|p| p * slope) }
    }

    /// Combines the partials of two numbers pair by pair.
    #[must_use]
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "all three arrays have N entries")]
    fn zip(self, other: Self, value: R, f: impl Fn(R, R) -> R) -> Self {
        Self { value, partials: array::from_fn(|j| f(self.partials[j], other.partials[j])) }
    }
}

impl<R: Real, const N: usize> Neg for Dual<R, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: -self.value, partials: self.partials.map(|p| -p) }
    }
}

impl<R: Real, const N: usize> Add for Dual<R, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, self.value + other.value, |a, b| a + b)
    }
}

impl<R: Real, const N: usize> Sub for Dual<R, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, self.value - other.value, |a, b| a - b)
    }
}

#[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule adds")]
impl<R: Real, const N: usize> Mul for Dual<R, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (x, y) = (self.value, other.value);
        self.zip(other, x * y, |a, b| a * y + b * x)
    }
}

#[expect(clippy::suspicious_arithmetic_impl, reason = "the quotient rule multiplies and subtracts")]
impl<R: Real, const N: usize> Div for Dual<R, N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let inverse = other.value.recip();
        let quotient: R = self.value * inverse;
        self.zip(other, quotient, |a, b| (a - b * quotient) * inverse)
    }
}

// With a plain number on the right, only the value and one factor change. `R` itself cannot implement these operators
// for the foreign type `Dual`, hence "parameter on the left".
macro_rules! with_real {
    ($float:ident) => {
        impl<const N: usize> Add<$float> for Dual<$float, N> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: $float) -> Self {
                Self { value: self.value + other, partials: self.partials }
            }
        }
        impl<const N: usize> Sub<$float> for Dual<$float, N> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: $float) -> Self {
                Self { value: self.value - other, partials: self.partials }
            }
        }
        impl<const N: usize> Mul<$float> for Dual<$float, N> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: $float) -> Self {
                self.chain(self.value * other, other)
            }
        }
        impl<const N: usize> Div<$float> for Dual<$float, N> {
            type Output = Self;
            #[inline(always)]
            fn div(self, other: $float) -> Self {
                let inverse = other.recip();
                self.chain(self.value / other, inverse)
            }
        }
        impl<const N: usize> Scalar for Dual<$float, N> {
            type Real = $float;

            #[inline(always)]
            fn from_real(value: $float) -> Self {
                Self { value, partials: [0.0; N] }
            }
            #[inline(always)]
            fn value(self) -> $float {
                self.value
            }
            #[inline(always)]
            fn exp(self) -> Self {
                let e = Scalar::exp(self.value);
                self.chain(e, e)
            }
            #[inline(always)]
            fn ln(self) -> Self {
                self.chain(Scalar::ln(self.value), self.value.recip())
            }
            #[inline(always)]
            fn ln_1p(self) -> Self {
                self.chain(Scalar::ln_1p(self.value), (1.0 + self.value).recip())
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                let root = self.value.sqrt();
                self.chain(root, 0.5 / root)
            }
            #[inline(always)]
            fn sqrt_pair(a: Self, b: Self) -> (Self, Self) {
                let (root_a, root_b): ($float, $float) = (a.value.sqrt(), b.value.sqrt());
                // 1/(2 sqrt a) and 1/(2 sqrt b) over a common denominator
                let common = 0.5 / (root_a * root_b);
                (a.chain(root_a, common * root_b), b.chain(root_b, common * root_a))
            }
            #[inline(always)]
            fn sin(self) -> Self {
                self.chain(self.value.sin(), self.value.cos())
            }
            #[inline(always)]
            fn erfc(self) -> Self {
                // d erfc(x)/dx = -2/sqrt(pi) exp(-x^2)
                let slope = -std::$float::consts::FRAC_2_SQRT_PI * Scalar::exp(-self.value * self.value);
                self.chain(Scalar::erfc(self.value), slope)
            }
            #[inline(always)]
            fn if_less(a: $float, b: $float, then: Self, otherwise: Self) -> Self {
                if a < b { then } else { otherwise }
            }
        }
    };
}

with_real!(f64);
with_real!(f32);
