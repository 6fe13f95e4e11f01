//! Samples grouped by their angle of incidence.
//!
//! A goniometer sets the lamp and then takes all viewing directions. A fault at one angle of incidence (alignment,
//! drift of the lamp) affects all its samples in the same way, and neighbouring samples contain almost the same
//! information. Whole angles are the parts of a measurement that come closest to being independent.

#![allow(
    clippy::indexing_slicing,
    reason = "a range is below RANGES, which is the number of limits and one more"
)]

use super::Samples;
use crate::geometry::{Block, Geometry};
use crate::math::count;
use rayon::prelude::*;
use std::ops::Range;

/// Samples grouped by angle of incidence, or by narrow ranges of it.
///
/// A cell of a half/difference grid stands for a pair of directions and its mirror image; its angle is that of the
/// direction that the cell's geometry calls incident.
#[derive(Clone, Debug)]
pub struct IncidenceGroups {
    /// Smallest and largest `theta_i` of each group, in degrees, ascending; both the same for a single angle.
    pub theta_i_deg: Vec<[f64; 2]>,
    /// The group of each sample.
    pub of_sample: Vec<usize>,
}

/// Angles that differ by less than this, in degrees, count as one: files round them, and the errors of goniometers are
/// smaller.
const SAME_ANGLE_DEG: f64 = 0.1;
/// Tolerance for the rounding of angles, in degrees: angles exactly 0.1 apart are two, and 5 belongs to 0..5.
const ROUNDING_DEG: f64 = 1e-6;
/// Largest number of angles that are kept as groups; with more, the directions are dense or random and are grouped in
/// ranges.
const MOST_ANGLES: usize = 50;
/// Number of samples of which the angles are counted first.
const FIRST_SAMPLES: usize = 10_000;
/// Width of those ranges, in degrees.
const RANGE_DEG: f64 = 5.0;
/// Number of those ranges, from the normal to the horizon.
const RANGES: usize = 18;

impl IncidenceGroups {
    /// The number of groups.
    #[must_use]
    pub fn len(&self) -> usize {
        self.theta_i_deg.len()
    }

    /// Whether there are no groups, because there are no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.theta_i_deg.is_empty()
    }

    /// Whether each group is a single angle, rather than a range.
    #[must_use]
    pub fn single_angles(&self) -> bool {
        self.theta_i_deg.iter().all(|[low, high]| low >= high)
    }

    /// The samples of the groups for which `wanted` returns true, in order.
    #[must_use]
    pub fn samples_of(&self, wanted: impl Fn(usize) -> bool) -> Vec<usize> {
        let numbered = self.of_sample.iter().enumerate();
        numbered.filter(|(_, group)| wanted(**group)).map(|(sample, _)| sample).collect()
    }
}

impl Samples {
    /// Groups the samples by angle of incidence: one group per angle if there are at most 50 (to 0.1 degrees),
    /// otherwise ranges of 5 degrees, each including its upper end.
    #[must_use]
    pub fn incidence_groups(&self) -> IncidenceGroups {
        // More samples never have fewer angles, so that the first ones of a dense table are enough to see that there are too many.
        let first: Vec<f64> = self.directions.iter().take(FIRST_SAMPLES).map(|g| g.theta_i_deg()).collect();
        if distinct(&first).is_none() {
            return ranges(self.ranges_of_samples());
        }
        let theta_i = self.directions.each(Geometry::theta_i_deg);
        angles(&theta_i).unwrap_or_else(|| ranges(self.ranges_of_samples()))
    }

    /// The range of 5 degrees that each sample's angle of incidence belongs to.
    fn ranges_of_samples(&self) -> Vec<usize> {
        let cosines: Vec<f64> =
            (1..RANGES).map(|k| (RANGE_DEG * count(k) + ROUNDING_DEG).to_radians().cos()).collect();
        let range_of = |cosine: f64| cosines.partition_point(|limit| cosine < *limit);
        let blocks: Vec<Range<usize>> = self.directions.blocks().collect();
        let of_block = |block: &mut Block, range: &Range<usize>| -> Vec<usize> {
            self.directions.fill(range.clone(), block);
            block.cos_i().iter().take(range.len()).map(|cosine| range_of(*cosine)).collect()
        };
        blocks.par_iter().map_init(Block::new, of_block).flatten_iter().collect()
    }
}

