//! Half/difference coordinates (Rusinkiewicz 1998, "A New Change of Variables for Efficient BRDF
//! Representation") and the grid that MERL tables are stored on.

use super::Geometry;
use crate::math::count;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::{Arc, LazyLock, OnceLock};

/// The MERL grid: 90 x 90 x 180 bins in (theta_h, theta_d, phi_d).
///
/// theta_h grows with the square of its index, theta_d and phi_d linearly. phi_d covers half a turn because
/// reciprocity makes the other half equal. The number of a cell is phi_d + 180 (theta_d + 90 theta_h), as in the
/// files.
#[derive(Clone, Debug)]
pub struct HalfDifferenceGrid {
    /// (sin, cos) of the polar angle of the half vector, by index.
    theta_h: Vec<(f64, f64)>,
    /// (sin, cos) of the difference angle, by index.
    theta_d: Vec<(f64, f64)>,
    /// Sine of the difference azimuth, by index.
    sin_phi_d: Vec<f64>,
    /// Cosine of the difference azimuth, by index.
    cos_phi_d: Vec<f64>,
    /// Solid-angle weight at the bin centre, by (theta_h, theta_d).
    weights: Vec<f64>,
    /// Whether both directions of each cell are above the horizon; computed on first use.
    above_horizon: OnceLock<Vec<bool>>,
}

impl HalfDifferenceGrid {
    /// Numbers of bins in theta_h, theta_d and phi_d.
    pub const DIMENSIONS: [usize; 3] = [90, 90, 180];
    /// Number of cells.
    pub const CELLS: usize = Self::DIMENSIONS[0] * Self::DIMENSIONS[1] * Self::DIMENSIONS[2];

    /// What turns [`weight`](Self::weight) into dwi dwo of a cell, all azimuths of the half vector together.
    pub(crate) const MEASURE: f64 =
        4.0 * (FRAC_PI_2 / 8100.0) * (FRAC_PI_2 / 90.0) * (PI / 180.0) * (2.0 * PI);

    /// Creates a grid whose values stand for bin centres (`offset` 0.5) or lower bin edges (`offset` 0).
    ///
    /// In both cases the weights are those of the bins at their centres.
    #[must_use]
    pub fn merl(offset: f64) -> Self {
        let [n_h, n_d, n_p] = Self::DIMENSIONS;
        let angle_h = |i: usize, offset: f64| ((count(i) + offset) / count(n_h)).powi(2) * FRAC_PI_2;
        let angle_d = |j: usize, offset: f64| (count(j) + offset) / count(n_d) * FRAC_PI_2;
        let sin_cos = f64::sin_cos;
        let phi_d = (0..n_p).map(|k| (count(k) + offset) / count(n_p) * PI);
        let weights = (0..n_h)
            .flat_map(|i| (0..n_d).map(move |j| (i, j)))
            .map(|(i, j)| {
                // dwi dwo = 4 cos(td) sin(th) sin(td) dth dphi_h dtd dphi_d; dth is proportional to 2i + 1.
                let (sin_d, cos_d) = angle_d(j, 0.5).sin_cos();
                cos_d * angle_h(i, 0.5).sin() * sin_d * (2.0 * count(i) + 1.0)
            })
            .collect();
        Self {
            theta_h: (0..n_h).map(|i| sin_cos(angle_h(i, offset))).collect(),
            theta_d: (0..n_d).map(|j| sin_cos(angle_d(j, offset))).collect(),
            sin_phi_d: phi_d.clone().map(f64::sin).collect(),
            cos_phi_d: phi_d.map(f64::cos).collect(),
            weights,
            above_horizon: OnceLock::new(),
        }
    }

    /// The grid of bin centres, created once per process and shared by all tables.
    #[must_use]
    pub fn merl_centers() -> Arc<Self> {
        static CENTERS: LazyLock<Arc<HalfDifferenceGrid>> =
            LazyLock::new(|| Arc::new(HalfDifferenceGrid::merl(0.5)));
        Arc::clone(&CENTERS)
    }

    /// The grid of lower bin edges, created once per process and shared by all tables.
    #[must_use]
    pub fn merl_edges() -> Arc<Self> {
        static EDGES: LazyLock<Arc<HalfDifferenceGrid>> =
            LazyLock::new(|| Arc::new(HalfDifferenceGrid::merl(0.0)));
        Arc::clone(&EDGES)
    }

