//! Long symmetric V-grooves whose upper edges all lie in the plane of the surface, as assumed by Torrance and Sparrow 1967
//! (doi:10.1364/JOSA.57.001105).
//!
//! A groove runs along y; across it, the surface is z = -t (1 - |x|) for x in -1..1 with slope t. Light that enters a
//! groove leaves it or hits it again; it never reaches another groove.

use super::surface::{Fate, RoughSurface};
use glam::{DVec2, DVec3};

/// Distribution of the slopes of the facets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Facets {
    /// A normal distribution: P(slope > t) = exp(-t^2/m^2).
    #[default]
    Beckmann,
    /// A distribution with long tails: P(slope > t) = 1/(1 + t^2/m^2).
    Ggx,
}

impl Facets {
    /// The slope that a share `p` of the facets exceeds.
    fn quantile(self, m: f64, p: f64) -> f64 {
        match self {
            Self::Beckmann => m * (-p.ln()).sqrt(),
            Self::Ggx => m * ((1.0 - p) / p).sqrt(),
        }
    }
}

/// Grooves of all slopes.
pub struct Grooves {
    pub facets: Facets,
    pub m: f64,
}

impl RoughSurface for Grooves {
    /// `place` determines the slope of the groove, and where across its opening the light enters.
    fn reflect(&self, place: DVec2, wi: DVec3) -> Fate {
        // 1 - place.x is in (0, 1]: no facet is vertical.
        let t = self.facets.quantile(self.m, 1.0 - place.x);
        let entry = 2.0 * place.y - 1.0;
        // The space above the groove is convex, so the ray first meets the facet whose plane it crosses first. Facet
        // s = +1 or -1 is z = -t (1 - s x); a ray from (entry, 0) starts at `height` above it and comes nearer by `approach`
        // per unit of length.
        let distance = |s: f64| {
            let height = t * (1.0 - s * entry);
            let approach = wi.z - t * s * wi.x;
            if approach > 0.0 { height / approach } else { f64::INFINITY }
        };
        let (right, left) = (distance(1.0), distance(-1.0));
        let s = if right < left { 1.0 } else { -1.0 };
        let hit = right.min(left);
        let slope = DVec2::new(-s * t, 0.0);
        let normal = slope.extend(1.0).normalize();
        let wo = normal * (2.0 * wi.dot(normal)) - wi;
        // Light that does not go upwards meets the groove again.
        if wo.z <= 0.0 {
            return Fate::Shadowed;
        }
        // The light escapes if it crosses the plane of the upper edges between them; otherwise the other facet blocks it.
        let (x, z) = (entry - hit * wi.x, -hit * wi.z);
        let exit = x - z / wo.z * wo.x;
        if exit.abs() > 1.0 { Fate::Shadowed } else { Fate::Escaped(slope) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The facets of a groove of slope 1 are at right angles: light along the normal goes from one to the other. At slope 1/2
    /// it leaves at twice the facet's angle, 53 degrees, and clears the edge wherever it came in.
    #[test]
    fn light_along_the_normal() {
        let grooves = Grooves { facets: Facets::Beckmann, m: 1.0 };
        let down = |t: f64, entry: f64| {
            let place = DVec2::new(1.0 - (-t * t).exp(), (entry + 1.0) / 2.0);
            grooves.reflect(place, DVec3::Z)
        };
        for entry in [-0.99, -0.5, 0.01, 0.7] {
            assert!(matches!(down(1.0, entry), Fate::Shadowed), "{entry}");
            assert!(matches!(down(1.5, entry), Fate::Shadowed), "{entry}");
        }
        // From (x, -(1 - x)/2) along (-4/5, 3/5) it comes to z = 0 at x - (2/3) (1 - x) > -1.
        for entry in [0.01, 0.3, 0.9] {
            let Fate::Escaped(slope) = down(0.5, entry) else { panic!("{entry}") };
            assert!((slope - DVec2::new(-0.5, 0.0)).length() < 1e-12);
        }
        // At slope 0.9: 1 - x must be below (1 + x) (1 - t^2)/(2 t^2), so x > 0.79 escapes.
        let edge = {
            let ratio = (1.0 - 0.81) / 1.62;
            (1.0 - ratio) / (1.0 + ratio)
        };
        assert!(matches!(down(0.9, edge - 0.01), Fate::Shadowed));
        assert!(matches!(down(0.9, edge + 0.01), Fate::Escaped(_)));
        assert!(matches!(down(0.9, -edge - 0.01), Fate::Escaped(slope) if slope.x > 0.0));
    }

    #[test]
    fn facets_follow_their_distribution() {
        // exp(-t^2/m^2) and 1/(1 + t^2/m^2) at t = 2 m.
        approx::assert_relative_eq!(
            Facets::Beckmann.quantile(0.3, (-4_f64).exp()),
            0.6,
            max_relative = 1e-12
        );
        approx::assert_relative_eq!(Facets::Ggx.quantile(0.3, 0.2), 0.6, max_relative = 1e-12);
    }
}
