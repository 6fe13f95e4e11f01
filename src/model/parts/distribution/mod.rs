//! Facet distributions D(h), normalised so that the integral of D(h) (n.h) over the hemisphere is 1.

pub(crate) mod abc;
mod beckmann;
mod blinn_phong;
mod directional_slope_table;
mod exponential_power;
mod gaussian;
mod ggx;
mod gtr;
pub mod half_angle;
mod registry;
mod roughness;
mod sgd;
mod slope_table;
mod student_t;
mod tabulated;

pub use registry::Distribution;
pub use slope_table::SlopeTable;

use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::{Kernel, ParamSpec, Part, Values};
pub(crate) use ggx::Ggx;
pub(crate) use gtr::Gtr;
pub(crate) use roughness::{Anisotropic, Isotropic, Roughness};
use std::marker::PhantomData;

/// A distribution of facet normals.
pub trait FacetDistribution: 'static {
    /// Number of parameters, all of which are shapes.
    const SHAPES: usize;
    /// Whether [`FacetDistribution::prepare`] takes longer than evaluating a block.
    const DENSITY_TAKES_LONG: bool = false;
    /// Whether [`FacetDistribution::prepare_smith`] takes longer than evaluating a block.
    const SMITH_TAKES_LONG: bool = false;
    /// Quantities for D that depend only on the shapes.
    type Prepared<T: Scalar>: Clone + Send + Sync + 'static;
    /// The form of its Smith shadowing.
    type Smith: SmithForm;
    /// The roughness with which it is treated as a Beckmann distribution.
    type Beckmann: Roughness;
    /// Number of shapes, from the first on, that determine that roughness.
    const BECKMANN_SHAPES: usize = Self::Beckmann::SHAPES;

    /// The parameters.
    fn parameters() -> Vec<ParamSpec>;

    /// Computes the quantities for D, when the shapes have changed.
    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> Self::Prepared<T>;

    /// D(h), 1/sr.
    fn density<T: Scalar>(prepared: &Self::Prepared<T>, g: &Geometry<T::Real>) -> T;

    /// Computes the quantities for Smith's shadowing, when the shapes have changed.
    fn prepare_smith<T: Scalar>(shapes: Values<'_, T>) -> <Self::Smith as SmithForm>::Prepared<T>;

    /// The roughness of the Beckmann distribution that it is treated as.
    fn prepare_beckmann<T: Scalar>(mut shapes: Values<'_, T>) -> <Self::Beckmann as Roughness>::Prepared<T> {
        Self::Beckmann::prepare(&mut shapes)
    }
}

/// A form of Smith's shadowing: a closed form or a table. Distributions that share one differ in how they prepare it.
pub trait SmithForm: 'static {
    /// Quantities that depend only on the shapes.
    type Prepared<T: Scalar>: Clone + Send + Sync + 'static;

    /// C = cos(theta) (1 + 2 Lambda(theta)) with Smith's Lambda, for the light and for the viewer. The cosine keeps it finite at
    /// grazing, and in this form no known Lambda needs a difference.
    fn smith_cosines<T: Scalar>(prepared: &Self::Prepared<T>, g: &Geometry<T::Real>) -> (T, T);
}

/// A form of shadowing and masking: which facets both the light and the viewer see.
pub trait Shadows: 'static {
    /// The visibility G/(4 ci co) of distribution `D`: a part with the shapes of the distribution.
    type Visibility<D: FacetDistribution>: Part;
}

/// The density of a distribution as a part of a lobe.
pub struct Density<D>(PhantomData<D>);

impl<D: FacetDistribution> Kernel for Density<D> {
    const SHARED_ON_RINGS: bool = true;
    type Prepared<T: Scalar> = D::Prepared<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(prepared: &D::Prepared<T>, g: &Geometry<T::Real>) -> [T; 1] {
        [D::density(prepared, g)]
    }
}

impl<D: FacetDistribution> Part for Density<D> {
    type Kernel = Self;
    const SHAPES: usize = D::SHAPES;
    const PREPARES_LONG: bool = D::DENSITY_TAKES_LONG;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> D::Prepared<T> {
        D::prepare(shapes)
    }
}

/// e^exponent times factor, for the case that the power alone is subnormal and the product is not.
#[inline(always)]
fn exp_times<T: Scalar>(exponent: T, factor: T) -> T {
    let half = exponent.times(0.5).exp();
    half * factor * half
}

