//! Numbers with twice the digits of f64, to find how many of its digits a formula keeps.
//!
//! A [`Wide`] is the unevaluated sum of two doubles, the second at most half a unit in the last place of the first
//! (Dekker 1971, doi:10.1007/BF01397083; Joldes, Muller and Popescu 2017, doi:10.1145/3121432). It has about 32 digits
//! in the range of f64. Every function keeps at least 28 of them against mpmath (the tests below), 12 more than f64
//! has. It is slow and meant for checks only. An infinite number has no second part, so 1/0 and overflow behave as
//! with f64.
//!
//! The library `twofloat` 0.8.4 has the same functions, but its quotients, exponentials and logarithms were found to
//! keep only 16, 11 and 12 digits.

use super::elementary;
use super::scalar::{Real, Scalar};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// The sum of two doubles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wide {
    high: f64,
    low: f64,
}

/// 0.
const ZERO: Wide = Wide { high: 0.0, low: 0.0 };
/// 1.
const ONE: Wide = Wide { high: 1.0, low: 0.0 };
/// ln 2.
const LN_2: Wide = Wide { high: std::f64::consts::LN_2, low: 2.319_046_813_846_299_6e-17 };
/// pi/2.
const HALF_PI: Wide = Wide { high: std::f64::consts::FRAC_PI_2, low: 6.123_233_995_736_766e-17 };
/// 1/sqrt(pi).
const INVERSE_ROOT_PI: Wide = Wide { high: 0.564_189_583_547_756_3, low: 7.667_729_806_582_94e-18 };

impl Wide {
    /// The nearest double.
    #[must_use]
    pub fn rounded(self) -> f64 {
        self.high
    }

    /// The absolute value.
    #[must_use]
    pub fn abs(self) -> Self {
        if self.high < 0.0 { -self } else { self }
    }

    /// high + low, where low is much smaller than high.
    fn normalised(high: f64, low: f64) -> Self {
        let sum = high + low;
        // Beyond the range of f64 there is no second part, because infinity minus infinity is NaN.
        if sum.is_finite() {
            Self { high: sum, low: low - (sum - high) }
        } else {
            Self { high: sum, low: 0.0 }
        }
    }

    /// self 2^power, exactly. It is applied as two factors, because a single one may be out of range even if the
    /// product is not.
    fn scaled(self, power: i32) -> Self {
        let half = power / 2;
        let (a, b) = (2.0_f64.powi(half), 2.0_f64.powi(power - half));
        Self { high: self.high * a * b, low: self.low * a * b }
    }

    /// e^self - 1 for |self| < 1, without cancellation.
    fn exp_m1(self) -> Self {
        // Taylor's series at a sixteenth of the argument, whose eighteenth term is below 1e-37; then e^2x - 1 = (e^x -
        // 1)(e^x + 1).
        let x = self.scaled(-4);
        let mut sum = ZERO;
        for k in (1..=18).rev() {
            sum = x / Self::literal(f64::from(k)) * (sum + ONE);
        }
        (0..4).fold(sum, |sum, _| sum * (sum + Self::literal(2.0)))
    }

    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self) {
        let turns = (self.high / HALF_PI.high).round();
        let x = self - HALF_PI * Self::literal(turns);
        let square: Self = x * x;
        // Series up to x^33 and x^32 for |x| <= pi/4: the next terms are below 1e-40.
        let (mut sin, mut cos) = (ONE, ONE);
        for k in (1..=16).rev() {
            let k = 2.0 * f64::from(k);
            sin = ONE - square / Self::literal(k * (k + 1.0)) * sin;
            cos = ONE - square / Self::literal(k * (k - 1.0)) * cos;
        }
        sin = sin * x;
        match turns.rem_euclid(4.0) {
            0.0 => (sin, cos),
            1.0 => (cos, -sin),
            2.0 => (-sin, -cos),
            _ => (-cos, sin),
        }
    }
}

