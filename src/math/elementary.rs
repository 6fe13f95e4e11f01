//! Elementary functions that a compiler can evaluate on several numbers at once.
//!
//! The standard library's `exp`, `ln`, `atan2` and the like call a platform's C library: a loop that contains one runs
//! number by number, and the last digit depends on the platform. The functions here are straight lines of additions,
//! multiplications, divisions, choices between two values that are both computed, and operations on the bits of a
//! double. There is no branch, table or call, so a loop over an array is vectorised on every instruction set. There is
//! no fused multiply-add, which the baseline lacks, so every machine gives the same bytes.
//!
//! The price is a little accuracy. The table lists the largest error found over random arguments against 50 digits, in
//! units in the last place (correct rounding: 0.5):
//!
//! | function | error | where |
//! |---|---|---|
//! | `exp` | 1.0 | everywhere |
//! | `ln` | 0.8 | everywhere |
//! | `ln_1p` | 0.8 | everywhere |
//! | `erfcx` | 4.0 | x >= 0 |
//! | `erfc` | 4.0 | x < 26 |
//! | `atan2` | 1.5 | finite arguments |
//! | `inverse_cbrt` | 1.3 | y a normal number |
//!
//! NaN gives NaN. Every constant without a name of its own comes from `scripts/elementary_coefficients.py`.

use super::scalar::Real;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4, LOG2_E, PI, SQRT_2};

/// 1.5 2^52: adding it to a number below 2^51 rounds that number to an integer, whose two's complement is then in the
/// low bits. Vector conversions between 64-bit integers and doubles came only with AVX-512.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// 2^52: putting an integer below 2^52 into the low bits of this gives the double 2^52 + integer.
const TWO_52: f64 = 4_503_599_627_370_496.0;

/// The larger part of ln 2. It ends in 21 zero bits, so its product with an exponent is exact.
const LN_2_HIGH: f64 = f64::from_bits(0x3fe6_2e42_fee0_0000);
/// The difference between ln 2 and [`LN_2_HIGH`].
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// The difference between pi and the nearest double, relative to pi.
const PI_REST: f64 = 1.224_646_799_147_353_2e-16 / PI;

/// The constant added to the exponent of a double when it is stored.
const EXPONENT_BIAS: u64 = 1023;
/// Number of bits of a double after the binary point.
const MANTISSA_BITS: u32 = 52;
/// A mask of the bits after the binary point.
const MANTISSA: u64 = (1 << MANTISSA_BITS) - 1;
/// The sign bit.
const SIGN: u64 = 1 << 63;

/// A polynomial by Horner's rule, with coefficients from the constant upwards.
macro_rules! polynomial {
    ($x:expr, [$constant:expr]) => { literal_like($x, $constant) };
    ($x:expr, [$constant:expr, $($rest:expr),+]) => {
        literal_like($x, $constant) + $x * polynomial!($x, [$($rest),+])
    };
}

/// A literal of the type of another number.
#[inline(always)]
fn literal_like<T: Real>(_: T, value: f64) -> T {
    T::literal(value)
}

/// The same with even and odd powers separate: two chains of half the length, which a processor evaluates in parallel.
macro_rules! long_polynomial {
    ($x:expr, [$($even:expr, $odd:expr),+]) => {
        polynomial!($x * $x, [$($even),+]) + $x * polynomial!($x * $x, [$($odd),+])
    };
}

/// e^x: infinity above 709.78, subnormal below -708.4, 0 below -745.13.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    // Beyond these limits the result stays as it is at the limit. NaN fails both comparisons.
    let x = if x > 710.0 { 710.0 } else { x };
    let x = if x < -746.0 { -746.0 } else { x };
    exp_of_sum(x, 0.0)
}

