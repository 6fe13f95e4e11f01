//! Blender's Principled BSDF: a rough diffuse body under a rough dielectric surface, a metal, or a mixture, as Cycles evaluates it.
//!
//! With M = metallic, s = (F - F0)/(1 - F0), F the exact dielectric reflectance of ior at wi.h, F0 that at normal incidence:
//!
//! ```text
//! f  = (1 - M) (V (F0 specular_tint (1 - s) + s) + (1 - F0 specular_tint)(1 - S) f_d) + M V F82
//! V  = D G/(4 ci co) of ggx-anisotropic and smith:  mx = min(roughness^2/a, 1), my = roughness^2 a, a = sqrt(1 - 0.9 anisotropic)
//! F82  f82-tint with f0 = base_color and tint = specular_tint
//! f_d  b g1 + b^3 g2,  where eon with albedo b = base_color and r = diffuse_roughness is b g1 + b^2 g2, g2 its later bounces
//! S    mean of s over the facets visible from wo, those that would mirror wo to below the horizon counting 0,
//!      at (mx my)^(1/4), co and sqrt((ior - 1)/(ior + 1)): linear between the nodes 0, 1/15, ..., 1 of each
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | roughness | 1 | 0.01..1 | its square is the m of other models, roughness = sqrt(m) |
//! | anisotropic | 1 | 0..1 | widens the highlight along x and narrows it along y; fixed at 0 unless freed |
//! | ior | 1 | 1.001..3 | refractive index, the same for all channels; fixed at 1.5 unless freed |
//! | diffuse_roughness | 1 | 0..1 | roughness of the body; 0 is Lambert, from which data cannot distinguish a small value |
//! | base_color | 1 | 0..1 | albedo of the body, f0 of the metal |
//! | metallic | 1 | 0..1 | 0 dielectric, 1 metal; shared by the channels |
//! | specular_tint | 1 | 0..1 | scales F0 of the dielectric, and F82 at 82 degrees of the metal; shared, fixed at 1 unless freed |
//!
//! Blender 5.0.1, Cycles (<https://projects.blender.org/blender/blender>): `intern/cycles/kernel/svm/closure.h` and
//! `kernel/closure/bsdf_microfacet.h`, `bsdf_util.h`, `bsdf_oren_nayar.h`; `app/cycles_precompute.cpp` says what the table of S holds. The
//! parameters are inputs of the node. This is its `Distribution` "GGX"; a new node has "Multiscatter GGX" and must be set. Leave
//! `Specular IOR Level` at 0.5. Renders of Cycles agreed with the reference formula to the digits of their single precision.
//!
//! Departures: the lower bounds of roughness and index; below roughness of about 0.01 Cycles renders a mirror. F82 is not cut off
//! at 0, below which it can fall slightly, near 82 degrees, for a tint close to 0. The nodes of S are integrated here (in ten
//! milliseconds where roughness and index first fall into a cell of the table) rather than copied; Cycles has them from random samples,
//! off by up to 1e-5. Left out: coat (Cycles dims what lies below it by a table of its albedo, which was not identified), sheen, thin film,
//! transmission, subsurface, emission, and the compensation of "Multiscatter GGX". specular_tint is shared by the channels, since what
//! reaches the body depends on that of the brightest.
//!
//! Two peculiarities are Cycles' own. The later bounces of the rough body carry base_color once more than EON's, so a rough body of
//! middle grey is darker. And S is linear between nodes, so derivatives jump at the multiples of 1/15 of roughness.
//!
//! Identifiability: as for `gltf` and `openpbr(base=mixed)`: one channel determines base_color and metallic once ior is fixed. M strictly
//! between 0 and 1 is a mixture of two materials; if M = 0 or M = 1 fits as well, prefer that.
//!
//! Not reciprocal: S depends on the viewer alone; wo is the viewer. Finite at grazing. Seen in light from all around, it never returns more
//! than it receives: the estimate of what the surface reflects neglects shadowing, so it is too high if anything. Lit from one direction near
//! grazing it returns more: the body is not dimmed by what the surface reflects of the light on its way in.
#![allow(clippy::indexing_slicing, reason = "a kernel: nodes and cells are within the table")]

