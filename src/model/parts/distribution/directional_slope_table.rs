//! Smith's shadowing for distributions with two roughnesses that are not stretched copies of an isotropic one.
//!
//! Slopes are in units of mx along x and my along y. In these units a direction v is seen at the angle psi from the x axis, with
//! cos^2(psi) = mx^2 vx^2/(mx^2 vx^2 + my^2 vy^2), and the slope along it has a density P2 of its own. With
//! (m sin)^2 = mx^2 vx^2 + my^2 vy^2, y = cos(theta)/(m sin) and M as in [`SlopeTable`](super::SlopeTable),
//!
//! ```text
//! M(y, psi) = 2 int_y^inf (q - y) P2(q) dq,   M(inf, psi) = 0
//! M'(y, psi) = -2 int_y^inf P2(q) dq = -(1/pi) int_-pi/2^pi/2 S(y^2/cos^2 f; psi + f) df
//! cos(theta) (1 + 2 Lambda) = cos(theta) + m sin(theta) M(y, psi)
//! ```
//!
//! S(s^2; chi) is the share of the slopes at the angle chi that are steeper than s. M' is integrated from infinity by Simpson's
//! rule, over the same r = 1/sqrt(1 + y) and the same cells as in a table for one roughness. M is even in vx and in vy: it is
//! tabulated at eight values of cos^2(psi), the nodes of a Chebyshev rule, and interpolated by a polynomial between them. G1 is
//! accurate to 2e-7 for `blinn-phong-anisotropic` within its bounds.

use super::SmithForm;
use super::slope_table::{CELLS, cubic};
use crate::geometry::Geometry;
use crate::math::{Cell, GaussLegendre, Real, Scalar, count};
use std::array;
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2};
use std::sync::{Arc, LazyLock};

/// Number of directions in the table. G1 errs by 1.3e-7 with eight of them and would err by 5e-7 with seven.
const DIRECTIONS: usize = 8;

/// Number of coefficients of M and of its slope.
const COEFFICIENTS: usize = 2 * DIRECTIONS;

/// M and its slope per cell at one end of a cell, as polynomials over cos^2(psi): their divided differences, with which Newton's
/// form keeps all digits in single precision too. Those of M and of its slope alternate.
type Node<T> = [T; COEFFICIENTS];

/// M as a function of r and of the direction.
#[derive(Clone, Debug)]
pub struct DirectionalSlopeTable<T: Scalar> {
    /// mx^2 and my^2.
    unit2: [T; 2],
    /// cos^2(psi) of the directions.
    places: [T::Real; DIRECTIONS],
    nodes: Arc<[Node<T>; CELLS + 1]>,
}

/// A point of the trapezoidal rule for the integral over f, after the substitution tan(f) = sinh(pi/2 sinh s), which resolves
/// both ends (Takahasi and Mori 1974).
struct Point {
    tan: f64,
    cos2: f64,
    weight: f64,
}

static POINTS: LazyLock<Vec<Point>> = LazyLock::new(|| {
    const STEP: f64 = 0.1;
    const EACH_SIDE: usize = 27;
    (0..=2 * EACH_SIDE)
        .map(|i| {
            let s = (count(i) - count(EACH_SIDE)) * STEP;
            let tan = (FRAC_PI_2 * s.sinh()).sinh();
            let cos2 = 1.0 / (1.0 + tan * tan);
            // df = cos^2 f dtan(f), and dtan(f) = dsinh/cos f
            Point { tan, cos2, weight: STEP * FRAC_PI_2 * s.cosh() * cos2.sqrt() }
        })
        .collect()
});

/// The angle psi of a direction of the table.
fn angle(direction: usize) -> f64 {
    FRAC_PI_2 * (count(direction) + 0.5) / count(DIRECTIONS)
}

impl<T: Scalar> DirectionalSlopeTable<T> {
    /// Makes the table from mx^2 and my^2 and the shares of steeper slopes. `ray` takes cos^2(chi) and sin^2(chi) and gives S at
    /// the angle chi as a function of the squared slope.
    #[expect(clippy::indexing_slicing, reason = "every direction has all nodes")]
    pub fn new<S: Fn(f64) -> T>(unit2: [T; 2], ray: impl Fn([f64; 2]) -> S) -> Self {
        let directions: [_; DIRECTIONS] = array::from_fn(|direction| at_angle(angle(direction), &ray));
        let places = array::from_fn(|direction| angle(direction).cos().powi(2));
        let nodes =
            array::from_fn(|node| divided_differences(directions.each_ref().map(|ends| ends[node]), &places));
        Self { unit2, places: places.map(T::Real::literal), nodes: Arc::new(nodes) }
    }

