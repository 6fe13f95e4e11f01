//! Kubelka and Munk's two-flux model: the shares of diffuse light that a layer of paint reflects and transmits.
//!
//! K and S are the absorbed and scattered shares of *diffuse* flux per unit of thickness, X is the thickness; a single layer
//! depends only on K X and S X. In the usual notation, a = 1 + K/S, b = sqrt(a^2 - 1), and Rg is the background:
//!
//! ```text
//! R_inf = a - b                                   opaque layer;   K/S = (1 - R_inf)^2/(2 R_inf)
//! R0 = sinh(bSX)/(a sinh(bSX) + b cosh(bSX))      over black;     T = b/(a sinh(bSX) + b cosh(bSX))
//! R  = (1 - Rg (a - b coth(bSX)))/(a - Rg + b coth(bSX)) = R0 + T^2 Rg/(1 - R0 Rg)
//! ```
//!
//! Kubelka and Munk 1931, Kubelka 1948 (doi:10.1364/JOSA.38.000448). As printed, a and b grow without bound as S goes to 0,
//! the hyperbolic functions of bSX overflow, and at K = 0 everything is 0/0. Here everything is multiplied by S X: with
//! x = bSX = sqrt(KX (KX + 2 SX)) and C = x coth x,
//!
//! ```text
//! R0 = SX/(KX + SX + C),   T = (x/sinh x)/(KX + SX + C)
//! R  = (SX + (x/sinh x)^2 Rg/(KX + SX (1 - Rg) + C))/(KX + SX + C)
//! 1 - R = (KX (1 + Rg) + C (1 - Rg))/(KX + SX (1 - Rg) + C)
//! ```
//!
//! These are sums of positive terms, and hold at K = 0 (C = 1: R0 = SX/(1 + SX)), at S = 0 (R0 = 0, T = exp(-KX)) and for
//! any thickness. C and x/sinh x are even in x: as functions of x^2 they, and their derivatives, are smooth at x = 0. C - KX
//! is also a sum of positive terms, so R keeps its digits over a white background, too.

use crate::math::{GaussLegendre, Real as _, Scalar};
use crate::model::parts::fresnel::{index_constants, index_reflectance};

/// Below this x the functions of x are quotients of the power series of cosh and sinh; above it, quotients of exponentials.
const SERIES_BELOW: f64 = 1.0;

/// 1/(2n)!, the coefficients of x^2n in cosh x. At x = 1 the first omitted term is below 1e-18.
const COSH: [f64; 10] = factorials(0);
/// 1/(2n + 1)!, the coefficients of x^2n in (sinh x)/x.
const SINH: [f64; 10] = factorials(1);

#[expect(clippy::indexing_slicing, reason = "evaluated when the program is compiled")]
const fn factorials(first: usize) -> [f64; 10] {
    let mut series = [1.0; 10];
    let mut n = 1;
    while n < 10 {
        let order = crate::math::count(2 * n + first);
        series[n] = series[n - 1] / (order * (order - 1.0));
        n += 1;
    }
    series
}

fn polynomial<T: Scalar>(coefficients: &[f64], x: T) -> T {
    coefficients.iter().rev().fold(T::constant(0.0), |sum, coefficient| (sum * x).plus(*coefficient))
}

/// R_inf, the reflectance of an opaque layer: S/(K + S + sqrt(K (K + 2 S))), which is a - b without cancellation.
///
/// It is 1 at K = 0, where its slope is infinite; the derivative returned there is large but finite. K + S must be positive.
#[must_use]
pub fn opaque<T: Scalar>(k: T, s: T) -> T {
    // The floor changes R by 1e-18 and keeps 0 * inf out of the derivative.
    let floor: T = T::from_real(s.value()).times(1e-36);
    let floored: T = T::if_less(k.value(), floor.value(), floor + (k - k.value()), k);
    let root: T = floored.sqrt() * (floored + s.times(2.0)).sqrt();
    s / (k + s + root)
}

/// 1 - R_inf with all its digits, which for a white layer cannot be computed from R_inf.
#[must_use]
pub fn opaque_absorptance<T: Scalar>(k: T, s: T) -> T {
    let floor: T = T::from_real(s.value()).times(1e-36);
    let floored: T = T::if_less(k.value(), floor.value(), floor + (k - k.value()), k);
    let absorbed: T = floored + floored.sqrt() * (floored + s.times(2.0)).sqrt();
    absorbed / (absorbed + s)
}

