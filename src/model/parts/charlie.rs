//! "Charlie", the sheen of fibres that stand up from a cloth: its density, its shadowing, and how much light it sends back.
//!
//! With a the roughness, p = 1/(2 a), c a cosine and t = (1 - a)^2:
//!
//! ```text
//! D  = (1 + p)/pi sin^2(theta_h)^p
//! V  = 1/((1 + Lambda(ci) + Lambda(co)) 4 ci co),    no cosine less than 2^-12
//! Lambda(c) = e^l(c) for c < 1/2,  e^(2 l(1/2) - l(1 - c)) otherwise,    l(c) = k1/(1 + k2 c^k3) + k4 c + k5
//! k1..k5 = (1 - t) (21.5473, 3.82987, 0.19823, -1.97760, -4.32054) + t (25.3245, 3.32435, 0.16801, -1.27393, -4.85967)
//! E(ci) = int D V co dwo
//! ```
//!
//! Conty Estevez and Kulla 2017, Production Friendly Microfacet Sheen BRDF
//! (<https://blog.selfshadow.com/publications/s2017-shading-course/imageworks/s2017_pbs_imageworks_sheen.pdf>): D is
//! equation 2, and Lambda the fit that KHR_materials_sheen of glTF prints.
//!
//! Lambda is a fit that stays finite at the horizon, where 1/(ci co) does not: within a hundredth of a degree of it V would grow
//! without bound. So cosines are cut off at 2^-12, 0.014 degrees above the horizon.
//!
//! E is tabulated over x = c^(1/8) whenever the roughness changes, and interpolated by cubics, to 2e-4 for a from 0.01 to 1. At a = 0.04
//! and less it exceeds 1 near grazing, as V is a fit.
#![allow(clippy::indexing_slicing, reason = "a kernel: the lengths that it indexes are checked at its head")]

use super::directional_albedo::Cubics;
use crate::geometry::Geometry;
use crate::math::{GaussLegendre, Real, Scalar, count};
use crate::model::{Kernel, Part, PreparedBy, Values};
use std::f64::consts::{FRAC_1_PI, PI};
use std::sync::LazyLock;

/// The least cosine: 2^-12.
const LEAST: f64 = 1.0 / 4096.0;
/// The eighth root of it.
const LEAST_ROOT: f64 = 0.353_553_390_593_273_8;
/// Number of cells of the table of E.
const CELLS: usize = 32;

/// D. Its shape is a.
pub(crate) struct CharlieDensity;

impl Kernel for CharlieDensity {
    const SHARED_ON_RINGS: bool = true;
    /// p and (1 + p)/pi.
    type Prepared<T: Scalar> = [T; 2];
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(&[power, scale]: &[T; 2], g: &Geometry<T::Real>) -> [T; 1] {
        let sin2: T::Real = g.sin2_h();
        // Along the normal the logarithm stays finite: the power there is 0, and its derivative would be 0 times infinity.
        let value = (power * sin2.greater(T::Real::TINY).ln()).exp() * scale;
        let zero = T::constant(0.0);
        [T::if_less(zero.value(), sin2, value, zero)]
    }
}

impl Part for CharlieDensity {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [roughness] = shapes.take();
        let power = roughness.recip().times(0.5);
        [power, power.plus(1.0).times(FRAC_1_PI)]
    }
}

/// V. Its shape is a.
pub(crate) struct CharlieVisibility;

/// k1..k5, and 2 l(1/2).
type Fit<T> = [T; 6];

fn fit<T: Scalar>(roughness: T) -> Fit<T> {
    const ROUGH: [f64; 5] = [21.5473, 3.82987, 0.19823, -1.97760, -4.32054];
    const SMOOTH: [f64; 5] = [25.3245, 3.32435, 0.16801, -1.27393, -4.85967];
    let share = (-roughness).plus(1.0).squared();
    let mut between =
        ROUGH.into_iter().zip(SMOOTH).map(|(rough, smooth)| share.times(smooth - rough).plus(rough));
    let mut fit: Fit<T> = std::array::from_fn(|_| between.next().unwrap_or(T::constant(0.0)));
    fit[5] = exponent(&fit, T::Real::literal(0.5)).times(2.0);
    fit
}

/// l(c)
#[inline(always)]
fn exponent<T: Scalar>(&[k1, k2, k3, k4, k5, _]: &Fit<T>, cos: T::Real) -> T {
    k1 / (k2 * (k3 * cos.ln()).exp()).plus(1.0) + k4 * cos + k5
}

