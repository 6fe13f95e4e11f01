//! Leaves out samples of a measurement.

use super::Measurement;
use crate::geometry::gather;

impl Measurement {
    /// Leaves out the samples for which `keep` is false, and counts them under `reason`. There is one entry per sample.
    pub(crate) fn retain(&mut self, keep: &[bool], reason: &'static str) {
        let left_out = keep.iter().filter(|keep| !**keep).count();
        if left_out == 0 {
            return;
        }
        let kept: Vec<usize> = keep.iter().enumerate().filter(|(_, keep)| **keep).map(|(k, _)| k).collect();
        let rows = |rows: &Vec<Vec<f64>>| rows.iter().map(|row| gather(row, &kept)).collect();
        self.directions = self.directions.select(&kept);
        self.values = rows(&self.values);
        self.sigma = self.sigma.as_ref().map(rows);
        *self.dropped.entry(reason).or_default() += left_out;
    }
}
