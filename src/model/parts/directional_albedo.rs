//! The light that a rough surface does not send back at once, and what becomes of it: a dielectric surface transmits it to a diffuse
//! layer below, the facets of a metal reflect it to one another.
//!
//! With f_s the lobe of the surface (`cook-torrance(d=ggx, g=smith)`, exact dielectric F), its directional albedo and the
//! mean of that are
//!
//! ```text
//! E(ci) = int f_s co dwo = int D V F 4 (wi.h) co dwh,    V = G/(4 ci co)
//! Ea    = 2 int_0^1 E(c) c dc
//! ```
//!
//! and the reflectance of a layer below is multiplied by (1 - E(ci))(1 - E(co))/(1 - Ea) (Kelemen and Szirmay-Kalos 2001,
//! for the matte component; Kulla and Conty 2017, Revisiting Physically Based Shading at Imageworks). Over a Lambertian layer
//! of albedo rho the directional albedo of the whole is E + rho (1 - E): a white layer loses nothing.
//!
//! Whenever the shapes change, 1 - E is tabulated over x = c^(1/4), which puts enough cells near grazing, and interpolated by
//! cubics through its values and slopes. Ea is the integral of the interpolant, so that the two are consistent. The nodes of
//! the quadrature do not depend on the shapes: with the logarithm of tan(theta_h) as the variable the peak has the same width
//! for every roughness from 1e-4 to 1, and the panels end where wo, mirrored by the facet, first meets the horizon. So E is
//! as smooth in the shapes as the lobe is, and dual numbers differentiate it.
#![allow(clippy::indexing_slicing, reason = "a kernel: the lengths that it indexes are checked at its head")]

use super::distribution::{Density, Ggx, Isotropic, Shadows};
use super::fresnel::{DielectricIndex, Reflectance};
use super::shadowing::Smith;
use crate::geometry::Geometry;
use crate::math::{GaussLegendre, Real, Scalar, count};
use crate::model::{Kernel, Part, PreparedBy, Values};
use std::f64::consts::{FRAC_1_PI, FRAC_PI_4, PI};
use std::sync::{Arc, LazyLock};

/// Number of cells of the table.
const CELLS: usize = 24;
/// Cosine that represents grazing incidence, where the mirror directions of a facet are 0/0.
const GRAZING: f64 = 1e-6;
/// Slope below which all facets are represented by one node: a hundredth of the smallest roughness.
const FLAT: f64 = 1e-6;
/// Slope above which the facets of a lobe are ignored: their share is less than (m/STEEP)^2.
const STEEP: f64 = 1e3;
/// Slope above which those that light is lost on are: seen from the side they are not foreshortened, and their share is up to m/STEEPEST.
const STEEPEST: f64 = 1e7;
/// Length of the longest panel, in the logarithm of the tangent.
const PANEL: f64 = 3.5;
/// Nodes of the quadrature along a panel.
const ALONG_PANEL: usize = 10;
/// Nodes of the quadrature along a ring of facets.
const ALONG_RING: usize = 12;

/// A facet, the light and its mirror direction, and 4 (wi.h) co dwh.
struct Node {
    geometry: Geometry<f64>,
    weight: f64,
}

/// Light from one direction, and the facets that it meets.
struct Light {
    cos: f64,
    sin: f64,
}

impl Light {
    fn new(cos: f64) -> Self {
        Self { cos, sin: (1.0 - cos * cos).sqrt() }
    }

    /// The slopes at which mirror directions begin to be below the horizon, and at which all are.
    fn horizon(&self) -> [f64; 2] {
        let theta = self.sin.atan2(self.cos);
        [(FRAC_PI_4 - 0.5 * theta).tan(), (FRAC_PI_4 + 0.5 * theta).tan()]
    }

    /// The azimuth up to which facets of a slope mirror the light to above the horizon.
    fn mirrored_up(&self, tan: f64) -> f64 {
        // co = sin(theta) sin(2 theta_h) cos(azimuth) + cos(theta) cos(2 theta_h) > 0
        widest(-self.cos * (1.0 - tan * tan) / (2.0 * self.sin * tan))
    }

