//! Facet distributions D(h), normalised so that the integral of D(h) (n.h) over the hemisphere is 1.

mod beckmann;
mod blinn_phong;
mod gaussian;
mod ggx;

use super::parts;
use super::shadowing::{Masking, Visibility};
use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::{Part, Values, Visitor};
use std::marker::PhantomData;

/// Quantities of the roughness alone.
pub type Constants<T> = [T; 3];

/// A distribution of facet normals with one roughness m.
pub trait FacetDistribution: 'static {
    /// What depends on the roughness alone, computed once per block.
    fn prepare<T: Scalar>(m: T) -> Constants<T>;

    /// D(h), 1/sr.
    fn density<T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> T;

    /// cos(theta) (1 + 2 Lambda(theta)) with Smith's Lambda for this distribution, from the cosine and the squared
    /// sine of theta. The cosine keeps it finite at grazing; in this form no Lambda that is known needs a
    /// difference.
    fn stretched_cos<T: Scalar>(constants: &Constants<T>, cos: T::Real, sin2: T::Real) -> T;

    /// The same for the light and for the viewer.
    #[inline(always)]
    fn stretched_cosines<T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> (T, T) {
        let of = |cos, sin2| Self::stretched_cos(constants, cos, sin2);
        (of(g.cos_i(), g.sin2_i()), of(g.cos_o(), g.sin2_o()))
    }
}

/// The density of a distribution as a part of a lobe.
pub struct Density<D>(PhantomData<D>);

impl<D: FacetDistribution> Part for Density<D> {
    const SHAPES: usize = 1;
    const SHARED_ON_RINGS: bool = true;
    type Prepared<T: Scalar> = Constants<T>;
    type Output<T: Scalar> = [T; 1];

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Constants<T> {
        let [m] = shapes.take();
        D::prepare(m)
    }

    #[inline(always)]
    fn at<T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> [T; 1] {
        [D::density(constants, g)]
    }
}

macro_rules! distributions {
    ($($name:literal => $module:ident::$part:ident),* $(,)?) => {
        parts! {
            /// Any facet distribution.
            Distribution: $($name => $module::$part),*
        }

        impl Distribution {
            /// Shows the density as a part whose shapes are a lobe's first.
            pub(crate) fn show(self, visitor: &mut impl Visitor) {
                match self { $(Self::$part => visitor.part::<Density<$module::$part>>(0)),* }
            }

            /// Shows what `G` makes of the distribution as a part whose shapes are a lobe's first.
            pub(crate) fn show_visibility<G: Masking>(self, visitor: &mut impl Visitor) {
                match self { $(Self::$part => visitor.part::<Visibility<G, $module::$part>>(0)),* }
            }
        }

        #[cfg(test)]
        impl Distribution {
            fn prepare(self, m: f64) -> Constants<f64> {
                match self { $(Self::$part => $module::$part::prepare(m)),* }
            }

            fn density(self, constants: &Constants<f64>, g: &Geometry<f64>) -> f64 {
                match self { $(Self::$part => $module::$part::density(constants, g)),* }
            }

            /// cos(theta) Lambda(theta).
            fn cos_lambda(self, constants: &Constants<f64>, cos: f64, sin2: f64) -> f64 {
                let stretched = match self { $(Self::$part => $module::$part::stretched_cos(constants, cos, sin2)),* };
                0.5 * (stretched - cos)
            }
        }
    };
}

distributions! {
    "ggx" => ggx::Ggx,
    "beckmann" => beckmann::Beckmann,
    "blinn-phong" => blinn_phong::BlinnPhong,
    "gaussian" => gaussian::Gaussian,
}

#[cfg(test)]
#[expect(clippy::excessive_precision, reason = "golden values stand as computed, to 17 digits")]
mod tests {
    use super::*;
    use crate::math::GaussLegendre;
    use approx::assert_relative_eq;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// Geometry whose half vector stands at `theta_h`.
    fn at(theta_h: f64) -> Geometry<f64> {
        let h = [theta_h.sin(), 0.0, theta_h.cos()];
        Geometry { wi: h, wo: h, h, cos_d: 1.0 }
    }

    /// Lambda(theta) by quadrature of the slope distribution (Heitz 2014, appendix A):
    /// Lambda = (1/mu) int_mu^inf (q - mu) P2(q) dq, P2 the marginal of P22 = D c^4.
    fn lambda_by_quadrature(d: Distribution, constants: &Constants<f64>, theta: f64) -> f64 {
        let rule = GaussLegendre::new(200);
        let mu = 1.0 / theta.tan();
        let marginal = |q: f64| {
            // int over the other slope, both half lines, in units of the scale on which it varies.
            let scale = q.hypot(0.3);
            2.0 * scale
                * rule.integrate(0.0, FRAC_PI_2, |t| {
                    let r = scale * t.tan();
                    let theta_h = q.hypot(r).atan();
                    let c = theta_h.cos();
                    d.density(constants, &at(theta_h)) * c.powi(4) / t.cos().powi(2)
                })
        };
        rule.integrate(mu.atan(), FRAC_PI_2, |t| (t.tan() - mu) * marginal(t.tan()) / t.cos().powi(2)) / mu
    }

