//! Samples divided into groups that err together.
//!
//! A lamp that drifts, a stage that is out of line, or a model that is wrong miss whole angles of incidence, and all samples that look into
//! nearly the same direction, in the same way. The errors of such samples are not independent, those of different groups nearly are.

use super::{IncidenceGroups, Samples};
use crate::geometry::Geometry;
use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Arc;

/// Samples divided into groups that err together.
#[derive(Clone, Debug)]
pub struct Clusters {
    /// What the samples of a group have in common.
    pub kind: ClusterKind,
    /// Width of a neighbourhood in the direction of the viewer, degrees; `None` for other kinds.
    pub width_deg: Option<f64>,
    /// Number of groups.
    pub groups: usize,
    /// The group of each sample.
    pub of_sample: Vec<u32>,
}

/// What the samples of a group have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ClusterKind {
    /// The angle of incidence.
    Incidence,
    /// A range of angles of incidence, 5 degrees wide.
    IncidenceRange,
    /// The angle of incidence, and about the direction of the viewer relative to the mirror direction.
    Neighbourhood,
    /// Both directions.
    Direction,
}

impl ClusterKind {
    /// Name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Incidence => "incidence",
            Self::IncidenceRange => "incidence-range",
            Self::Neighbourhood => "neighbourhood",
            Self::Direction => "direction",
        }
    }
}

/// Least number of groups of one angle of incidence each: the spread of fewer says little.
const FEWEST_GROUPS: usize = 10;
/// How many more groups than free parameters are needed, at least.
const SPARE_GROUPS: usize = 3;
/// Widths of neighbourhoods, degrees. The widest that gives enough of them is taken.
const WIDTHS_DEG: [f64; 5] = [40.0, 20.0, 10.0, 5.0, 2.5];
/// Tolerance for the rounding of angles, as a fraction of a width.
const ROUNDING: f64 = 1e-6;
/// Number of thousandths of a degree in a radian.
const PER_MILLIDEGREE: f64 = 57_295.779_513;
/// Largest number of groups.
const MOST_GROUPS: usize = 1000;

impl Samples {
    /// Divides the samples into groups that err together, for a model that has `free` parameters in each channel: by angle of incidence
    /// where there are at least 10 angles and 3 more than parameters, then by ever narrower neighbourhoods of directions, and last by
    /// direction. Divisions with too few groups, or very many, are left out.
    pub fn clusters(&self, free: usize) -> impl Iterator<Item = Clusters> {
        let least = FEWEST_GROUPS.max(free + SPARE_GROUPS);
        let incidence = Arc::new(self.incidence_groups());
        let angles = std::iter::once(by_incidence(&incidence));
        let by_width =
            WIDTHS_DEG.into_iter().map(move |width_deg| self.neighbourhoods(&incidence, width_deg));
        let enough = move |clusters: &Clusters| (least..=MOST_GROUPS).contains(&clusters.groups);
        angles.chain(by_width).chain(std::iter::once_with(|| self.by_direction())).filter(enough)
    }

    /// One group for each angle of incidence and part of the half vectors. Parts are as wide as half the width in the direction of the
    /// viewer: a cap about the normal, where the lobe is, and rings about it, divided by azimuth.
    fn neighbourhoods(&self, incidence: &IncidenceGroups, width_deg: f64) -> Clusters {
        let part = |g: &Geometry<f64>| {
            let ring = (g.theta_h_deg() / (0.5 * width_deg) + ROUNDING).floor();
            if ring <= 0.0 {
                return [0, 0];
            }
            let middle_deg = 0.5 * width_deg * (ring + 0.5);
            let sectors = (360.0 * middle_deg.to_radians().sin() / (0.5 * width_deg)).round().max(2.0);
            // The azimuth from the plane of incidence.
            let ([ix, iy, _], [hx, hy, _]) = (g.wi, g.h);
            let azimuth = (ix * hy - iy * hx).atan2(ix * hx + iy * hy);
            // Half a sector is added, so that the plane of incidence runs through the middle of a sector.
            let turns = azimuth / std::f64::consts::TAU + (0.5 + ROUNDING) / sectors;
            let sector = ((turns - turns.floor()) * sectors).floor();
            [ring.to_bits(), sector.to_bits()]
        };
        let parts = self.directions.each(part);
        let keys = parts.into_iter().zip(&incidence.of_sample).map(|(part, group)| (*group, part));
        numbered(ClusterKind::Neighbourhood, Some(width_deg), keys)
    }

    /// One group for each pair of directions, to a thousandth of a degree.
    fn by_direction(&self) -> Clusters {
        // 0 is added because there are two zeros.
        let rounded = |g: &Geometry<f64>| {
            [g.wi[0], g.wi[1], g.wo[0], g.wo[1]].map(|x| ((x * PER_MILLIDEGREE).round() + 0.0).to_bits())
        };
        numbered(ClusterKind::Direction, None, self.directions.each(rounded).into_iter())
    }
}

/// The groups by angle of incidence.
fn by_incidence(incidence: &IncidenceGroups) -> Clusters {
    let kind = if incidence.single_angles() { ClusterKind::Incidence } else { ClusterKind::IncidenceRange };
    let of_sample = incidence.of_sample.iter().map(|group| number(*group)).collect();
    Clusters { kind, width_deg: None, groups: incidence.len(), of_sample }
}

fn number(group: usize) -> u32 {
    u32::try_from(group).unwrap_or(u32::MAX)
}

/// Groups of samples with the same key, numbered as they first occur.
fn numbered<K: Hash + Eq>(
    kind: ClusterKind,
    width_deg: Option<f64>,
    keys: impl Iterator<Item = K>,
) -> Clusters {
    let mut numbers: HashMap<K, u32> = HashMap::new();
    let of_sample = keys
        .map(|key| {
            let next = number(numbers.len());
            *numbers.entry(key).or_insert(next)
        })
        .collect();
    Clusters { kind, width_deg, groups: numbers.len(), of_sample }
}
