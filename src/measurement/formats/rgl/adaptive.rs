//! The adaptive parameterisation: f at any pair of directions.
//!
//! With m the half vector, u = (sqrt(2 theta_m/pi), phi_m/(2 pi) + 1/2), and s the point that the density `vndf` of visible normals maps
//! to u, f cos(theta_o) = `spectra`(s) `ndf`(u) / (4 `sigma`(u_i)), where u_i stands for wi as u does for m. Tables of neighbouring
//! directions of incidence are interpolated, and so are the densities between them. Of an isotropic material phi_m counts from phi_i.

#![allow(
    clippy::indexing_slicing,
    reason = "sizes are checked when a file is read; an index beyond the end is a mistake in the program"
)]

use super::warp::{Place, Slices, Table, Warp};
use crate::geometry::{Pair, direction};
use crate::measurement::Continuous;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The symmetry by which a file of an anisotropic material leaves out azimuths of incidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Symmetry {
    /// It has all azimuths.
    None,
    /// It has those around this direction: the material looks the same when it is turned by 180 degrees.
    HalfTurn(DVec3),
    /// It has those of the quadrant of this direction: the material is its own mirror image along both axes.
    Mirrors(DVec3),
}

impl Symmetry {
    /// The half turn around the axis that is closest to `middle`; files of the database have -180 to 0 degrees.
    pub(super) fn half_turn(middle: f64) -> Self {
        Self::HalfTurn(direction(FRAC_PI_2, (middle / FRAC_PI_2).round() * FRAC_PI_2))
    }

    /// The quadrant in which `middle` lies; files of the database have -180 to -90 degrees.
    pub(super) fn mirrors(middle: f64) -> Self {
        Self::Mirrors(direction(FRAC_PI_2, ((middle / FRAC_PI_2).floor() + 0.5) * FRAC_PI_2))
    }

    /// The directions that the tables have instead of these.
    fn reduced(self, wi: DVec3, wo: DVec3) -> (DVec3, DVec3) {
        let sign = |beside: f64| if beside < 0.0 { -1.0 } else { 1.0 };
        let signs = match self {
            Self::None => return (wi, wo),
            Self::HalfTurn(middle) => {
                let sign = sign(middle.x * wi.x + middle.y * wi.y);
                DVec3::new(sign, sign, 1.0)
            }
            Self::Mirrors(middle) => DVec3::new(sign(middle.x * wi.x), sign(middle.y * wi.y), 1.0),
        };
        (wi * signs, wo * signs)
    }
}

/// A measured BRDF with its adaptive parameterisation.
#[derive(Clone, Debug)]
pub(super) struct Adaptive {
    /// Azimuths of incidence, increasing, radians.
    pub(super) phi_i: Vec<f64>,
    /// Polar angles of incidence, increasing, radians.
    pub(super) theta_i: Vec<f64>,
    pub(super) symmetry: Symmetry,
    pub(super) ndf: Table,
    pub(super) sigma: Table,
    pub(super) vndf: Warp,
    /// Number of channels.
    pub(super) channels: usize,
    /// Number of nodes along either side of a table of `spectra`.
    pub(super) side: usize,
    /// By azimuth and polar angle of incidence, channel, row and column.
    pub(super) spectra: Vec<f32>,
    /// Whether `spectra` must be multiplied by ndf / (4 sigma), as is usual.
    pub(super) scaled: bool,
}

/// A node of the tables of spectra as a pair of directions.
pub(super) struct Node {
    pub(super) pair: Pair,
    /// f cos(theta_o) per stored number.
    pub(super) scale: f64,
}

impl Adaptive {
    /// A material is isotropic if its file has hardly any azimuths of incidence, as all readers of the format decide.
    pub(super) fn isotropic(&self) -> bool {
        self.phi_i.len() <= 2
    }

    /// The azimuth of incidence, turned by 360 degrees if that is one of the tabulated ones and it is not: a file may begin at 0 instead
    /// of -180 degrees.
    fn wrapped(&self, phi: f64) -> f64 {
        let (first, last) = (self.phi_i[0], self.phi_i[self.phi_i.len() - 1]);
        let within = |phi: &f64| (first..=last).contains(phi);
        // Between the last and the first azimuth of an incomplete turn, the nearest table holds, as in other readers.
        [phi, phi - TAU, phi + TAU].into_iter().find(within).unwrap_or(phi)
    }

    fn slices(&self, phi_i: f64, theta_i: f64) -> Slices {
        Slices::at(&self.phi_i, &self.theta_i, self.wrapped(phi_i), theta_i)
    }