#[inline(always)]
fn lambda<T: Scalar>(fit: &Fit<T>, cos: T::Real) -> T {
    let half = T::Real::literal(0.5);
    let upper: T::Real = (-cos).plus(1.0);
    // The logarithm of 0 would make derivatives undefined.
    let place = T::Real::if_less(cos, half, cos, upper.greater(T::Real::TINY));
    let l = exponent(fit, place);
    T::if_less(cos, half, l, fit[5] - l).exp()
}

/// V between directions whose Lambda and cosines these are.
#[inline(always)]
fn visibility<T: Scalar>(lambda: [T; 2], [ci, co]: [T::Real; 2]) -> T {
    let [of_light, of_viewer] = lambda;
    let cosines: T::Real = (ci * co).times(4.0);
    ((of_light + of_viewer).plus(1.0) * cosines).recip()
}

impl Kernel for CharlieVisibility {
    type Prepared<T: Scalar> = Fit<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(fit: &Fit<T>, g: &Geometry<T::Real>) -> [T; 1] {
        let cosines = [g.cos_i(), g.cos_o()].map(|cos| cos.greater(T::Real::literal(LEAST)));
        let [ci, co] = cosines;
        [visibility([lambda(fit, ci), lambda(fit, co)], cosines)]
    }
}

impl Part for CharlieVisibility {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Fit<T> {
        let [roughness] = shapes.take();
        fit(roughness)
    }
}

/// Outgoing directions at one cosine.
struct Ring {
    cos: f64,
    /// Twice co dco, for both halves of the ring.
    weight: f64,
    /// ln sin^2(theta_h) along half of the ring, and the share of the azimuth.
    halves: Vec<(f64, f64)>,
}

/// The cosine of a point of the table.
fn cosine(k: usize) -> f64 {
    // Rounding must not raise it above 1.
    (LEAST_ROOT + (1.0 - LEAST_ROOT) * count(k) / count(CELLS)).powi(8).min(1.0)
}

/// Outgoing directions for light at cosine `cos`.
fn rings(cos: f64) -> Vec<Ring> {
    /// The fourth roots of cosines between which the integrand is smooth: Lambda has a bend at 1/2 and is cut off at the least.
    const ALONG: [f64; 6] = [0.0, 0.125, 0.4, 0.65, 0.840_896_415_253_714_5, 1.0];
    /// Panels of the azimuth, in half turns: opposite to the light the half vector turns from the horizon to the normal, the faster
    /// the closer both are to grazing.
    const AROUND: [f64; 5] = [0.0, 0.6, 0.88, 0.97, 1.0];
    let (along, around) = (GaussLegendre::new(6), GaussLegendre::new(8));
    let sin = (1.0 - cos * cos).sqrt();
    let mut all = Vec::new();
    for panel in ALONG.windows(2) {
        along.for_each(panel[0], panel[1], |root, share| {
            let co = root.powi(4);
            let so = (1.0 - co * co).sqrt();
            let mut halves = Vec::new();
            for part in AROUND.windows(2) {
                around.for_each(PI * part[0], PI * part[1], |azimuth, share| {
                    let [x, y, z] = [sin + so * azimuth.cos(), so * azimuth.sin(), cos + co];
                    let flat = x * x + y * y;
                    halves.push(((flat / (flat + z * z)).max(f64::MIN_POSITIVE).ln(), share));
                });
            }
            all.push(Ring { cos: co, weight: 2.0 * co * 4.0 * root.powi(3) * share, halves });
        });
    }
    all
}

/// The outgoing directions for every point of the table.
static RINGS: LazyLock<Vec<Vec<Ring>>> = LazyLock::new(|| (0..=CELLS).map(|k| rings(cosine(k))).collect());

/// E at a point of the table.
fn albedo<T: Scalar>(k: usize, fit: &Fit<T>, [power, scale]: [T; 2]) -> T {
    let light = T::Real::literal(cosine(k));
    let of_light = lambda(fit, light);
    let sum = RINGS[k].iter().fold(T::constant(0.0), |sum, ring| {
        let viewer = T::Real::literal(ring.cos.max(LEAST));
        let seen = visibility([of_light, lambda(fit, viewer)], [light, viewer]).times(ring.weight);
        let facets = ring
            .halves
            .iter()
            .fold(T::constant(0.0), |sum, (ln_sin2, share)| sum + power.times(*ln_sin2).exp().times(*share));
        sum + seen * facets
    });
    sum * scale
}

/// 1 - E of the direction in which the sheen sends back more, and 0 where that is more than it receives. Its shape is a.
pub(crate) struct BelowCharlie;

impl Kernel for BelowCharlie {
    /// 1 - E over the eighth root of the cosine.
    type Prepared<T: Scalar> = Cubics<T, { CELLS + 1 }>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(table: &Self::Prepared<T>, g: &Geometry<T::Real>) -> [T; 1] {
        let [a, b] = [rest(table, g.cos_i()), rest(table, g.cos_o())];
        let least = T::if_less(a.value(), b.value(), a, b);
        let zero = T::constant(0.0);
        [T::if_less(zero.value(), least.value(), least, zero)]
    }
}