/// K/S of an opaque layer of reflectance `r`, which must be above 0: the inverse of [`opaque`].
#[must_use]
pub fn k_over_s<T: Scalar>(r: T) -> T {
    (-r).plus(1.0).squared() / r.times(2.0)
}

/// A homogeneous layer of finite thickness.
#[derive(Clone, Copy, Debug)]
pub struct Film<T> {
    /// S X.
    sx: T,
    /// K X.
    kx: T,
    /// C = x coth x.
    c: T,
    /// x/sinh x.
    decay: T,
}

impl<T: Scalar> Film<T> {
    /// Makes a layer with K X = `kx` and S X = `sx`, neither of which may be negative.
    #[must_use]
    pub fn new(kx: T, sx: T) -> Self {
        let limit = T::Real::literal(SERIES_BELOW);
        let x: T = kx.sqrt() * (kx + sx.times(2.0)).sqrt();

        // In a thin or clear layer use powers of x^2, whose root is not needed.
        let x2: T = kx * (kx + sx.times(2.0));
        let sinh: T = polynomial(&SINH, x2);
        let thin_c: T = polynomial(&COSH, x2) / sinh;

        // Elsewhere use e = e^-2x, which falls to 0 where hyperbolic functions would overflow. coth x is 1 + 2 e/(1 - e).
        let e: T = x.times(-2.0).exp();
        let open: T = (-e).plus(1.0);
        let thick_c: T = x + x.times(2.0) * (e / open);

        let choose = |thin: T, thick: T| T::if_less(x.value(), limit, thin, thick);
        Self {
            sx,
            kx,
            c: choose(thin_c, thick_c),
            decay: choose(sinh.recip(), x.times(2.0) * ((-x).exp() / open)),
        }
    }

    /// R0: reflectance over a black background.
    #[must_use]
    pub fn reflectance(&self) -> T {
        self.sx / (self.kx + self.c + self.sx)
    }

    /// T: transmittance.
    #[must_use]
    pub fn transmittance(&self) -> T {
        self.decay / (self.kx + self.c + self.sx)
    }

    /// Reflectance over a background of reflectance `rg`, 0..1.
    #[must_use]
    pub fn over(&self, rg: T) -> T {
        let seen: T = rg / self.over_denominator(rg);
        (self.sx + self.decay.squared() * seen) / (self.kx + self.c + self.sx)
    }

    /// 1 minus the reflectance over a background of reflectance `rg`.
    #[must_use]
    pub fn absorptance_over(&self, rg: T) -> T {
        (self.kx * rg.plus(1.0) + self.c * (-rg).plus(1.0)) / self.over_denominator(rg)
    }

    fn over_denominator(&self, rg: T) -> T {
        self.kx + self.c + self.sx * (-rg).plus(1.0)
    }

    /// The same layer as an element of a stack.
    #[must_use]
    pub fn slab(&self) -> Slab<T> {
        Slab::symmetric(self.reflectance(), self.transmittance())
    }
}

/// A layer or stack of layers, described by its reflectance and transmittance from either side.
#[derive(Clone, Copy, Debug)]
pub struct Slab<T> {
    /// Reflectance from above.
    pub reflectance: T,
    /// Transmittance from above to below.
    pub transmittance: T,
    /// Reflectance from below.
    pub back_reflectance: T,
    /// Transmittance from below to above.
    pub back_transmittance: T,
}

impl<T: Scalar> Slab<T> {
    /// A layer that is the same from both sides.
    #[must_use]
    pub fn symmetric(reflectance: T, transmittance: T) -> Self {
        Self { reflectance, transmittance, back_reflectance: reflectance, back_transmittance: transmittance }
    }

    /// A smooth surface that reflects `k1` of light from outside and `k2` of light from inside.
    #[must_use]
    pub fn interface(k1: T, k2: T) -> Self {
        Self {
            reflectance: k1,
            transmittance: (-k1).plus(1.0),
            back_reflectance: k2,
            back_transmittance: (-k2).plus(1.0),
        }
    }

