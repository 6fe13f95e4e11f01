//! Smith's shadowing for distributions for which it has no closed form.
//!
//! For a polar angle theta, with P(t^2) = D cos^4 the density of slopes t and mu = cot(theta) (Smith 1967; Heitz 2014,
//! appendix A):
//!
//! ```text
//! Lambda = (1/mu) int_mu^inf (q - mu) P2(q) dq,    P2 the density of the slope along the direction of view
//! ```
//!
//! In units of a scale m, with t = m u and y = mu/m, and with the inner integral in polar coordinates,
//!
//! ```text
//! M(y) = 2 y Lambda = 4 int_0^inf Q(y^2 + w^2) w (w - y atan(w/y)) dw,   Q(u^2) = m^2 P(m^2 u^2)
//! M'(y) = -4 int_0^inf Q(y^2 + w^2) w atan(w/y) dw
//! cos(theta) (1 + 2 Lambda) = cos(theta) + m sin(theta) M(y)
//! ```
//!
//! M is smooth and falls from twice the mean positive slope, for a view along the surface, to 0, for a view straight down. It
//! is tabulated once per set of shapes over r = 1/sqrt(1 + y), which compresses the long tails of M into a few cells near 0,
//! and interpolated by cubics through its values and slopes. G1 is accurate to 1e-6 for GGX and Beckmann, whose closed forms
//! are known, to 3e-5 for all distributions with a formula within their bounds (against 20 digits, docs/trust/numerics.md),
//! and to 2e-4 for tables whose exponents jump.
//!
//! P must depend on t alone or be a stretched copy of such a density, because stretching a surface stretches its slopes. For any
//! other density M depends on the direction as well:
//! [`DirectionalSlopeTable`](super::directional_slope_table::DirectionalSlopeTable).
//!
//! This is also the shadowing that Ashikhmin, Premoze and Shirley 2000 (doi:10.1145/344779.344814) derive for any
//! distribution: their g(k) = int (h.k)+ p(h) dh with p = D <n.h> is cos(theta)/G1.

use super::{Roughness, SmithForm};
use crate::geometry::Geometry;
use crate::math::{Real, Scalar, count};
use std::f64::consts::{FRAC_PI_2, PI};
use std::marker::PhantomData;
use std::sync::{Arc, LazyLock};

/// Number of cells of the table.
pub(super) const CELLS: usize = 96;

/// Value, and slope per cell, at the ends of every cell.
type Nodes<T> = [[T; 2]; CELLS + 1];

/// M as a function of r.
#[derive(Clone, Debug)]
pub struct SlopeTable<T: Scalar> {
    nodes: Arc<Nodes<T>>,
    /// The mean slope, which is the table's unit in units of the caller's.
    mean: T,
}

/// Points w and weights of the trapezoidal rule after the substitution w = exp(pi/2 sinh s) (Takahasi and Mori 1974), which
/// resolves every scale from 1e-8 to 1e8 and includes the tails beyond.
static POINTS: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| {
    const STEP: f64 = 0.1;
    const EACH_SIDE: usize = 45;
    (0..=2 * EACH_SIDE)
        .map(|i| {
            let s = (count(i) - count(EACH_SIDE)) * STEP;
            let w = (FRAC_PI_2 * s.sinh()).exp();
            (w, STEP * FRAC_PI_2 * s.cosh() * w)
        })
        .collect()
});

impl<T: Scalar> SlopeTable<T> {
    /// Makes the table for a density of slopes, given as a function of the squared slope, both in units of the scale. Its
    /// integral over the plane must be 1.
    pub fn new(density: &dyn Fn(T) -> T) -> Self {
        let literal = T::Real::literal;
        // Slopes that overflow in a small type are left out; it cannot represent facets so steep.
        let countable = |w: f64| {
            let (volume, end) = (literal(100.0 * w * w * w), literal(1e300));
            T::Real::if_less(volume, end, literal(1.0), literal(0.0)).whole() == 1
        };
        let usable = || POINTS.iter().filter(|(w, _)| countable(*w));
        // Shadowing at grazing depends on the slopes that most facets have; their mean, which need not be exact, is the unit of
        // the table. It has derivatives, so that those of f include the error of the table and are exact, which matters to
        // solvers.
        let mean = usable().fold(T::constant(0.0), |sum, (w, weight)| {
            sum + density(T::constant(w * w)) * literal(2.0 * PI * w * w * weight)
        });
        let mean2: T = mean * mean;
        let density = |u2: f64| density(mean2.times(u2)) * mean2;
        let node = |y: f64| -> [T; 2] {
            let mut sums = [T::constant(0.0); 2];
            for (w, weight) in usable() {
                let at = density(y * y + w * w);
                let angle = w.atan2(y);
                let [value, slope] = sums;
                sums = [
                    value + at * literal(4.0 * weight * w * (w - y * angle)),
                    slope - at * literal(4.0 * weight * w * angle),
                ];
            }
            sums
        };
        let mut nodes = [[T::constant(0.0); 2]; CELLS + 1];
        for (i, entry) in nodes.iter_mut().enumerate().skip(1) {
            let r = count(i) / count(CELLS);
            let [value, slope] = node(1.0 / (r * r) - 1.0);
            // dM/dr = M'(y) dy/dr, per cell
            *entry = [value, slope.times(-2.0 / (r * r * r) / count(CELLS))];
        }
        // At r = 0 the slope of a long tail is infinite; the slope of the chord replaces it.
        let [[_, slope], [value, _], ..] = &mut nodes;
        *slope = *value;
        Self { nodes: Arc::new(nodes), mean }
    }

    /// cos (1 + 2 Lambda) for a direction, from (m sin)^2 and its cosine.
    #[inline(always)]
    pub fn smith_cosine(&self, slope2: T, cos: T::Real) -> T {
        // At normal incidence the slope of the root would be infinite.
        let floor = T::constant(1e-37);
        let slope = T::if_less(floor.value(), slope2.value(), slope2, floor).sqrt() * self.mean;
        // r^2 = 1/(1 + y) = m sin/(m sin + cos)
        let place = (slope / (slope + cos)).sqrt().times(count(CELLS));
        let cell = T::look_up(&*self.nodes, place.value());
        slope * cubic(place - cell.number, cell.start, cell.end) + cos
    }
}

/// The cubic with these values and slopes at 0 and at 1, in powers of t.
#[inline(always)]
pub(super) fn cubic<T: Scalar>(t: T, [a, da]: [T; 2], [b, db]: [T; 2]) -> T {
    let rise: T = b - a;
    let c3 = da + db - rise.times(2.0);
    let c2 = rise - da - c3;
    a + t * (da + t * (c2 + t * c3))
}

/// Smith's shadowing from a table of slopes, in units of a roughness that may differ along x and y, since stretching a surface
/// stretches its slopes.
pub struct TableOfSlopes<R>(PhantomData<R>);

/// What [`TableOfSlopes`] prepares: the roughness that is the unit of slopes, and the table.
pub type ScaledTable<R, T> = (<R as Roughness>::Prepared<T>, SlopeTable<T>);

impl<R: Roughness> SmithForm for TableOfSlopes<R> {
    type Prepared<T: Scalar> = ScaledTable<R, T>;

    #[inline(always)]
    fn smith_cosines<T: Scalar>((unit, table): &Self::Prepared<T>, g: &Geometry<T::Real>) -> (T, T) {
        (
            table.smith_cosine(R::projected_slope2(unit, g.wi), g.cos_i()),
            table.smith_cosine(R::projected_slope2(unit, g.wo), g.cos_o()),
        )
    }
}