/// (e^x - 1)/x, smooth at 0.
#[inline(always)]
pub(crate) fn relative_exp_m1<T: Scalar>(x: T) -> T {
    /// Terms of the series, the last of them below 1e-17 where it is used.
    const TERMS: u8 = 16;
    let small = T::constant(0.5);
    let series =
        (1..TERMS).rev().fold(T::constant(1.0), |sum, k| (sum * x).times(1.0 / f64::from(k + 1)).plus(1.0));
    let magnitude = T::if_less(x.value(), T::constant(0.0).value(), -x, x);
    // Avoids 0/0 where the series is used.
    let large = T::if_less(magnitude.value(), small.value(), small, x);
    T::if_less(magnitude.value(), small.value(), series, large.exp().plus(-1.0) / large)
}

#[cfg(test)]
#[expect(clippy::excessive_precision, reason = "golden values are given as computed, to 17 digits")]
mod tests {
    use super::*;
    use crate::math::GaussLegendre;
    use approx::assert_relative_eq;
    use rayon::prelude::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// A geometry whose half vector and light are both at `theta`.
    fn at(theta: f64, phi: f64) -> Geometry<f64> {
        let h = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
        Geometry { wi: h, wo: h, h, cos_d: 1.0, one_less_cos_d: 0.0 }
    }

    fn is_isotropic(d: Distribution) -> bool {
        d.parameters().iter().all(|spec| spec.isotropy.is_none())
    }

    /// Like [`at`], from the tangent of the polar angle, which has more digits near the horizon.
    fn facet(tan: f64, phi: f64) -> Geometry<f64> {
        let cos = 1.0 / tan.hypot(1.0);
        let h = [tan * cos * phi.cos(), tan * cos * phi.sin(), cos];
        Geometry { wi: h, wo: h, h, cos_d: 1.0, one_less_cos_d: 0.0 }
    }

    /// Every distribution at both ends of a range of each shape, and at its start.
    fn everywhere(range: impl Fn(&ParamSpec) -> (f64, f64)) -> Vec<(&'static str, Distribution, Vec<f64>)> {
        let mut all = Vec::new();
        for name in Distribution::names() {
            let d = Distribution::named(name);
            let specs = d.parameters();
            let scanned = specs.iter().filter(|spec| spec.scanned).count();
            for combination in 0..3_usize.pow(u32::try_from(scanned).unwrap()) {
                let mut rest = combination;
                let shapes = specs.iter().map(|spec| {
                    if !spec.scanned {
                        return spec.initial;
                    }
                    let third = rest % 3;
                    rest /= 3;
                    [range(spec).0, spec.initial, range(spec).1][third]
                });
                all.push((name, d, shapes.collect()));
            }
        }
        all.push(("tabulated", Distribution::Tabulated, vec![0.1, 3.0, 1.0, 0.5, 6.0, 2.5, 1.7, 1.65]));
        all.push(("tabulated", Distribution::Tabulated, vec![0.4, 2.5, 3.0, 6.0, 12.0, 20.0, 30.0, 40.0]));
        all
    }

    /// int f(theta, phi) sin(theta) dtheta dphi over the hemisphere: on panels in the logarithm of tan(theta), from far inside
    /// the sharpest peak to the horizon, and over a quarter turn that represents all four.
    fn over_hemisphere(d: Distribution, f: impl Fn(&Geometry<f64>) -> f64) -> f64 {
        let rule = GaussLegendre::new(24);
        // Likewise in the azimuth, around both axes.
        let turn: Vec<f64> = (-21..=21).map(|k| 2.0 * f64::from(k)).collect();
        let ring = |tan: f64| {
            if is_isotropic(d) {
                return 2.0 * PI * f(&facet(tan, 0.3));
            }
            let at = |v: f64| {
                let phi = v.exp().atan();
                4.0 * f(&facet(tan, phi)) * phi.sin() * phi.cos()
            };
            turn.windows(2).map(|p| rule.integrate(p[0], p[1], at)).sum::<f64>()
        };
        // A table's exponents have kinks, which finer panels resolve.
        let parts = if matches!(d, Distribution::Tabulated) { 16 } else { 1 };
        let edges: Vec<f64> = (-60 * parts..=90 * parts).map(|k| f64::from(k) / f64::from(parts)).collect();
        edges
            .windows(2)
            .map(|e| {
                rule.integrate(e[0], e[1], |v: f64| {
                    let tan = (0.5 * v).exp();
                    // sin dtheta = tan cos^3 dtan, dtan = tan/2 dv
                    ring(tan) * 0.5 * tan * tan / tan.hypot(1.0).powi(3)
                })
            })
            .sum()
    }

    #[test]
    fn integrate_to_one() {
        for (name, d, shapes) in everywhere(|spec| spec.bounds) {
            let density = d.density(&shapes);
            let integral = over_hemisphere(d, |g| density(g) * g.cos_h());
            assert!((integral - 1.0).abs() < 1e-8, "{name} {shapes:?}: {integral}");
        }
    }

