//! Dipole: diffuse light that has been scattered many times below a smooth surface, ignoring the distance that it travelled.
//!
//! With the Fresnel transmittance Ft = 1 - F(eta) of an exact dielectric, ci = n.wi, co = n.wo:
//!
//! ```text
//! f  = Ft(ci) Ft(co) Rd/pi
//! Rd = albedo_prime/2 (1 + exp(-(4/3) A w)) exp(-w),   w = sqrt(3 (1 - albedo_prime))
//! A  = (1 + Fdr)/(1 - Fdr),   Fdr = -1.440/eta^2 + 0.710/eta + 0.668 + 0.0636 eta
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | albedo_prime | 1 | 0..0.999999 | reduced albedo sigma_s'/(sigma_s' + sigma_a), alpha' of the paper; 0.7 gives Rd = 0.14, 0.99 gives 0.58 |
//! | eta | 1 | 1.05..3 | refractive index; fixed at 1.5 unless freed |
//!
//! Jensen, Marschner, Levoy and Hanrahan 2001, A Practical Model for Subsurface Light Transport, section 2.4,
//! doi:10.1145/383259.383319; Fdr after Egan and Hilgeman 1973, only for eta above 1. The upper bound of albedo_prime is below
//! 1, where Rd has an infinite slope and a fit would get stuck; at the bound Rd is 0.994.
//!
//! In a BRDF Rd is one number per channel, and albedo_prime is another way to write it: together with `lambert` it is not
//! determined. Because Rd also depends on eta, on which the basis function depends, both are shapes; albedo_prime has one value
//! per channel.
//!
//! Reciprocal. Energy conserving, with a margin: the two Ft multiply Rd, which already includes the light that the surface
//! reflects back inside, so that light is lost even at Rd = 1 (at eta = 1.5 the diffuse light that comes out is
//! 0.908 Ft(ci) Rd). At grazing Ft and f go to 0.

use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::fresnel::{Constants, index_constants, index_transmittance};
use crate::model::{Choices, Kernel, Model, ParamSpec, Part, Scale, Sharing, Strength, Values, Visitor};
use std::f64::consts::FRAC_1_PI;

/// Diffuse light from below a smooth surface.
#[derive(Clone, Copy, Debug)]
pub struct Dipole;

/// Rd of a half space.
fn diffuse_reflectance<T: Scalar>(albedo_prime: T, eta: T) -> T {
    let inverse: T = eta.recip();
    let fdr: T = (inverse * inverse).times(-1.440) + inverse.times(0.710) + eta.times(0.0636).plus(0.668);
    let a: T = fdr.plus(1.0) / (-fdr).plus(1.0);
    // Without absorption the root would have an infinite slope, which the floor avoids.
    let absorbed: T = (-albedo_prime).plus(1.0).times(3.0);
    let floor = T::constant(1e-30);
    let w: T =
        T::if_less(absorbed.value(), floor.value(), floor + (absorbed - absorbed.value()), absorbed).sqrt();
    albedo_prime.times(0.5) * (a * w).times(-4.0 / 3.0).exp().plus(1.0) * (-w).exp()
}

/// Rd/pi. It is the same at all angles, so it is evaluated once per block if possible.
struct Reflectance;

impl Kernel for Reflectance {
    const SHARED_ON_RINGS: bool = true;
    type Prepared<T: Scalar> = T;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(reflectance: &T, _: &Geometry<T::Real>) -> [T; 1] {
        [*reflectance]
    }
}

impl Part for Reflectance {
    type Kernel = Self;
    const SHAPES: usize = 2;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> T {
        let [albedo_prime, eta] = shapes.take();
        diffuse_reflectance(albedo_prime, eta).times(FRAC_1_PI)
    }
}

/// Ft(ci) Ft(co), which is the same for all channels.
struct Transmittance;

impl Kernel for Transmittance {
    type Prepared<T: Scalar> = Constants<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> [T; 1] {
        [index_transmittance(constants, g.cos_i()) * index_transmittance(constants, g.cos_o())]
    }
}

impl Part for Transmittance {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Constants<T> {
        let [eta] = shapes.take();
        index_constants(eta)
    }
}

impl Model for Dipole {
    type Coefficients<T: Scalar> = [T; 1];

