//! Lights as points of light: distant directions or nearby positions.
//!
//! Every light becomes a fixed list of points, the same for all pixels. Per unit of f, a surface reflects from one of them
//!
//! ```text
//! far      E cos(theta_i)                              E: irradiance at normal incidence
//! point    I cos(theta_i)/d^2                          I: intensity
//! panel    L A |cos(theta_l)| cos(theta_i)/d^2         L: radiance, A: area of its cell, theta_l: angle to its normal
//! ```

use crate::math::GOLDEN;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A point of light.
#[derive(Clone, Copy, Debug)]
pub(super) enum Lamp {
    /// Distant light from the unit direction `to_light`; irradiance in W/m^2.
    Far { to_light: DVec3, irradiance: DVec3 },
    /// Light from a position; intensity in W/sr.
    Point { position: DVec3, intensity: DVec3 },
    /// Light from both sides of a small piece of a plane; intensity along its unit normal in W/sr.
    Cell { position: DVec3, normal: DVec3, intensity: DVec3 },
}

impl Lamp {
    /// The direction from `point` to the light, the distance, and the irradiance at `point` of a surface facing the light.
    /// `None` at the light itself.
    pub fn at(&self, point: DVec3) -> Option<(DVec3, f64, DVec3)> {
        let near = |position: DVec3| {
            let to = position - point;
            let distance = to.length();
            // Closer than any size that a scene may have.
            (distance > 1e-9).then(|| (to / distance, distance))
        };
        match *self {
            Self::Far { to_light, irradiance } => Some((to_light, f64::INFINITY, irradiance)),
            Self::Point { position, intensity } => {
                let (to, distance) = near(position)?;
                Some((to, distance, intensity / (distance * distance)))
            }
            Self::Cell { position, normal, intensity } => {
                let (to, distance) = near(position)?;
                Some((to, distance, intensity * (normal.dot(to).abs() / (distance * distance))))
            }
        }
    }
}

/// Divides a rectangle with half edges `u` and `v` into at most `samples` equal cells, as square as possible, and returns
/// their midpoints as lamps.
pub(super) fn panel(center: DVec3, u: DVec3, v: DVec3, radiance: DVec3, samples: u32) -> Vec<Lamp> {
    let (along, across) = cells(u.length() / v.length(), samples);
    let normal = u.cross(v);
    let area = 4.0 * normal.length() / (f64::from(along) * f64::from(across));
    let normal = normal.normalize();
    let middle = |i: u32, n: u32| (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
    (0..across)
        .flat_map(|j| (0..along).map(move |i| (i, j)))
        .map(|(i, j)| Lamp::Cell {
            position: center + u * middle(i, along) + v * middle(j, across),
            normal,
            intensity: radiance * area,
        })
        .collect()
}

/// Number of cells along each side of a rectangle whose first side is `ratio` times the second.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and samples")]
fn cells(ratio: f64, samples: u32) -> (u32, u32) {
    let most = f64::from(samples.max(1));
    let across = (most / ratio).sqrt().round().clamp(1.0, most);
    let along = (most / across).floor();
    (along as u32, across as u32)
}

/// Points that fill the unit square evenly, in ascending order of the first coordinate: (k + 1/2)/n and multiples of the
/// golden ratio. Mapped to a sphere by height and azimuth, they form a Fibonacci lattice.
pub(super) fn lattice(samples: u32) -> impl Iterator<Item = (f64, f64)> {
    (0..samples).map(move |k| {
        let k = f64::from(k);
        ((k + 0.5) / f64::from(samples), (0.5 + k * GOLDEN).fract())
    })
}

/// The direction with a given cos(theta) and azimuth. The azimuth is a fraction of a turn, counted like the columns of a
/// map: from -x over +y, +x and -y.
pub(super) fn sky(cos_theta: f64, turn: f64) -> DVec3 {
    let sin_theta = ((1.0 - cos_theta) * (1.0 + cos_theta)).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (PI - TAU * turn).sin_cos();
    DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
}

/// Lamps for the same radiance from all directions.
pub(super) fn uniform(radiance: DVec3, samples: u32) -> Vec<Lamp> {
    let irradiance = radiance * (4.0 * PI / f64::from(samples));
    lattice(samples).map(|(u, v)| Lamp::Far { to_light: sky(1.0 - 2.0 * u, v), irradiance }).collect()
}

/// Lamps for the overcast sky of the CIE (ISO 15469, type 1, in the form of Moon and Spencer 1942): radiance
/// Lz (1 + 2 cos theta)/3 above the horizon.
///
/// The density of the directions is proportional to the radiance: with u from 0 to 1, cos + cos^2 = 2 (1 - u), and each
/// represents the same share of the integral, 4 pi/3 Lz.
pub(super) fn overcast(zenith: DVec3, samples: u32) -> Vec<Lamp> {
    let irradiance = zenith * (4.0 * PI / 3.0 / f64::from(samples));
    let cosine = |u: f64| ((9.0 - 8.0 * u).sqrt() - 1.0) / 2.0;
    lattice(samples).map(|(u, v)| Lamp::Far { to_light: sky(cosine(u), v), irradiance }).collect()
}
