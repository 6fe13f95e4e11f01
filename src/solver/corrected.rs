//! A problem on part of the data that has the gradient of the whole.

use super::least_squares::{LeastSquares, Linearisation};
use nalgebra::DVector;

/// The cost on part of the samples plus a linear function that gives it the gradient of the whole at one point.
pub(crate) struct Corrected<'p, P> {
    part: &'p P,
    /// Half the difference between the gradient of the whole and that of the part.
    slope: DVector<f64>,
    /// The point at which the gradients were computed.
    origin: DVector<f64>,
    /// Lengths of the part's columns at that point.
    scale: DVector<f64>,
}

/// Size of the entries that carry the correction, relative to the column. They change the column's curvature by a
/// relative error of the square of this.
const CORRECTION_SHARE: f64 = 1e-4;

impl<'p, P: LeastSquares> Corrected<'p, P> {
    pub(crate) fn new(part: &'p P, whole: &Linearisation, origin: &DVector<f64>) -> Self {
        let n = origin.len();
        let of_part = part.linearise(origin);
        let nowhere = DVector::zeros(n);
        Self {
            part,
            slope: whole.slope_at(&nowhere) - of_part.slope_at(&nowhere),
            origin: origin.clone(),
            scale: of_part.column_lengths(n),
        }
    }
}

impl<P: LeastSquares> LeastSquares for Corrected<'_, P> {
    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        assert_eq!(x.len(), self.origin.len(), "number of parameters");
        let mut model = self.part.linearise(x);
        model.cost += 2.0 * self.slope.dot(&(x - &self.origin));
        // A row with the entry e and the residual s/e has the gradient s. It is added to a block that already involves
        // the parameter, so that the blocks stay as independent as they were.
        let mut carried = vec![false; x.len()];
        for rows in &mut model.blocks {
            for (local, column) in rows.columns.iter().copied().enumerate() {
                let entry = CORRECTION_SHARE * self.scale[column];
                if !std::mem::replace(&mut carried[column], true) && entry > 0.0 {
                    let last = rows.residual.len();
                    rows.jacobian = std::mem::take(&mut rows.jacobian).insert_row(last, 0.0);
                    rows.residual =
                        std::mem::take(&mut rows.residual).insert_row(last, self.slope[column] / entry);
                    rows.jacobian[(last, local)] = entry;
                }
            }
        }
        model
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.part.bounds()
    }

    fn cost_floor(&self) -> f64 {
        self.part.cost_floor()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::test_problems::{Decay, decays};
    use crate::solver::{Limits, Tolerances, minimise};
    use approx::assert_relative_eq;

    #[test]
    fn a_correction_carries_the_gradient_of_the_whole() {
        let (whole, part) = (decays(1), decays(7));
        let x = DVector::from_vec(vec![4.0, 1.3]);
        let model = whole.linearise(&x);
        let corrected = Corrected::new(&part, &model, &x);
        let (wanted, found) =
            (model.slope_at(&DVector::zeros(2)), corrected.linearise(&x).slope_at(&DVector::zeros(2)));
        assert_relative_eq!(wanted, found, max_relative = 1e-10);
        // The cost has the same gradient as the rows at other points too.
        let (there, step) = (DVector::from_vec(vec![4.2, 1.2]), 1e-5);
        let slope = corrected.linearise(&there).slope_at(&DVector::zeros(2));
        for axis in 0..2 {
            let cost = |shift: f64| {
                let mut moved = there.clone();
                moved[axis] += shift;
                corrected.linearise(&moved).cost
            };
            assert_relative_eq!(
                (cost(step) - cost(-step)) / (2.0 * step),
                2.0 * slope[axis],
                max_relative = 1e-6
            );
        }
    }

    #[test]
    fn corrections_lead_from_the_minimum_of_a_part_to_that_of_the_whole() {
        let (whole, part) = (decays(1), decays(3));
        let start = DVector::from_vec(vec![1.0, 1.0]);
        let solve = |problem: &Decay| {
            minimise(problem, start.clone(), Tolerances::default(), Limits::default()).unwrap().x
        };
        let tight = Tolerances { step: 1e-11, cost: 1e-14, gradient: 1e-14, refinements: 0 };
        let (wanted, mut x) = (solve(&whole), solve(&part));
        let mut distance = (&x - &wanted).norm();
        assert!(distance > 1e-3);
        for _ in 0..3 {
            let corrected = Corrected::new(&part, &whole.linearise(&x), &x);
            x = minimise(&corrected, x.clone(), tight, Limits::default()).unwrap().x;
            let closer = (&x - &wanted).norm();
            assert!(closer < 0.1 * distance, "{closer:e} after {distance:e}");
            distance = closer;
        }
    }
}
