//! A problem that several tests use.

use super::{LeastSquares, Linearisation};
use crate::math::count;
use nalgebra::{DMatrix, DVector};
use std::cell::Cell;

/// y = a e^(-k t) fitted to values measured at some times, all with the same weight. Counts its evaluations.
pub(super) struct Decay {
    data: Vec<(f64, f64)>,
    weight: f64,
    pub(super) evaluations: Cell<usize>,
}

impl LeastSquares for Decay {
    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        self.evaluations.set(self.evaluations.get() + 1);
        let (a, k) = (x[0], x[1]);
        let n = self.data.len();
        let residual = DVector::from_fn(n, |i, _| a * (-k * self.data[i].0).exp() - self.data[i].1);
        let jacobian = DMatrix::from_fn(n, 2, |i, column| {
            let (t, shape) = (self.data[i].0, (-k * self.data[i].0).exp());
            if column == 0 { shape } else { -a * t * shape }
        });
        Linearisation::dense(self.weight.sqrt() * jacobian, self.weight.sqrt() * residual)
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        vec![(0.0, 100.0), (0.0, 100.0)]
    }
}

/// Values that no exponential decay fits, so that residuals remain; with `step`, every `step`-th value stands for all.
pub(super) fn decays(step: usize) -> Decay {
    let at = |i: usize| (0.01 * count(i), 5.0 / (1.0 + 0.02 * count(i)).powi(2));
    Decay { data: (0..300).step_by(step).map(at).collect(), weight: count(step), evaluations: Cell::new(0) }
}