/// 1 - E
#[inline(always)]
fn rest<T: Scalar>(table: &Cubics<T, { CELLS + 1 }>, cos: T::Real) -> T {
    let root: T::Real = cos.greater(T::Real::literal(LEAST)).sqrt().sqrt().sqrt();
    // Rounding must not lead below the table.
    table.at(root.plus(-LEAST_ROOT).greater(T::Real::literal(0.0)).times(count(CELLS) / (1.0 - LEAST_ROOT)))
}

impl Part for BelowCharlie {
    type Kernel = Self;
    const SHAPES: usize = 1;
    const PREPARES_LONG: bool = true;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        let [roughness] = shapes.take();
        let (fit, density) = (fit(roughness), CharlieDensity::prepare(Values::new(&[roughness])));
        Cubics::new(std::array::from_fn(|k| (-albedo(k, &fit, density)).plus(1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// E by a different method: the printed formulas integrated over the angles of the outgoing direction, on many panels that get
    /// narrower towards the horizon and towards the direction opposite to the light.
    fn brute_force(ci: f64, a: f64) -> f64 {
        let mix = |rough: f64, smooth: f64| rough + (1.0 - a).powi(2) * (smooth - rough);
        let l = |x: f64| {
            let top = mix(21.5473, 25.3245) / (1.0 + mix(3.82987, 3.32435) * x.powf(mix(0.19823, 0.16801)));
            top + mix(-1.97760, -1.27393) * x + mix(-4.32054, -4.85967)
        };
        let lambda = |c: f64| if c < 0.5 { l(c).exp() } else { (2.0 * l(0.5) - l(1.0 - c)).exp() };
        let sin = (1.0 - ci * ci).sqrt();
        let lobe = |theta: f64, phi: f64| {
            let sum = [sin + theta.sin() * phi.cos(), theta.sin() * phi.sin(), ci + theta.cos()];
            let cos2 = sum[2] * sum[2] / sum.iter().map(|x| x * x).sum::<f64>();
            let density = (2.0 + 1.0 / a) * (1.0 - cos2).powf(0.5 / a) / (2.0 * PI);
            let co = theta.cos().max(LEAST);
            density / ((1.0 + lambda(ci) + lambda(co)) * 4.0 * ci * co)
        };
        let rule = GaussLegendre::new(16);
        let towards = |from: f64, to: f64| -> Vec<f64> {
            (0..16).map(|k| to - (to - from) * 0.5_f64.powi(k)).chain([to]).collect()
        };
        let mut thetas = [vec![0.0], towards(std::f64::consts::FRAC_PI_3, FRAC_PI_2)].concat();
        thetas.push(LEAST.acos());
        thetas.sort_by(f64::total_cmp);
        let phis = towards(0.0, PI);
        let ring = |theta: f64| -> f64 {
            let half = phis.windows(2).map(|p| rule.integrate(p[0], p[1], |phi: f64| lobe(theta, phi)));
            2.0 * half.sum::<f64>() * theta.sin() * theta.cos()
        };
        thetas.windows(2).map(|t| rule.integrate(t[0], t[1], ring)).sum()
    }

    #[test]
    fn albedo_agrees_with_brute_force() {
        for a in [0.01, 0.04, 0.25, 1.0] {
            let table = BelowCharlie::prepare(Values::new(&[a]));
            for degrees in [0.0, 20.0, 35.0, 55.0, 62.0, 75.0, 85.0, 89.0, 89.9_f64] {
                let cos = degrees.to_radians().cos();
                let error = 1.0 - rest(&table, cos) - brute_force(cos, a);
                assert!(error.abs() < 2e-4, "a {a}, {degrees} degrees: {error:e}");
            }
        }
    }

    /// D is a density of facets: the integral of D cos(theta_h) over the hemisphere is 1.
    #[test]
    fn density_is_normalised() {
        let rule = GaussLegendre::new(64);
        for a in [0.02, 0.3, 1.0] {
            let prepared = CharlieDensity::prepare(Values::new(&[a]));
            let at = |theta: f64| {
                let h = [theta.sin(), 0.0, theta.cos()];
                let [density] = CharlieDensity::at::<f64>(&prepared, &Geometry::new(h, h));
                2.0 * PI * density * theta.sin() * theta.cos()
            };
            let whole: f64 = rule.integrate(0.0, FRAC_PI_2, at);
            assert!((whole - 1.0).abs() < 1e-10, "a {a}: {whole}");
        }
    }
}
