//! The directions of a measurement: scattered pairs of directions or cells of a grid.

use super::{BLOCK, Block, Geometry, HalfDifferenceGrid, Pair};
use crate::error::Error;
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// The unit direction at polar angle `theta` and azimuth `phi`, radians.
///
/// A negative `theta` means the direction at `|theta|` on the other side of the normal (phi + pi), which is how
/// goniophotometers report in-plane scans.
#[must_use]
pub fn direction(theta: f64, phi: f64) -> DVec3 {
    let (sin_theta, cos_theta) = theta.sin_cos();
    let (sin_phi, cos_phi) = phi.sin_cos();
    DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
}

/// (theta, phi) of a direction in degrees, theta in 0..180 and phi in (-180, 180].
#[must_use]
pub fn spherical_degrees(v: DVec3) -> (f64, f64) {
    let theta = v.x.hypot(v.y).atan2(v.z);
    (theta.to_degrees(), v.y.atan2(v.x).to_degrees())
}

/// The directions of a set of samples, stored as compactly as their source allows.
#[derive(Clone, Debug)]
pub enum Directions {
    /// One pair of directions per sample.
    Scattered(Vec<Pair>),
    /// Cells of a half/difference grid.
    Grid {
        /// The grid, shared by everything that samples it.
        grid: Arc<HalfDifferenceGrid>,
        /// The cell of each sample.
        cells: Vec<u32>,
    },
}

impl Directions {
    /// Creates scattered pairs of directions, each from its angles `[theta_i, phi_i, theta_o, phi_o]` in degrees:
    /// polar angles from -90 to 90 from the normal, and azimuths. A negative polar angle is on the other side of the
    /// normal.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the first angle that is not finite, or is below the horizon.
    pub fn from_degrees(angles: impl IntoIterator<Item = [f64; 4]>) -> Result<Self, Error> {
        const NAMES: [&str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];
        let mut pairs = Vec::new();
        for (index, angles) in angles.into_iter().enumerate() {
            for (name, angle) in NAMES.iter().zip(angles) {
                let most = if name.starts_with("theta") { 90.0 } else { f64::MAX };
                if angle.is_nan() || angle.abs() > most {
                    let expected = if most == 90.0 { "at most 90 degrees" } else { "a finite angle" };
                    let found = format!("{name} = {angle} in pair {}", index + 1);
                    return Err(Error::invalid("directions", expected, found));
                }
            }
            let [theta_i, phi_i, theta_o, phi_o] = angles.map(f64::to_radians);
            pairs.push(Pair { wi: direction(theta_i, phi_i), wo: direction(theta_o, phi_o) });
        }
        Ok(Self::Scattered(pairs))
    }

    /// Creates scattered pairs of directions from vectors to the light and to the viewer in the local frame, where z
    /// is the normal. The vectors need not be unit.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the first vector that is not finite, is 0, or points below the horizon.
    pub fn from_vectors(vectors: impl IntoIterator<Item = (DVec3, DVec3)>) -> Result<Self, Error> {
        let mut pairs = Vec::new();
        for (index, (wi, wo)) in vectors.into_iter().enumerate() {
            for (name, v) in [("wi", wi), ("wo", wo)] {
                if v.try_normalize().is_none() || v.z < 0.0 {
                    let found = format!("{name} = {v} in pair {}", index + 1);
                    return Err(Error::invalid("directions", "a vector above the horizon", found));
                }
            }
            pairs.push(Pair { wi: wi.normalize(), wo: wo.normalize() });
        }
        Ok(Self::Scattered(pairs))
    }

