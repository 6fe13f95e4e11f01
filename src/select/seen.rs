//! The directions that a scene shows.

use crate::geometry::{Geometry, Pair};
use crate::image::luminance;
use crate::math::Real;
use crate::measurement::Measurement;
use crate::scene::View;
use serde::Serialize;

/// Cells per axis.
const CELLS: usize = 18;
/// Size of a cell, degrees.
const CELL_DEG: f64 = 5.0;

/// How the light of a scene is spread over theta_h and theta_d, the angles of half and difference vector, in cells of 5
/// degrees.
#[derive(Clone, Debug, Serialize)]
pub struct SeenMap {
    /// Size of a cell, degrees.
    pub cell_deg: f64,
    /// Share of the light in each cell: a row per theta_h, a column per theta_d, both from 0 to 90 degrees.
    pub share: Vec<Vec<f64>>,
    /// Share of the measurement's samples that lie in cells of which the scene shows nothing.
    pub samples_never_seen: f64,
}

impl SeenMap {
    pub(super) fn new(view: &View, measurement: &Measurement) -> Self {
        let mut share = vec![vec![0.0; CELLS]; CELLS];
        let mut sum = 0.0;
        for seen in &view.samples {
            let light = luminance(seen.weight);
            let (h, d) = cell(&of(&seen.pair));
            share[h][d] += light;
            sum += light;
        }
        if sum > 0.0 {
            share.iter_mut().flatten().for_each(|cell| *cell /= sum);
        }
        let (mut unseen, mut all) = (0_u32, 0_u32);
        for g in measurement.directions.iter() {
            let (h, d) = cell(&g);
            all = all.saturating_add(1);
            unseen = unseen.saturating_add(u32::from(share[h][d] <= 0.0));
        }
        let samples_never_seen = if all > 0 { f64::from(unseen) / f64::from(all) } else { 0.0 };
        Self { cell_deg: CELL_DEG, share, samples_never_seen }
    }

    /// Share of the cells in which the scene shows nothing.
    #[must_use]
    pub fn cells_never_seen(&self) -> f64 {
        let cells = || self.share.iter().flatten();
        let unseen = cells().filter(|share| **share == 0.0).count();
        crate::math::count(unseen) / crate::math::count(cells().count().max(1))
    }
}

fn of(pair: &Pair) -> Geometry<f64> {
    Geometry::new(pair.wi.to_array(), pair.wo.to_array())
}

/// The cell of a pair: its row (theta_h) and column (theta_d).
fn cell(g: &Geometry<f64>) -> (usize, usize) {
    let theta_d = g.cos_d.clamp(-1.0, 1.0).acos().to_degrees();
    let index = |degrees: f64| (degrees / CELL_DEG).whole().min(CELLS - 1);
    (index(g.theta_h_deg()), index(theta_d))
}