/// e^(high + low) for high in -1400..=710 and low below 1e-4.
///
/// x = k ln 2 + r with |r| <= (ln 2)/2 (Cody and Waite 1980, Software Manual for the Elementary Functions, ch. 6); e^r
/// = 1 + r + r^2 q(r), summed from the smallest term so that only the last addition has a noticeable rounding error.
#[inline(always)]
fn exp_of_sum(high: f64, low: f64) -> f64 {
    let k = (high * LOG2_E + ROUND) - ROUND;
    let high = high - k * LN_2_HIGH;
    let low = low - k * LN_2_LOW;
    let r = high + low;
    let q = long_polynomial!(
        r,
        [
            0.5000000000000001,
            0.1666666666666667,
            0.04166666666662412,
            0.008333333333326134,
            0.0013888888917215586,
            0.00019841269874822307,
            2.4801521293463862e-05,
            2.755725539833871e-06,
            2.762008948195459e-07,
            2.5105217695684516e-08
        ]
    );
    let rest = r * r * q;
    let power = 1.0 + (high + (low + rest));
    // 2^k is applied as two factors, because for the largest and the subnormal results 2^k itself is not a double. The
    // first product is exact, so a subnormal result is rounded only once.
    let half = 0.5 * k + ROUND;
    let other = (k - (half - ROUND)) + ROUND;
    power * power_of_two(half) * power_of_two(other)
}

/// 2^k for an integer k in -1022..=1023 given as k + [`ROUND`].
#[inline(always)]
fn power_of_two(rounded: f64) -> f64 {
    // The shift keeps the low twelve bits, where the bits of ROUND itself are zero.
    f64::from_bits(rounded.to_bits().wrapping_add(EXPONENT_BIAS) << MANTISSA_BITS)
}

/// Natural logarithm: -infinity at 0, NaN below.
#[inline(always)]
pub(crate) fn ln(x: f64) -> f64 {
    // The exponent bits of a subnormal number are 0, so it is first multiplied by 2^54.
    let subnormal = x < f64::MIN_POSITIVE;
    let scaled = if subnormal { x * 18_014_398_509_481_984.0 } else { x };
    let exponent = if subnormal { -54.0 } else { 0.0 };
    ln_at_limits(x, ln_of_normal(scaled, exponent, 0.0))
}

/// ln(1 + x), accurate near zero: -infinity at -1, NaN below.
///
/// The part that rounding removes from 1 + x, relative to the sum, is added to the logarithm (fdlibm, `s_log1p.c`, Sun
/// Microsystems 1993).
#[inline(always)]
pub(crate) fn ln_1p(x: f64) -> f64 {
    let sum = 1.0 + x;
    let lost = (x - (sum - 1.0)) / sum;
    ln_at_limits(sum, ln_of_normal(sum, 0.0, lost))
}

/// ln(x + rest) for a positive normal x and a rest of a few units in its last place.
#[inline(always)]
pub(crate) fn ln_of_sum(x: f64, rest: f64) -> f64 {
    ln_of_normal(x, 0.0, rest / x)
}

/// `logarithm`, or the logarithm of `x` if `x` is not a positive finite number.
#[inline(always)]
fn ln_at_limits(x: f64, logarithm: f64) -> f64 {
    let undefined = if x == 0.0 { f64::NEG_INFINITY } else { f64::NAN };
    let defined = if x > 0.0 { logarithm } else { undefined };
    if x == f64::INFINITY { x } else { defined }
}

