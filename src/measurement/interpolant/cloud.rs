//! Between scattered samples.
//!
//! **Where samples are.** Each is a point, so that near points look alike. With isotropy, u = sqrt(theta_h/90 deg):
//!
//! ```text
//! ( 2 u,  theta_d,  u sin(theta_d)/2 cos(phi_d),  u sin(theta_d)/2 |sin(phi_d)| )
//! ```
//!
//! The root stretches the neighbourhood of the mirror direction, where peaks are; phi_d counts for nothing where it
//! means nothing, at theta_h = 0 and theta_d = 0; |sin| is mirror symmetry. With reciprocity cos becomes |cos|, since
//! exchanging the directions adds half a turn to phi_d. Without isotropy
//!
//! ```text
//! ( 2 u cos(phi_h),  2 u sin(phi_h),  (wi - wo)/2 )
//! ```
//!
//! and with reciprocity every sample stands there a second time, exchanged.
//!
//! **Which symmetries.** Samples of one phi_i can tell nothing of anisotropy and are taken as isotropic; otherwise both are
//! tried. Of all candidates, the most symmetric one is taken whose median error of samples left out is at most
//! [`WORSE`] times that of the best. Data that contradict a symmetry thereby are not forced into it: Cornell's paints are far
//! from reciprocal away from the mirror direction.
//!
//! **Between them.** cbrt(f) is fitted by a linear function of the coordinates to the [`NEAREST`] nearest samples, with weights
//! ((R - d)/(R d))^2 that are infinite at a sample and vanish at the distance R of the next one beyond
//! (Franke and Little's, in Franke 1982, doi:10.2307/2007474), and a ridge that leaves Shepard's weighted mean where the samples do not
//! tell a slope. The value at the pair is held between the smallest and the largest of those samples. At a sample this is
//! the measured value (at several under the same symmetry, their mean).
//!
//! **Covered** is a pair whose polar angles are within those measured, and that is no farther from the nearest sample than
//! that one's [`REACH`]th neighbour is.
//!
//! **What was tried,** on Cornell's cayman, garnet red and krylon blue (1439 samples each; angles up to 80 degrees): the
//! median of sum_c |f - f*| / sum_c |f*|, first with one sample left out, then with all of its theta_i, which is 10 degrees from the
//! next:
//!
//! | | cayman | garnet red | krylon blue |
//! |---|---|---|---|
//! | FIGURES | | | |

use super::tree::{Near, Point, Tree};
use super::{HalfDifference, apart, spread};
use crate::geometry::Pair;
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use std::f64::consts::FRAC_PI_2;

/// What samples are taken to be alike under.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Symmetry {
    /// Turning both directions about the normal, and mirroring them, changes nothing.
    pub isotropic: bool,
    /// Exchanging them changes nothing.
    pub reciprocal: bool,
}

/// Samples that a value is found from.
const NEAREST: usize = 12;
/// The neighbour that says how far a sample reaches.
const REACH: usize = 8;
/// How much worse samples may be foretold with a symmetry than without.
const WORSE: f64 = 1.1;
/// Samples left out to choose the symmetry.
const JUDGES: usize = 500;
/// Squared distance below which points are the same: an angle of some 1e-7, and of 1e-14 from the mirror direction.
const SAME: f64 = 1e-14;
/// The ridge, as a part of the samples' mean square distance.
const RIDGE: f64 = 1e-3;

#[derive(Clone, Debug)]
pub(super) struct Cloud {
    channels: usize,
    pairs: Vec<Pair>,
    /// cbrt(f), the channels of each sample together.
    roots: Vec<f64>,
    symmetry: Symmetry,
    tree: Tree,
    /// Squared distance of each sample's [`REACH`]th neighbour.
    reach: Vec<f64>,
    /// Smallest n.wi and n.wo.
    lowest: (f64, f64),
}

/// Room for the neighbours of one pair after the other.
pub(super) type Room = Vec<Near>;