impl Neg for Wide {
    type Output = Self;
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Add for Wide {
    type Output = Self;
    #[inline(never)]
    fn add(self, other: Self) -> Self {
        // Knuth's two-sum of both parts, exact except for the rounding of the remainder.
        let two_sum = |a: f64, b: f64| {
            let sum = a + b;
            let of_b = sum - a;
            (sum, (a - (sum - of_b)) + (b - of_b))
        };
        let (high, rest) = two_sum(self.high, other.high);
        if !high.is_finite() {
            return Self { high, low: 0.0 };
        }
        let (low, last) = two_sum(self.low, other.low);
        let first = Self::normalised(high, rest + low);
        Self::normalised(first.high, first.low + last)
    }
}

impl Sub for Wide {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Wide {
    type Output = Self;
    #[inline(never)]
    fn mul(self, other: Self) -> Self {
        let high = self.high * other.high;
        if !high.is_finite() {
            return Self { high, low: 0.0 };
        }
        // The error of the product is exact, with a single rounding.
        let rest = self.high.mul_add(other.high, -high);
        Self::normalised(high, rest + (self.high * other.low + self.low * other.high))
    }
}

impl Div for Wide {
    type Output = Self;
    #[inline(never)]
    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        // Dividing by infinity leaves no remainder, and dividing by 0 leaves none that can be used.
        if !first.is_finite() || !other.high.is_finite() {
            return Self { high: first, low: 0.0 };
        }
        let rest = self - other * Self::literal(first);
        let second = rest.high / other.high;
        let rest = rest - other * Self::literal(second);
        Self::normalised(first, second) + Self::literal(rest.high / other.high)
    }
}

impl Scalar for Wide {
    type Real = Self;

    fn from_real(value: Self) -> Self {
        value
    }
    fn value(self) -> Self {
        self
    }
    #[inline(never)]
    fn exp(self) -> Self {
        // Beyond these limits the result is out of the range of f64.
        if self.high > 710.0 || self.high.is_nan() {
            return Self { high: self.high.exp(), low: 0.0 };
        }
        if self.high < -746.0 {
            return ZERO;
        }
        let powers = (self.high / LN_2.high).round();
        let rest = self - LN_2 * Self::literal(powers);
        #[expect(clippy::cast_possible_truncation, reason = "between -1077 and 1025")]
        (rest.exp_m1() + ONE).scaled(powers as i32)
    }
    #[inline(never)]
    fn ln(self) -> Self {
        let start = self.high.ln();
        if self.high <= 0.0 || !start.is_finite() {
            return Self { high: start, low: 0.0 };
        }
        // x = 2^n y; Newton's method for ln(y), on e^a - 1, starts from all the digits of f64 and doubles them.
        let powers = (start / LN_2.high).round();
        #[expect(clippy::cast_possible_truncation, reason = "between -1075 and 1025")]
        let y = self.scaled(-(powers as i32));
        LN_2 * Self::literal(powers) + (y - ONE).ln_1p_near()
    }
    fn ln_1p(self) -> Self {
        if self.high.abs() < 0.4 { self.ln_1p_near() } else { (self + ONE).ln() }
    }
    #[inline(never)]
    fn sqrt(self) -> Self {
        let root = self.high.sqrt();
        if root == 0.0 || !root.is_finite() {
            return Self { high: root, low: 0.0 };
        }
        let start = Self::literal(root);
        start + (self - start * start) / Self::literal(2.0 * root)
    }
    #[inline(never)]
    fn sin(self) -> Self {
        self.sin_cos().0
    }
    #[inline(never)]
    fn erfc(self) -> Self {
        let x = self.abs();
        let of_abs = if x.high > 27.3 || x.high.is_nan() {
            Self::literal(elementary::erfc(x.high))
        } else if x.high < 3.0 {
            // erf = 2/sqrt(pi) exp(-x^2) sum 2^n x^(2n+1)/(2n+1)!! (Abramowitz and Stegun 1964, 7.1.6); 1 - erf loses
            // five digits at most.
            let square: Self = x * x;
            let sum =
                (1..=90).rev().fold(ONE, |sum, n| ONE + sum * square / Self::literal(f64::from(n) + 0.5));
            ONE - (-square).exp() * x * sum * INVERSE_ROOT_PI * Self::literal(2.0)
        } else {
            // sqrt(pi) exp(x^2) erfc = 1/(x + (1/2)/(x + 1/(x + (3/2)/(x + ...)))) (7.1.14).
            let below = (1..=140).rev().fold(x, |below, k| x + Self::literal(0.5 * f64::from(k)) / below);
            (-(x * x)).exp() * INVERSE_ROOT_PI / below
        };
        if self.high < 0.0 { Self::literal(2.0) - of_abs } else { of_abs }
    }
    fn if_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self {
        if a.high < b.high || (a.high <= b.high && a.low < b.low) { then } else { otherwise }
    }
}

impl Wide {
    /// ln(1 + self) for -1/2 < self < 1.
    fn ln_1p_near(self) -> Self {
        let start = Self::literal(self.high.ln_1p());
        let power = start.exp_m1();
        start + (self - power) / (power + ONE)
    }
}

impl Real for Wide {
    const TINY: Self = Self { high: 1e-300, low: 0.0 };