    /// The azimuth up to which facets of a slope face the light.
    fn facing(&self, tan: f64) -> f64 {
        // wi.h = sin(theta) sin(theta_h) cos(azimuth) + cos(theta) cos(theta_h) > 0
        widest(-self.cos / (self.sin * tan))
    }

    /// The node of the facets at a slope and azimuth, of an area in solid angle.
    fn node(&self, tan: f64, azimuth: f64, area: f64) -> Node {
        let cos_h = 1.0 / tan.hypot(1.0);
        let h = [tan * cos_h * azimuth.cos(), tan * cos_h * azimuth.sin(), cos_h];
        let wi = [self.sin, 0.0, self.cos];
        let dot: f64 = wi.iter().zip(h).map(|(a, b)| a * b).sum();
        let [x, y, z] = h;
        // Rounding must not move a direction at the horizon below it.
        let wo = [2.0 * dot * x - self.sin, 2.0 * dot * y, (2.0 * dot * z - self.cos).max(1e-12)];
        let [.., cos_o] = wo;
        let geometry = Geometry { wi, wo, h, cos_d: dot, one_less_cos_d: 1.0 - dot };
        Node { geometry, weight: area * 4.0 * dot * cos_o }
    }
}

/// The azimuth at which the cosine falls to `least`: all of a ring below -1, nothing above 1.
fn widest(least: f64) -> f64 {
    if least <= -1.0 { PI } else { least.min(1.0).acos() }
}

/// Calls `each` with slope, azimuth and area of facets between slopes, in panels that end at `edges`, and between the azimuths that
/// `range` gives for a slope.
fn rings(edges: &[f64], range: impl Fn(f64) -> (f64, f64), mut each: impl FnMut(f64, f64, f64)) {
    let (panel, ring) = (GaussLegendre::new(ALONG_PANEL), GaussLegendre::new(ALONG_RING));
    for (from, to) in edges.iter().zip(edges.iter().skip(1)) {
        let length = (to / from).ln();
        let panels = (1..).find(|n| length <= PANEL * f64::from(*n)).unwrap_or(1);
        for k in (0..panels).filter(|_| length > 0.0) {
            let place = |k: i32| from.ln() + length * f64::from(k) / f64::from(panels);
            panel.for_each(place(k), place(k + 1), |v, share| {
                let tan = v.exp();
                let (start, end) = range(tan);
                ring.for_each(start, end, |azimuth, turn| {
                    // Both halves of the ring, sin(theta_h) dtheta_h = tan^2 cos^3 dv
                    each(tan, azimuth, 2.0 * turn * share * tan * tan / tan.hypot(1.0).powi(3));
                });
            });
        }
    }
}

/// The facets for which both directions are above the horizon, for light at cosine `cos`.
fn nodes(cos: f64) -> Vec<Node> {
    let light = Light::new(cos);
    let [first, last] = light.horizon();
    let mut all = vec![light.node(0.0, 0.0, PI * FLAT * FLAT)];
    let up = |tan: f64| (0.0, light.mirrored_up(tan));
    rings(&[FLAT, first, last.min(STEEP)], up, |tan, azimuth, area| all.push(light.node(tan, azimuth, area)));
    all
}

/// The facets that face light at one cosine.
struct Facets {
    cos: f64,
    /// Those that mirror it to above the horizon.
    up: Vec<Facet>,
    /// Those that mirror it to below.
    down: Vec<Facet>,
}

/// A facet: its squared slope, the cosine of the mirror direction, and (wi.h) dwh/(pi cos(theta_h)^4).
struct Facet {
    slope2: f64,
    cos_o: f64,
    weight: f64,
}