    /// What a stored number is multiplied by to give f cos(theta_o).
    fn scale(&self, u_m: [f64; 2], u_i: [f64; 2]) -> f64 {
        if self.scaled { self.ndf.at(u_m) / (4.0 * self.sigma.at(u_i)) } else { 1.0 }
    }

    /// What a stored number is multiplied by to give f cos(theta_o) where `m` is the half vector.
    pub(super) fn scale_at(&self, wi: DVec3, m: DVec3) -> f64 {
        self.point(wi, m).2
    }

    /// The point for the half vector, and what stored numbers are multiplied by there to give f cos(theta_o).
    fn point(&self, wi: DVec3, m: DVec3) -> (Slices, [f64; 2], f64) {
        let (theta_i, phi_i) = angles(wi);
        let (theta_m, phi_m) = angles(m);
        let turned = if self.isotropic() { phi_m - phi_i } else { phi_m };
        let v = azimuth_to_unit(turned);
        let u_m = [polar_to_unit(theta_m), v - v.floor()];
        let slices = self.slices(phi_i, theta_i);
        let scale = self.scale(u_m, [polar_to_unit(theta_i), azimuth_to_unit(phi_i)]);
        (slices, self.vndf.invert(u_m, &slices), scale)
    }

    /// The direction of incidence of tables: that of the azimuth `k` and the polar angle `j`.
    pub(super) fn incident(&self, k: usize, j: usize) -> DVec3 {
        direction(self.theta_i[j], self.phi_i[k])
    }

    /// The directions that the node at `column` and `row` of the tables for `k` and `j` stands for.
    #[expect(clippy::cast_precision_loss, reason = "numbers of nodes")]
    pub(super) fn node(&self, k: usize, j: usize, column: usize, row: usize) -> Node {
        let last = (self.side - 1) as f64;
        let slices = Slices::only(k * self.theta_i.len() + j);
        let u_m = self.vndf.sample([column as f64 / last, row as f64 / last], &slices);
        let wi = self.incident(k, j);
        let (theta_i, phi_i) = (self.theta_i[j], self.phi_i[k]);
        let phi_m = unit_to_azimuth(u_m[1]) + if self.isotropic() { phi_i } else { 0.0 };
        let m = direction(unit_to_polar(u_m[0]), phi_m);
        let wo = (2.0 * m.dot(wi) * m - wi).normalize();
        let (_, phi) = angles(wi);
        Node { pair: Pair { wi, wo }, scale: self.scale(u_m, [polar_to_unit(theta_i), azimuth_to_unit(phi)]) }
    }

    /// The stored numbers of a channel in the tables for `k` and `j`, row by row.
    pub(super) fn table(&self, k: usize, j: usize, channel: usize) -> &[f32] {
        let size = self.side * self.side;
        let begin = ((k * self.theta_i.len() + j) * self.channels + channel) * size;
        &self.spectra[begin..begin + size]
    }
}

impl Continuous for Adaptive {
    fn at(&self, pair: &Pair, values: &mut [f64]) {
        let (wi, wo) = self.symmetry.reduced(pair.wi, pair.wo);
        let (slices, point, scale) = self.point(wi, (wi + wo).normalize());
        let place = Place::new(point, self.side, self.side);
        let size = self.side * self.side;
        let factor = scale / pair.wo.z;
        for (channel, value) in values.iter_mut().enumerate() {
            let stored = slices.sum(|slice| {
                let table = &self.spectra[(slice * self.channels + channel) * size..][..size];
                place.bilinear(self.side, |node| f64::from(table[node]))
            });
            *value = stored * factor;
        }
    }
}

/// The polar angle and the azimuth of a direction, radians.
pub(super) fn angles(v: DVec3) -> (f64, f64) {
    (v.x.hypot(v.y).atan2(v.z), v.y.atan2(v.x))
}

/// The polar angle at a coordinate of the unit square; nodes lie the closer the nearer they are to the normal.
pub(super) fn unit_to_polar(u: f64) -> f64 {
    u * u * (0.5 * PI)
}

pub(super) fn polar_to_unit(theta: f64) -> f64 {
    (theta * (2.0 / PI)).max(0.0).sqrt()
}

pub(super) fn unit_to_azimuth(u: f64) -> f64 {
    (2.0 * u - 1.0) * PI
}

pub(super) fn azimuth_to_unit(phi: f64) -> f64 {
    phi / TAU + 0.5
}
