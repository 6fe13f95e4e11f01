//! Samples grouped by their angle of incidence.
//!
//! A goniometer sets the lamp and then takes all viewing directions. A fault at one angle of incidence (alignment,
//! drift of the lamp) affects all its samples in the same way, and neighbouring samples contain almost the same
//! information. Whole angles are the parts of a measurement that come closest to being independent.

use super::Samples;
use crate::geometry::Geometry;
use crate::math::count;

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
        let theta_i = self.directions.each(Geometry::theta_i_deg);
        angles(&theta_i).unwrap_or_else(|| ranges(&theta_i))
    }
}

/// One group per angle; `None` if there are too many angles.
fn angles(theta_i: &[f64]) -> Option<IncidenceGroups> {
    // More samples never have fewer angles, so that the first ones of a dense table are enough to see that there are too many.
    distinct(theta_i.get(..FIRST_SAMPLES).unwrap_or_default())?;
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

/// One group for each range that contains samples.
fn ranges(theta_i: &[f64]) -> IncidenceGroups {
    let lows: Vec<f64> = (0..RANGES).map(|k| RANGE_DEG * count(k)).collect();
    let range = |angle: &f64| lows.partition_point(|low| low + ROUNDING_DEG < *angle).saturating_sub(1);
    let of_sample: Vec<usize> = theta_i.iter().map(range).collect();
    let mut taken: Vec<usize> = of_sample.clone();
    taken.sort_unstable();
    taken.dedup();
    let place = |range: &usize| taken.partition_point(|t| t < range);
    IncidenceGroups {
        theta_i_deg: taken.iter().map(|k| [RANGE_DEG * count(*k), RANGE_DEG * count(k + 1)]).collect(),
        of_sample: of_sample.iter().map(place).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn many_angles_are_grouped_in_ranges() {
        let theta_i: Vec<f64> =
            (0..=800).map(|k| 0.1 * f64::from(k)).filter(|a| *a < 20.0 || *a > 29.0).collect();
        assert!(angles(&theta_i).is_none());
        let groups = ranges(&theta_i);
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
        let groups = ranges(&[0.0, 90.0, 5.0]);
        assert_eq!(groups.theta_i_deg, [[0.0, 5.0], [85.0, 90.0]]);
        assert_eq!(groups.of_sample, [0, 1, 0]);
    }
}