impl Cloud {
    pub(super) fn new(pairs: &[Pair], rows: &[Vec<f64>]) -> Self {
        let lowest =
            pairs.iter().fold((1.0_f64, 1.0_f64), |(i, o), pair| (i.min(pair.wi.z), o.min(pair.wo.z)));
        let mut cloud = Self {
            channels: rows.len(),
            pairs: pairs.to_vec(),
            roots: by_sample(rows, pairs.len(), f64::cbrt),
            symmetry: Symmetry { isotropic: true, reciprocal: true },
            tree: Tree::new(Vec::new()),
            reach: Vec::new(),
            lowest,
        };
        cloud.settle();
        let neighbour = |pair: &Pair| {
            let mut room = Room::new();
            let place = place(pair, cloud.symmetry);
            cloud.tree.nearest(&place, REACH, |near| near.square > SAME, &mut room);
            room.last().map_or(0.0, |near| near.square)
        };
        cloud.reach = cloud.pairs.par_iter().map(neighbour).collect();
        if cloud.symmetry.reciprocal {
            let (i, o) = cloud.lowest;
            cloud.lowest = (i.min(o), i.min(o));
        }
        cloud
    }

    /// Chooses the symmetry and makes the tree for it.
    fn settle(&mut self) {
        let mut tried = Vec::new();
        for isotropic in [true, false] {
            for reciprocal in [true, false] {
                if isotropic || several_azimuths(&self.pairs) {
                    self.symmetry = Symmetry { isotropic, reciprocal };
                    self.tree = tree(&self.pairs, self.symmetry);
                    let median = super::summary(self.leave_out(JUDGES)).map_or(0.0, |errors| errors.median);
                    tried.push((self.symmetry, median));
                }
            }
        }
        let best = tried.iter().map(|(_, median)| *median).fold(f64::INFINITY, f64::min);
        if let Some((symmetry, _)) = tried.iter().find(|(_, median)| *median <= WORSE * best) {
            self.symmetry = *symmetry;
            self.tree = tree(&self.pairs, self.symmetry);
        }
    }

    pub(super) fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    /// f at a pair; whether it is covered.
    pub(super) fn at(&self, pair: &Pair, room: &mut Room, f: &mut [f64]) -> bool {
        let q = place(pair, self.symmetry);
        self.tree.nearest(&q, NEAREST + 1, |_| true, room);
        self.value(&q, room, f);
        let Some(nearest) = room.first() else { return false };
        let within = |z: f64, lowest: f64| z >= lowest - 1e-9;
        let reach = self.reach.get(nearest.sample).copied().unwrap_or(0.0);
        within(pair.wi.z, self.lowest.0)
            && within(pair.wo.z, self.lowest.1)
            && nearest.square <= reach.max(SAME)
    }

    /// cbrt(f) of a sample, per channel.
    fn sample(&self, index: usize) -> &[f64] {
        let start = index * self.channels;
        self.roots.get(start..start + self.channels).unwrap_or_default()
    }

    /// f at `q` from the samples that were found near it.
    fn value(&self, q: &Point, found: &[Near], f: &mut [f64]) {
        let same = found.partition_point(|near| near.square < SAME);
        let (used, weights) = match found.get(..same).filter(|same| !same.is_empty()) {
            Some(same) => (same, vec![1.0; same.len()]),
            None => (found, weights(found, q)),
        };
        f.fill(0.0);
        let total: f64 = weights.iter().sum();
        let mut range = vec![(f64::INFINITY, f64::NEG_INFINITY); f.len()];
        for (near, weight) in used.iter().zip(weights) {
            for ((f, range), root) in f.iter_mut().zip(&mut range).zip(self.sample(near.sample)) {
                *f += weight / total * root;
                *range = (range.0.min(*root), range.1.max(*root));
            }
        }
        for (f, (low, high)) in f.iter_mut().zip(range) {
            let root = f.max(low).min(high);
            *f = root * root * root;
        }
    }