    /// Whether both directions of each cell are above the horizon. Computed once per grid.
    #[must_use]
    pub fn above_horizon(&self) -> &[bool] {
        self.above_horizon.get_or_init(|| {
            let [n_h, n_d, _] = Self::DIMENSIONS;
            let mut above = Vec::with_capacity(Self::CELLS);
            for ring in (0..n_h).flat_map(|i| (0..n_d).map(move |j| self.ring(i, j))) {
                let cosines = self.cos_phi_d.iter().map(|cos_p| ring.cosines(*cos_p));
                above.extend(cosines.map(|(cos_i, cos_o)| cos_i > 0.0 && cos_o > 0.0));
            }
            above
        })
    }

    /// The indices of a cell in theta_h, theta_d and phi_d.
    pub(crate) fn indices(cell: u32) -> (usize, usize, usize) {
        let [_, n_d, n_p] = Self::DIMENSIONS;
        let cell = usize::try_from(cell).unwrap_or(usize::MAX);
        (cell / (n_d * n_p), (cell / n_p) % n_d, cell % n_p)
    }

    /// The solid-angle weight of a cell, proportional to dwi dwo of its bin.
    #[must_use]
    pub fn weight(&self, cell: u32) -> f64 {
        let (i, j, _) = Self::indices(cell);
        self.weights[i * Self::DIMENSIONS[1] + j]
    }

    /// The geometry of a cell, with phi_h = 0 (the half vector lies in the x-z plane).
    #[must_use]
    pub fn geometry(&self, cell: u32) -> Geometry<f64> {
        let (i, j, k) = Self::indices(cell);
        self.ring(i, j).geometry(self.sin_phi_d[k], self.cos_phi_d[k])
    }

    /// The directions of the cells with these indices of theta_h and theta_d.
    fn ring(&self, i: usize, j: usize) -> Ring {
        let ((sin_h, cos_h), (sin_d, cos_d)) = (self.theta_h[i], self.theta_d[j]);
        Ring { sin_h, cos_h, sin_d, cos_d, one_less_cos_d: sin_d * sin_d / (1.0 + cos_d) }
    }

    /// The ring that the first of `cells` lies on, and the sines and cosines of the difference azimuths of the cells
    /// that follow it on the ring without a gap. `None` if there are no cells.
    pub(super) fn first_ring(&self, cells: &[u32]) -> Option<(Ring, &[f64], &[f64])> {
        let first = *cells.first()?;
        let (i, j, k) = Self::indices(first);
        let [_, _, n_p] = Self::DIMENSIONS;
        let len = cells.iter().zip(first..).zip(k..n_p).take_while(|((cell, next), _)| *cell == next).count();
        Some((self.ring(i, j), &self.sin_phi_d[k..k + len], &self.cos_phi_d[k..k + len]))
    }
}

/// All difference azimuths at one half vector and one difference angle.
#[derive(Clone, Copy)]
pub(super) struct Ring {
    sin_h: f64,
    cos_h: f64,
    sin_d: f64,
    pub(super) cos_d: f64,
    pub(super) one_less_cos_d: f64,
}

impl Ring {
    /// The half vector.
    pub(super) fn h(&self) -> [f64; 3] {
        [self.sin_h, 0.0, self.cos_h]
    }

    /// n.wi and n.wo at the difference azimuth with this cosine.
    #[inline(always)]
    fn cosines(&self, cos_p: f64) -> (f64, f64) {
        let (along, across) = (self.cos_d * self.cos_h, -self.sin_d * cos_p * self.sin_h);
        (along + across, along - across)
    }

    /// wi and wo at the difference azimuth with this sine and cosine.
    #[inline(always)]
    pub(super) fn directions(&self, sin_p: f64, cos_p: f64) -> ([f64; 3], [f64; 3]) {
        let Self { sin_h, cos_h, sin_d, cos_d, .. } = *self;
        // wi = Ry(theta_h) (sin td cos pd, sin td sin pd, cos td); wo mirrors wi in h.
        let (along_x, across_x, across_y) = (cos_d * sin_h, sin_d * cos_p * cos_h, sin_d * sin_p);
        let (cos_i, cos_o) = self.cosines(cos_p);
        // 0 - y instead of -y, because negating would make a zero negative and its azimuth -180 degrees.
        ([along_x + across_x, across_y, cos_i], [along_x - across_x, 0.0 - across_y, cos_o])
    }

    fn geometry(&self, sin_p: f64, cos_p: f64) -> Geometry<f64> {
        let (wi, wo) = self.directions(sin_p, cos_p);
        Geometry { wi, wo, h: self.h(), cos_d: self.cos_d, one_less_cos_d: self.one_less_cos_d }
    }
}
