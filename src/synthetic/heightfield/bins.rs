//! Bins of outgoing directions: squares in the slope of the half vector.
//!
//! A mirror facet reflects light into the direction for which its normal is the half vector, so a bin of reflected
//! directions is a bin of facet slopes. Squares of slope suit every angle of incidence, cover the lobe whatever its width,
//! and stay narrow compared with it, since their side is a fixed fraction of m.
//!
//! ```text
//! f = share of the light in the bin / int co dwo,    dwo = 4 (wi.h) dwh,  dwh = cos^3(theta_h) du dv
//! ```
//!
//! This is the mean of f over the bin, weighted by w = 4 co (wi.h) cos^3(theta_h); the sample's direction is the centroid
//! of w. The remaining error of second order widens the lobe as convolution with a square widens a normal distribution:
//! m^2 increases by step^2/6, m by 0.13 % at steps of m/8.

use crate::geometry::{Pair, direction};
use crate::math::{GaussLegendre, count};
use glam::DVec3;

/// Number of bins per slope of m, along each side.
const PER_SLOPE: usize = 8;
/// Largest slope that the bins cover, in units of m. Steeper are 0.2 % of the facets of a Beckmann surface and 14 % of
/// those of GGX.
const REACH: f64 = 2.5;
/// Number of bins from the normal to the last one.
const HALF: usize = 20;
/// Number of neighbours on each side that enter the estimate of a count's variance.
const NEIGHBOURS: usize = 1;

/// Number of rays in each bin, for one angle of incidence. The light comes from +x; the two sides of the plane of incidence
/// are equivalent and counted together.
#[derive(Clone)]
pub struct Counts {
    step: f64,
    counts: Vec<u32>,
}

/// The direction, f and standard error of one bin.
pub struct Sample {
    pub pair: Pair,
    pub value: f64,
    pub sigma: f64,
}

impl Counts {
    /// Makes empty bins for surfaces of roughness `m`.
    pub fn new(m: f64) -> Self {
        Self { step: m / count(PER_SLOPE), counts: vec![0; 2 * HALF * HALF] }
    }

    /// Counts a ray that was reflected about a half vector of slope (`u`, `v`), with u in the plane of incidence.
    pub fn add(&mut self, u: f64, v: f64) {
        if let Some(place) = index(u / self.step, v.abs() / self.step) {
            self.counts[place] += 1;
        }
    }

    /// Adds the counts of other rays.
    pub fn merge(&mut self, other: &Self) {
        self.counts.iter_mut().zip(&other.counts).for_each(|(sum, n)| *sum += n);
    }

    /// Returns a sample of f, measured with this number of `rays`, for every bin that lies entirely within `max_theta`
    /// (radians) of the normal.
    pub fn samples(&self, theta_i: f64, max_theta: f64, rays: usize) -> Vec<Sample> {
        let wi = direction(theta_i, 0.0);
        let rule = GaussLegendre::new(3);
        let places = (0..HALF).flat_map(|row| (0..2 * HALF).map(move |column| (column, row)));
        places
            .filter_map(|(column, row)| {
                let (u, v) = (count(column) - count(HALF), count(row));
                let inside = (u + 0.5).hypot(v + 0.5) <= REACH * count(PER_SLOPE);
                let corner = |i: f64, j: f64| mirrored(wi, (u + i) * self.step, (v + j) * self.step);
                let above = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)]
                    .iter()
                    .all(|wo| wo.z >= max_theta.cos());
                if !(inside && above) {
                    return None;
                }
                // The projected solid angle of the bin and its mirror image, and the moments of its weight.
                let moment = |of: &dyn Fn(f64, f64) -> f64| {
                    let along_v = |u: f64| {
                        rule.integrate(v * self.step, (v + 1.0) * self.step, |v: f64| {
                            weight(wi, u, v) * of(u, v)
                        })
                    };
                    rule.integrate(u * self.step, (u + 1.0) * self.step, along_v)
                };
                let angle = moment(&|_, _| 1.0);
                let wo = mirrored(wi, moment(&|u, _| u) / angle, moment(&|_, v| v) / angle);
                let per_ray = 1.0 / (2.0 * angle * count(rays));
                let value = f64::from(self.at(column, row)) * per_ray;
                let sigma = self.local_mean(column, row).max(1.0).sqrt() * per_ray;
                Some(Sample { pair: Pair { wi, wo }, value, sigma })
            })
            .collect()
    }

    fn at(&self, column: usize, row: usize) -> u32 {
        self.counts[row * 2 * HALF + column]
    }

    /// The mean count of a bin and its neighbours, which serves as the variance of the bin's count.
    ///
    /// The bin's own count would be good enough in the peak. In the tails its error is correlated with the value: a bin that is
    /// low by chance would get more weight, and a fit with these sigmas would be low by one count per bin.
    fn local_mean(&self, column: usize, row: usize) -> f64 {
        let near = |at: usize, end: usize| at.saturating_sub(NEIGHBOURS)..(at + NEIGHBOURS + 1).min(end);
        let block = near(row, HALF).flat_map(|r| near(column, 2 * HALF).map(move |c| (c, r)));
        let (sum, n) = block.fold((0.0, 0), |(sum, n), (c, r)| (sum + f64::from(self.at(c, r)), n + 1));
        sum / count(n)
    }
}

