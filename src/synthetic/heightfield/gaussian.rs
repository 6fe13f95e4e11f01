//! A random Gaussian surface: a periodic tile of triangles over a square grid, and rays that walk over it.
//!
//! ```text
//! <h(0) h(r)> = s^2 exp(-r^2/l^2),   variance of each slope component 2 s^2/l^2 = m^2/2,   so s = m l/2
//! spectrum ~ exp(-k^2 l^2/4)
//! ```
//!
//! The tile is the sum of all waves that fit its period, with amplitudes from the spectrum and random phases. The slopes of
//! the triangles are sums of the same waves and so normally distributed, too; the heights are scaled such that the
//! variance of each slope component over the triangles is exactly m^2/2 for any grid.

use super::surface::{Fate, RoughSurface};
use crate::math::count;
use glam::{DVec2, DVec3};
use rand::{Rng, RngExt};
use std::f64::consts::TAU;

/// Grid cells per correlation length l.
const PER_LENGTH: usize = 8;
/// Largest wave number, in 1/l; exp(-k^2 l^2/4) is 3e-5 there.
const CUTOFF: f64 = 6.5;

/// A periodic surface in units of grid cells.
pub struct Tile {
    cells: Vec<Cell>,
    /// Number of cells along each side.
    side: usize,
    /// A height below the lowest point and one above the highest.
    range: [f64; 2],
}

/// One square of the grid: two triangles that meet in the diagonal from corner (0, 0) to (1, 1).
#[derive(Clone, Copy)]
struct Cell {
    /// The height at corner (0, 0).
    base: f64,
    /// The gradients of the triangle below the diagonal (x > y) and of that above it.
    gradients: [DVec2; 2],
    low: f64,
    high: f64,
}

impl Cell {
    fn new([[h00, h10], [h01, h11]]: [[f64; 2]; 2]) -> Self {
        Self {
            base: h00,
            gradients: [DVec2::new(h10 - h00, h11 - h10), DVec2::new(h11 - h01, h01 - h00)],
            low: h00.min(h10).min(h01).min(h11),
            high: h00.max(h10).max(h01).max(h11),
        }
    }