    /// Errors of at most `most` samples, each found from the others that do not coincide with it.
    pub(super) fn leave_out(&self, most: usize) -> Vec<f64> {
        let error = |sample: usize| {
            let q = place(self.pairs.get(sample)?, self.symmetry);
            let mut room = Room::new();
            let other = |near: &Near| near.sample != sample && near.square > SAME;
            self.tree.nearest(&q, NEAREST + 1, other, &mut room);
            let mut found = vec![0.0; self.channels];
            self.value(&q, &room, &mut found);
            apart(&found, self.sample(sample).iter().map(|root| root * root * root))
                .filter(|_| !room.is_empty())
        };
        spread(self.pairs.len(), most).filter_map(error).collect()
    }
}

/// The values of rows, one per channel, so that all channels of a sample stand together.
pub(super) fn by_sample(rows: &[Vec<f64>], samples: usize, of: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut values = vec![0.0; rows.len() * samples];
    for (channel, row) in rows.iter().enumerate() {
        let places = values.iter_mut().skip(channel).step_by(rows.len());
        places.zip(row).for_each(|(place, f)| *place = of(*f));
    }
    values
}

/// Whether light came from more than one azimuth.
fn several_azimuths(pairs: &[Pair]) -> bool {
    let mut azimuths = pairs.iter().map(|pair| pair.wi.truncate()).filter(|v| v.length() > 1e-6);
    let Some(first) = azimuths.next() else { return false };
    azimuths.any(|v| v.normalize().distance(first.normalize()) > 1e-6)
}

fn tree(pairs: &[Pair], symmetry: Symmetry) -> Tree {
    let twice = symmetry.reciprocal && !symmetry.isotropic;
    let exchanged = pairs.iter().map(|pair| Pair { wi: pair.wo, wo: pair.wi }).filter(|_| twice);
    let all = pairs.iter().copied().zip(0..).chain(exchanged.zip(0..));
    Tree::new(all.map(|(pair, sample)| (place(&pair, symmetry), sample)).collect())
}

/// The coordinates of a pair.
fn place(pair: &Pair, symmetry: Symmetry) -> Point {
    let q = HalfDifference::of(pair);
    let u = (q.theta_h / FRAC_PI_2).sqrt();
    if symmetry.isotropic {
        let along = if symmetry.reciprocal { q.along.abs() } else { q.along };
        [2.0 * u, q.theta_d, 0.5 * u * along, 0.5 * u * q.across.abs(), 0.0]
    } else {
        let (cos_phi, sin_phi) = q.azimuth;
        let [x, y, z] = q.difference.to_array();
        [2.0 * u * cos_phi, 2.0 * u * sin_phi, x, y, z]
    }
}

type Vector = SVector<f64, 5>;

/// The weights of the samples in the value at `q` of the linear function that fits them best.
///
/// With m the weighted mean of x - q and S the weighted covariance of x, the value at q is the mean of
/// y (1 - (x - q - m) S^-1 m).
fn weights(found: &[Near], q: &Point) -> Vec<f64> {
    // A little beyond the last, so that it has a weight where it is alone.
    let range = 1.000_1 * found.last().map_or(1.0, |near| near.square.sqrt());
    let near: Vec<f64> = found
        .iter()
        .map(|near| {
            let distance = near.square.sqrt();
            ((range - distance) / (range * distance)).powi(2)
        })
        .collect();
    let total: f64 = near.iter().sum();
    let from = |near: &Near| Vector::from(near.point) - Vector::from(*q);
    let weighted = || found.iter().zip(near.iter().map(|weight| weight / total));
    let mean: Vector = weighted().map(|(near, weight)| from(near) * weight).sum();
    let mut covariance = SMatrix::<f64, 5, 5>::zeros();
    for (near, weight) in weighted() {
        let step = from(near) - mean;
        covariance += step * step.transpose() * weight;
    }
    // The ridge also stands for the axes that these coordinates leave empty.
    let ridge = (RIDGE * covariance.trace()).max(f64::MIN_POSITIVE);
    covariance += SMatrix::identity() * ridge;
    let slope = covariance.cholesky().map_or_else(Vector::zeros, |s| s.solve(&mean));
    weighted().map(|(near, weight)| weight * (1.0 - (from(near) - mean).dot(&slope))).collect()
}