use super::openpbr::{BODY, Body, body_coefficients};
use crate::geometry::Geometry;
use crate::math::{GaussLegendre, Real, Scalar, count};
use crate::model::parts::distribution::{Anisotropic, Density, Ggx, Shadows};
use crate::model::parts::fresnel::{
    Constants, Fresnel, FresnelReflectance, Schlick, index_constants, index_reflectance,
};
use crate::model::parts::shadowing::Smith;
use crate::model::{
    Choices, Kernel, Model, ParamSpec, Part, PreparedBy, Reshape, Reshaped, Scale, Sharing, Sharper,
    Strength, Values, Visitor,
};
use std::f64::consts::{FRAC_PI_4, PI};
use std::sync::{LazyLock, OnceLock};

/// Blender's Principled BSDF.
#[derive(Clone, Copy, Debug)]
pub struct BlenderPrincipled;

/// Index of the first of the shapes that hold the surface's roughness, anisotropy and index.
const ROUGHNESS: usize = 0;
/// Index of the shape that is the surface's index of refraction.
const IOR: usize = 2;
/// Index of the shape that is the body's roughness.
const DIFFUSE_ROUGHNESS: usize = 3;

/// mx and my of the surface.
struct Surface;

impl Reshape for Surface {
    const SHAPES: usize = 2;

    fn reshape<T: Scalar>(mut shapes: Values<'_, T>) -> [T; 2] {
        let [roughness, anisotropic] = shapes.take();
        let aspect = (-anisotropic.times(0.9)).plus(1.0).sqrt();
        let m = roughness.squared();
        let (mx, one) = (m / aspect, T::constant(1.0));
        [T::if_less(mx.value(), one.value(), mx, one), m * aspect]
    }
}

/// Number of nodes of Cycles' table along each axis.
const NODES: usize = 16;
/// The place of the last of them.
const LAST: f64 = 15.0;

/// S at all nodes of co, for a node of the roughness and one of the index.
fn nodes(rough: usize, index: usize) -> &'static [f64; NODES] {
    static TABLE: [OnceLock<[f64; NODES]>; NODES * NODES] = [const { OnceLock::new() }; NODES * NODES];
    static ZERO: [f64; NODES] = [0.0; NODES];
    let place = |node: usize, most: f64| (count(node) / LAST).clamp(1e-4, most);
    // At the first node of the index nothing is reflected.
    match TABLE.get(rough * NODES + index) {
        Some(known) if index > 0 => known.get_or_init(|| {
            let (rough, z) = (place(rough, 1.0), place(index, 0.99));
            std::array::from_fn(|node| mean_grazing(rough * rough, place(node, 1.0), z.powi(4)))
        }),
        _ => &ZERO,
    }
}

/// S of facets of roughness m and reflectance f0 seen at cosine `cos`: the mean over the visible normals. These are even on a cap of
/// the sphere when the roughness is taken out (Dupuy and Benyoub 2023, Sampling Visible GGX Normals with Spherical Caps).
fn mean_grazing(m: f64, cos: f64, f0: f64) -> f64 {
    static RULE: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(32));
    let root = f0.sqrt();
    let constants = index_constants((1.0 + root) / (1.0 - root));
    let sin = (1.0 - cos * cos).sqrt();
    let length = (m * sin).hypot(cos);
    let (across, up) = (m * sin / length, cos / length);

    // s of the facet at height z and azimuth phi on the cap.
    let grazing = |z: f64, phi: f64| {
        let ring = (1.0 - z * z).max(0.0).sqrt();
        let h = [m * (ring * phi.cos() + across), m * ring * phi.sin(), z + up];
        let mu = (h[0] * sin + h[2] * cos) / h.iter().map(|x| x * x).sum::<f64>().max(1e-300).sqrt();
        ((index_reflectance(&constants, mu.clamp(1e-300, 1.0)) - f0) / (1.0 - f0)).clamp(0.0, 1.0)
    };
    // The azimuths of a ring whose facets mirror to above the horizon: 2 mu hz > cos is linear in the azimuth's cosine.
    let above = |z: f64| {
        let (ring, hz) = ((1.0 - z * z).max(0.0).sqrt(), z + up);
        let slope = 2.0 * m * ring * (sin * hz - cos * m * across);
        let least = cos * (m * m * (ring * ring + across * across) - hz * hz) - 2.0 * sin * m * hz * across;
        let edge = if slope == 0.0 { f64::from(u8::from(least > 0.0)) * 2.0 - 1.0 } else { least / slope };
        let edge = edge.clamp(-1.0, 1.0).acos();
        if slope >= 0.0 { (0.0, edge) } else { (edge, PI) }
    };
    // Rings that are cut begin and end where the horizon is met in the plane of incidence. There a facet mirrors wo to the horizon if it
    // is tilted by half the angle; on the cap, a tilt is half the sum of a normal's polar angle and that of what is seen. Towards the
    // bottom of the cap facets turn to the horizon within a height of the size of m.
    let (seen, view) = (across.atan2(up), sin.atan2(cos));
    let on_cap = |tilt: f64| 2.0 * (tilt.sin() / m).atan2(tilt.cos());
    let bottom = -up;
    let mut ends: Vec<f64> = [on_cap(FRAC_PI_4 + 0.5 * view) - seen, on_cap(FRAC_PI_4 - 0.5 * view) + seen]
        .into_iter()
        .filter(|angle| (0.0..PI).contains(angle))
        .map(f64::cos)
        .chain((0..12).map(|octave| bottom + m * 4_f64.powi(octave)))
        .filter(|z| *z > bottom && *z < 1.0)
        .chain([bottom, 1.0])
        .collect();
    ends.sort_by(f64::total_cmp);
    // Nodes gather at the ends, where roots begin.
    let gathered = |from: f64, to: f64, f: &dyn Fn(f64) -> f64| {
        RULE.integrate(0.0, PI, |u: f64| {
            0.5 * (to - from) * u.sin() * f(from + 0.5 * (to - from) * (1.0 - u.cos()))
        })
    };
    let ring = |z: f64| {
        let (from, to) = above(z);
        RULE.integrate(from, to, |phi: f64| grazing(z, phi))
    };
    let sum: f64 = ends.windows(2).map(|pair| gathered(pair[0], pair[1], &ring)).sum();
    sum / (PI * (1.0 + up))
}