impl Facets {
    fn new(cos: f64) -> Self {
        let light = Light::new(cos);
        let facet = |tan: f64, azimuth: f64, area: f64| {
            let Geometry { wo: [.., cos_o], cos_d, .. } = light.node(tan, azimuth, area).geometry;
            let slope2 = tan * tan;
            Facet { slope2, cos_o, weight: area * cos_d * (1.0 + slope2).powi(2) / PI }
        };
        let [first, last] = light.horizon();
        let mut up = vec![facet(0.0, 0.0, PI * FLAT * FLAT)];
        let above = |tan: f64| (0.0, light.mirrored_up(tan));
        rings(&[FLAT, first, last.min(STEEPEST)], above, |tan, azimuth, area| {
            up.push(facet(tan, azimuth, area))
        });
        // Beyond this slope some facets of a ring turn away from the light.
        let turned = (light.cos / light.sin).clamp(first, STEEPEST);
        let mut edges = [first, last.min(STEEPEST), turned, STEEPEST];
        edges.sort_by(f64::total_cmp);
        let mut down = Vec::new();
        let below = |tan: f64| (light.mirrored_up(tan), light.facing(tan));
        rings(&edges, below, |tan, azimuth, area| down.push(facet(tan, azimuth, area)));
        Self { cos, up, down }
    }
}

/// 1 - E of white facets: the light that meets a second facet, or none that is seen.
///
/// Of the facets that the light sees, with the density D (wi.h) 2/(ci + Ci) and C = cos (1 + 2 Lambda), the share G2/G1 sends it back.
/// Smith's 1 - G2/G1 = ci (Co - co)/(co Ci + ci Co) and the facets that mirror it down are added up instead of subtracting E from 1:
/// a smooth surface loses little.
fn lost<T: Scalar>(facets: &Facets, m: T) -> T {
    let m2: T = m * m;
    let smith = |cos: f64| (m2.times(1.0 - cos * cos)).plus(cos * cos).sqrt();
    let of_light = smith(facets.cos);
    let density = |facet: &Facet| (m2 / m2.plus(facet.slope2).squared()).times(facet.weight);
    let up = facets.up.iter().fold(T::constant(0.0), |sum, facet| {
        let co = facet.cos_o;
        let of_viewer = smith(co);
        let excess = m2.times(1.0 - co * co) / of_viewer.plus(co);
        let stopped = excess.times(facets.cos) / (of_light.times(co) + of_viewer.times(facets.cos));
        sum + density(facet) * stopped
    });
    let all = facets.down.iter().fold(up, |sum, facet| sum + density(facet));
    all.times(2.0) / of_light.plus(facets.cos)
}

/// The nodes for every point of the table.
static NODES: LazyLock<Vec<Vec<Node>>> = LazyLock::new(|| (0..=CELLS).map(|k| nodes(cosine(k))).collect());

/// All facets for every point of the table.
static FACETS: LazyLock<Vec<Facets>> =
    LazyLock::new(|| (0..=CELLS).map(|k| Facets::new(cosine(k))).collect());

/// The cosine of a point of the table.
fn cosine(k: usize) -> f64 {
    (count(k) / count(CELLS)).powi(4).max(GRAZING)
}

/// Nodes and weights of int_0^1 f(t) dt within a cell, exact for all functions that are integrated here.
static WITHIN_CELL: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| {
    let mut nodes = Vec::new();
    GaussLegendre::new(6).for_each(0.0, 1.0, |t, weight| nodes.push((t, weight)));
    nodes
});

/// Multiplies `products` by a part at every node.
fn multiply<P: Part, T: Scalar>(products: &mut [T], nodes: &[Node], shapes: &[T]) {
    let prepared = P::prepare(Values::new(shapes));
    for (product, node) in products.iter_mut().zip(nodes) {
        let Geometry { wi, wo, h, cos_d, one_less_cos_d } = node.geometry;
        let [wi, wo, h] = [wi, wo, h].map(|v| v.map(T::Real::literal));
        let [cos_d, one_less_cos_d] = [cos_d, one_less_cos_d].map(T::Real::literal);
        let g = Geometry { wi, wo, h, cos_d, one_less_cos_d };
        let factor = P::Kernel::at(&prepared, &g).as_ref()[0];
        *product = *product * factor;
    }
}