    fn gradient(&self, triangle: Triangle) -> DVec2 {
        let [below, above] = self.gradients;
        match triangle {
            Triangle::Below => below,
            Triangle::Above => above,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Triangle {
    Below,
    Above,
}

/// A point on a ray's path: the cell, and the position in it.
#[derive(Clone, Copy)]
struct Place {
    column: usize,
    row: usize,
    /// Position within the cell, 0 to 1, and height.
    at: DVec3,
}

/// Where a ray meets the surface.
struct Hit {
    place: Place,
    triangle: Triangle,
    gradient: DVec2,
}

impl Tile {
    /// Makes a tile of rms slope `m` with sides of `lengths` correlation lengths.
    pub fn new(m: f64, lengths: usize, rng: &mut impl Rng) -> Self {
        let side = lengths * PER_LENGTH;
        let heights = waves(lengths, side, rng);
        let at = |column: usize, row: usize| heights[(row % side) * side + column % side];
        let corners = (0..side * side)
            .map(|i| (i % side, i / side))
            .map(|(c, r)| [[at(c, r), at(c + 1, r)], [at(c, r + 1), at(c + 1, r + 1)]]);
        let cells: Vec<Cell> = corners.clone().map(Cell::new).collect();
        let scale = m / mean_square_slope(&cells).sqrt();
        let cells: Vec<Cell> = corners.map(|c| Cell::new(c.map(|row| row.map(|h| scale * h)))).collect();
        let low = cells.iter().fold(f64::INFINITY, |low, cell| low.min(cell.low));
        let high = cells.iter().fold(f64::NEG_INFINITY, |high, cell| high.max(cell.high));
        // A small margin, so that no ray starts or ends on the surface itself.
        let room = 1e-3 * (high - low);
        Self { cells, side, range: [low - room, high + room] }
    }

    /// Where a ray from `place` in `direction` first meets the surface. `None` if it escapes above it. A ray that starts on
    /// the surface starts from the triangle `own`.
    ///
    /// The surface is continuous, so it is enough to check the points where the ray crosses an edge: it has met the triangle
    /// before that edge if and only if it is below the surface there.
    fn first_hit(&self, mut place: Place, direction: DVec3, mut own: Option<Triangle>) -> Option<Hit> {
        let [bottom, top] = self.range;
        let limit = if direction.z > 0.0 { top } else { bottom };
        loop {
            let cell = &self.cells[place.row * self.side + place.column];
            // The distances to the edges of the cell along x and y, and to the height at which the ray is done.
            let way = |at: f64, speed: f64| {
                let edge = if speed > 0.0 { 1.0 } else { 0.0 };
                if speed == 0.0 { f64::INFINITY } else { (edge - at) / speed }
            };
            let (along_x, along_y) = (way(place.at.x, direction.x), way(place.at.y, direction.y));
            let end = (limit - place.at.z) / direction.z;
            let step = along_x.min(along_y).min(end).max(0.0);
            let next = place.at + direction * step;
            if place.at.z.min(next.z) <= cell.high
                && let Some(hit) = cell.first_hit(place, next, own)
            {
                return Some(hit);
            }
            own = None;
            if step >= end {
                return None;
            }
            place.at = next;
            if along_x <= along_y {
                (place.column, place.at.x) = self.neighbour(place.column, direction.x);
            } else {
                (place.row, place.at.y) = self.neighbour(place.row, direction.y);
            }
        }
    }

    /// The next cell in a direction, and the coordinate at which the ray enters it.
    fn neighbour(&self, cell: usize, speed: f64) -> (usize, f64) {
        if speed > 0.0 {
            (if cell + 1 == self.side { 0 } else { cell + 1 }, 0.0)
        } else {
            (if cell == 0 { self.side - 1 } else { cell - 1 }, 1.0)
        }
    }
}

impl Cell {
    /// Where a ray from `place` to `end`, both within the cell, goes below the surface. `None` if it does not.
    fn first_hit(&self, place: Place, end: DVec3, own: Option<Triangle>) -> Option<Hit> {
        let start = place.at;
        let (before, after) = (start.x - start.y, end.x - end.y);
        let side = |across: f64| if across > 0.0 { Triangle::Below } else { Triangle::Above };
        let crosses = before * after < 0.0;
        let middle = if crosses { start.lerp(end, before / (before - after)) } else { end };
        let first = side(if before == 0.0 { after } else { before });
        let pieces = [Some((first, start, middle)), crosses.then(|| (side(after), middle, end))];
        for (triangle, from, to) in pieces.into_iter().flatten() {
            if own == Some(triangle) {
                continue;
            }
            let gradient = self.gradient(triangle);
            let height = |at: DVec3| self.base + gradient.dot(at.truncate());
            let below = to.z - height(to);
            if below < 0.0 {
                // Rounding may have moved a ray that enters at the surface below it.
                let above = (from.z - height(from)).max(0.0);
                let mut at = from.lerp(to, above / (above - below));
                at.z = height(at);
                return Some(Hit { place: Place { at, ..place }, triangle, gradient });
            }
        }
        None
    }
}

impl RoughSurface for Tile {
    /// `place` is the point at which the light would cross the plane above the tile, in units of the tile's side.
    fn reflect(&self, place: DVec2, wi: DVec3) -> Fate {
        let [_, top] = self.range;
        let start = place * count(self.side);
        let (column, x) = self.cell(start.x);
        let (row, y) = self.cell(start.y);
        let start = Place { column, row, at: DVec3::new(x, y, top) };
        let Some(Hit { place, triangle, gradient }) = self.first_hit(start, -wi, None) else {
            return Fate::Lost;
        };
        let slope = -gradient;
        let normal = slope.extend(1.0).normalize();
        let wo = normal * (2.0 * wi.dot(normal)) - wi;
        // Light that does not go upwards meets the surface again.
        if wo.z <= 0.0 || self.first_hit(place, wo, Some(triangle)).is_some() {
            Fate::Shadowed
        } else {
            Fate::Escaped(slope)
        }
    }
}

impl Tile {
    /// The cell of a coordinate between 0 and the side, and the position in it.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and the side")]
    fn cell(&self, x: f64) -> (usize, f64) {
        let cell = (x.floor() as usize).min(self.side - 1);
        (cell, x - count(cell))
    }
}

/// The mean square slope over the triangles, all of which have the same area seen from above.
fn mean_square_slope(cells: &[Cell]) -> f64 {
    let sum: f64 = cells.iter().flat_map(|cell| cell.gradients).map(DVec2::length_squared).sum();
    sum / count(2 * cells.len())
}

/// Heights on a square grid, row by row: waves with random phases, in arbitrary units.
///
/// The wave vectors 2 pi (a, b)/side and -2 pi (a, b)/side describe the same wave, so half of the plane is enough. The sum
/// over a is computed first, for every b and column, so there is one transform per direction and not one per point.
fn waves(lengths: usize, side: usize, rng: &mut impl Rng) -> Vec<f64> {
    let turns: Vec<DVec2> = (0..side).map(|i| DVec2::from_angle(TAU * count(i) / count(side))).collect();
    let turn = |i: usize| turns[i % side];
    let most = (1..side).take_while(|n| TAU * count(*n) / count(lengths) <= CUTOFF).count();
    let mut heights = vec![0.0; side * side];
    let mut across = vec![DVec2::ZERO; side];
    for b in 0..=most {
        across.fill(DVec2::ZERO);
        // a runs from -most to most; of the waves along x only those with positive a are used, and no constant.
        for a in 0..=2 * most {
            let phase = DVec2::from_angle(TAU * rng.random::<f64>());
            let wave = DVec2::new(count(a) - count(most), count(b)) * (TAU / count(lengths));
            if (b == 0 && a <= most) || wave.length() > CUTOFF {
                continue;
            }
            let amplitude = phase * (-wave.length_squared() / 8.0).exp();
            for (column, sum) in across.iter_mut().enumerate() {
                // Adding a multiple of the side keeps the number of turns positive.
                *sum += amplitude.rotate(turn((a + side - most) * column));
            }
        }
        for (row, line) in heights.chunks_exact_mut(side).enumerate() {
            let along = turn(b * row);
            for (height, sum) in line.iter_mut().zip(&across) {
                *height += sum.x * along.x - sum.y * along.y;
            }
        }
    }
    heights
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    fn tile(m: f64) -> Tile {
        Tile::new(m, 32, &mut Pcg64Mcg::seed_from_u64(7))
    }

    /// The moments are those of a normal distribution: variance m^2/2 of each component, covariance 0, kurtosis 3.
    #[test]
    fn slopes_are_normally_distributed() {
        let m = 0.3;
        let slopes: Vec<DVec2> = tile(m).cells.iter().flat_map(|cell| cell.gradients).collect();
        let mean = |of: &dyn Fn(&DVec2) -> f64| slopes.iter().map(of).sum::<f64>() / count(slopes.len());
        let variance = m * m / 2.0;
        approx::assert_relative_eq!(mean(&|s| s.length_squared()), m * m, max_relative = 1e-12);
        // The triangles tilt slightly towards their diagonals: (1/2) (step/l)^2 of the variance is 0.8 %.
        assert!(mean(&|s| s.x * s.y).abs() < 0.012 * variance);
        for component in [|s: &DVec2| s.x, |s: &DVec2| s.y] {
            assert!(mean(&component).abs() < 1e-12, "a periodic surface is level");
            approx::assert_relative_eq!(mean(&|s| component(s).powi(2)), variance, max_relative = 0.01);
            let kurtosis = mean(&|s| component(s).powi(4)) / mean(&|s| component(s).powi(2)).powi(2);
            // About 32^2 independent patches, each with an error of sqrt(24).
            assert!((kurtosis - 3.0).abs() < 3.0 * 24_f64.sqrt() / 32.0, "kurtosis {kurtosis}");
        }
    }

    /// The heights' standard deviation is m l/2 with l = 8 cells, as the Gaussian autocorrelation says, and
    /// the correlation at a distance l is 1/e.
    #[test]
    fn heights_have_a_gaussian_autocorrelation() {
        let tile = tile(0.3);
        let at =
            |column: usize, row: usize| tile.cells[(row % tile.side) * tile.side + column % tile.side].base;
        let mean = |of: &dyn Fn(usize, usize) -> f64| {
            let all = (0..tile.side).flat_map(|row| (0..tile.side).map(move |column| of(column, row)));
            all.sum::<f64>() / count(tile.side * tile.side)
        };
        let variance = mean(&|c, r| at(c, r).powi(2));
        // The lattice of waves samples the spectrum of the infinite surface finely; triangles reduce the slope by
        // (1/4) (step/l)^2 = 0.4 %, which the scale corrects.
        approx::assert_relative_eq!(variance.sqrt(), 0.3 * 8.0 / 2.0, max_relative = 0.01);
        for (shift, expected) in [(4, (-0.25_f64).exp()), (8, (-1_f64).exp()), (16, (-4_f64).exp())] {
            let along_x = mean(&|c, r| at(c, r) * at(c + shift, r)) / variance;
            let along_y = mean(&|c, r| at(c, r) * at(c, r + shift)) / variance;
            assert!((along_x - expected).abs() < 0.01, "{shift}: {along_x}");
            assert!((along_y - expected).abs() < 0.01, "{shift}: {along_y}");
        }
    }

    /// Compared with small steps along the ray, without a grid, up to the first point below the surface.
    #[test]
    fn rays_meet_the_surface_where_small_steps_find_it() {
        let tile = tile(0.7);
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        let side = count(tile.side);
        let height = |at: DVec3| {
            let (column, x) = tile.cell(at.x.rem_euclid(side));
            let (row, y) = tile.cell(at.y.rem_euclid(side));
            let cell = &tile.cells[row * tile.side + column];
            let gradient = cell.gradient(if x > y { Triangle::Below } else { Triangle::Above });
            cell.base + gradient.dot(DVec2::new(x, y))
        };
        for _ in 0..300 {
            let azimuth = DVec2::from_angle(TAU * rng.random::<f64>());
            let theta = 1.4 * rng.random::<f64>();
            let wi = (azimuth * theta.sin()).extend(theta.cos());
            let start = DVec2::new(rng.random(), rng.random()) * side;
            let (column, x) = tile.cell(start.x);
            let (row, y) = tile.cell(start.y);
            let place = Place { column, row, at: DVec3::new(x, y, tile.range[1]) };
            let hit = tile.first_hit(place, -wi, None).unwrap();
            let step = 1e-3;
            let mut at = start.extend(tile.range[1]);
            while at.z >= height(at) {
                at -= wi * step;
            }
            // A grazing ray may go below the surface between two steps, by less than the height of one step.
            let found = DVec3::new(count(hit.place.column), count(hit.place.row), 0.0) + hit.place.at;
            let apart = (at.truncate() - found.truncate()).map(|d| d - side * (d / side).round());
            assert!(apart.length() < 2.0 * step && (at.z - found.z).abs() < 2.0 * step, "{at} {found}");
        }
    }
}
