//! Interpolation between scattered samples.
//!
//! **Coordinates.** Each sample is a point, such that points that are near have similar values. With isotropy, and u =
//! sqrt(theta_h/90 deg):
//!
//! ```text
//! ( 2 u,  theta_d,  u sin(theta_d)/2 cos(phi_d),  u sin(theta_d)/2 |sin(phi_d)| )
//! ```
//!
//! The root stretches the neighbourhood of the mirror direction, where the peaks are. phi_d has no effect where it has
//! no meaning, at theta_h = 0 and theta_d = 0, and |sin| gives mirror symmetry. With reciprocity cos becomes |cos|,
//! because exchanging the directions adds half a turn to phi_d. Without isotropy the coordinates are
//! ```text
//! ( 2 u cos(phi_h),  2 u sin(phi_h),  (wi - wo)/2 )
//! ```
//!
//! and with reciprocity every sample occurs a second time, exchanged.
//!
//! **Symmetries.** Samples with a single phi_i contain no information on anisotropy and are taken as isotropic;
//! otherwise both are tried. Of all candidates whose median error, with all samples of the same light direction left
//! out, is at most [`WORSE`] times that of the best, the most symmetric one is chosen. So data that contradict a
//! symmetry are not forced into it: Cornell's paints are far from reciprocal away from the mirror direction.
//!
//! **Interpolation.** A linear function of the coordinates is fitted to cbrt(f) at the [`NEAREST`] nearest samples.
//! The weights ((R - d)/(R d))^2 are infinite at a sample and vanish at the distance R of the next one beyond (Franke
//! and Little's, in Franke 1982, doi:10.2307/2007474). A ridge leaves Shepard's weighted mean if the samples do not
//! determine a slope. The value at the pair is limited to the range from the smallest to the largest of those samples.
//! At a sample it is the measured value (if several samples coincide under the symmetry, their mean).
//!
//! **Coverage.** A pair is covered if its polar angles are within those measured, and if it is no farther from the
//! nearest sample than the [`REACH`]th neighbour of that sample is.
//!
//! **Alternatives tried,** on Cornell's cayman, garnet red and krylon blue (1439 samples each), at polar angles up to
//! 80 degrees. The numbers are the median of sum_c |f - f*| / sum_c |f*| in per cent, with one sample left out, and
//! with all samples of its theta_i left out (20 to 70 degrees), which is 10 degrees from the next:
//!
//! | | cayman | garnet red | krylon blue |
//! |---|---|---|---|
//! | as above | 3.3, 5.3 | 1.4, 2.4 | 1.2, 2.5 |
//! | f in place of cbrt(f) | 3.4, 5.5 | 1.6, 2.6 | 1.3, 2.7 |
//! | ln(1 + f) | 3.4, 5.5 | 1.6, 2.5 | 1.3, 2.7 |
//! | f cos(theta_i) cos(theta_o) | 3.4, 7.1 | 1.6, 3.4 | 1.4, 3.3 |
//! | weighted mean (Shepard) of f | 4.2, 9.3 | 1.7, 3.5 | 1.3, 2.9 |
//! | eight neighbours | 3.2, 6.3 | 1.4, 2.7 | 1.2, 2.6 |
//! | twenty-four | 3.2, 5.1 | 1.4, 2.4 | 1.2, 2.5 |
//! | theta_h in place of its root | 3.7, 6.8 | 1.5, 2.9 | 1.3, 2.8 |
//! | coordinates without isotropy | 4.5, 5.3 | 2.1, 3.1 | 2.0, 3.5 |
//! | reciprocity forced | 7.7, 22 | 1.8, 4.4 | 3.3, 11 |
//!
//! cbrt also accepts negative values, and it has no scale: doubling the values doubles the result.

use super::half_difference::HalfDifference;
use super::left_out::{LeftOut, apart, spread, summary};
use super::tree::{Near, Point, Tree};
use crate::geometry::Pair;
use crate::math::count;
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use std::f64::consts::FRAC_PI_2;

/// The symmetries that samples are assumed to have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Symmetry {
    /// Rotating both directions about the normal, or mirroring them, changes nothing.
    pub isotropic: bool,
    /// Exchanging the two directions changes nothing.
    pub reciprocal: bool,
}