/// E at a point of the table.
fn albedo<T: Scalar>(nodes: &[Node], m: T, eta: T) -> T {
    let mut products: Vec<T> = nodes.iter().map(|node| T::constant(node.weight)).collect();
    multiply::<Density<Ggx<Isotropic>>, T>(&mut products, nodes, &[m]);
    multiply::<<Smith as Shadows>::Visibility<Ggx<Isotropic>>, T>(&mut products, nodes, &[m]);
    multiply::<Reflectance<DielectricIndex>, T>(&mut products, nodes, &[eta]);
    products.into_iter().fold(T::constant(0.0), |sum, product| sum + product)
}

/// A function that is known at equally spaced points, and cubics through its values and slopes between them.
#[derive(Clone, Debug)]
pub(crate) struct Cubics<T: Scalar, const POINTS: usize> {
    /// Value, and slope per cell, at the ends of every cell.
    points: Arc<[[T; 2]; POINTS]>,
}

impl<T: Scalar, const POINTS: usize> Cubics<T, POINTS> {
    /// Makes the cubics from the values.
    pub fn new(values: [T; POINTS]) -> Self {
        let mut points = values.map(|value| [value, T::constant(0.0)]);
        // Finite differences that are exact for polynomials of degree 4, and of degree 3 at the ends.
        let weighted = |terms: [(usize, f64); 4]| {
            terms.into_iter().fold(T::constant(0.0), |sum, (k, weight)| sum + values[k].times(weight))
        };
        let n = POINTS - 1;
        for (k, [_, slope]) in points.iter_mut().enumerate() {
            *slope = match k {
                0 => weighted([(0, -11.0), (1, 18.0), (2, -9.0), (3, 2.0)]).times(1.0 / 6.0),
                1 => weighted([(0, -2.0), (1, -3.0), (2, 6.0), (3, -1.0)]).times(1.0 / 6.0),
                _ if k == n - 1 => {
                    weighted([(n, 2.0), (n - 1, 3.0), (n - 2, -6.0), (n - 3, 1.0)]).times(1.0 / 6.0)
                }
                _ if k == n => {
                    weighted([(n, 11.0), (n - 1, -18.0), (n - 2, 9.0), (n - 3, -2.0)]).times(1.0 / 6.0)
                }
                _ => weighted([(k - 2, 1.0), (k - 1, -8.0), (k + 1, 8.0), (k + 2, -1.0)]).times(1.0 / 12.0),
            };
        }
        Self { points: Arc::new(points) }
    }

    /// The cubic of a cell.
    #[inline(always)]
    fn within([a, da]: [T; 2], [b, db]: [T; 2], t: T::Real) -> T {
        let rise: T = b - a;
        let c3 = da + db - rise.times(2.0);
        let c2 = rise - da - c3;
        a + (da + (c2 + c3 * t) * t) * t
    }

    /// The function at a place between the first point, 0, and the last, in cells.
    #[inline(always)]
    pub fn at(&self, place: T::Real) -> T {
        let cell = T::look_up(&*self.points, place);
        Self::within(cell.start, cell.end, place - cell.number)
    }
}

/// 1 - E as a function of x, and 1/(1 - Ea).
#[derive(Clone, Debug)]
pub struct Transmittance<T: Scalar> {
    table: Cubics<T, { CELLS + 1 }>,
    inverse_mean: T,
}

impl<T: Scalar> Transmittance<T> {
    /// Makes the table for a surface of roughness `m` and refractive index `eta`.
    pub fn new(m: T, eta: T) -> Self {
        Self::of_values(std::array::from_fn(|k| (-albedo(&NODES[k], m, eta)).plus(1.0)), 0)
    }