    #[test]
    fn integrate_to_one() {
        let rule = GaussLegendre::new(64);
        for name in Distribution::names() {
            let d = Distribution::named(name);
            for m in [1e-3, 0.01, 0.1, 0.3, 0.6, 1.0] {
                let constants = d.prepare(m);
                // Panels that double from far inside the peak to the horizon.
                let mut edges = vec![0.0];
                let mut edge = m * 1e-2;
                while edge < FRAC_PI_2 {
                    edges.push(edge);
                    edge *= 1.5;
                }
                edges.push(FRAC_PI_2);
                let integral: f64 = edges
                    .windows(2)
                    .map(|e| {
                        rule.integrate(e[0], e[1], |theta: f64| {
                            2.0 * PI * d.density(&constants, &at(theta)) * theta.sin() * theta.cos()
                        })
                    })
                    .sum();
                assert_relative_eq!(integral, 1.0, max_relative = 1e-10);
            }
        }
    }

    #[test]
    fn golden_values() {
        let half = 30f64.to_radians();
        let d = |name, m| {
            let d = Distribution::named(name);
            d.density(&d.prepare(m), &at(half))
        };
        assert_relative_eq!(d("beckmann", 0.3), 0.154_877_029_345_865_75, max_relative = 1e-12);
        assert_relative_eq!(d("ggx", 0.3), 0.284_187_634_760_157_83, max_relative = 1e-12);
        // n = 50 is m = sqrt(2/52).
        let m = (2.0 / 52.0_f64).sqrt();
        assert_relative_eq!(d("blinn-phong", m), 0.006_228_092_585_438_294_9, max_relative = 1e-12);
        // int exp(-(a/m)^2) cos a dw is quoted as .031207 for m = .1 and .26637 for m = .3.
        for (m, integral) in [(0.1, 0.031_207), (0.3, 0.266_37)] {
            let g = Distribution::named("gaussian");
            let peak = g.density(&g.prepare(m), &at(0.0));
            assert_relative_eq!(1.0 / peak, integral, max_relative = 3e-5);
        }
    }

    #[test]
    fn smith_lambda() {
        let theta = 75f64.to_radians();
        for (name, golden) in [("beckmann", 0.038_963_615_764_392_13), ("ggx", 0.250_589_483_460_299_33)] {
            let d = Distribution::named(name);
            let constants = d.prepare(0.3);
            let lambda = d.cos_lambda(&constants, theta.cos(), theta.sin().powi(2)) / theta.cos();
            assert_relative_eq!(lambda, golden, max_relative = 1e-12);
            assert_relative_eq!(lambda_by_quadrature(d, &constants, theta), golden, max_relative = 1e-6);
        }
    }

    /// The facets seen from any direction cover the surface's own projection: int G1 D (o.h)+ dh = cos(theta)
    /// (Heitz 2014, eq. 14). It ties the shadowing to the distribution.
    #[test]
    fn visible_facets_cover_the_surface() {
        let rule = GaussLegendre::new(64);
        // Those with a Smith integral of their own; the others borrow Beckmann's.
        for name in ["ggx", "beckmann"] {
            let d = Distribution::named(name);
            for m in [0.1, 0.4, 1.0] {
                let constants = d.prepare(m);
                for theta in [0.3_f64, 1.0, 1.4] {
                    let (sin, cos) = theta.sin_cos();
                    let g1 = cos / (cos + d.cos_lambda(&constants, cos, sin * sin));
                    // tan(theta_h) = m s; panels in s carry both the peak and the tail.
                    let ring = |s: f64| {
                        let theta_h = (m * s).atan();
                        let (sin_h, cos_h) = theta_h.sin_cos();
                        // (o.h)+ has a kink where cos phi = -cot cot.
                        let edge = (-cos * cos_h / (sin * sin_h)).clamp(-1.0, 1.0).acos();
                        let facing =
                            rule.integrate(0.0, edge, |phi: f64| cos * cos_h + sin * sin_h * phi.cos());
                        2.0 * facing * d.density(&constants, &at(theta_h)) * sin_h * m
                            / (1.0 + (m * s).powi(2))
                    };
                    let panels = [0.0, 1.0, 2.0, 4.0, 8.0, 32.0, 256.0, 4096.0, 65536.0, 1e7];
                    let seen: f64 = panels.windows(2).map(|p| rule.integrate(p[0], p[1], ring)).sum();
                    assert_relative_eq!(g1 * seen, cos, max_relative = 1e-5);
                }
            }
        }
    }
}