/// ln(x 2^exponent) + `small` for a positive normal x.
///
/// x = 2^k (1 + f) with 1 + f in sqrt(1/2)..sqrt(2), s = f/(2 + f), and ln(1 + f) = f - f^2/2 + s (f^2/2 + s^2
/// q(s^2)). f is exact, so the relative error stays small near x = 1 (fdlibm, `e_log.c`, Sun Microsystems 1993).
#[inline(always)]
fn ln_of_normal(x: f64, exponent: f64, small: f64) -> f64 {
    /// The bits of sqrt(1/2), rounded to the upper half. Shifted by the difference between the bits of 1 and these,
    /// the exponent changes at sqrt(2) instead of 2.
    const SQRT_HALF: u64 = 0x3fe6_a09e_0000_0000;
    let moved = x.to_bits().wrapping_add(1.0_f64.to_bits() - SQRT_HALF);
    let biased = f64::from_bits((moved >> MANTISSA_BITS) | TWO_52.to_bits());
    let k = (biased - (TWO_52 + 1023.0)) + exponent;
    let f = f64::from_bits((moved & MANTISSA).wrapping_add(SQRT_HALF)) - 1.0;
    let (half_square, third) = ln_terms(f);
    let low = third + (k * LN_2_LOW + small);
    k * LN_2_HIGH + (f - (half_square - low))
}

/// f^2/2 and s (f^2/2 + s^2 q(s^2)), with s = f/(2 + f): the terms of ln(1 + f) after f, for 1 + f in sqrt(1/2)..sqrt(2).
#[inline(always)]
fn ln_terms<T: Real>(f: T) -> (T, T) {
    let s: T = f / f.plus(2.0);
    let z: T = s * s;
    let q: T = polynomial!(
        z,
        [
            0.666666666666667,
            0.39999999999898944,
            0.2857142862620096,
            0.22222211101577205,
            0.1818289133623783,
            0.1533165379922582,
            0.14617229114009048
        ]
    );
    let rest: T = z * q;
    let half_square: T = f.times(0.5) * f;
    (half_square, s * (half_square + rest))
}

/// `far`, or ln(1 + f) by its series where f is small.
fn ln_1p_or<T: Real>(f: T, far: T) -> T {
    let (half_square, third) = ln_terms(f);
    let (low, high) = (T::literal(FRAC_1_SQRT_2 - 1.0), T::literal(SQRT_2 - 1.0));
    let near: T = f - (half_square - third);
    T::if_less(low, f, T::if_less(f, high, near, far), far)
}

/// ln(1 + x) from a logarithm that may be rough near 1, for languages that have no other.
pub(crate) fn ln_1p_by_ln<T: Real>(x: T) -> T {
    ln_1p_or(x, x.plus(1.0).ln())
}

/// ln(x) from a logarithm that may be rough near 1: graphics processors promise no relative accuracy there.
pub(crate) fn ln_by_ln<T: Real>(x: T) -> T {
    ln_1p_or(x.plus(-1.0), x.ln())
}

/// Complementary error function, with a small relative error until it underflows beyond 26.5.
#[inline(always)]
pub(crate) fn erfc(x: f64) -> f64 {
    // Beyond this the result is 0 or 2, and every step below stays finite. NaN fails the comparison.
    let a = if x.abs() > 28.0 { 28.0 } else { x.abs() };
    // exp(-a^2) would magnify the rounding error of a^2 by a factor of a^2. A head of 26 bits has an exact square.
    let head = f64::from_bits(a.to_bits() & !0x07ff_ffff);
    let tail = (a - head) * (a + head);
    let upper = exp_of_sum(-(head * head), -tail) * erfcx(a);
    if x < 0.0 { 2.0 - upper } else { upper }
}