    /// Makes the table for a surface of roughness `m` whose facets reflect everything: 1 - E is what they do not send back at once.
    /// It holds (1 - E)/c, since 1 - E falls as c does towards grazing.
    pub fn of_white_facets(m: T) -> Self {
        Self::of_values(std::array::from_fn(|k| lost(&FACETS[k], m).times(1.0 / cosine(k))), 1)
    }

    /// Makes the table from its values at [`cosine`], over which 1 - E has this power of c.
    fn of_values(values: [T; CELLS + 1], power: i32) -> Self {
        let table = Cubics::new(values);
        // 2 c dc = 8 x^7 dx
        let mean = (0..CELLS).flat_map(|cell| WITHIN_CELL.iter().map(move |node| (cell, node)));
        let mean = mean.fold(T::constant(0.0), |sum, (cell, (t, weight))| {
            let x = (count(cell) + t) / count(CELLS);
            let weight = weight * 8.0 * x.powi(7 + 4 * power) / count(CELLS);
            let [start, end] = [table.points[cell], table.points[cell + 1]];
            sum + Cubics::<T, { CELLS + 1 }>::within(start, end, T::Real::literal(*t)).times(weight)
        });
        Self { table, inverse_mean: mean.recip() }
    }

    /// The table at a direction with cosine `cos`.
    #[inline(always)]
    pub fn of(&self, cos: T::Real) -> T {
        self.table.at(cos.sqrt().sqrt().times(count(CELLS)))
    }
}

/// The factor by which the surface changes the reflectance of a layer below it. Its shapes are m and eta.
pub(crate) struct Through;

impl Kernel for Through {
    type Prepared<T: Scalar> = Transmittance<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(table: &Transmittance<T>, g: &Geometry<T::Real>) -> [T; 1] {
        [table.of(g.cos_i()) * table.of(g.cos_o()) * table.inverse_mean]
    }
}

impl Part for Through {
    type Kernel = Self;
    const SHAPES: usize = 2;
    const PREPARES_LONG: bool = true;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Transmittance<T> {
        let [m, eta] = shapes.take();
        Transmittance::new(m, eta)
    }
}

/// Light that is scattered more than once between the facets of a metal: (1 - E(ci))(1 - E(co))/(pi (1 - Ea)) of white facets, times
/// each of the Lagrange polynomials in 1 - Ea at [`BOUNCES`]. Its shape is m.
///
/// Facets that reflect the share Fa on average scale this by Fa^2 Ea/(1 - Fa (1 - Ea)) (Kulla and Conty 2017, Revisiting Physically
/// Based Shading at Imageworks), which is [`later_bounces`] at the nodes, interpolated.
pub(crate) struct Bounced;

/// Number of nodes of the interpolation in 1 - Ea.
pub(crate) const BOUNCES: usize = 7;
/// A little more than 1 - Ea at roughness 1.
const MOST_LOST: f64 = 0.6;

/// The nodes of the interpolation in 1 - Ea.
pub(crate) fn bounce_nodes() -> [f64; BOUNCES] {
    chebyshev(MOST_LOST)
}

/// Chebyshev nodes between 0 and `end`.
pub(crate) fn chebyshev<const N: usize>(end: f64) -> [f64; N] {
    std::array::from_fn(|j| 0.5 * end * (1.0 - (PI * (count(j) + 0.5) / count(N)).cos()))
}

/// The Lagrange polynomial of each node at `x`.
pub(crate) fn lagrange<T: Scalar, const N: usize>(nodes: [f64; N], x: T) -> [T; N] {
    nodes.map(|node| {
        let others = nodes.iter().filter(|other| **other != node);
        others.fold(T::constant(1.0), |product, other| product * x.plus(-other).times(1.0 / (node - other)))
    })
}

/// What is left after later bounces where each returns the share `albedo`, and `missing` of the light bounces again:
/// albedo^2 (1 - missing)/(1 - albedo missing), at each node.
pub(crate) fn later_bounces<T: Scalar, const N: usize>(nodes: [f64; N], albedo: T) -> [T; N] {
    nodes.map(|missing| (albedo * albedo).times(1.0 - missing) / (-albedo.times(missing)).plus(1.0))
}