    #[test]
    fn golden_values() {
        let d =
            |name, shapes: &[f64]| Distribution::named(name).density(shapes)(&at(30f64.to_radians(), 0.3));
        for (found, golden) in [
            (d("beckmann", &[0.3]), 0.154_877_029_345_865_75),
            (d("beckmann-anisotropic", &[0.3, 0.3]), 0.154_877_029_345_865_75),
            (d("ggx", &[0.3]), 0.284_187_634_760_157_83),
            (d("ggx-anisotropic", &[0.3, 0.3]), 0.284_187_634_760_157_83),
            // n = 50 is m = sqrt(2/52).
            (d("blinn-phong", &[(2.0 / 52.0_f64).sqrt()]), 0.006_228_092_585_438_294_9),
            (d("gtr", &[0.3, 1.5]), 0.346_951_799_406_326_58),
            (d("gtr", &[0.3, 1.0]), 0.378_879_508_453_905_78),
            (d("gtr", &[0.3, 2.0]), 0.284_187_634_760_157_83),
            (d("student-t", &[0.3, 3.0]), 0.271_084_201_466_833_31),
            (d("student-t", &[0.3, 2.0]), 0.284_187_634_760_157_83),
            (d("exponential-power", &[0.3, 0.6]), 0.465_960_838_874_393_66),
            (d("exponential-power", &[0.3, 1.0]), 0.154_877_029_345_865_75),
            (d("sgd", &[0.05, 0.5]), 0.003_967_117_392_304_831_1),
            (sgd::normaliser(0.05, 0.5), 15.008_442_285_299_703),
            (abc::normaliser(1000.0, 1.2), 0.021_583_150_959_071_866),
            (d("tabulated", &[0.3, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0]), 0.284_187_634_760_157_83),
        ] {
            assert_relative_eq!(found, golden, max_relative = 1e-12);
        }
        // int exp(-(a/m)^2) cos a dw is quoted as .031207 for m = .1 and .26637 for m = .3.
        for (m, integral) in [(0.1, 0.031_207), (0.3, 0.266_37)] {
            let peak = Distribution::named("gaussian").density(&[m])(&at(0.0, 0.0));
            assert_relative_eq!(1.0 / peak, integral, max_relative = 3e-5);
        }
        // Bagher, Soler and Holzschuch's table prints K for every material: alum-bronze's three channels.
        for (alpha, p, k) in [
            (0.014_832, 0.459_076, 46.3841),
            (0.030_012_6, 0.450_056, 24.5961),
            (0.049_033_9, 0.529_272, 14.8261),
            (0.000_117_714, 0.402_598, 5710.42),
        ] {
            assert_relative_eq!(sgd::normaliser(alpha, p), k, max_relative = 2e-5);
        }
    }

    /// Near the points where the formula is 0/0, and where the series is used.
    #[test]
    fn gtr_is_smooth_where_its_normalisation_is_0_over_0() {
        let peak = |m: f64, gamma: f64| Distribution::Gtr.density(&[m, gamma])(&at(0.0, 0.0));
        for (m, gamma) in [(0.3, 1.0), (1.0, 1.7), (1.0, 1.0)] {
            for step in [1e-3, 1e-6, 1e-9] {
                let middle = 0.5 * (peak(m, gamma + step) + peak(m, gamma - step));
                assert_relative_eq!(middle, peak(m, gamma), max_relative = 10.0 * step * step + 1e-14);
            }
        }
        assert_relative_eq!(peak(1.0, 3.0), 1.0 / PI, max_relative = 1e-14);
    }

    #[test]
    fn half_angles() {
        for degrees in [0.5_f64, 5.0, 20.0, 50.0] {
            let beta = degrees.to_radians();
            for (name, m) in [
                ("blinn-phong", half_angle::blinn_phong_m(beta)),
                ("gaussian", half_angle::gaussian_m(beta)),
                ("ggx", half_angle::ggx_m(beta)),
            ] {
                let density = Distribution::named(name).density(&[m]);
                let d = |theta: f64| density(&at(theta, 0.0));
                assert_relative_eq!(d(beta) / d(0.0), 0.5, max_relative = 1e-12);
            }
        }
    }

    #[test]
    fn smith_lambda() {
        let theta = 75f64.to_radians();
        for (name, golden) in [("beckmann", 0.038_963_615_764_392_13), ("ggx", 0.250_589_483_460_299_33)] {
            let lambda = Distribution::named(name).cos_lambda(&[0.3])(&at(theta, 0.0)) / theta.cos();
            assert_relative_eq!(lambda, golden, max_relative = 1e-12);
        }
    }

