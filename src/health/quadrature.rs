//! Directional albedo, int f cos(theta_o) dwo, by adaptive quadrature with an estimate of its error.
//!
//! The hemisphere of outgoing directions is cut into cells of theta and phi, which get smaller towards the directions in
//! which a lobe can be sharp: the mirror direction and the direction back to the light. So a lobe of any width above 1e-4
//! is covered by cells of its own size. Each cell is integrated by the product of two 15-point Kronrod rules; the
//! difference from the 7-point Gauss rules inside them is its error (Piessens et al. 1983, QUADPACK, qk15). While the sum
//! of the errors is too large, the cells that contribute most are halved across their longer side, round by round.

use crate::geometry::{Directions, Pair, direction};
use crate::math::count;
use crate::model::{Expression, LobeValues};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// When the quadrature stops.
#[derive(Clone, Copy, Debug)]
pub struct Quadrature {
    /// The error to reach: relative for an albedo above 1, absolute below.
    pub tolerance: f64,
    /// Number of cells at which it stops in any case.
    pub most_cells: usize,
}

impl Default for Quadrature {
    fn default() -> Self {
        Self { tolerance: 2e-7, most_cells: 20_000 }
    }
}

/// An integral and its estimated error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Integral {
    /// Its value.
    pub value: f64,
    /// Sum over all cells of the difference between the two rules.
    pub error: f64,
}

/// Largest side of a first cell, radians. A lobe may be 0 in floating point except within a few degrees, and a point must
/// hit it.
const COARSEST: f64 = 0.25;
/// Size below which first cells are not divided, radians.
const FINEST: f64 = 2e-5;
/// Smallest limit of the size of first cells along the two planes in which an anisotropic lobe may be a ridge, radians.
const ALONG_RIDGES: f64 = 0.03;

/// Points of the Kronrod rule from the outermost to the middle, with their Kronrod and Gauss weights.
#[expect(clippy::unreadable_literal, reason = "as printed")]
const RULE: [(f64, f64, f64); 8] = [
    (0.9914553711208126, 0.022935322010529224, 0.0),
    (0.9491079123427585, 0.06309209262997856, 0.1294849661688697),
    (0.8648644233597691, 0.10479001032225019, 0.0),
    (0.7415311855993945, 0.14065325971552592, 0.27970539148927664),
    (0.5860872354676911, 0.1690047266392679, 0.0),
    (0.4058451513773972, 0.19035057806478542, 0.3818300505051189),
    (0.20778495500789848, 0.20443294007529889, 0.0),
    (0.0, 0.20948214108472782, 0.4179591836734694),
];

/// All fifteen points: position in -1..1, and both weights.
fn points() -> impl Iterator<Item = (f64, f64, f64)> + Clone {
    let left = RULE.iter().map(|(x, k, g)| (-x, *k, *g));
    left.chain(RULE.iter().rev().skip(1).copied())
}

/// A range of theta and phi.
#[derive(Clone, Copy, Debug)]
struct Cell {
    theta: (f64, f64),
    phi: (f64, f64),
}

impl Cell {
    fn sides(&self) -> (f64, f64) {
        (self.theta.1 - self.theta.0, (self.phi.1 - self.phi.0) * self.theta.1.sin())
    }

    fn halves(self) -> [Self; 2] {
        let (along, around) = self.sides();
        let middle = |(low, high): (f64, f64)| 0.5 * (low + high);
        if along > around {
            let middle = middle(self.theta);
            [Self { theta: (self.theta.0, middle), ..self }, Self { theta: (middle, self.theta.1), ..self }]
        } else {
            let middle = middle(self.phi);
            [Self { phi: (self.phi.0, middle), ..self }, Self { phi: (middle, self.phi.1), ..self }]
        }
    }

    fn middle(&self) -> DVec3 {
        direction(0.5 * (self.theta.0 + self.theta.1), 0.5 * (self.phi.0 + self.phi.1))
    }

    /// The points of the cell: direction, and weights of both rules for dw cos(theta).
    fn points(self) -> impl Iterator<Item = (DVec3, f64, f64)> {
        let place = |(low, high): (f64, f64), x: f64| 0.5 * (low + high) + 0.5 * (high - low) * x;
        let area = 0.25 * (self.theta.1 - self.theta.0) * (self.phi.1 - self.phi.0);
        points().flat_map(move |(x, kx, gx)| {
            let theta = place(self.theta, x);
            let measure = area * theta.sin() * theta.cos();
            points().map(move |(y, ky, gy)| {
                (direction(theta, place(self.phi, y)), measure * kx * ky, measure * gx * gy)
            })
        })
    }
}

/// A cell and its integrals, one per channel.
struct Done {
    cell: Cell,
    integrals: Vec<Integral>,
}