    /// Puts this slab on top of `below`, with all reflections between the two (Kubelka 1954, doi:10.1364/JOSA.44.000330;
    /// Dorsey and Hanrahan 1996, doi:10.1145/237170.237278, stack their patinas in the same way).
    #[must_use]
    pub fn over(&self, below: &Self) -> Self {
        let between = gain(self.back_reflectance, below.reflectance);
        Self {
            reflectance: self.reflectance
                + self.transmittance * self.back_transmittance * below.reflectance * between,
            transmittance: self.transmittance * below.transmittance * between,
            back_reflectance: below.back_reflectance
                + below.back_transmittance * below.transmittance * self.back_reflectance * between,
            back_transmittance: below.back_transmittance * self.back_transmittance * between,
        }
    }

    /// Reflectance of this slab over a background of reflectance `rg`.
    #[must_use]
    pub fn on(&self, rg: T) -> T {
        let passed: T = self.transmittance * self.back_transmittance;
        self.reflectance + passed * rg * gain(self.back_reflectance, rg)
    }
}

/// 1/(1 - r1 r2), the factor for all reflections between two layers. It is 0 instead of infinity for two layers that reflect
/// everything, since they let nothing through.
fn gain<T: Scalar>(r1: T, r2: T) -> T {
    let left: T = (-(r1 * r2)).plus(1.0);
    T::if_less(T::Real::literal(0.0), left.value(), left.recip(), T::constant(0.0))
}

/// Saunderson's correction (1942, doi:10.1364/JOSA.32.000727): the reflectance with the surface of a layer whose reflectance
/// without it is `r`. The surface reflects the share `k1` of light from outside and the share `k2`, less than 1, of diffuse
/// light from inside: k1 + (1 - k1)(1 - k2) r/(1 - k2 r).
#[must_use]
pub fn saunderson<T: Scalar>(k1: T, k2: T, r: T) -> T {
    k1 + through_surface(k1, k2, r)
}

/// Saunderson's correction without its first term, the reflection at the surface.
#[must_use]
pub fn through_surface<T: Scalar>(k1: T, k2: T, r: T) -> T {
    through_surface_of(k1, k2, r, (-r).plus(1.0))
}

/// Like [`through_surface`], for a layer whose absorptance 1 - r is known to more digits than r.
///
/// (1 - k2)/(1 - k2 r) = 1 - k2 a/(1 - k2 (1 - a)), whose derivatives are exact where k2 or a is small.
#[must_use]
pub fn through_surface_of<T: Scalar>(k1: T, k2: T, r: T, absorptance: T) -> T {
    let kept: T = (-k2).plus(1.0);
    let lost: T = k2 * absorptance;
    let (quotient, rest): (T, T) = (kept / (kept + lost), lost / (kept + lost));
    let few: T = T::if_less(rest.value(), T::Real::literal(0.5), (-rest).plus(1.0), quotient);
    (-k1).plus(1.0) * few * r
}

/// The inverse of [`saunderson`]: the reflectance without the surface, from the reflectance `measured` with it.
#[must_use]
pub fn saunderson_inverse<T: Scalar>(k1: T, k2: T, measured: T) -> T {
    let above: T = measured - k1;
    above / ((-k1).plus(1.0) * (-k2).plus(1.0) + k2 * above)
}

/// k1 and k2 of a smooth surface of refractive index `eta`, which must be above 1. k1 is the reflectance for light from
/// outside along the normal. k2 is that for diffuse light from inside, 1 - (1 - r)/eta^2, with r that for diffuse light from
/// outside.
#[must_use]
pub fn surface_of_index(eta: f64) -> [f64; 2] {
    let normal = (eta - 1.0) / (eta + 1.0);
    [normal * normal, 1.0 - (1.0 - diffuse_reflectance(eta)) / (eta * eta)]
}

