//! Hanrahan-Krueger: light scattered once in a layer below a smooth surface.
//!
//! With ci', co' the cosines inside after refraction, T = 1 - F(eta) the transmittance of an exact dielectric, and wi', wo' the
//! refracted directions, both pointing up:
//!
//! ```text
//! f = albedo T(ci) T(co) p(c)/(eta^2 (ci' + co')) (1 - exp(-tau (1/ci' + 1/co')))
//! p(c) = (1 - g^2)/(4 pi (1 + g^2 - 2 g c)^(3/2)),   c = -wi'.wo'   (forward scattering is c = 1)
//! ci' = sqrt(1 - (1 - ci^2)/eta^2)
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | albedo | 1 | 0..1 | single-scattering albedo W = sigma_s/(sigma_s + sigma_a) |
//! | g | 1 | -0.95..0.95 | mean cosine of scattering, Henyey-Greenstein; 0 isotropic, 0.8 skin or leaves, negative backward |
//! | tau | 1 | 1e-3..1e3 | optical depth of the layer; 0.1 a haze, 10 practically infinite |
//! | eta | 1 | 1..3 | refractive index; fixed at 1.5 unless freed |
//!
//! Hanrahan and Krueger 1993, Reflection from Layered Surfaces due to Subsurface Scattering, eq. 5,
//! doi:10.1145/166117.166139. Some texts omit the 1/eta^2 by which radiance decreases on its way out; others confuse radiance
//! with BRDF and lose a ci. This is only the single-scattering term. Light that is scattered more often is nearly diffuse; add
//! `lambert` or `dipole` for it.
//!
//! For a thin layer only the product albedo tau is determined, for a thick one (tau above about 5) only albedo. g is determined
//! by the rise towards backward or forward pairs of directions. But refraction keeps both directions within 42 degrees of the
//! normal at eta = 1.5, so that c stays below about -0.1, and the three are strongly correlated: data without noise determine
//! them, but if f is no larger than the noise one of them ends at a bound. Fix what is known. With strong forward scattering
//! (g above 0.3) little light comes back after one scattering.
//!
//! Reciprocal and energy conserving. Finite at grazing for eta > 1, since ci' + co' is at least 2 sqrt(1 - 1/eta^2);
//! at eta = 1 it grows as 1/(ci + co).

use crate::geometry::Geometry;
use crate::math::{Real, Scalar};
use crate::model::parts::distribution::relative_exp_m1;
use crate::model::parts::fresnel::{Constants, index_constants, index_transmittance};
use crate::model::{Choices, Kernel, Model, ParamSpec, Part, Scale, Values, Visitor};
use std::f64::consts::PI;

/// Light scattered once below a smooth surface.
#[derive(Clone, Copy, Debug)]
pub struct HanrahanKrueger;

/// Quantities that depend only on the shapes.
#[derive(Clone, Copy, Debug)]
pub struct Layer<T: Scalar> {
    /// |g|, the sign of g, and (1 - |g|)^2.
    size_g: T,
    sign_g: T::Real,
    rest_g2: T,
    /// (1 - g^2)/(4 pi eta^2)
    norm: T,
    tau: T,
    /// 1/eta^2 and 1 - 1/eta^2.
    bend: T,
    rest: T,
    surface: Constants<T>,
}

impl Kernel for HanrahanKrueger {
    type Prepared<T: Scalar> = Layer<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(l: &Layer<T>, g: &Geometry<T::Real>) -> [T; 1] {
        // Snell's law; cos'^2 as cos^2 + sin^2 (1 - 1/eta^2), which rounding cannot make negative.
        let refracted = |cos: T::Real, sin2: T::Real| -> T { l.rest * sin2 + cos * cos };
        let (inside_i, inside_o) =
            T::sqrt_pair(refracted(g.cos_i(), g.sin2_i()), refracted(g.cos_o(), g.sin2_o()));
        let sum: T = inside_i + inside_o;
        let product: T = inside_i * inside_o;

        // Henyey and Greenstein's phase function: 1 + g^2 + 2 g wi'.wo' = (1 - |g|)^2 + |g| |wi' + sign(g) wo'|^2, whose
        // terms are positive, while those of the other sum cancel.
        let ([ix, iy, _], [ox, oy, _]) = (g.wi, g.wo);
        let (x, y): (T::Real, T::Real) = (ix + l.sign_g * ox, iy + l.sign_g * oy);
        let across: T::Real = x * x + y * y;
        let z: T = inside_i + inside_o * l.sign_g;
        let spread: T = l.rest_g2 + l.size_g * (l.bend * across + z.squared());
        let phase: T = l.norm / (spread * spread.sqrt());

        // (1 - exp(-depth))/(ci' + co'), depth = tau (ci' + co')/(ci' co')
        let per_sum: T = l.tau / product;
        let depth: T = per_sum * sum;
        let deep: T = (-(-depth).exp()).plus(1.0) / sum;
        let kept = T::if_less(depth.value(), T::Real::literal(0.5), relative_exp_m1(-depth) * per_sum, deep);
        let (in_i, out_o) =
            (index_transmittance(&l.surface, g.cos_i()), index_transmittance(&l.surface, g.cos_o()));
        [phase * in_i * out_o * kept]
    }
}

