//! Predicts where a sequence of steps would end.
//!
//! With the steps f_i at the points x_i, that point is x_k + f_k - sum_i w_i (x_k + f_k - x_i - f_i), with the weights that minimise
//! |D (f_k - sum_i w_i (f_k - f_i))| (Anderson 1965, doi:10.1145/321296.321305).

use super::inverse::svd::Svd;
use nalgebra::{DMatrix, DVector};

/// Number of past steps that are used; more rarely help.
const MEMORY: usize = 3;

/// The last points of a sequence, each with the step from there.
#[derive(Clone, Default)]
pub(crate) struct Extrapolation {
    history: Vec<(DVector<f64>, DVector<f64>)>,
}

impl Extrapolation {
    /// Forgets all points.
    pub(crate) fn clear(&mut self) {
        self.history.clear();
    }

    /// The length of `step` as a share of that of the last one, in units of D; `None` if it is the first.
    pub(crate) fn shrinking(
        &self,
        x: &DVector<f64>,
        step: &DVector<f64>,
        scale: &DVector<f64>,
    ) -> Option<f64> {
        let length = |p: &DVector<f64>| p.component_mul(scale).norm();
        // A refused step leaves the point where it was.
        let (_, last) = self.history.iter().rev().find(|(point, _)| point != x)?;
        Some(length(step) / length(last))
    }

    /// Stores the `step` at `x`, and returns the step from `x` to the point where the sequence would end, with lengths in units of
    /// `scale`, D. `None` for the first step, or if there is no such point.
    pub(crate) fn end(
        &mut self,
        x: &DVector<f64>,
        step: &DVector<f64>,
        scale: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        self.history.retain(|(point, _)| point != x);
        let past = self.history.clone();
        self.history.push((x.clone(), step.clone()));
        if self.history.len() > MEMORY {
            self.history.remove(0);
        }
        if past.is_empty() {
            return None;
        }
        let differences: Vec<_> = past.iter().map(|(_, f)| (step - f).component_mul(scale)).collect();
        let moves: Vec<_> = past.iter().map(|(point, f)| x + step - point - f).collect();
        let weights = Svd::new(DMatrix::from_columns(&differences))
            .solve(&step.component_mul(scale), f64::EPSILON.sqrt());
        let end = step - DMatrix::from_columns(&moves) * weights;
        end.iter().all(|v| v.is_finite()).then_some(end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In two dimensions, two past steps of a linear sequence tell exactly where it ends.
    #[test]
    fn linear_sequences_end_where_they_would() {
        let shrink = DMatrix::from_row_slice(2, 2, &[0.9, 0.05, 0.1, 0.6]);
        let limit = DVector::from_vec(vec![3.0, -2.0]);
        let scale = DVector::from_vec(vec![1.0, 10.0]);
        let mut x = DVector::from_vec(vec![0.0, 0.0]);
        let mut sequence = Extrapolation::default();
        let mut ends = Vec::new();
        for _ in 0..3 {
            let step = &shrink * (&x - &limit) + &limit - &x;
            ends.push(sequence.end(&x, &step, &scale).map(|step| &x + step));
            x += step;
        }
        assert!(ends[0].is_none() && (ends[1].as_ref().unwrap() - &limit).norm() > 1e-3);
        assert!((ends[2].as_ref().unwrap() - &limit).norm() < 1e-10, "{ends:?}");
    }
}