impl Kernel for Bounced {
    const FUNCTIONS: usize = BOUNCES;
    type Prepared<T: Scalar> = (Transmittance<T>, [T; BOUNCES]);
    type Output<T: Scalar> = [T; BOUNCES];

    #[inline(always)]
    fn at<T: Scalar>((table, factors): &Self::Prepared<T>, g: &Geometry<T::Real>) -> [T; BOUNCES] {
        let cosines: T::Real = g.cos_i() * g.cos_o();
        let both = table.of(g.cos_i()) * table.of(g.cos_o()) * cosines;
        factors.map(|factor| factor * both)
    }
}

impl Part for Bounced {
    type Kernel = Self;
    const SHAPES: usize = 1;
    const PREPARES_LONG: bool = true;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        let [m] = shapes.take();
        let table = Transmittance::of_white_facets(m);
        let scale = table.inverse_mean.times(FRAC_1_PI);
        let factors =
            lagrange(bounce_nodes(), table.inverse_mean.recip()).map(|polynomial| polynomial * scale);
        (table, factors)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// Snell's form of Fresnel's equations.
    fn dielectric(eta: f64) -> impl Fn(f64) -> f64 {
        move |mu: f64| {
            let refracted = (1.0 - (1.0 - mu * mu) / (eta * eta)).sqrt();
            let rs = (mu - eta * refracted) / (mu + eta * refracted);
            let rp = (eta * mu - refracted) / (eta * mu + refracted);
            0.5 * (rs * rs + rp * rp)
        }
    }

    /// E by a different method: an integral over outgoing directions, with the lobe written out again after Walter et al.
    /// 2007, on many panels that get narrower towards the mirror direction.
    fn brute_force(cos: f64, m: f64, fresnel: impl Fn(f64) -> f64) -> f64 {
        let sin = (1.0 - cos * cos).sqrt();
        let lambda = |cos: f64| 0.5 * ((1.0 + m * m * (1.0 / (cos * cos) - 1.0)).sqrt() - 1.0);
        let lobe = |theta: f64, phi: f64| {
            let wo = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
            let sum = [wo[0] - sin, wo[1], wo[2] + cos];
            let length = sum.iter().map(|c| c * c).sum::<f64>().sqrt();
            let h = sum.map(|c| c / length);
            let tan2 = (h[0] * h[0] + h[1] * h[1]) / (h[2] * h[2]);
            let d = 1.0 / (PI * m * m * h[2].powi(4) * (1.0 + tan2 / (m * m)).powi(2));
            let shadowing = 1.0 / (1.0 + lambda(cos) + lambda(wo[2]));
            fresnel(0.5 * length) * d * shadowing / (4.0 * cos * wo[2])
        };
        let rule = GaussLegendre::new(16);
        // The mirror direction is at (theta, 0).
        let mirror = sin.atan2(cos);
        let towards = |middle: f64, end: f64| -> Vec<f64> {
            (0..28).map(|k| middle + (end - middle) * 0.5_f64.powi(k)).chain([middle]).collect()
        };
        let mut thetas = [towards(mirror, 0.0), towards(mirror, FRAC_PI_2)].concat();
        // Near grazing there is another scale.
        thetas.extend((1..20).map(|k| FRAC_PI_2 - (FRAC_PI_2 - mirror) * 0.5_f64.powi(k)));
        thetas.sort_by(f64::total_cmp);
        let mut phis = towards(0.0, PI);
        phis.sort_by(f64::total_cmp);
        let ring = |theta: f64| -> f64 {
            let half = phis.windows(2).map(|p| rule.integrate(p[0], p[1], |phi: f64| lobe(theta, phi)));
            2.0 * half.sum::<f64>()
        };
        let ring = |theta: f64| ring(theta) * theta.sin() * theta.cos();
        thetas.windows(2).filter(|t| t[1] > t[0]).map(|t| rule.integrate(t[0], t[1], ring)).sum()
    }