/// exp(x^2) erfc(x) for x >= 0.
///
/// (1 + 2 x) erfcx(x) is smooth and goes from 1 to 2/sqrt(pi), so a single polynomial in t = (x - k)/(x + k) is enough
/// from zero to infinity (Shepherd and Laframboise 1981, <https://doi.org/10.1090/S0025-5718-1981-0595058-X>). Here it
/// is 1 + w q(t) with w = x/(x + k) = (1 + t)/2, where w q(t) stays below 0.29, which also keeps its rounding error
/// small.
#[inline(always)]
pub(crate) fn erfcx<T: Real>(x: T) -> T {
    /// k, the x at which t = 0.
    const K: f64 = 3.75;
    // The quotient of two infinities is NaN; from 1e30 on the quotient is 1.
    let end = T::literal(1e30);
    let near: T = T::if_less(end, x, end, x);
    let w: T = near / near.plus(K);
    let t: T = (w + w).plus(-1.0);
    let q: T = long_polynomial!(
        t,
        [
            0.47502526167565506,
            -0.7555064588467445,
            0.7626772898177036,
            -0.5981238128377921,
            0.38051595255286125,
            -0.19590731022259958,
            0.07852051306995105,
            -0.021795958342558396,
            0.0023027989708267046,
            0.0012084534511953807,
            -0.0006210246708333556,
            4.07136660384951e-05,
            6.257932283528154e-05,
            -1.7803576280724755e-05,
            -5.072387877604351e-06,
            3.1130660031559476e-06,
            3.7074002405139937e-07,
            -4.7179663189961975e-07,
            -2.522795146405995e-08,
            6.252839803344951e-08,
            1.380475780242306e-09,
            -5.237185672513449e-09
        ]
    );
    let one = T::literal(1.0);
    (one + w * q) / (one + x.times(2.0))
}

/// Complementary error function in numbers without bits, for languages that have none. Its relative error grows with x^2.
pub(crate) fn erfc_by_erfcx<T: Real>(x: T) -> T {
    let zero = T::literal(0.0);
    let size: T = T::if_less(x, zero, -x, x);
    // Beyond this the result is 0 or 2, and every step below stays finite.
    let a: T = size.lesser(T::literal(28.0));
    let upper: T = (-(a * a)).exp() * erfcx(a);
    T::if_less(x, zero, (-upper).plus(2.0), upper)
}

/// Angle of the point (x, y), radians in [-pi, pi]; 0 at the origin. Both must be below 8e307.
///
/// The sign of a zero matters for y, as usual, but not for x: -0 counts as 0.
#[inline(always)]
pub(crate) fn atan2(y: f64, x: f64) -> f64 {
    // The angle to the nearer axis is atan(least/most), in 0..pi/4.
    let steep = x.abs() < y.abs();
    let least = if steep { x.abs() } else { y.abs() };
    let most = if steep { y.abs() } else { x.abs() };
    // Above a slope of 1/2 it is pi/4 + atan((least - most)/(least + most)), where the difference is exact.
    let diagonal = 0.5 * most < least;
    let numerator = if diagonal { least - most } else { least };
    let denominator = if diagonal { least + most } else { most };
    let denominator = if denominator == 0.0 { 1.0 } else { denominator };
    let q = numerator / denominator;
    let z = q * q;
    let series = polynomial!(
        z,
        [
            -0.3333333333333333,
            0.1999999999999951,
            -0.14285714285603243,
            0.11111111101218353,
            -0.09090908631869019,
            0.07692294974053462,
            -0.06666439433808748,
            0.058796139661525026,
            -0.05240323840202828,
            0.04628960510483861,
            -0.038091290434468725,
            0.02504413334455908,
            -0.009240823931354782
        ]
    );
    let small = q + q * (z * series);
    // Multiples of pi/4 up to pi are exact sums, because the double nearest to pi ends in three zero bits.
    let base = if diagonal { FRAC_PI_4 } else { 0.0 };
    let (base, small) = (if steep { FRAC_PI_2 - base } else { base }, if steep { -small } else { small });
    let behind = x < 0.0;
    let (base, small) = (if behind { PI - base } else { base }, if behind { -small } else { small });
    let angle = base + (small + base * PI_REST);
    f64::from_bits(angle.to_bits() | (y.to_bits() & SIGN))
}