    /// Compares the table with distributions whose Smith integral has a closed form.
    #[test]
    fn tabulated_shadowing_agrees_with_closed_forms() {
        let beckmann = SlopeTable::<f64>::new(&|u2: f64| (-u2).exp() / PI);
        let ggx = SlopeTable::<f64>::new(&|u2: f64| (1.0 + u2).powi(-2) / PI);
        let mut worst = 0.0_f64;
        for (name, table) in [("beckmann", beckmann), ("ggx", ggx)] {
            for m in [1e-4, 1e-3, 0.01, 0.1, 0.3, 0.6, 1.0] {
                let closed = Distribution::named(name).cos_lambda(&[m]);
                for k in 0..2000 {
                    let theta = FRAC_PI_2 * (1.0 - (f64::from(k) / 2000.0).powi(3));
                    let g = at(theta, 0.0);
                    let cos = g.cos_i();
                    let g1 = |cos_lambda: f64| cos / (cos + cos_lambda);
                    let exact = g1(closed(&g));
                    let found = g1(0.5 * (table.smith_cosine(m * m * g.sin2_i(), cos) - cos));
                    worst = worst.max((found / exact - 1.0).abs());
                }
            }
        }
        assert!(worst < 1e-6, "{worst:e}");
    }

    /// Two roughnesses that are equal shadow as one does: the table for all directions agrees with that for one.
    #[test]
    fn equal_roughnesses_shadow_as_one() {
        let mut worst = 0.0_f64;
        for m in [1e-4, 1e-3, 0.01, 0.1, 0.3, 0.6, 1.0] {
            let one = Distribution::named("blinn-phong").cos_lambda(&[m]);
            let two = Distribution::named("blinn-phong-anisotropic").cos_lambda(&[m, m]);
            for k in 0..500 {
                let g = at(FRAC_PI_2 * (1.0 - (f64::from(k) / 500.0).powi(3)), 0.1 * f64::from(k));
                let cos = g.cos_i();
                worst = worst.max(((cos + one(&g)) / (cos + two(&g)) - 1.0).abs());
            }
        }
        assert!(worst < 1e-6, "{worst:e}");
    }

    /// The facets visible from any direction cover the projection of the surface: int G1 D (o.h)+ dh = cos(theta) (Heitz 2014,
    /// eq. 14). This links the shadowing to the distribution.
    #[test]
    #[ignore = "takes a minute"]
    fn visible_facets_cover_the_surface() {
        let (rule, radial) = (GaussLegendre::new(48), GaussLegendre::new(32));
        // A sharper ridge would need other panels where it meets the edge of the visible facets.
        let range = |spec: &ParamSpec| match spec.name {
            "mx" | "my" => (0.05, 1.0),
            _ => spec.typical,
        };
        let all: Vec<_> = everywhere(range).into_iter().collect();
        all.into_par_iter().for_each(|(name, d, shapes)| {
            let (density, cos_lambda) = (d.density(&shapes), d.cos_lambda(&shapes));
            for theta in [0.3_f64, 1.0, 1.4, 1.54] {
                let view = at(theta, 0.4);
                let cos = view.cos_i();
                let g1 = cos / (cos + cos_lambda(&view));
                // Panels in the azimuth around the two directions where (o.h)+ has its kinks, and around those of the axes.
                let ring = |tan: f64| {
                    let edge = (-1.0 / (theta.tan() * tan)).clamp(-1.0, 1.0).acos();
                    let mut turns = vec![0.4 - edge, 0.4 + edge];
                    let axes =
                        if is_isotropic(d) { vec![] } else { vec![-PI, -FRAC_PI_2, 0.0, FRAC_PI_2, PI] };
                    for axis in axes {
                        for k in 0..8_i32 {
                            let offset = 0.5 * (-f64::from(k)).exp();
                            let inside = |turn: &f64| (turn - 0.4).abs() < edge;
                            turns.extend([axis - offset, axis + offset].into_iter().filter(inside));
                        }
                    }
                    turns.sort_by(f64::total_cmp);
                    let facing = |phi: f64| {
                        let h = facet(tan, phi);
                        let dot: f64 = h.h.iter().zip(view.wi).map(|(a, b)| a * b).sum();
                        dot * density(&h)
                    };
                    turns.windows(2).map(|p| rule.integrate(p[0], p[1], facing)).sum::<f64>()
                };
                let edges: Vec<f64> = (-60..=90).map(f64::from).collect();
                let seen: f64 = edges
                    .windows(2)
                    .map(|e| {
                        radial.integrate(e[0], e[1], |v: f64| {
                            let tan = (0.5 * v).exp();
                            ring(tan) * 0.5 * tan * tan / tan.hypot(1.0).powi(3)
                        })
                    })
                    .sum();
                // The errors stated in slope_table.rs.
                let stated = if matches!(d, Distribution::Tabulated) { 2e-4 } else { 2e-5 };
                assert!(
                    (g1 * seen / cos - 1.0).abs() < stated,
                    "{name} {shapes:?} {theta}: {}",
                    g1 * seen / cos
                );
            }
        });
    }
}