/// (1 - S) of the surface at the nodes of co, and 1 - F0. Its shapes are roughness, anisotropy and index.
type Unreflected<T> = ([[T; 1]; NODES], T);

/// 1 - S
#[inline(always)]
fn unreflected<T: Scalar>((table, _): &Unreflected<T>, g: &Geometry<T::Real>) -> T {
    let x: T::Real = g.cos_o().times(LAST);
    let cell = T::look_up(table, x);
    let ([low], [high]) = (cell.start, cell.end);
    (high - low) * (x - cell.number) + low
}

fn prepare_unreflected<T: Scalar>(mut shapes: Values<'_, T>) -> Unreflected<T> {
    let [mx, my] = Surface::reshape(shapes.clone());
    let [_, _, eta] = shapes.take();
    let r = eta.plus(-1.0) / eta.plus(1.0);
    let places = [(mx * my).sqrt().sqrt(), r.sqrt()].map(|place| {
        let x = place.times(LAST);
        let cell = x.value().whole().min(NODES - 2);
        (cell, x.plus(-count(cell)))
    });
    let [(rough, up), (index, right)] = places;
    let corner = |i: usize, k: usize| nodes(rough + i, index + k);
    let [a, b, c, d] = [corner(0, 0), corner(0, 1), corner(1, 0), corner(1, 1)];
    let between = |low: f64, high: f64| right.times(high - low).plus(low);
    let table = std::array::from_fn(|node| {
        let (low, high) = (between(a[node], b[node]), between(c[node], d[node]));
        [(-(low + (high - low) * up)).plus(1.0)]
    });
    (table, (-(r * r)).plus(1.0))
}

/// (1 - F0)(1 - S): what passes to the body.
struct Through;

/// 1 - S: the same of a surface without tint.
struct Untinted;

impl Kernel for Through {
    type Prepared<T: Scalar> = Unreflected<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(prepared: &Unreflected<T>, g: &Geometry<T::Real>) -> [T; 1] {
        [unreflected(prepared, g) * prepared.1]
    }
}

impl Part for Through {
    type Kernel = Self;
    const SHAPES: usize = 3;
    const PREPARES_LONG: bool = true;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        prepare_unreflected(shapes)
    }
}

impl Kernel for Untinted {
    type Prepared<T: Scalar> = Unreflected<T>;
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>(prepared: &Unreflected<T>, g: &Geometry<T::Real>) -> [T; 1] {
        [unreflected(prepared, g)]
    }
}

impl Part for Untinted {
    type Kernel = Self;
    const SHAPES: usize = 3;
    const PREPARES_LONG: bool = true;

    fn prepare<T: Scalar>(shapes: Values<'_, T>) -> PreparedBy<Self, T> {
        prepare_unreflected(shapes)
    }
}

/// F0 (1 - s) and s of the dielectric, and the three factors of F82. Its shape is the index.
struct Facets;