    fn literal(value: f64) -> Self {
        Self { high: value, low: 0.0 }
    }
    fn ln_of_sum(self, rest: Self) -> Self {
        (self + rest).ln()
    }
    #[inline(never)]
    fn atan2(self, x: Self) -> Self {
        let start = self.high.atan2(x.high);
        let radius = (self * self + x * x).sqrt();
        if radius.high == 0.0 || !radius.high.is_finite() {
            return Self::literal(start);
        }
        // The remaining angle, whose sine is known to all its digits.
        let start = Self::literal(start);
        let (sin, cos) = start.sin_cos();
        start + (self * cos - x * sin) / radius
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "rounding down and saturating is what the function is for"
    )]
    fn whole(self) -> usize {
        // The first part is an integer, and the second part may be below it.
        let whole = self.high.floor();
        (if whole >= self.high && self.low < 0.0 { whole - 1.0 } else { whole }) as usize
    }
}

#[cfg(test)]
#[expect(clippy::unreadable_literal, reason = "as mpmath prints them")]
mod tests {
    use super::*;

    /// |found/exact - 1|, with the exact value as a sum of two doubles.
    fn error(found: Wide, exact: (f64, f64)) -> f64 {
        let exact = Wide::normalised(exact.0, exact.1);
        ((found - exact) / exact).rounded().abs()
    }