/// One group per angle; `None` if there are too many angles.
fn angles(theta_i: &[f64]) -> Option<IncidenceGroups> {
    let groups = distinct(theta_i)?;
    let group = |angle: &f64| groups.partition_point(|[low, _]| low <= angle).saturating_sub(1);
    let of_sample = theta_i.iter().map(group).collect();
    // The intended angle: the middle, without the digits that a conversion from radians adds.
    let meant = |[low, high]: [f64; 2]| (50.0 * (low + high)).round() / 100.0;
    Some(IncidenceGroups { theta_i_deg: groups.into_iter().map(|g| [meant(g); 2]).collect(), of_sample })
}

/// The smallest and the largest of the angles that count as one, ascending; `None` if there are too many.
fn distinct(theta_i: &[f64]) -> Option<Vec<[f64; 2]>> {
    let mut sorted = theta_i.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let mut groups: Vec<[f64; 2]> = Vec::new();
    for angle in sorted {
        let full = groups.len() == MOST_ANGLES;
        match groups.last_mut() {
            Some([low, high]) if angle < *low + SAME_ANGLE_DEG - ROUNDING_DEG => *high = angle,
            _ if full => return None,
            _ => groups.push([angle, angle]),
        }
    }
    Some(groups)
}

/// One group for each range that contains samples, given the range of each sample.
fn ranges(of_sample: Vec<usize>) -> IncidenceGroups {
    let mut has_samples = [false; RANGES];
    of_sample.iter().for_each(|range| has_samples[*range] = true);
    let taken: Vec<usize> = (0..RANGES).filter(|range| has_samples[*range]).collect();
    let mut places = [0; RANGES];
    taken.iter().enumerate().for_each(|(place, range)| places[*range] = place);
    IncidenceGroups {
        theta_i_deg: taken.iter().map(|k| [RANGE_DEG * count(*k), RANGE_DEG * count(k + 1)]).collect(),
        of_sample: of_sample.iter().map(|range| places[*range]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Directions;
    use crate::measurement::{Filters, Measurement};

    #[test]
    fn few_angles_are_groups_of_their_own() {
        // Angles as they come from radians with few digits, a group of angles on both sides of a tenth of a degree,
        // and two that are a tenth apart.
        let theta_i = [0.872_665_f64.to_degrees(), 11.249, 0.0, 50.0, 11.251, 20.0, 20.1];
        let groups = angles(&theta_i).unwrap();
        assert_eq!(groups.theta_i_deg, [0.0, 11.25, 20.0, 20.1, 50.0].map(|a| [a, a]));
        assert_eq!(groups.of_sample, [4, 1, 0, 4, 1, 2, 3]);
        assert!(groups.single_angles());
        assert_eq!(groups.samples_of(|group| group == 4), [0, 3]);
    }

    /// The groups of samples at these angles of incidence.
    fn groups_of(theta_i: &[f64]) -> IncidenceGroups {
        let directions =
            Directions::from_degrees(theta_i.iter().map(|theta| [*theta, 0.0, 10.0, 0.0])).unwrap();
        let values = vec![("f", vec![0.1; theta_i.len()])];
        let measurement = Measurement::new(directions, values).unwrap();
        Samples::select(&measurement, &Filters::default().with_max_theta_deg(90.0))
            .unwrap()
            .incidence_groups()
    }

    #[test]
    fn many_angles_are_grouped_in_ranges() {
        let theta_i: Vec<f64> =
            (0..=800).map(|k| 0.1 * f64::from(k)).filter(|a| *a < 20.0 || *a > 29.0).collect();
        assert!(angles(&theta_i).is_none());
        let groups = groups_of(&theta_i);
        // 20..25 has no samples, and 80 belongs to 75..80.
        assert_eq!(groups.len(), 15);
        assert_eq!(groups.theta_i_deg.first(), Some(&[0.0, 5.0]));
        assert_eq!(groups.theta_i_deg[4], [25.0, 30.0]);
        assert_eq!(groups.theta_i_deg.last(), Some(&[75.0, 80.0]));
        assert_eq!(groups.of_sample.first(), Some(&0));
        assert_eq!(groups.of_sample.last(), Some(&14));
        assert_eq!(groups.samples_of(|group| group == 4).len(), 10);
        assert!(!groups.single_angles());
    }

    #[test]
    fn the_horizon_is_in_the_last_range() {
        let groups = ranges(vec![0, 17, 0]);
        assert_eq!(groups.theta_i_deg, [[0.0, 5.0], [85.0, 90.0]]);
        assert_eq!(groups.of_sample, [0, 1, 0]);
    }
}