/// Number of samples from which a value is computed.
const NEAREST: usize = 12;
/// The neighbour whose distance is the reach of a sample.
const REACH: usize = 8;
/// Largest ratio of the prediction error with a symmetry to that of the best candidate.
const WORSE: f64 = 1.1;
/// Number of samples left out to choose the symmetry.
const JUDGES: usize = 500;
/// Squared distance below which points coincide: an angle of about 1e-7, or of 1e-14 from the mirror direction.
pub(super) const SAME: f64 = 1e-14;
/// Distance below which two light directions are the same.
const SAME_LIGHT: f64 = 1e-3;
/// The ridge, as a fraction of the samples' mean square distance.
const RIDGE: f64 = 1e-2;

#[derive(Clone, Debug)]
pub(super) struct Cloud {
    channels: usize,
    pairs: Vec<Pair>,
    /// cbrt(f), with the channels of each sample together.
    roots: Vec<f64>,
    symmetry: Symmetry,
    tree: Tree,
    /// Squared distance of the [`REACH`]th neighbour of each sample.
    reach: Vec<f64>,
    /// The largest of these.
    farthest: f64,
    /// Smallest n.wi and n.wo.
    lowest: (f64, f64),
}

/// Working space for the neighbours of a pair and their weights, reused from pair to pair.
#[derive(Default)]
pub(super) struct Room {
    found: Vec<Near>,
    weights: Vec<f64>,
}

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
            farthest: 0.0,
            lowest,
        };
        cloud.settle();
        let neighbour = |pair: &Pair| {
            let mut found = Vec::new();
            let place = place(pair, cloud.symmetry);
            cloud.tree.nearest(&place, REACH, |near| near.square > SAME, &mut found);
            found.last().map_or(0.0, |near| near.square)
        };
        cloud.reach = cloud.pairs.par_iter().map(neighbour).collect();
        cloud.farthest = cloud.reach.iter().copied().fold(0.0, f64::max);
        if cloud.symmetry.reciprocal {
            let (i, o) = cloud.lowest;
            cloud.lowest = (i.min(o), i.min(o));
        }
        cloud
    }

    /// Chooses the symmetry and builds the tree for it.
    fn settle(&mut self) {
        let mut tried = Vec::new();
        for isotropic in [true, false] {
            for reciprocal in [true, false] {
                if isotropic || several_azimuths(&self.pairs) {
                    self.symmetry = Symmetry { isotropic, reciprocal };
                    self.tree = tree(&self.pairs, self.symmetry);
                    // If all light came from one direction, single samples must be left out instead.
                    let median = [LeftOut::Light, LeftOut::Sample]
                        .into_iter()
                        .find_map(|out| summary(self.leave_out(out, JUDGES)));
                    tried.push((self.symmetry, median.map_or(0.0, |errors| errors.median)));
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

    /// Whether a pair lies so far off to one side of all samples that none can be near enough to cover it.
    pub(super) fn is_beyond(&self, pair: &Pair) -> bool {
        self.tree.is_farther_than(self.farthest.max(SAME), &place(pair, self.symmetry))
    }

    /// Writes f at a pair, and returns whether the pair is covered.
    pub(super) fn at(&self, pair: &Pair, room: &mut Room, f: &mut [f64]) -> bool {
        let q = place(pair, self.symmetry);
        self.tree.nearest(&q, NEAREST + 1, |_| true, &mut room.found);
        self.value(&q, room, f);
        let Some(nearest) = room.found.first() else { return false };
        let within = |z: f64, lowest: f64| z >= lowest - 1e-9;
        let reach = self.reach.get(nearest.sample).copied().unwrap_or(0.0);
        within(pair.wi.z, self.lowest.0)
            && within(pair.wo.z, self.lowest.1)
            && nearest.square <= reach.max(SAME)
    }

    /// Writes f at `q`, computed from the samples found near it.
    fn value(&self, q: &Point, Room { found, weights }: &mut Room, f: &mut [f64]) {
        let same = found.partition_point(|near| near.square < SAME);
        if same > 0 {
            weights.clear();
            weights.resize(same, 1.0 / count(same));
        } else {
            weigh(found, q, weights);
        }
        for (channel, f) in f.iter_mut().enumerate() {
            let (mut root, mut low, mut high) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
            for (near, weight) in found.iter().zip(&*weights) {
                let of = self.roots.get(near.sample * self.channels + channel).copied().unwrap_or(0.0);
                root += weight * of;
                (low, high) = (low.min(of), high.max(of));
            }
            let root = if low <= high { root.clamp(low, high) } else { 0.0 };
            *f = root * root * root;
        }
    }

    /// The errors of at most `most` samples. Each is predicted from the others that do not coincide with it.
    pub(super) fn leave_out(&self, out: LeftOut, most: usize) -> Vec<f64> {
        let error = |sample: usize| {
            let pair = self.pairs.get(sample)?;
            let lit = |other: usize| {
                self.pairs.get(other).is_some_and(|other| other.wi.distance(pair.wi) < SAME_LIGHT)
            };
            let stays = |near: &Near| match out {
                LeftOut::Sample => near.sample != sample && near.square > SAME,
                LeftOut::Light => !lit(near.sample) && near.square > SAME,
            };
            let (q, mut room) = (place(pair, self.symmetry), Room::default());
            self.tree.nearest(&q, NEAREST + 1, stays, &mut room.found);
            let mut found = vec![0.0; self.channels];
            self.value(&q, &mut room, &mut found);
            let start = sample * self.channels;
            let measured =
                self.roots.get(start..start + self.channels)?.iter().map(|root| root * root * root);
            apart(&found, measured).filter(|_| !room.found.is_empty())
        };
        spread(self.pairs.len(), most).filter_map(error).collect()
    }
}

/// The values of every sample as the others predict them that do not coincide with it, by row; its own where there are no others.
pub(in crate::measurement) fn leave_each_out(
    pairs: &[Pair],
    rows: &[Vec<f64>],
    isotropic: bool,
) -> Vec<Vec<f64>> {
    /// Number of samples that one thread predicts at a time.
    const PART: usize = 256;
    let symmetry = Symmetry { isotropic, reciprocal: false };
    let cloud = Cloud {
        channels: rows.len(),
        pairs: Vec::new(),
        roots: by_sample(rows, pairs.len(), f64::cbrt),
        symmetry,
        tree: tree(pairs, symmetry),
        reach: Vec::new(),
        farthest: 0.0,
        lowest: (0.0, 0.0),
    };
    let of_part = |part: &[Pair]| {
        let (mut room, mut f) = (Room::default(), vec![0.0; rows.len()]);
        let mut found: Vec<Option<Vec<f64>>> = Vec::with_capacity(part.len());
        for pair in part {
            let q = place(pair, symmetry);
            cloud.tree.nearest(&q, NEAREST + 1, |near| near.square > SAME, &mut room.found);
            found.push((!room.found.is_empty()).then(|| {
                cloud.value(&q, &mut room, &mut f);
                f.clone()
            }));
        }
        found
    };
    let parts: Vec<Vec<Option<Vec<f64>>>> = pairs.par_chunks(PART).map(of_part).collect();
    let mut predicted = rows.to_vec();
    for (sample, found) in parts.iter().flatten().enumerate() {
        for (row, f) in predicted.iter_mut().zip(found.iter().flatten()) {
            row.iter_mut().skip(sample).take(1).for_each(|place| *place = *f);
        }
    }
    predicted
}

/// Applies `transform` to the values of rows, one row per channel, and rearranges them so that all channels of a sample
/// are together.
pub(super) fn by_sample(rows: &[Vec<f64>], samples: usize, transform: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut values = vec![0.0; rows.len() * samples];
    for (channel, row) in rows.iter().enumerate() {
        let places = values.iter_mut().skip(channel).step_by(rows.len());
        places.zip(row).for_each(|(place, f)| *place = transform(*f));
    }
    values
}

/// Whether the light came from more than one azimuth.
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
pub(super) fn place(pair: &Pair, symmetry: Symmetry) -> Point {
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

/// The weight of each sample in the value at `q` of the linear function that fits the samples best.
///
/// With m the weighted mean of x - q and S the weighted covariance of x, the value at q is the mean of y (1 - (x - q -
/// m) S^-1 m).
fn weigh(found: &[Near], q: &Point, weights: &mut Vec<f64>) {
    // The range extends slightly beyond the last sample, so that it has a weight if it is the only one.
    let range = 1.000_1 * found.last().map_or(1.0, |near| near.square.sqrt());
    weights.clear();
    weights.extend(found.iter().map(|near| {
        let distance = near.square.sqrt();
        ((range - distance) / (range * distance)).powi(2)
    }));
    let total: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= total);
    let from = |near: &Near| Vector::from(near.point) - Vector::from(*q);
    let mut mean = Vector::zeros();
    found.iter().zip(&*weights).for_each(|(near, weight)| mean += from(near) * *weight);
    let mut covariance = SMatrix::<f64, 5, 5>::zeros();
    for (near, weight) in found.iter().zip(&*weights) {
        let step = from(near) - mean;
        covariance += step * (step * *weight).transpose();
    }
    // The ridge also takes the place of the axes that these coordinates do not use.
    let ridge = (RIDGE * covariance.trace()).max(f64::MIN_POSITIVE);
    covariance += SMatrix::identity() * ridge;
    let slope = covariance.cholesky().map_or_else(Vector::zeros, |s| s.solve(&mean));
    for (near, weight) in found.iter().zip(weights) {
        *weight *= 1.0 - (from(near) - mean).dot(&slope);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Answer, Interpolant};
    use super::*;
    use crate::geometry::direction;
    use approx::assert_relative_eq;
    use rand::{RngExt, SeedableRng};
    use std::f64::consts::TAU;

    fn interpolant(pairs: &[Pair], rows: &[Vec<f64>]) -> Interpolant {
        let kind = super::super::Kind::Cloud(Cloud::new(pairs, rows));
        Interpolant::of_kind(rows.len(), kind)
    }

    /// Pairs over both hemispheres up to 80 degrees. The azimuth of the light is 0, or random if `turned`.
    fn pairs(n: usize, turned: bool, seed: u64) -> Vec<Pair> {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let mut any = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        let mut one = |phi: f64| direction(any(80_f64.to_radians().cos(), 1.0).acos(), any(0.0, phi));
        (0..n).map(|_| Pair { wi: one(if turned { TAU } else { 0.0 }), wo: one(TAU) }).collect()
    }

    /// A wide lobe about the half vector on top of a diffuse floor, with different roughnesses along x and y.
    fn lobe(pair: &Pair, [x, y]: [f64; 2]) -> f64 {
        let h = (pair.wi + pair.wo).normalize();
        let t2 = (h.x / x).powi(2) + (h.y / y).powi(2);
        0.1 + 0.5 * (-t2 / (h.z * h.z)).exp()
    }

    #[test]
    fn through_every_sample() {
        let (pairs, other) = (pairs(700, false, 1), pairs(300, false, 2));
        let rows: Vec<Vec<f64>> =
            [0.3, 0.6].map(|m| pairs.iter().map(|pair| lobe(pair, [m, m]) - 0.15).collect()).into();
        let interpolant = interpolant(&pairs, &rows);
        let Answer { values, covered } = interpolant.at(&pairs);
        for (found, row) in values.iter().zip(&rows) {
            for (found, f) in found.iter().zip(row) {
                assert_relative_eq!(*found, *f, max_relative = 1e-14);
            }
        }
        assert!(covered.iter().all(|is| *is));
        let within = |f: f64| f > -0.06 && f < 0.45;
        assert!(interpolant.at(&other).values.iter().flatten().all(|f| within(*f)));
        assert!(interpolant.leave_out_error(LeftOut::Sample).is_some());
    }

    #[test]
    fn a_constant_stays_constant() {
        let rows = [vec![0.25; 500], vec![0.0; 500]];
        for turned in [false, true] {
            let interpolant = interpolant(&pairs(500, turned, 3), &rows);
            let symmetry = Symmetry { isotropic: true, reciprocal: true };
            assert_eq!(interpolant.symmetry(), Some(symmetry));
            let Answer { values, .. } = interpolant.at(&pairs(500, true, 4));
            assert!(values[0].iter().all(|f| (f - 0.25).abs() < 1e-14));
            assert!(values[1].iter().all(|f| *f == 0.0));
        }
    }

    /// Median and 95th percentile of the error relative to the value, over the pairs that are covered.
    fn errors(sampled: &[Pair], f: impl Fn(&Pair) -> f64) -> (Symmetry, [f64; 2], f64) {
        let interpolant = interpolant(sampled, &[sampled.iter().map(&f).collect()]);
        let asked = pairs(4000, true, 5);
        let Answer { values, covered } = interpolant.at(&asked);
        let mut errors: Vec<f64> = asked
            .iter()
            .zip(&values[0])
            .zip(&covered)
            .filter(|(_, is)| **is)
            .map(|((pair, found), _)| (found / f(pair) - 1.0).abs())
            .collect();
        errors.sort_by(f64::total_cmp);
        let rank = |share: usize| errors[errors.len() * share / 100];
        let left_out = interpolant.leave_out_error(LeftOut::Sample).unwrap().median;
        println!(
            "{} samples: {:.4} {:.4}, left out {left_out:.4}, covered {}",
            sampled.len(),
            rank(50),
            rank(95),
            errors.len()
        );
        (interpolant.symmetry().unwrap(), [rank(50), rank(95)], left_out)
    }

    #[test]
    fn a_smooth_lobe_and_its_symmetry() {
        let both = Symmetry { isotropic: true, reciprocal: true };
        for turned in [false, true] {
            let (symmetry, [median, p95], left_out) =
                errors(&pairs(2000, turned, 6), |pair| lobe(pair, [0.4, 0.4]));
            assert_eq!(symmetry, both);
            assert!(median < 0.01 && p95 < 0.06, "{median} {p95}");
            assert!((0.5..2.0).contains(&(left_out / median)), "{left_out} {median}");
        }
        let (symmetry, [median, _], _) = errors(&pairs(2000, true, 7), |pair| lobe(pair, [0.2, 0.8]));
        assert_eq!(symmetry, Symmetry { isotropic: false, reciprocal: true });
        assert!(median < 0.06, "{median}");
        let (symmetry, [median, _], _) =
            errors(&pairs(2000, true, 8), |pair| lobe(pair, [0.4, 0.4]) * (0.2 + pair.wi.z));
        assert_eq!(symmetry, Symmetry { isotropic: true, reciprocal: false });
        assert!(median < 0.02, "{median}");
    }

    #[test]
    fn where_there_are_no_data() {
        // Samples in the plane of incidence only: pairs far from it are not covered.
        let angles = || (-8..=8).map(|i| f64::from(i) * 10_f64.to_radians());
        let plane: Vec<Pair> = angles()
            .flat_map(|i| angles().map(move |o| Pair { wi: direction(i, 0.0), wo: direction(o, 0.0) }))
            .collect();
        let rows = [plane.iter().map(|pair| lobe(pair, [0.4, 0.4])).collect()];
        let interpolant = interpolant(&plane, &rows);
        let degrees = |i: f64, o: f64, phi: f64| Pair {
            wi: direction(i.to_radians(), 0.3),
            wo: direction(o.to_radians(), 0.3 + phi.to_radians()),
        };
        let asked = [degrees(25.0, 33.0, 180.0), degrees(60.0, 60.0, 90.0), degrees(85.0, 30.0, 180.0)];
        assert_eq!(interpolant.at(&asked).covered, [true, false, false]);
        assert_eq!(super::tests::interpolant(&[], &[vec![]]).at(&asked).covered, [false; 3]);
        let lone = super::tests::interpolant(&plane[..1], &[vec![0.7]]);
        assert_relative_eq!(lone.at(&asked[..1]).values[0][0], 0.7, max_relative = 1e-12);
        assert_eq!(lone.leave_out_error(LeftOut::Sample), None);
    }

    #[test]
    fn the_same_at_any_number_of_threads() {
        let pairs_of = pairs(3000, true, 9);
        let rows = [pairs_of.iter().map(|pair| lobe(pair, [0.2, 0.3])).collect::<Vec<_>>()];
        let asked = pairs(3000, true, 10);
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let interpolant = interpolant(&pairs_of, &rows);
                (interpolant.at(&asked), interpolant.leave_out_error(LeftOut::Sample))
            })
        };
        assert_eq!(run(1), run(3));
    }
}