    #[test]
    fn agrees_with_brute_force() {
        for m in [1e-3, 0.03, 0.3, 1.0] {
            for eta in [1.1, 1.5, 3.0] {
                let table = Transmittance::<f64>::new(m, eta);
                for (degrees, most) in [0.0, 20.0, 45.0, 60.0, 75.0, 85.0]
                    .map(|degrees| (degrees, 3e-5))
                    .into_iter()
                    .chain([(89.0_f64, 2e-4)])
                {
                    let cos = degrees.to_radians().cos();
                    let error = 1.0 - table.of(cos) - brute_force(cos, m, dielectric(eta));
                    assert!(error.abs() < most, "m {m}, eta {eta}, {degrees} degrees: {error:e}");
                }
            }
        }
    }

    /// 1 - E of white facets by the lobe's own quadrature, and the whole with later bounces, which loses nothing.
    #[test]
    fn white_facets_lose_what_their_lobe_does_not_send_back() {
        for m in [1e-4, 1e-3, 0.03, 0.25, 0.49, 1.0] {
            let table = Transmittance::<f64>::of_white_facets(m);
            for (degrees, most) in [(0.0, 6e-5), (20.0, 6e-5), (45.0, 6e-5), (75.0, 6e-5), (85.0, 1e-4)] {
                let cos = f64::to_radians(degrees).cos();
                let lobe = brute_force(cos, m, |_| 1.0);
                let error = 1.0 - table.of(cos) * cos - lobe;
                assert!(error.abs() < most, "m {m}, {degrees} degrees: {error:e}");
            }
            assert!(1.0 / table.inverse_mean < MOST_LOST);
        }
    }

    /// The interpolated factor of later bounces agrees with its formula, for all reflectances and roughnesses.
    #[test]
    fn later_bounces_are_interpolated() {
        let mut worst = 0.0_f64;
        for fa in (0..=50).map(|i| 0.02 * f64::from(i)) {
            for missing in (0..=60).map(|i| 0.01 * f64::from(i)) {
                let exact = fa * fa * (1.0 - missing) / (1.0 - fa * missing);
                let at_nodes = later_bounces(bounce_nodes(), fa);
                let found: f64 =
                    at_nodes.iter().zip(lagrange(bounce_nodes(), missing)).map(|(a, b)| a * b).sum();
                worst = worst.max((found - exact).abs());
            }
        }
        assert!(worst < 5e-6, "{worst:e}");
    }

    /// The reflectance of a smooth surface for diffuse light agrees with Walsh's integral of Fresnel's equations (Walsh 1926;
    /// Duntley 1942): 0.092 at eta 1.5.
    #[test]
    fn smooth_surface_in_diffuse_light() {
        for eta in [1.2_f64, 1.5, 2.0] {
            let [e2, e3, e4] = [2, 3, 4].map(|power| eta.powi(power));
            let walsh = 0.5
                + (eta - 1.0) * (3.0 * eta + 1.0) / (6.0 * (eta + 1.0).powi(2))
                + e2 * (e2 - 1.0).powi(2) / (e2 + 1.0).powi(3) * ((eta - 1.0) / (eta + 1.0)).ln()
                - 2.0 * e3 * (e2 + 2.0 * eta - 1.0) / ((e2 + 1.0) * (e4 - 1.0))
                + 8.0 * e4 * (e4 + 1.0) / ((e2 + 1.0) * (e4 - 1.0).powi(2)) * eta.ln();
            if eta == 1.5 {
                assert!((walsh - 0.092).abs() < 5e-4, "{walsh}");
            }
            let mean = 1.0 - 1.0 / Transmittance::<f64>::new(1e-3, eta).inverse_mean;
            assert!((mean - walsh).abs() < 1e-4, "eta {eta}: {mean} for {walsh}");
        }
    }
}
