//! `f64` and `f32` as scalars.

use super::elementary;
use super::scalar::{Real, Scalar};

// A function that is not inlined into the loop that calls it prevents the loop from being vectorised, hence
// `inline(always)` here and in `dual.rs`. The smaller type uses the functions of the larger one, which costs it no
// more than a conversion.
macro_rules! plain_number {
    ($float:ident, $tiny:literal) => {
        impl Scalar for $float {
            type Real = $float;

            #[inline(always)]
            fn from_real(value: $float) -> Self {
                value
            }
            #[inline(always)]
            fn value(self) -> $float {
                self
            }
            #[inline(always)]
            fn exp(self) -> Self {
                Self::literal(elementary::exp(f64::from(self)))
            }
            #[inline(always)]
            fn ln(self) -> Self {
                Self::literal(elementary::ln(f64::from(self)))
            }
            #[inline(always)]
            fn ln_1p(self) -> Self {
                Self::literal(elementary::ln_1p(f64::from(self)))
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                $float::sqrt(self)
            }
            #[inline(always)]
            fn sin(self) -> Self {
                $float::sin(self)
            }
            #[inline(always)]
            fn erfc(self) -> Self {
                Self::literal(elementary::erfc(f64::from(self)))
            }
            #[inline(always)]
            fn if_less(a: $float, b: $float, then: Self, otherwise: Self) -> Self {
                if a < b { then } else { otherwise }
            }
        }

        impl Real for $float {
            const TINY: Self = $tiny;

            #[allow(
                clippy::cast_possible_truncation,
                reason = "rounding to the type is what the function is for"
            )]
            #[inline(always)]
            fn literal(value: f64) -> Self {
                value as $float
            }
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "rounding down and saturating is what the function is for"
            )]
            #[inline(always)]
            fn whole(self) -> usize {
                self as usize
            }
            #[inline(always)]
            fn ln_of_sum(self, rest: Self) -> Self {
                Self::literal(elementary::ln_of_sum(f64::from(self), f64::from(rest)))
            }
            #[inline(always)]
            fn atan2(self, x: Self) -> Self {
                Self::literal(elementary::atan2(f64::from(self), f64::from(x)))
            }
        }
    };
}

plain_number!(f64, 1e-300);
plain_number!(f32, 1e-37);

#[cfg(test)]
mod tests {
    use super::*;

    // The result is computed in f64 and rounded once, so it is the nearest f32 or, rarely, its neighbour.
    #[test]
    fn single_precision_is_rounded_once() {
        let close = |found: f32, exact: f64| {
            let exact = f32::literal(exact);
            assert!((exact.next_down()..=exact.next_up()).contains(&found), "{found:e}, not {exact:e}");
        };
        for i in 1..20_000_u16 {
            let x = f32::from(i) * 1e-3;
            let wide = f64::from(x);
            close(Scalar::exp(-x), libm::exp(-wide));
            close(Scalar::ln(x), libm::log(wide));
            close(Scalar::erfc(x * 0.5), libm::erfc(wide * 0.5));
            close(Scalar::ln_1p(x), libm::log1p(wide));
            close(Real::atan2(x, -0.7), libm::atan2(wide, f64::from(-0.7_f32)));
        }
        assert_eq!(Scalar::exp(89.0_f32), f32::INFINITY);
        assert!(Scalar::ln(-1.0_f32).is_nan());
    }
}