    /// Values by mpmath at 90 digits, each rounded to the sum of two doubles.
    #[test]
    fn twenty_eight_digits() {
        type Case = (f64, f64, f64);
        type Function = (&'static str, fn(Wide) -> Wide, &'static [Case]);
        let functions: [Function; 6] = [
            (
                "exp",
                Scalar::exp,
                &[
                    (-87.5, 9.982350930569248e-39, -5.412148383948367e-57),
                    (-1.3, 0.2725317930340126, -1.6829627435184408e-18),
                    (-1e-09, 0.999999999, -2.778193152587354e-17),
                    (0.3, 1.3498588075760032, -9.447314673432387e-17),
                    (5.75, 314.1906602856942, -9.087484746164239e-15),
                    (300.1, 2.1467131625231985e+130, -1.2143805928062731e+114),
                ],
            ),
            (
                "ln",
                Scalar::ln,
                &[
                    (1e-200, -460.51701859880916, 2.2080942657241066e-14),
                    (0.013, -4.3428059215206005, 1.5867610767519736e-16),
                    (0.9999999, -1.0000000494736474e-07, -5.529865283193222e-24),
                    (1.0000001, 9.999999505838704e-08, 1.5249709528441489e-24),
                    (2.5, 0.9162907318741551, -4.141195369011963e-17),
                    (1e+150, 345.38776394910684, 1.1828413230444957e-14),
                ],
            ),
            (
                "ln_1p",
                Scalar::ln_1p,
                &[
                    (-0.99, -4.605170185988091, 4.341512446764495e-16),
                    (-0.3, -0.35667494393873234, -2.6895094047056423e-17),
                    (-1e-12, -1.0000000000005e-12, 2.4217939436345712e-29),
                    (1e-20, 1e-20, -5e-41),
                    (0.4, 0.33647223662121295, -3.704625908593426e-18),
                    (7.5, 2.1400661634962708, 2.824867970189398e-18),
                    (1000000000.0, 20.72326583794641, 6.276142870575942e-16),
                ],
            ),
            (
                "sqrt",
                Scalar::sqrt,
                &[
                    (3.0, 1.7320508075688772, 1.0035084221806903e-16),
                    (1e-30, 1e-15, -3.6037189572868085e-32),
                    (0.7, 0.8366600265340756, -4.12265279558505e-17),
                ],
            ),
            (
                "sin",
                Scalar::sin,
                &[
                    (1e-08, 1e-08, -1.6666666666666668e-25),
                    (0.3, 0.29552020666133955, 1.8315357276792536e-17),
                    (1.5, 0.9974949866040544, -1.4558643538840918e-17),
                    (3.0, 0.1411200080598672, 8.577269787017502e-18),
                    (-2.2, -0.8084964038195901, 1.2844576299244281e-17),
                    (100.0, -0.5063656411097588, -3.050947053792115e-18),
                ],
            ),
            // Between 2 and 3, the subtraction from 1 loses five of the 32 digits.
            (
                "erfc",
                Scalar::erfc,
                &[
                    (-3.5, 1.9999992569016276, 4.9647279187212204e-17),
                    (-0.4, 1.4283923550466684, 8.262873871434374e-17),
                    (1e-10, 0.999999999887162, 4.44874363735484e-17),
                    (0.5, 0.4795001221869535, -1.900077467916287e-17),
                    (1.7, 0.01620954140922544, -2.044440186672801e-20),
                    (2.9, 4.109787809945886e-05, 4.912754141041331e-22),
                    (3.1, 1.1648657367199589e-05, 4.0306267103274617e-22),
                    (6.5, 3.8421483271206475e-20, -2.4455816825736104e-37),
                    (15.25, 3.6865151492308134e-103, 3.801937808599602e-120),
                ],
            ),
        ];
        for (name, function, cases) in functions {
            for &(x, high, low) in cases {
                let error = error(function(Wide::literal(x)), (high, low));
                let most = if name == "erfc" { 1e-26 } else { 1e-28 };
                assert!(error < most, "{name}({x}): {error:e}");
            }
        }
        for (y, x, high, low) in [
            (1e-9, 1.0, 1e-09, -3.3333333333333338e-28),
            (0.3, -0.7, 2.7367008673047097, 6.667662545167815e-17),
            (-2.0, 1e-5, -1.5707913267948967, 8.638998719835093e-17),
            (1.0, 2.0, 0.4636476090008061, 2.2698777452961687e-17),
            (-1e-3, -1.0, -3.1405926539231266, 2.15270241598307e-16),
        ] {
            let error = error(Wide::literal(y).atan2(Wide::literal(x)), (high, low));
            assert!(error < 1e-28, "atan2({y}, {x}): {error:e}");
        }
    }

    /// Identities that hold for any argument, to the last digits.
    #[test]
    fn arithmetic() {
        for i in 1..400 {
            let [a, b] = [0.731, 0.0137].map(|step| Wide::literal(f64::from(i) * step).sqrt());
            for (found, expected) in
                [(a / b * b, a), (a + b - b, a), ((a * b).sqrt() * (a * b).sqrt(), a * b), (a.ln().exp(), a)]
            {
                assert!(((found - expected) / expected).rounded().abs() < 2e-30, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn ends_of_the_range() {
        let infinite = ONE / ZERO;
        assert_eq!(infinite.rounded(), f64::INFINITY);
        assert_eq!((ONE / infinite).rounded(), 0.0);
        assert_eq!((Wide::literal(1e300) * Wide::literal(1e300)).rounded(), f64::INFINITY);
        assert_eq!(Wide::literal(-800.0).exp().rounded(), 0.0);
        assert_eq!(Wide::literal(800.0).exp().rounded(), f64::INFINITY);
        assert_eq!(ZERO.ln().rounded(), f64::NEG_INFINITY);
        assert_eq!(ZERO.sqrt().rounded(), 0.0);
        assert_eq!(Wide::literal(30.0).erfc().rounded(), 0.0);
        assert!((infinite - infinite).rounded().is_nan());
        assert_eq!(
            [Wide::literal(2.0) - Wide::literal(1e-20), Wide::literal(2.7), -ONE].map(Real::whole),
            [1, 2, 0]
        );
    }
}