/// The half vector of slope (u, v).
fn half_vector(u: f64, v: f64) -> DVec3 {
    DVec3::new(u, v, 1.0).normalize()
}

/// The direction into which a facet of slope (u, v) reflects the light.
fn mirrored(wi: DVec3, u: f64, v: f64) -> DVec3 {
    let h = half_vector(u, v);
    h * (2.0 * wi.dot(h)) - wi
}

/// Projected solid angle of outgoing directions per area of slope.
fn weight(wi: DVec3, u: f64, v: f64) -> f64 {
    let h = half_vector(u, v);
    4.0 * mirrored(wi, u, v).z * wi.dot(h) * h.z.powi(3)
}

/// The bin of a slope, which is given in steps. `None` if it lies beyond the last bin.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "checked to be small and positive"
)]
fn index(u: f64, v: f64) -> Option<usize> {
    let column = u.floor() + count(HALF);
    let inside = column >= 0.0 && column < count(2 * HALF) && v < count(HALF);
    inside.then(|| (v as usize) * 2 * HALF + column as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// All light is reflected once by normally distributed slopes, without masking or shadowing: a facet of slope (u, v)
    /// receives the share P22 (wi.h)/(ci hz) of the light, and f = D/(4 ci co). The formula is written out here and not taken
    /// from the models.
    #[test]
    fn counts_become_f() {
        let m = 0.2_f64;
        let rule = GaussLegendre::new(6);
        let p22 = |u: f64, v: f64| (-(u * u + v * v) / (m * m)).exp() / (PI * m * m);
        for theta_i in [0.0_f64, 0.6, 1.0] {
            let wi = direction(theta_i, 0.0);
            let share = |u: f64, v: f64| {
                let h = half_vector(u, v);
                p22(u, v) * wi.dot(h) / (wi.z * h.z)
            };
            let mut counts = Counts::new(m);
            let step = counts.step;
            let rays = 2_000_000_000_usize;
            for (place, n) in counts.counts.iter_mut().enumerate() {
                let (u, v) = (count(place % (2 * HALF)) - count(HALF), count(place / (2 * HALF)));
                let along_v = |u: f64| rule.integrate(v * step, (v + 1.0) * step, |v: f64| share(u, v));
                let expected = 2.0 * count(rays) * rule.integrate(u * step, (u + 1.0) * step, along_v);
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
                let whole = expected.round() as u32;
                *n = whole;
            }
            let samples = counts.samples(theta_i, 80_f64.to_radians(), rays);
            assert!(samples.len() > 300);
            for Sample { pair, value, sigma } in samples {
                let h = (pair.wi + pair.wo).normalize();
                let f = p22(h.x / h.z, h.y / h.z) / h.z.powi(4) / (4.0 * pair.wi.z * pair.wo.z);
                // The mean over a bin differs from the value at its middle by (step^2/24) f''/f, which is up to
                // (2.5^2 4 - 4)/(24 64) = 1.4 % in the tail and -0.3 % in the peak.
                assert!((value / f - 1.0).abs() < 0.015, "{theta_i} {pair:?}: {value} {f}");
                assert!(sigma > 0.0 && sigma < value);
            }
        }
    }

    #[test]
    fn slopes_find_their_bins() {
        let mut counts = Counts::new(0.8);
        // Steps of 0.1: the bins about the normal, the last ones, and the first beyond.
        for (u, v) in
            [(0.05, 0.05), (0.05, -0.05), (-0.05, 0.0), (1.95, 1.95), (-1.95, 0.0), (2.05, 0.0), (0.0, -2.05)]
        {
            counts.add(u, v);
        }
        assert_eq!(counts.at(HALF, 0), 2, "the two sides of the plane of incidence");
        assert_eq!(counts.at(HALF - 1, 0), 1);
        assert_eq!(counts.at(2 * HALF - 1, HALF - 1), 1);
        assert_eq!(counts.at(0, 0), 1);
        assert_eq!(counts.counts.iter().sum::<u32>(), 5, "two lie beyond");
    }
}