/// The reflectance of a smooth surface of refractive index `eta`, which must be above 1, for diffuse light from outside:
/// 2 int F(mu) mu dmu. With mu = t^2 the nodes are dense where F is steep.
#[must_use]
pub fn diffuse_reflectance(eta: f64) -> f64 {
    let constants = index_constants(eta);
    let ring = |t: f64| 4.0 * index_reflectance(&constants, t * t) * t * t * t;
    GaussLegendre::new(128).integrate(0.0, 1.0, ring)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Dual;
    use approx::assert_relative_eq;

    /// K X and S X from clear to opaque.
    fn layers() -> Vec<(f64, f64)> {
        let steps = [0.0, 1e-12, 1e-4, 0.03, 0.21, 0.84, 3.0, 40.0, 1e4];
        steps.iter().flat_map(|k| steps.map(|s| (*k, s))).collect()
    }

    /// K = 0.3, S = 1.2, X = 0.7 to 30 digits with mpmath.
    #[test]
    fn golden_values() {
        let film = Film::new(0.3 * 0.7, 1.2 * 0.7);
        assert_relative_eq!(film.reflectance(), 0.385_510_917_771_491_15, max_relative = 1e-14);
        assert_relative_eq!(film.transmittance(), 0.429_931_824_005_027_03, max_relative = 1e-14);
        assert_relative_eq!(opaque(0.3, 1.2), 0.5, max_relative = 1e-15);
        assert_relative_eq!(k_over_s(0.5), 0.25, max_relative = 1e-15);
    }

    /// Agrees with the formulas as printed, where they neither overflow nor vanish.
    #[test]
    fn as_printed() {
        for (kx, sx) in layers() {
            let (a, b) = (1.0 + kx / sx, (kx / sx * (2.0 + kx / sx)).sqrt());
            let x = b * sx;
            // a - b loses twice as many digits as a has before the point.
            if !(1e-2..100.0).contains(&x) || a > 300.0 {
                continue;
            }
            let film = Film::new(kx, sx);
            let bottom = a * x.sinh() + b * x.cosh();
            assert_relative_eq!(film.reflectance(), x.sinh() / bottom, max_relative = 1e-12);
            assert_relative_eq!(film.transmittance(), b / bottom, max_relative = 1e-12);
            for rg in [0.0, 0.3, 0.9] {
                let coth = 1.0 / x.tanh();
                let printed = (1.0 - rg * (a - b * coth)) / (a - rg + b * coth);
                assert_relative_eq!(film.over(rg), printed, max_relative = 1e-10);
            }
            assert_relative_eq!(opaque(kx, sx), a - b, max_relative = 1e-9);
        }
    }

    /// Solves the equation of the two fluxes, dR/dX = S - 2 (K + S) R + S R^2, by Runge and Kutta's method from the background
    /// up.
    #[test]
    fn solves_the_differential_equation() {
        for (k, s, rg) in [(0.3, 1.2, 0.0), (0.0, 2.0, 0.4), (2.5, 0.1, 0.9), (0.01, 6.0, 0.2)] {
            let slope = |r: f64| s - 2.0 * (k + s) * r + s * r * r;
            let (steps, mut r) = (4000, rg);
            let h = 1.0 / f64::from(steps);
            for _ in 0..steps {
                let k1 = slope(r);
                let k2 = slope(r + 0.5 * h * k1);
                let k3 = slope(r + 0.5 * h * k2);
                r += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + slope(r + h * k3));
            }
            assert_relative_eq!(Film::new(k, s).over(rg), r, max_relative = 1e-10);
        }
    }

    #[test]
    fn a_layer_cut_in_two_is_the_same_layer() {
        for (kx, sx) in layers() {
            // Above 1e3 the rounding of K X itself changes T by more.
            if kx > 100.0 || sx > 100.0 {
                continue;
            }
            let whole = Film::new(kx, sx);
            for share in [0.5, 0.1] {
                let upper = Film::new(share * kx, share * sx).slab();
                let lower = Film::new((1.0 - share) * kx, (1.0 - share) * sx).slab();
                let joined = upper.over(&lower);
                assert!((joined.reflectance - whole.reflectance()).abs() <= 1e-15, "{kx} {sx}");
                assert!((joined.back_reflectance - whole.reflectance()).abs() <= 1e-15, "{kx} {sx}");
                assert!((joined.transmittance - whole.transmittance()).abs() <= 1e-15, "{kx} {sx}");
                assert!((joined.back_transmittance - whole.transmittance()).abs() <= 1e-15, "{kx} {sx}");
                for rg in [0.0, 0.5, 0.95] {
                    assert_relative_eq!(joined.on(rg), whole.over(rg), max_relative = 1e-13);
                }
            }
        }
    }

    #[test]
    fn stacking_is_associative_and_keeps_light() {
        let a = Slab::interface(0.04, 0.596);
        let b = Film::new(0.2, 0.9).slab();
        let c = Film::new(0.0, 3.0).slab();
        let (left, right) = (a.over(&b).over(&c), a.over(&b.over(&c)));
        assert_relative_eq!(left.reflectance, right.reflectance, max_relative = 1e-14);
        assert_relative_eq!(left.back_reflectance, right.back_reflectance, max_relative = 1e-14);
        assert_relative_eq!(left.transmittance, right.transmittance, max_relative = 1e-14);
        // Without absorption all light comes out somewhere.
        let clear = a.over(&c);
        assert_relative_eq!(clear.reflectance + clear.transmittance, 1.0, max_relative = 1e-14);
        assert_relative_eq!(clear.back_reflectance + clear.back_transmittance, 1.0, max_relative = 1e-14);
        // Between two perfect mirrors there is no light.
        let mirror = Slab::symmetric(1.0, 0.0);
        assert_eq!(mirror.over(&mirror).reflectance, 1.0);
    }

    #[test]
    fn exact_limits() {
        for sx in [0.0, 1e-300, 0.7, 3.0, 1e12, 1e300] {
            let clear = Film::new(0.0, sx);
            assert_relative_eq!(clear.reflectance(), sx / (1.0 + sx), max_relative = 1e-15);
            assert_relative_eq!(clear.transmittance(), 1.0 / (1.0 + sx), max_relative = 1e-15);
            assert_relative_eq!(clear.over(1.0), 1.0, max_relative = 1e-15);
        }
        for kx in [0.0_f64, 1e-300, 0.7, 3.0, 700.0] {
            let glass = Film::new(kx, 0.0);
            assert_eq!(glass.reflectance(), 0.0);
            assert_relative_eq!(glass.transmittance(), (-kx).exp(), max_relative = 2e-15);
            assert_relative_eq!(glass.over(0.8), 0.8 * (-2.0 * kx).exp(), max_relative = 3e-15);
        }
        for (k, s) in [(1e3, 1e3), (1e9, 1e3), (1.0, 1e8), (1e200, 1e200), (1e300, 1.0)] {
            let thick = Film::new(k, s);
            assert_relative_eq!(thick.reflectance(), opaque(k, s), max_relative = 1e-14);
            assert_relative_eq!(thick.over(0.9), opaque(k, s), max_relative = 1e-14);
            assert_eq!(thick.transmittance(), 0.0);
        }
        assert_eq!(opaque(0.0, 1.0), 1.0);
        assert_eq!(opaque(1.0, 0.0), 0.0);
        for ratio in [1e-12_f64, 1e-3, 1.0, 1e6, 1e100] {
            assert_relative_eq!(
                k_over_s(opaque(ratio, 1.0)),
                ratio,
                max_relative = 1e-14 / ratio.min(1.0).sqrt()
            );
        }
    }

    #[test]
    fn no_jump_where_the_formulas_change() {
        let kx_at = |x: f64, sx: f64| (sx * sx + x * x).sqrt() - sx;
        for sx in [0.0, 0.1, 1.0, 30.0] {
            let [below, above] = [1.0 - 1e-13, 1.0 + 1e-13].map(|x| Film::new(kx_at(x, sx), sx));
            assert_relative_eq!(below.reflectance(), above.reflectance(), max_relative = 1e-12);
            assert_relative_eq!(below.transmittance(), above.transmittance(), max_relative = 1e-12);
            assert_relative_eq!(below.over(0.8), above.over(0.8), max_relative = 1e-12);
        }
    }

    /// Derivatives agree with extrapolated central differences, and are finite everywhere, including the ends.
    #[test]
    fn derivatives() {
        type Two = Dual<f64, 2>;
        let functions: [fn(Two, Two) -> Two; 4] = [
            |k, s| Film::new(k, s).reflectance(),
            |k, s| Film::new(k, s).transmittance(),
            |k, s| Film::new(k, s).over(Two::constant(0.7)),
            |k, s| saunderson(Two::constant(0.04), Two::constant(0.596), Film::new(k, s).reflectance()),
        ];
        for (kx, sx) in layers() {
            for (index, f) in functions.iter().enumerate() {
                let at = |k: f64, s: f64| f(Two::constant(k), Two::constant(s)).value;
                let found = f(Two::variable(kx, 0), Two::variable(sx, 1)).partials;
                assert!(found.iter().all(|d| d.is_finite()), "{index} at {kx}, {sx}: {found:?}");
                if kx < 0.03 || sx < 0.03 {
                    continue;
                }
                for (j, found) in found.iter().enumerate() {
                    let (step, value) = if j == 0 { (1e-3 * kx, kx) } else { (1e-3 * sx, sx) };
                    // Where x is large, T falls steeply.
                    let step = step / (1.0 + kx + (kx * sx).sqrt());
                    let moved = |h: f64| if j == 0 { at(kx + h, sx) } else { at(kx, sx + h) };
                    let difference = |h: f64| (moved(h) - moved(-h)) / (2.0 * h);
                    let expected = (4.0 * difference(step / 2.0) - difference(step)) / 3.0;
                    let scale = expected.abs().max(at(kx, sx) / value);
                    assert!(
                        (found - expected).abs() <= 1e-7 * scale,
                        "{index} at {kx}, {sx}: {found} for {expected}"
                    );
                }
            }
        }
        // At K = 0 the slope with respect to K by one-sided differences: R0 = S/(K + S + C), C = 1 + 2 K S/3 + ...
        let film = Film::new(Two::variable(0.0, 0), Two::variable(2.0, 1));
        let [by_k, by_s] = film.reflectance().partials;
        assert_relative_eq!(by_k, -2.0 / 9.0 * (1.0 + 4.0 / 3.0), max_relative = 1e-14);
        assert_relative_eq!(by_s, 1.0 / 9.0, max_relative = 1e-14);
        for k in [0.0, 1e-40, 1.0, 1e6] {
            let r = opaque(Dual::<f64, 1>::variable(k, 0), Dual::constant(1.0));
            assert!(r.partials[0].is_finite() && r.partials[0] < 0.0);
        }
    }

    #[test]
    fn saunderson_is_a_surface_on_a_layer() {
        for (k1, k2) in [(0.0, 0.0), (0.04, 0.596), (0.092, 0.596)] {
            for r in [0.0, 1e-6, 0.3, 0.9, 1.0] {
                let measured = saunderson(k1, k2, r);
                assert_relative_eq!(measured, Slab::interface(k1, k2).on(r), max_relative = 1e-14);
                assert_relative_eq!(
                    saunderson_inverse(k1, k2, measured),
                    r,
                    max_relative = 1e-9,
                    epsilon = 1e-15
                );
                assert_relative_eq!(through_surface(k1, k2, r), measured - k1, epsilon = 1e-15);
            }
        }
    }

    /// Diffuse light from outside in closed form (Walsh 1926), and the published .092 and .596 at eta = 1.5.
    #[test]
    fn surface_of_a_dielectric() {
        for n in [1.1_f64, 1.33, 1.5, 1.8, 2.5] {
            let (n2, n4) = (n * n, n.powi(4));
            let closed = 0.5
                + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0).powi(2))
                + n2 * (n2 - 1.0).powi(2) / (n2 + 1.0).powi(3) * ((n - 1.0) / (n + 1.0)).ln()
                - 2.0 * n.powi(3) * (n2 + 2.0 * n - 1.0) / ((n2 + 1.0) * (n4 - 1.0))
                + 8.0 * n4 * (n4 + 1.0) / ((n2 + 1.0) * (n4 - 1.0).powi(2)) * n.ln();
            assert_relative_eq!(diffuse_reflectance(n), closed, max_relative = 1e-8);
        }
        let [k1, k2] = surface_of_index(1.5);
        assert_relative_eq!(k1, 0.04, max_relative = 1e-14);
        assert!((k2 - 0.596).abs() < 5e-4 && (diffuse_reflectance(1.5) - 0.092).abs() < 5e-4, "{k2}");
    }
}