impl Kernel for Facets {
    const FUNCTIONS: usize = 5;
    const SHARED_ON_RINGS: bool = true;
    type Prepared<T: Scalar> = Constants<T>;
    type Output<T: Scalar> = [T; 5];

    #[inline(always)]
    fn at<T: Scalar>(constants: &Constants<T>, g: &Geometry<T::Real>) -> [T; 5] {
        let (mu, rest): (T::Real, T::Real) = (g.cos_d, g.one_less_cos_d);
        let rise = grazing_share(constants, mu, rest);
        let [f0, _, _] = *constants;
        let [fallen, risen, _] = Schlick::factors::<T>(constants, mu, rest);
        [(-rise).plus(1.0) * f0, rise, fallen, risen, risen * (mu * rest)]
    }
}

/// s = (F - F0)/(1 - F0) without the difference, which grows with (1 - mu)^2 only.
///
/// In the notation of the dielectric part, with S = G + M, Rs = F0 A^2 and Rp = F0 A^2 p^2 with A = 4/S^2. With alpha = A - 1 and
/// beta = 1 - A p, which are multiples of 1 - mu, F/F0 - 1 = alpha - beta + (alpha^2 + beta^2)/2, and
/// alpha - beta = -32 (1 - r) r^2 sin^4/(S^3 (4 r mu/S + 1 - r)(mu (2 + 2 r - (1 - r) y) + G y)), y = 1 + r mu^2.
#[inline(always)]
fn grazing_share<T: Scalar>(&[f0, r, scale]: &Constants<T>, mu: T::Real, rest: T::Real) -> T {
    let m = scale * mu;
    let g = (m * m + r.times(4.0)).sqrt();
    let sum = g + m;
    let inverse = sum.recip();
    let inverse2 = inverse * inverse;
    let (mu2, s2): (T::Real, T::Real) = (mu * mu, rest * mu.plus(1.0));
    // 2 - S
    let missing = scale * rest + scale * scale * s2 / (r.plus(1.0) + g);
    let alpha = scale.times(2.0) * (missing + sum * rest) * inverse2;
    let of_p = r.times(4.0) * inverse * mu + scale;
    let beta = scale.times(8.0) * s2 * inverse2 / of_p - alpha;
    let y = (r * mu2).plus(1.0);
    let of_difference = (r.plus(1.0).times(2.0) - scale * y) * mu + g * y;
    let s4: T::Real = s2 * s2;
    let difference = scale * r * r * s4 * (inverse2 * inverse).times(32.0) / (of_p * of_difference);
    f0 * ((alpha.squared() + beta.squared()).times(0.5) - difference) / (-f0).plus(1.0)
}

impl Part for Facets {
    type Kernel = Self;
    const SHAPES: usize = 1;

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Constants<T> {
        let [eta] = shapes.take();
        index_constants(eta)
    }
}

/// Number of coefficients: the body's with the tint and without, two of the dielectric's highlight and three of the metal's.
const COEFFICIENTS: usize = 2 * BODY + 2 + 3;

impl Model for BlenderPrincipled {
    type Coefficients<T: Scalar> = [T; COEFFICIENTS];

    const NAME: &'static str = "blender-principled";
    const SUMMARY: &'static str = "base and specular of Blender's Principled BSDF";
    const REFERENCE: &'static str = "Blender 5.0.1, Cycles, intern/cycles/kernel/svm/closure.h and kernel/closure, \
        https://projects.blender.org/blender/blender";
    const RECIPROCAL: bool = false;