    const NAME: &'static str = "dipole";
    const SUMMARY: &'static str = "diffuse light from below a smooth surface";
    const REFERENCE: &'static str =
        "Jensen et al. 2001, A Practical Model for Subsurface Light Transport, doi:10.1145/383259.383319";

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let albedo_prime = ParamSpec::shape(
            "albedo_prime",
            "reduced albedo",
            (0.0, 0.999_999),
            (0.05, 0.999),
            0.8,
            Scale::Linear,
        );
        let eta = ParamSpec::shape("eta", "refractive index", (1.05, 3.0), (1.2, 2.0), 1.5, Scale::Linear);
        vec![ParamSpec { sharing: Sharing::PerChannel, ..albedo_prime }, eta.fixed()]
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        visitor.part::<Reflectance>(0);
        visitor.part::<Transmittance>(1);
    }

    fn coefficients<T: Scalar>(&self, _: Values<'_, T>) -> [T; 1] {
        [T::constant(1.0)]
    }

    fn strength(&self) -> Strength {
        Strength::Shape("albedo_prime")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::direction;
    use crate::math::{Dual, GaussLegendre};
    use crate::model::parts::paint_layers;
    use approx::assert_relative_eq;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// Rd is the radial profile of the two sources (paper, eq. 4) integrated over the plane, lengths in mean free paths.
    #[test]
    fn is_the_planar_integral_of_the_two_sources() {
        let rule = GaussLegendre::new(48);
        for (albedo_prime, eta) in [(0.2_f64, 1.3_f64), (0.8, 1.5), (0.97, 1.5), (0.9, 1.9)] {
            let fdr = -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
            let a = (1.0 + fdr) / (1.0 - fdr);
            let decay = (3.0 * (1.0 - albedo_prime)).sqrt();
            let source = |z: f64, r: f64| {
                let d = r.hypot(z);
                z * (decay * d + 1.0) * (-decay * d).exp() / d.powi(3)
            };
            let profile =
                |r: f64| albedo_prime / (4.0 * PI) * (source(1.0, r) + source(1.0 + 4.0 * a / 3.0, r));
            let mut edges = vec![0.0, 1.0];
            (1..13).for_each(|k| edges.push(2.0_f64.powi(k)));
            let ring = |r: f64| 2.0 * PI * r * profile(r);
            let planar: f64 = edges.windows(2).map(|e| rule.integrate(e[0], e[1], ring)).sum();
            assert_relative_eq!(diffuse_reflectance(albedo_prime, eta), planar, max_relative = 1e-10);
        }
    }

    /// The published check: the light that comes out at eta = 1.5 is 0.908 Ft(ci) Rd, and 0.908 = 1 - 0.092.
    #[test]
    fn what_comes_out() {
        let rule = GaussLegendre::new(64);
        let (albedo_prime, eta) = (0.9, 1.5);
        let wi = direction(0.6, 0.0).to_array();
        let prepared = index_constants(eta);
        let through = index_transmittance(&prepared, 0.6_f64.cos());
        let rd = diffuse_reflectance(albedo_prime, eta);
        let ring = |theta: f64| {
            let g = Geometry::new(wi, direction(theta, 1.0).to_array());
            let [ft] = Transmittance::at::<f64>(&prepared, &g);
            let [reflectance] = Reflectance::at::<f64>(&(rd * FRAC_1_PI), &g);
            2.0 * PI * ft * reflectance * theta.sin() * theta.cos()
        };
        let out: f64 = [0.0, 0.8, 1.3, FRAC_PI_2].windows(2).map(|e| rule.integrate(e[0], e[1], ring)).sum();
        assert!((out / (through * rd) - 0.908).abs() < 5e-4, "{}", out / (through * rd));
        let expected = 1.0 - paint_layers::diffuse_reflectance(eta);
        assert_relative_eq!(out / (through * rd), expected, max_relative = 1e-7);
    }

    #[test]
    fn limits() {
        assert_eq!(diffuse_reflectance(0.0, 1.5), 0.0);
        assert_relative_eq!(diffuse_reflectance(1.0, 1.5), 1.0, max_relative = 1e-14);
        let at_one = diffuse_reflectance(Dual::<f64, 1>::variable(1.0, 0), Dual::constant(1.5));
        assert!(at_one.partials[0].is_finite());
        let mut last = 0.0;
        for step in 1..=100 {
            let rd = diffuse_reflectance(f64::from(step) / 100.0, 1.33);
            assert!(rd > last && rd <= 1.0 + 1e-14);
            last = rd;
        }
    }
}
