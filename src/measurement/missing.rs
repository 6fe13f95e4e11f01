//! Values that were not measured.
//!
//! A detector that was blind at some directions says nothing about the other channels there. So a value that was not measured is NaN in
//! its own channel, and the sample keeps its other values. A sample without any value is left out. There is no other mark: whoever reads
//! values leaves NaN out of sums and counts.

use super::Measurement;
use crate::error::Error;

/// Why a sample that has no value in any channel is left out.
const NOT_MEASURED: &str = "not-measured";

impl Measurement {
    /// The number of values that were not measured, by channel.
    #[must_use]
    pub fn missing(&self) -> Vec<usize> {
        self.values.iter().map(|row| missing_in(row)).collect()
    }

    /// Leaves out the samples that have no value in any channel, counts them as `not-measured`, and returns their places; none if all
    /// samples stay.
    pub(crate) fn leave_out_empty(&mut self) -> Vec<usize> {
        // In most files the first channel has all its values, and then no sample is empty.
        let Some((first, others)) = self.values.split_first() else { return Vec::new() };
        if missing_in(first) == 0 {
            return Vec::new();
        }
        let is_empty = |(sample, value): (usize, &f64)| {
            let rest = || others.iter().filter_map(|row| row.get(sample));
            (value.is_nan() && rest().all(|value| value.is_nan())).then_some(sample)
        };
        let empty: Vec<usize> = first.iter().enumerate().filter_map(is_empty).collect();
        let mut keep = vec![true; self.directions.len()];
        for sample in &empty {
            if let Some(keep) = keep.get_mut(*sample) {
                *keep = false;
            }
        }
        self.retain(&keep, NOT_MEASURED);
        empty
    }

    /// Checks values that were computed by a model, which has a value everywhere.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the first sample at which a value is NaN or infinite.
    #[doc(hidden)]
    pub fn check_finite(&self) -> Result<(), Error> {
        let wrong = |row: &Vec<f64>| row.iter().position(|value| !value.is_finite());
        match self.values.iter().filter_map(wrong).min() {
            None => Ok(()),
            Some(sample) => {
                let found = format!("NaN or infinity at sample {}", sample + 1);
                Err(Error::invalid("model", "finite values", found))
            }
        }
    }
}

/// The number of values of a row that were not measured.
pub(super) fn missing_in(row: &[f64]) -> usize {
    row.iter().filter(|value| value.is_nan()).count()
}

/// Removes the entries at the places `empty`, which ascend, from every row.
pub(super) fn leave_out(rows: &mut [Vec<f64>], empty: &[usize]) {
    for row in rows {
        let mut place = 0..;
        row.retain(|_| place.next().is_some_and(|place| empty.binary_search(&place).is_err()));
    }
}

/// Channels that have values at the same samples.
#[derive(Debug, PartialEq)]
pub(super) struct Alike {
    /// The channels, ascending.
    pub(super) channels: Vec<usize>,
    /// The samples at which they have values, ascending; `None` for all.
    pub(super) samples: Option<Vec<usize>>,
}

/// Divides channels, whose values are in `rows`, into those that have values at the same samples; in the order of their first channels.
pub(super) fn alike(rows: &[Vec<f64>]) -> Vec<Alike> {
    let mut groups: Vec<Alike> = Vec::new();
    for (channel, row) in rows.iter().enumerate() {
        let measured = |(sample, value): (usize, &f64)| (!value.is_nan()).then_some(sample);
        let samples = (missing_in(row) > 0).then(|| row.iter().enumerate().filter_map(measured).collect());
        match groups.iter_mut().find(|group| group.samples == samples) {
            Some(group) => group.channels.push(channel),
            None => groups.push(Alike { channels: vec![channel], samples }),
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Directions;

    const NAN: f64 = f64::NAN;

    #[test]
    fn channels_are_grouped_by_the_samples_that_they_have() {
        let rows =
            [vec![1.0, 2.0, 3.0], vec![NAN, 2.0, 3.0], vec![0.0; 3], vec![NAN, 5.0, 6.0], vec![NAN; 3]];
        let group =
            |channels: &[usize], samples: Option<Vec<usize>>| Alike { channels: channels.to_vec(), samples };
        let expected =
            [group(&[0, 2], None), group(&[1, 3], Some(vec![1, 2])), group(&[4], Some(Vec::new()))];
        assert_eq!(alike(&rows), expected);
    }

    #[test]
    fn only_samples_without_any_value_are_left_out() {
        let degrees = [10.0, 20.0, 30.0, 40.0].map(|theta| [theta, 0.0, theta, 180.0]);
        let directions = Directions::from_degrees(degrees).unwrap();
        let channels = [("r", vec![NAN, 2.0, NAN, 4.0]), ("g", vec![1.0, NAN, NAN, 4.0])];
        let m = Measurement::new(directions, channels).unwrap();
        assert_eq!((m.directions.len(), m.missing(), m.total()), (3, vec![1, 1], 4));
        assert_eq!(m.dropped.get(NOT_MEASURED), Some(&1));
        assert_eq!(m.values[0][1..], [2.0, 4.0]);
        let steepest = m.directions.iter().map(|g| g.theta_i_deg().round()).collect::<Vec<_>>();
        assert_eq!(steepest, [10.0, 20.0, 40.0]);
        assert!(m.check_finite().unwrap_err().to_string().contains("at sample 1"));
        // Standard deviations belong to the samples as they were given, and a value that is missing needs none.
        let sigma = vec![vec![NAN, 0.2, NAN, 0.4], vec![0.1, NAN, 0.3, 0.4]];
        let m = m.with_sigma(sigma).unwrap();
        assert_eq!(m.sigma.unwrap()[1][2..], [0.4]);
    }
}