    fn build(_: &Choices) -> Self {
        Self
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let shape = |name, summary, bounds, typical, initial| {
            ParamSpec::shape(name, summary, bounds, typical, initial, Scale::Linear)
        };
        let shared = |name, summary, initial| {
            let spec = ParamSpec::amplitude(name, summary, 1.0, initial);
            ParamSpec { sharing: Sharing::Shared, ..spec }
        };
        vec![
            shape("roughness", "roughness of the surface", (0.01, 1.0), (0.05, 1.0), 0.3)
                .sharper_when(Sharper::Smaller),
            shape("anisotropic", "anisotropy of the surface", (0.0, 1.0), (0.1, 0.9), 0.0)
                .isotropic_at(0.0)
                .fixed(),
            shape("ior", "refractive index", (1.001, 3.0), (1.1, 2.5), 1.5).fixed(),
            shape("diffuse_roughness", "roughness of the body", (0.0, 1.0), (0.0, 1.0), 0.5),
            ParamSpec::amplitude("base_color", "albedo of the body, f0 of the metal", 1.0, 0.2),
            shared("metallic", "metal or dielectric", 0.1),
            shared("specular_tint", "scale of F0, and the metal's colour at 82 degrees", 1.0).fixed(),
        ]
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        visitor.part::<Body>(DIFFUSE_ROUGHNESS);
        visitor.part::<Through>(ROUGHNESS);
        visitor.next_term();
        visitor.part::<Body>(DIFFUSE_ROUGHNESS);
        visitor.part::<Untinted>(ROUGHNESS);
        visitor.next_term();
        visitor.part::<Reshaped<Density<Ggx<Anisotropic>>, Surface>>(ROUGHNESS);
        visitor.part::<Reshaped<<Smith as Shadows>::Visibility<Ggx<Anisotropic>>, Surface>>(ROUGHNESS);
        visitor.part::<Facets>(IOR);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; COEFFICIENTS] {
        let [base, metallic, tint] = amplitudes.take();
        let dielectric = -metallic + T::constant(1.0);
        let [single, later @ ..] = body_coefficients(base);
        // Later bounces have the colour once more.
        let body = || std::iter::once(single).chain(later.map(|coefficient| base * coefficient));
        let (tinted, untinted) = (dielectric * tint, dielectric * (-tint).plus(1.0));
        let metal = Fresnel::F82Tint.coefficients(&mut Values::new(&[base, tint]));
        let below = [tinted, untinted].into_iter().flat_map(|factor| body().map(move |x| factor * x));
        let mut all =
            below.chain([tinted, dielectric]).chain(metal.map(|coefficient| metallic * coefficient));
        std::array::from_fn(|_| all.next().unwrap_or(T::constant(0.0)))
    }

    fn strength(&self) -> Strength {
        Strength::Missing
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// By Snell's form of Fresnel's equations, whose difference from F0 keeps digits away from the normal.
    #[test]
    fn grazing_share_is_that_of_fresnel() {
        for eta in [1.01_f64, 1.5, 3.0] {
            let constants = index_constants(eta);
            let f0 = ((eta - 1.0) / (eta + 1.0)).powi(2);
            for mu in [1e-3, 0.05, 0.2, 0.5, 0.8] {
                let inside = (1.0 - (1.0 - mu * mu) / (eta * eta)).sqrt();
                let (s, p) =
                    ((mu - eta * inside) / (mu + eta * inside), (eta * mu - inside) / (eta * mu + inside));
                let expected = (0.5 * (s * s + p * p) - f0) / (1.0 - f0);
                assert_relative_eq!(
                    grazing_share(&constants, mu, 1.0 - mu),
                    expected,
                    max_relative = 1e-9,
                    epsilon = 1e-15
                );
            }
        }
    }

    /// The mean over visible normals by brute force: over directions of the mirrored light, weighted with D G1(co)/(4 co).
    #[test]
    fn nodes_are_means_over_visible_facets() {
        let rule = GaussLegendre::new(64);
        for (m, cos) in [(0.3_f64, 0.6_f64), (0.6, 0.3), (1.0, 0.9)] {
            let z4 = 0.04;
            let constants = index_constants(1.5);
            let sin = (1.0 - cos * cos).sqrt();
            let g1 = 2.0 * cos / (cos + (m * m * sin * sin + cos * cos).sqrt());
            let over = |theta: f64, phi: f64| {
                let (st, ct) = theta.sin_cos();
                let sum = [st * phi.cos() + sin, st * phi.sin(), ct + cos];
                let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
                let (mu, hz) = (0.5 * length, sum[2] / length);
                let density = m * m / (PI * (1.0 - hz * hz + m * m * hz * hz).powi(2));
                let s = (index_reflectance(&constants, mu) - z4) / (1.0 - z4);
                density * g1 / (4.0 * cos) * s * st
            };
            // Panels, since the peak is narrow.
            let panels = |end: f64, f: &dyn Fn(f64) -> f64| -> f64 {
                (0..8)
                    .map(|k| rule.integrate(end * f64::from(k) / 8.0, end * f64::from(k + 1) / 8.0, f))
                    .sum()
            };
            let expected = 2.0 * panels(0.5 * PI, &|theta| panels(PI, &|phi| over(theta, phi)));
            assert_relative_eq!(mean_grazing(m, cos, z4), expected, max_relative = 1e-5);
        }
    }
}
