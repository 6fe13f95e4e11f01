//! Passing parameter values to a model.

use crate::math::Scalar;

/// Parameter values, handed out in the order in which the model declares its parameters.
///
/// A missing value is NaN, so that a mismatch shows up as a result that is not finite.
#[derive(Clone, Debug)]
pub struct Values<'a, T> {
    remaining: &'a [T],
}

impl<'a, T: Scalar> Values<'a, T> {
    /// Starts at the first of `values`.
    #[must_use]
    pub fn new(values: &'a [T]) -> Self {
        Self { remaining: values }
    }

    /// Takes the next `N` values.
    pub fn take<const N: usize>(&mut self) -> [T; N] {
        std::array::from_fn(|_| match self.remaining.split_first() {
            Some((&value, rest)) => {
                self.remaining = rest;
                value
            }
            None => T::constant(f64::NAN),
        })
    }
}