/// y^(-1/3) for a positive normal number; 0 at infinity, and some large finite number at 0.
///
/// The bits of a double are nearly linear in its logarithm. Subtracting a third of them from a constant gives the bits
/// of a first value t that is off by up to 3.5 %. With h = 1 - y t^3, which is then below 0.103, y^(-1/3) = t (1 -
/// h)^(-1/3), whose series needs no division (Moroz, Samotyy, Walczyk and Cieslinski 2021,
/// <https://doi.org/10.3390/en14041058>).
#[inline(always)]
pub(crate) fn inverse_cbrt(y: f64) -> f64 {
    /// The constant from which a third of the bits is subtracted.
    const START: u64 = 0x553e_e94b_8525_f7bf;
    /// 2^32/3. bits/3 = (upper half) (2^32/3) is a product of 32-bit numbers, which SSE2 can vectorise; it cannot
    /// vectorise one of 64-bit numbers.
    const THIRD: u64 = 0x5555_5555;
    let t = f64::from_bits(START.wrapping_sub((y.to_bits() >> 32).wrapping_mul(THIRD)));
    // In this order the products lie between y and 1 in size, so they cannot overflow.
    let h = 1.0 - y * t * t * t;
    // Terms to h^4 leave 0.125 h^5 < 1.5e-6 ...
    let t = t + t * (h * polynomial!(h, [1.0 / 3.0, 2.0 / 9.0, 14.0 / 81.0, 35.0 / 243.0]));
    let h = 1.0 - y * t * t * t;
    // ... and then terms to h^2 leave 0.17 h^3 < 2e-17.
    let t = t + t * (h * polynomial!(h, [1.0 / 3.0, 2.0 / 9.0]));
    if y == f64::INFINITY { 0.0 } else { t }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `n` numbers spread evenly over low..high (multiples of the golden ratio, modulo 1), none of them round.
    fn spread(n: u32, low: f64, high: f64) -> impl Iterator<Item = f64> {
        (0..n).map(move |i| low + (high - low) * (f64::from(i) * 0.618_033_988_749_894_9).fract())
    }

    /// The error in units in the last place of the expected value; 0 if both are the same, including NaN, and infinite
    /// if only one is finite.
    fn ulps(found: f64, expected: f64) -> f64 {
        if found == expected || (found.is_nan() && expected.is_nan()) {
            return 0.0;
        }
        let error = (found - expected).abs() / (expected.abs().next_up() - expected.abs());
        if error.is_nan() { f64::INFINITY } else { error }
    }

    /// Asserts that `f` stays within `bound` of the Rust port of musl's C library, whose own errors are below 1.
    fn follows(
        what: &str,
        bound: f64,
        f: fn(f64) -> f64,
        reference: fn(f64) -> f64,
        x: impl Iterator<Item = f64>,
    ) {
        let error = |x: f64| ulps(f(x), reference(x));
        let (worst, at) = x.map(|x| (error(x), x)).fold((0.0, 0.0), |a, b| if b.0 <= a.0 { a } else { b });
        assert!(worst <= bound, "{what}({at:e}) is off by {worst}, more than {bound}");
    }

    /// Values to 17 digits from `scripts/elementary_coefficients.py` (mpmath, 50 digits).
    fn agrees(what: &str, bound: f64, f: fn(f64) -> f64, values: &[(f64, f64)]) {
        for &(x, expected) in values {
            let error = ulps(f(x), expected);
            assert!(error <= bound, "{what}({x:e}) = {:e}, not {expected:e}: {error} > {bound}", f(x));
        }
    }

    /// Asserts that around `at`, in steps of 1e-14, the function is monotonic and has no jump.
    fn joins(what: &str, f: impl Fn(f64) -> f64, at: f64, rising: bool) {
        let values: Vec<f64> = (-200..=200).map(|i| f(at * (1.0 + 1e-14 * f64::from(i)))).collect();
        for pair in values.windows(2) {
            let step = (pair[1] - pair[0]) / pair[0].abs() * if rising { 1.0 } else { -1.0 };
            assert!((0.0..3e-12).contains(&step), "{what} about {at}: {pair:?}");
        }
    }

    #[test]
    fn exponentials() {
        agrees(
            "exp",
            1.0,
            exp,
            &[
                (-700.0, 9.85967654375977e-305),
                (-87.5, 9.982350930569248e-39),
                (-10.25, 3.535750085040998e-05),
                (-1.0, 0.36787944117144233),
                (-0.35, 0.7046880897187134),
                (-1e-09, 0.999999999),
                (0.34, 1.4049475905635938),
                (1.5, 4.4816890703380645),
                (20.0, 485165195.4097903),
                (300.5, 3.202519714603633e+130),
                (709.75, 1.7398368732641605e+308),
            ],
        );
        follows("exp", 2.0, exp, libm::exp, spread(200_000, -745.0, 710.0));
        follows("exp", 2.0, exp, libm::exp, spread(200_000, -2.0, 2.0));
        follows("exp", 2.0, exp, libm::exp, spread(100_000, -1e-7, 1e-7));
        for k in [-30.5, -1.5, -0.5, 0.5, 1.5, 7.5] {
            joins("exp", exp, k * std::f64::consts::LN_2, k > 0.0);
        }
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(exp(f64::INFINITY), f64::INFINITY);
        assert_eq!(exp(709.8), f64::INFINITY);
        assert_eq!(exp(f64::NEG_INFINITY), 0.0);
        assert_eq!(exp(-745.2), 0.0);
        // The smallest subnormal number is 2^-1074 = e^-744.44.
        assert_eq!(exp(-744.44), f64::from_bits(1));
        assert!(exp(f64::NAN).is_nan());
    }

    #[test]
    fn logarithms() {
        agrees(
            "ln",
            1.0,
            ln,
            &[
                (1e-300, -690.7755278982137),
                (1e-05, -11.512925464970229),
                (0.4, -0.916290731874155),
                (0.70703125, -0.3466804132137367),
                (0.99, -0.01005033585350145),
                (0.9999999, -1.0000000494736474e-07),
                (1.0000001, 9.999999505838704e-08),
                (1.01, 0.009950330853168092),
                (1.4140625, 0.34646676734620857),
                (3.0, 1.0986122886681098),
                (1e+300, 690.7755278982137),
            ],
        );
        follows("ln", 2.0, ln, libm::log, spread(200_000, 0.0, 4.0));
        follows("ln", 2.0, ln, libm::log, spread(100_000, 0.999, 1.001));
        follows("ln", 2.0, ln, libm::log, spread(200_000, -700.0, 700.0).map(libm::exp));
        // From normal to subnormal numbers, and at the ends of each power of two.
        follows("ln", 2.0, ln, libm::log, spread(10_000, 0.0, 4.0 * f64::MIN_POSITIVE));
        for x in [std::f64::consts::SQRT_2, std::f64::consts::FRAC_1_SQRT_2, 2.0, 4.0, 1e100] {
            joins("ln", ln, x, true);
        }
        assert_eq!(ln(1.0), 0.0);
        assert_eq!(ln(0.0), f64::NEG_INFINITY);
        assert_eq!(ln(-0.0), f64::NEG_INFINITY);
        assert_eq!(ln(f64::INFINITY), f64::INFINITY);
        assert!([-1e-320, -1.0, f64::NEG_INFINITY, f64::NAN].into_iter().all(|x| ln(x).is_nan()));
    }

    #[test]
    fn logarithms_of_one_plus() {
        agrees(
            "ln_1p",
            1.0,
            ln_1p,
            &[
                (-0.9999999, -16.118095651484676),
                (-0.75, -1.3862943611198906),
                (-0.3, -0.35667494393873234),
                (-1e-05, -1.0000050000333337e-05),
                (-1e-18, -1e-18),
                (1e-300, 1e-300),
                (1e-12, 9.999999999995e-13),
                (0.01, 0.009950330853168083),
                (0.42, 0.35065687161316933),
                (1e+17, 39.14394658089878),
            ],
        );
        follows("ln_1p", 2.0, ln_1p, libm::log1p, spread(200_000, -1.0, 3.0));
        follows("ln_1p", 2.0, ln_1p, libm::log1p, spread(100_000, -0.001, 0.001));
        follows("ln_1p", 2.0, ln_1p, libm::log1p, spread(200_000, -45.0, 700.0).map(libm::exp));
        follows("ln_1p", 2.0, ln_1p, libm::log1p, spread(100_000, -45.0, 0.0).map(|x| -libm::exp(x)));
        for x in [std::f64::consts::SQRT_2 - 1.0, 1.0, 3.0] {
            joins("ln_1p", ln_1p, x, true);
        }
        // Arguments too small to change 1 are returned unchanged.
        assert!([0.0, 1e-17, -1e-17, 1e-300, f64::MIN_POSITIVE].into_iter().all(|x| ln_1p(x) == x));
        assert_eq!(ln_1p(-1.0), f64::NEG_INFINITY);
        assert_eq!(ln_1p(f64::INFINITY), f64::INFINITY);
        assert!([-1.001, f64::NEG_INFINITY, f64::NAN].into_iter().all(|x| ln_1p(x).is_nan()));
    }

    #[test]
    fn error_functions() {
        agrees(
            "erfc",
            4.0,
            erfc,
            &[
                (-7.0, 2.0),
                (-3.0, 1.9999779095030015),
                (-1.0, 1.8427007929497148),
                (-0.3, 1.3286267594591274),
                (1e-300, 1.0),
                (1e-09, 0.9999999988716208),
                (0.1, 0.887537083981715),
                (0.25, 0.7236736098317631),
                (0.5, 0.4795001221869535),
                (0.84375, 0.23277433876765838),
                (1.0, 0.15729920705028513),
                (1.25, 0.07709987174354177),
                (1.75, 0.013328328780817557),
                (2.5, 0.0004069520174449589),
                (3.5, 7.430983723414128e-07),
                (3.75, 1.1372725656979665e-07),
                (4.5, 1.9661604415428876e-10),
                (6.0, 2.1519736712498913e-17),
                (8.0, 1.1224297172982926e-29),
                (10.0, 2.088487583762545e-45),
                (13.0, 1.7395573154667246e-75),
                (17.5, 3.198863812343481e-135),
                (22.0, 1.6219058609334726e-212),
                (26.0, 5.663192408856143e-296),
            ],
        );
        agrees(
            "erfcx",
            4.0,
            erfcx,
            &[
                (0.0, 1.0),
                (1e-300, 1.0),
                (1e-09, 0.9999999988716208),
                (0.1, 0.8964569799691267),
                (0.25, 0.7703465477309968),
                (0.5, 0.6156903441929259),
                (0.84375, 0.4743680720269093),
                (1.0, 0.427583576155807),
                (1.25, 0.3678229164523611),
                (1.75, 0.2849722347374364),
                (2.5, 0.2108063640611436),
                (3.5, 0.1552936556088943),
                (3.75, 0.14558972127503855),
                (4.5, 0.12248480427384142),
                (6.0, 0.09277656780053835),
                (10.0, 0.05614099274382259),
                (28.0, 0.020136801964214277),
                (100.0, 0.005641613782989433),
                (1000000.0, 5.641895835474742e-07),
                (1e+18, 5.641895835477563e-19),
                (1e+300, 5.641895835477562e-301),
            ],
        );
        follows("erfc", 5.0, erfc, libm::erfc, spread(200_000, -6.0, 6.0));
        follows("erfc", 5.0, erfc, libm::erfc, spread(200_000, 0.0, 26.0));
        follows("erfc", 5.0, erfc, libm::erfc, spread(100_000, -1e-3, 1e-3));
        assert_eq!(erfc(0.0), 1.0);
        assert_eq!((erfc(29.0), erfc(f64::INFINITY)), (0.0, 0.0));
        assert_eq!((erfc(-29.0), erfc(f64::NEG_INFINITY)), (2.0, 2.0));
        assert_eq!((erfcx(0.0), erfcx(f64::INFINITY)), (1.0, 0.0));
        assert!(erfc(f64::NAN).is_nan() && erfcx(f64::NAN).is_nan());
        // Down into the subnormal numbers, without a step up.
        let fall: Vec<f64> = (0..=3000).map(|i| erfc(25.0 + 1e-3 * f64::from(i))).collect();
        assert!(fall.windows(2).all(|pair| pair[1] <= pair[0]));
        // At the point where the polynomial's argument is cut off.
        joins("erfcx", erfcx, 1e30, false);
    }

    #[test]
    fn angles() {
        use std::f64::consts::FRAC_PI_8;
        let mut worst = 0.0_f64;
        for (i, turn) in spread(300_000, -PI, PI).enumerate() {
            let length = [1.0, 1e-300, 1e300][i % 3];
            let (y, x) = (length * turn.sin(), length * turn.cos());
            worst = worst.max(ulps(atan2(y, x), libm::atan2(y, x)));
        }
        for logarithm in spread(200_000, -300.0, 300.0) {
            let y = logarithm.exp();
            worst = worst.max(ulps(atan2(y, 1.0), libm::atan2(y, 1.0)));
            worst = worst.max(ulps(atan2(-y, -1.0), libm::atan2(-y, -1.0)));
        }
        assert!(worst <= 2.0, "atan2 is off by {worst}");
        for slope in [0.5, 1.0, 2.0, FRAC_PI_8.tan()] {
            joins("atan2, in front", |y| atan2(y, 1.0), slope, true);
            joins("atan2, behind", |y| atan2(y, -1.0), slope, false);
        }
        // On the axes and the diagonals the angle is the double nearest to the exact one.
        let eighths = [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (1.0, -1.0), (0.0, -1.0)];
        for ((y, x), eighth) in eighths.into_iter().zip(0..) {
            assert_eq!(atan2(y, x), FRAC_PI_4 * f64::from(eighth));
            assert_eq!(atan2(-y, x), -FRAC_PI_4 * f64::from(eighth));
        }
        assert_eq!(atan2(0.0, 0.0), 0.0);
        assert!(atan2(f64::NAN, 1.0).is_nan() && atan2(1.0, f64::NAN).is_nan());
        assert!(atan2(f64::NAN, 0.0).is_nan() && atan2(0.0, f64::NAN).is_nan());
    }

    #[test]
    fn inverse_cube_roots() {
        agrees(
            "inverse_cbrt",
            1.3,
            inverse_cbrt,
            &[
                (1e-300, 1e+100),
                (1e-60, 1e+20),
                (0.001, 10.0),
                (0.3, 1.4938015821857216),
                (1.0, 1.0),
                (2.0, 0.7937005259840998),
                (7.9, 0.5021008650105004),
                (12345.0, 0.04326828037557253),
                (1e+300, 1e-100),
            ],
        );
        // The reference rounds twice.
        let reference = |y: f64| 1.0 / libm::cbrt(y);
        follows("inverse_cbrt", 2.5, inverse_cbrt, reference, spread(300_000, 1.0, 8.0));
        follows("inverse_cbrt", 2.5, inverse_cbrt, reference, spread(200_000, 1e-300, 1.0));
        follows("inverse_cbrt", 2.5, inverse_cbrt, reference, spread(200_000, -708.0, 709.0).map(libm::exp));
        for y in [0.5, 1.0, 2.0, 4.0, 8.0] {
            joins("inverse_cbrt", inverse_cbrt, y, false);
        }
        assert!(inverse_cbrt(0.0) > 1e100 && inverse_cbrt(0.0).is_finite());
        assert_eq!(inverse_cbrt(f64::INFINITY), 0.0);
        assert!(inverse_cbrt(f64::NAN).is_nan());
    }
}