    /// cos (1 + 2 Lambda) for a direction.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "the cell is kept inside the table")]
    fn smith_cosine(&self, [x, y, cos]: [T::Real; 3]) -> T {
        let [mx2, my2] = self.unit2;
        let (x2, y2): (T::Real, T::Real) = (x * x, y * y);
        // At normal incidence the slope of the root would be infinite.
        let floor = T::constant(1e-37);
        let along: T = mx2 * x2;
        let both: T = along + my2 * y2;
        let slope2 = T::if_less(floor.value(), both.value(), both, floor);
        let slope = slope2.sqrt();
        let cos2_psi: T = along / slope2;
        // r^2 = 1/(1 + y) = m sin/(m sin + cos)
        let place = (slope / (slope + cos)).sqrt().times(count(CELLS));
        let Cell { start, end, number } = T::look_up(&*self.nodes, place.value());
        let [mut a, mut da] = [start[COEFFICIENTS - 2], start[COEFFICIENTS - 1]];
        let [mut b, mut db] = [end[COEFFICIENTS - 2], end[COEFFICIENTS - 1]];
        for k in (0..DIRECTIONS - 1).rev() {
            let beyond = cos2_psi - self.places[k];
            a = a * beyond + start[2 * k];
            da = da * beyond + start[2 * k + 1];
            b = b * beyond + end[2 * k];
            db = db * beyond + end[2 * k + 1];
        }
        slope * cubic(place - number, [a, da], [b, db]) + cos
    }
}

/// M, and its slope per cell, at the ends of all cells and one angle psi.
fn at_angle<T: Scalar, S: Fn(f64) -> T>(psi: f64, ray: &impl Fn([f64; 2]) -> S) -> [[T; 2]; CELLS + 1] {
    let (sin, cos) = psi.sin_cos();
    let rays = POINTS.iter().map(|point| {
        let [x, y] = [cos - point.tan * sin, sin + point.tan * cos];
        (point, ray([x * x * point.cos2, y * y * point.cos2]))
    });
    let rays: Vec<(&Point, S)> = rays.collect();
    // dM/dr = M'(y) dy/dr, per cell
    let slope = |cell: f64| -> T {
        let r = cell / count(CELLS);
        let y = 1.0 / (r * r) - 1.0;
        let sum = rays.iter().fold(T::constant(0.0), |sum, (point, steeper)| {
            sum + steeper(y * y / point.cos2) * T::Real::literal(point.weight)
        });
        sum.times(2.0 * FRAC_1_PI / (r * r * r) / count(CELLS))
    };
    // In the cell at r = 0, where a long tail leaves a singularity, by Gauss's rule over the root of r.
    let mut value = T::constant(0.0);
    GaussLegendre::new(8).for_each(0.0, 1.0, |root, weight| {
        value = value + slope(root * root).times(2.0 * root * weight);
    });
    let mut before = slope(1.0);
    // At r = 0 the slope of a long tail is infinite; the slope of the chord replaces it.
    let mut ends = [[T::constant(0.0), value]; CELLS + 1];
    for (node, end) in ends.iter_mut().enumerate().skip(1) {
        if node > 1 {
            let (middle, after): (T, T) = (slope(count(node) - 0.5), slope(count(node)));
            value = value + (before + middle.times(4.0) + after).times(1.0 / 6.0);
            before = after;
        }
        *end = [value, before];
    }
    ends
}

/// The coefficients of Newton's form of the polynomial that has these values, and slopes, at these places.
#[expect(clippy::indexing_slicing, reason = "all arrays have DIRECTIONS entries")]
fn divided_differences<T: Scalar>(mut node: [[T; 2]; DIRECTIONS], places: &[f64; DIRECTIONS]) -> Node<T> {
    for order in 1..DIRECTIONS {
        for k in (order..DIRECTIONS).rev() {
            let [[a, da], [b, db]] = [node[k - 1], node[k]];
            let apart = places[k] - places[k - order];
            node[k] = [(b - a).times(1.0 / apart), (db - da).times(1.0 / apart)];
        }
    }
    array::from_fn(|index| node[index / 2][index % 2])
}

/// Smith's shadowing from a table of slopes that depends on the direction.
pub struct TableOfDirections;

impl SmithForm for TableOfDirections {
    type Prepared<T: Scalar> = DirectionalSlopeTable<T>;

    #[inline(always)]
    fn smith_cosines<T: Scalar>(table: &Self::Prepared<T>, g: &Geometry<T::Real>) -> (T, T) {
        (table.smith_cosine(g.wi), table.smith_cosine(g.wo))
    }
}