    /// The number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Scattered(pairs) => pairs.len(),
            Self::Grid { cells, .. } => cells.len(),
        }
    }

    /// Whether there are no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether the samples lie on a half/difference grid, which does not contain the half vector's azimuth.
    #[must_use]
    pub fn is_grid(&self) -> bool {
        matches!(self, Self::Grid { .. })
    }

    /// Iterates over the geometry of every sample.
    pub fn iter(&self) -> impl Iterator<Item = Geometry<f64>> + '_ {
        let (pairs, grid): (&[Pair], Option<(&HalfDifferenceGrid, &[u32])>) = match self {
            Self::Scattered(pairs) => (pairs, None),
            Self::Grid { grid, cells } => (&[], Some((grid, cells))),
        };
        let cells = grid.into_iter().flat_map(|(grid, cells)| cells.iter().map(|&cell| grid.geometry(cell)));
        pairs.iter().map(Pair::geometry).chain(cells)
    }

    /// Writes the geometry of the samples in `range`, which is one of [`Self::blocks`], to `block`.
    pub fn fill(&self, range: Range<usize>, block: &mut Block) {
        match self {
            Self::Scattered(pairs) => {
                block.fill_pairs(&pairs[range]);
            }
            Self::Grid { grid, cells } => {
                block.fill_cells(grid, &cells[range]);
            }
        }
    }

    /// The results of `function` for the geometry of every sample.
    pub(crate) fn each<T: Send>(&self, function: impl Fn(&Geometry<f64>) -> T + Sync) -> Vec<T> {
        match self {
            Self::Scattered(pairs) => pairs.par_iter().map(|pair| function(&pair.geometry())).collect(),
            Self::Grid { grid, cells } => {
                cells.par_iter().map(|&cell| function(&grid.geometry(cell))).collect()
            }
        }
    }

    /// The samples at `indices`, in that order.
    #[must_use]
    pub fn select(&self, indices: &[usize]) -> Self {
        match self {
            Self::Scattered(pairs) => Self::Scattered(gather(pairs, indices)),
            Self::Grid { grid, cells } => {
                Self::Grid { grid: Arc::clone(grid), cells: gather(cells, indices) }
            }
        }
    }

    /// The ranges of the blocks into which the samples are divided.
    pub fn blocks(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let len = self.len();
        (0..len).step_by(BLOCK).map(move |start| start..len.min(start + BLOCK))
    }
}

/// The elements at `indices`, in that order.
#[must_use]
pub(crate) fn gather<T: Copy>(from: &[T], indices: &[usize]) -> Vec<T> {
    indices.iter().map(|&i| from[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn grid_and_vectors_agree() {
        let grid = HalfDifferenceGrid::merl(0.5);
        for cell in [0, 12_345, 700_001, 1_000_000] {
            let g = grid.geometry(cell);
            let again = Geometry::new(g.wi, g.wo);
            for (a, b) in g.h.into_iter().zip(again.h) {
                assert_relative_eq!(a, b, epsilon = 1e-14);
            }
            assert_relative_eq!(g.cos_d, again.cos_d, epsilon = 1e-14);
            assert_relative_eq!(DVec3::from_array(g.wi).length(), 1.0, epsilon = 1e-14);
        }
    }

    #[test]
    fn directions_from_arrays() {
        let from_degrees = |angles: [f64; 4]| Directions::from_degrees([angles]);
        let across = from_degrees([-30.0, 0.0, 90.0, 45.0]).unwrap().iter().next().unwrap();
        assert_relative_eq!(across.wi[0], -0.5, epsilon = 1e-15);
        assert!(
            from_degrees([91.0, 0.0, 0.0, 0.0]).unwrap_err().to_string().contains("theta_i = 91 in pair 1")
        );
        assert!(from_degrees([0.0, 0.0, f64::NAN, 0.0]).is_err());
        assert!(from_degrees([0.0, f64::INFINITY, 0.0, 0.0]).is_err());

        let from_vectors = |wi: DVec3| Directions::from_vectors([(wi, DVec3::Z)]);
        let oblique = from_vectors(DVec3::new(3.0, 0.0, 4.0)).unwrap().iter().next().unwrap();
        assert_relative_eq!(oblique.wi[2], 0.8, epsilon = 1e-15);
        for wrong in [DVec3::ZERO, DVec3::NAN, -DVec3::Z] {
            assert!(from_vectors(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn weights_integrate_to_both_hemispheres() {
        // The sum over all bins above the horizon of 4 x weight x bin size is (2 pi)^2, with every pair of directions
        // counted once. phi_d is stored for half a turn and phi_h not at all, hence a factor of 2 pi x 2.
        let grid = HalfDifferenceGrid::merl(0.5);
        let bin = (std::f64::consts::FRAC_PI_2 / 8100.0)
            * (std::f64::consts::FRAC_PI_2 / 90.0)
            * (std::f64::consts::PI / 180.0);
        let sum: f64 = (0..u32::try_from(HalfDifferenceGrid::CELLS).unwrap())
            .filter(|&cell| {
                let g = grid.geometry(cell);
                g.cos_i() > 0.0 && g.cos_o() > 0.0
            })
            .map(|cell| grid.weight(cell))
            .sum();
        let pi2 = 2.0 * std::f64::consts::PI;
        assert_relative_eq!(4.0 * sum * bin * pi2 * 2.0, pi2 * pi2, max_relative = 1e-3);
    }
}