/// The share of light from `wi` that is reflected, per channel. `parameters` holds values by channel and lobe.
#[must_use]
pub fn directional_albedo(
    expression: &Expression,
    parameters: &[Vec<LobeValues>],
    wi: DVec3,
    anisotropic: bool,
    quadrature: &Quadrature,
) -> Vec<Integral> {
    let integrate = |cells: &[Cell]| integrate(expression, parameters, wi, cells);
    let seeds = [DVec3::new(-wi.x, -wi.y, wi.z), wi];
    let mut done = integrate(&mesh(wi, &seeds, anisotropic));
    loop {
        let sums = sums(&done, parameters.len());
        let allowed: Vec<f64> =
            sums.iter().map(|sum| quadrature.tolerance * sum.value.abs().max(1.0)).collect();
        let reached = sums.iter().zip(&allowed).all(|(sum, allowed)| sum.error <= *allowed);
        if reached || done.len() >= quadrature.most_cells || sums.iter().any(|sum| !sum.error.is_finite()) {
            return sums;
        }
        // A cell stays if its error is less than half of an equal share of the allowed error.
        let share = 0.5 / count(done.len());
        let (split, stay): (Vec<Done>, Vec<Done>) = done.into_iter().partition(|cell| {
            let too_large = |(integral, allowed): (&Integral, &f64)| integral.error > share * allowed;
            cell.integrals.iter().zip(&allowed).any(too_large)
        });
        let halves: Vec<Cell> = split.into_iter().flat_map(|done| done.cell.halves()).collect();
        done = stay;
        if halves.is_empty() {
            return sums;
        }
        done.extend(integrate(&halves));
    }
}

fn sums(done: &[Done], channels: usize) -> Vec<Integral> {
    let mut sums = vec![Integral { value: 0.0, error: 0.0 }; channels];
    for done in done {
        for (sum, integral) in sums.iter_mut().zip(&done.integrals) {
            sum.value += integral.value;
            sum.error += integral.error;
        }
    }
    sums
}

/// The first cells.
fn mesh(wi: DVec3, seeds: &[DVec3], anisotropic: bool) -> Vec<Cell> {
    let phi = wi.y.atan2(wi.x);
    let mut open = vec![Cell { theta: (0.0, FRAC_PI_2), phi: (phi, phi + TAU) }];
    let mut cells = Vec::new();
    while let Some(cell) = open.pop() {
        let middle = cell.middle();
        let nearest = seeds.iter().map(|seed| seed.distance(middle)).fold(f64::INFINITY, f64::min);
        let mut limit = (0.8 * nearest).clamp(FINEST, COARSEST);
        if anisotropic {
            let h = (wi + middle).normalize_or_zero();
            limit = limit.min((0.8 * h.x.abs().min(h.y.abs())).max(ALONG_RIDGES));
        }
        let (along, around) = cell.sides();
        if along.max(around) > limit {
            open.extend(cell.halves());
        } else {
            cells.push(cell);
        }
    }
    cells
}

/// The integral over each cell.
fn integrate(
    expression: &Expression,
    parameters: &[Vec<LobeValues>],
    wi: DVec3,
    cells: &[Cell],
) -> Vec<Done> {
    /// Number of cells whose points are evaluated together: small, to save memory.
    const AT_ONCE: usize = 256;
    let mut done = Vec::with_capacity(cells.len());
    for cells in cells.chunks(AT_ONCE) {
        let points: Vec<(DVec3, f64, f64)> = cells.iter().flat_map(|cell| cell.points()).collect();
        let pairs = points.iter().map(|(wo, ..)| Pair { wi, wo: *wo }).collect();
        let values = expression.values(&Directions::Scattered(pairs), parameters);
        let each = points.len() / cells.len();
        for (index, (cell, points)) in cells.iter().zip(points.chunks(each)).enumerate() {
            let integral = |row: &Vec<f64>| {
                let row = &row[index * each..(index + 1) * each];
                let (kronrod, gauss) = points
                    .iter()
                    .zip(row)
                    .fold((0.0, 0.0), |(k, g), ((_, wk, wg), f)| (k + wk * f, g + wg * f));
                Integral { value: kronrod, error: (kronrod - gauss).abs() }
            };
            done.push(Done { cell: *cell, integrals: values.iter().map(integral).collect() });
        }
    }
    done
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// The rules integrate polynomials of degree 22 and 13 exactly.
    #[test]
    fn both_rules_are_exact() {
        for (power, exact) in [(0, 2.0), (12, 2.0 / 13.0), (22, 2.0 / 23.0), (13, 0.0)] {
            let (k, g) = points().fold((0.0, 0.0), |(k, g), (x, wk, wg)| {
                (k + wk * f64::powi(x, power), g + wg * f64::powi(x, power))
            });
            assert!((k - exact).abs() < 1e-14, "{power}: {k}");
            assert_eq!((g - exact).abs() < 1e-14, power < 14, "{power}: {g}");
        }
    }

    /// int cos dw over the hemisphere is pi, over any mesh.
    #[test]
    fn cells_cover_the_hemisphere_once() {
        for theta in [0.0, 0.3, 1.5] {
            let wi = direction(theta, 0.4);
            let cells = mesh(wi, &[wi, DVec3::new(-wi.x, -wi.y, wi.z)], theta > 1.0);
            let sum: f64 = cells.iter().flat_map(|cell| cell.points()).map(|(_, weight, _)| weight).sum();
            assert!((sum - PI).abs() < 1e-12, "{sum}");
            assert!(cells.len() < 6000, "{}", cells.len());
        }
    }
}