impl Part for HanrahanKrueger {
    type Kernel = Self;
    const SHAPES: usize = 3;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Layer<T> {
        let [g, tau, eta] = shapes.take();
        let (zero, bend): (T::Real, T) = (T::Real::literal(0.0), (eta * eta).recip());
        let size_g = T::if_less(g.value(), zero, -g, g);
        let rest_g = (-size_g).plus(1.0);
        Layer {
            size_g,
            sign_g: T::Real::if_less(g.value(), zero, T::Real::literal(-1.0), T::Real::literal(1.0)),
            rest_g2: rest_g.squared(),
            norm: (rest_g * size_g.plus(1.0)).times(0.25 / PI) * bend,
            tau,
            bend,
            // For an index close to 1 the difference of squares would keep few digits.
            rest: eta.plus(-1.0) * eta.plus(1.0) * bend,
            surface: index_constants(eta),
        }
    }
}

impl Model for HanrahanKrueger {
    type Coefficients<T: Scalar> = [T; 1];

    const NAME: &'static str = "hanrahan-krueger";
    const SUMMARY: &'static str = "light scattered once in a layer below a smooth surface";
    const REFERENCE: &'static str = "Hanrahan and Krueger 1993, Reflection from Layered Surfaces due to Subsurface \
                                     Scattering, doi:10.1145/166117.166139";

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let shape = ParamSpec::shape;
        vec![
            ParamSpec::amplitude("albedo", "single-scattering albedo", 1.0, 0.5),
            shape("g", "mean cosine of scattering", (-0.95, 0.95), (-0.7, 0.8), 0.0, Scale::Linear),
            shape("tau", "optical depth", (1e-3, 1e3), (0.05, 5.0), 1.0, Scale::Log),
            shape("eta", "refractive index", (1.0, 3.0), (1.2, 2.0), 1.5, Scale::Linear).fixed(),
        ]
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        visitor.part::<Self>(0);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 1] {
        amplitudes.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::direction;
    use crate::math::GaussLegendre;
    use approx::assert_relative_eq;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;
    use std::f64::consts::{FRAC_PI_2, TAU};

    fn brdf([g, tau, eta]: [f64; 3], theta_i: f64, theta_o: f64, phi: f64) -> f64 {
        let pair = Geometry::new(direction(theta_i, 0.0).to_array(), direction(theta_o, phi).to_array());
        let [f] = HanrahanKrueger::at(&HanrahanKrueger::prepare(Values::new(&[g, tau, eta])), &pair);
        f
    }

    /// Fresnel's reflectance in Snell's form, from the two angles.
    fn fresnel(eta: f64, theta: f64) -> f64 {
        let inside = (theta.sin() / eta).asin();
        let (c, d) = (theta.cos(), inside.cos());
        let (s, p) = ((c - eta * d) / (c + eta * d), (eta * c - d) / (eta * c + d));
        0.5 * (s * s + p * p)
    }

    /// Compares with a layer cut into slices: each receives the attenuated refracted beam, and scatters light towards the viewer,
    /// part of which gets out.
    #[test]
    fn is_the_sum_over_depth() {
        let rule = GaussLegendre::new(40);
        for shapes in [[0.0_f64, 1.0_f64, 1.5_f64], [0.7, 0.3, 1.3], [-0.5, 8.0, 1.7], [0.4, 2.0, 1.0]] {
            let [g, tau, eta] = shapes;
            for (theta_i, theta_o, phi) in
                [(0.0, 0.0, 0.0), (0.5, 1.2, 2.5), (1.4, 1.5, 3.0), (0.9, 0.9, 0.0)]
            {
                let inside = |theta: f64, phi: f64| direction((theta.sin() / eta).asin(), phi);
                let (wi, wo) = (inside(theta_i, 0.0), inside(theta_o, phi));
                let cos = (-wi).dot(wo);
                let phase = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5));
                // For unit irradiance on the surface: the light that enters, per area across the beam.
                let beam = (1.0 - fresnel(eta, theta_i)) / wi.z;
                let slice = |t: f64| beam * (-t / wi.z).exp() * phase * (-t / wo.z).exp() / wo.z;
                let depths: Vec<f64> = (0..=8).map(|k| tau * f64::from(k) / 8.0).collect();
                let radiance: f64 = depths.windows(2).map(|d| rule.integrate(d[0], d[1], slice)).sum();
                let out = radiance * (1.0 - fresnel(eta, theta_o)) / (eta * eta);
                assert_relative_eq!(brdf(shapes, theta_i, theta_o, phi), out, max_relative = 1e-11);
            }
        }
    }

    /// Follows photons from outside to outside and counts those that leave after one scattering, in rings of the viewing angle.
    /// The simulation does not contain 1/eta^2, which must result from the refraction of the solid angle.
    #[test]
    fn agrees_with_a_monte_carlo_simulation() {
        const PHOTONS: u32 = 400_000;
        const RINGS: usize = 4;
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        let shapes = [0.4, 1.5, 1.4];
        let [g, tau, eta] = shapes;
        let theta_i = 0.7_f64;
        let wi = direction((theta_i.sin() / eta).asin(), 0.0);
        let entered = 1.0 - fresnel(eta, theta_i);
        let (mut sums, mut squares) = ([0.0; RINGS], [0.0; RINGS]);
        for _ in 0..PHOTONS {
            // The photon goes down along -wi and meets a scatterer at depth t, or leaves through the bottom.
            let t = -rng.random::<f64>().ln() * wi.z;
            if t > tau {
                continue;
            }
            let out = direction((1.0 - 2.0 * rng.random::<f64>()).acos(), TAU * rng.random::<f64>());
            // The photon goes up and is not totally reflected by the surface.
            let sin = eta * out.z.acos().sin();
            if out.z <= 0.0 || sin >= 1.0 {
                continue;
            }
            let cos = (-wi).dot(out);
            let phase = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cos).powf(1.5);
            let theta_o = sin.asin();
            let weight = entered * phase * (-t / out.z).exp() * (1.0 - fresnel(eta, theta_o));
            let edge = |k: usize| FRAC_PI_2 * crate::math::count(k) / crate::math::count(RINGS);
            let ring = (0..RINGS).find(|k| theta_o < edge(k + 1)).unwrap();
            sums[ring] += weight;
            squares[ring] += weight * weight;
        }
        let n = f64::from(PHOTONS);
        let rule = GaussLegendre::new(32);
        for k in 0..RINGS {
            let edge = |k: usize| FRAC_PI_2 * crate::math::count(k) / crate::math::count(RINGS);
            let over_phi =
                |theta: f64| 2.0 * rule.integrate(0.0, PI, |phi: f64| brdf(shapes, theta_i, theta, phi));
            let expected = rule.integrate(edge(k), edge(k + 1), |t: f64| over_phi(t) * t.sin() * t.cos());
            let mean = sums[k] / n;
            let error = ((squares[k] / n - mean * mean) / n).sqrt();
            assert!((mean - expected).abs() < 4.0 * error, "ring {k}: {mean} +/- {error} for {expected}");
            assert!(error < 0.02 * expected, "{error} of {expected}");
        }
    }

    /// A thin layer scatters in proportion to tau in all directions: f ci' co' = tau p T T/eta^2. A thick one is a half space:
    /// f (ci' + co') = p T T/eta^2.
    #[test]
    fn thin_and_thick() {
        let (eta, g) = (1.5_f64, 0.3_f64);
        for (theta_i, theta_o, phi) in [(0.2, 0.9, 0.4), (1.3, 1.1, 3.0)] {
            let inside = |theta: f64, phi: f64| direction((theta.sin() / eta).asin(), phi);
            let (wi, wo) = (inside(theta_i, 0.0), inside(theta_o, phi));
            let phase = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g + 2.0 * g * wi.dot(wo)).powf(1.5));
            let common = phase * (1.0 - fresnel(eta, theta_i)) * (1.0 - fresnel(eta, theta_o)) / (eta * eta);
            let thin = brdf([g, 1e-7, eta], theta_i, theta_o, phi);
            assert_relative_eq!(thin, 1e-7 * common / (wi.z * wo.z), max_relative = 1e-6);
            let thick = brdf([g, 1e3, eta], theta_i, theta_o, phi);
            assert_relative_eq!(thick, common / (wi.z + wo.z), max_relative = 1e-13);
            let swapped = brdf([g, 0.8, eta], theta_o, theta_i, phi);
            assert_relative_eq!(brdf([g, 0.8, eta], theta_i, theta_o, phi), swapped, max_relative = 1e-13);
        }
    }
}
