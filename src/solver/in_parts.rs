//! A problem in other coordinates: two parts of a strength instead of the strength and a share of it.
//!
//! The strength s of a lobe and its reflectance p at normal incidence enter a model as the parts a = s p and b = s (1 - p). In s and p
//! the model is bilinear, with a valley that bends, and where s is 0 the derivative by p vanishes. In a and b it is linear. Both are at
//! least 0, so bounds remain bounds.

use super::least_squares::{LeastSquares, Linearisation};
use super::levenberg_marquardt::minimise;
use super::termination::{Limits, Solution, Tolerances};
use crate::error::Error;
use nalgebra::DVector;

/// A problem in which some pairs of parameters, a strength and a share between 0 and 1, are replaced by two parts.
pub(crate) struct InParts<'p, P> {
    problem: &'p P,
    /// The indices of the strength, and of the share, of each pair.
    pairs: Vec<(usize, usize)>,
}

/// Minimises the sum of squares of `problem` as [`minimise`] does, with `pairs` of parameters in parts.
pub(crate) fn minimise_in_parts(
    problem: &impl LeastSquares,
    pairs: &[(usize, usize)],
    start: &DVector<f64>,
    tolerances: Tolerances,
    limits: Limits,
) -> Result<Solution, Error> {
    let parts = InParts::new(problem, pairs);
    minimise(&parts, parts.parts(start), tolerances, limits).map(|solution| parts.solution(solution))
}

/// A strength below this share of its upper bound counts as this much where derivatives are taken: at 0 the share has none.
const LEAST_STRENGTH: f64 = 1e-12;

impl<'p, P: LeastSquares> InParts<'p, P> {
    /// The problem with those of `pairs` replaced whose bounds are those of a strength and a share: from 0, and from 0 to 1.
    pub(crate) fn new(problem: &'p P, pairs: &[(usize, usize)]) -> Self {
        let bounds = problem.bounds();
        let suits =
            |(strength, share): &&(usize, usize)| bounds[*strength].0 == 0.0 && bounds[*share] == (0.0, 1.0);
        Self { problem, pairs: pairs.iter().filter(suits).copied().collect() }
    }

    /// The parts at a point of the problem itself.
    pub(crate) fn parts(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut y = x.clone();
        for (strength, share) in &self.pairs {
            let (s, p) = (x[*strength], x[*share]);
            (y[*share], y[*strength]) = (s * p, s * (1.0 - p));
        }
        y
    }

    /// The point of the problem itself at these parts. Where both are 0 the share is that of the first part alone.
    pub(crate) fn whole(&self, y: &DVector<f64>) -> DVector<f64> {
        let mut x = y.clone();
        let bounds = self.problem.bounds();
        for (strength, share) in &self.pairs {
            let (a, b) = (y[*share], y[*strength]);
            let s = a + b;
            x[*strength] = s.min(bounds[*strength].1);
            x[*share] = if s > 0.0 { (a / s).clamp(0.0, 1.0) } else { 1.0 };
        }
        x
    }

    /// A solution in parts as one of the problem itself.
    pub(crate) fn solution(&self, mut solution: Solution) -> Solution {
        let x = self.whole(&solution.x);
        for (strength, share) in &self.pairs {
            let (s, p) = (x[*strength], x[*share]);
            // df/ds = p df/da + (1 - p) df/db, and df/dp = s (df/da - df/db).
            combine(&mut solution.linearisation, (*strength, *share), [[1.0 - p, p], [-s, s]]);
        }
        Solution { x, ..solution }
    }
}

impl<P: LeastSquares> LeastSquares for InParts<'_, P> {
    fn linearise(&self, y: &DVector<f64>) -> Linearisation {
        let bounds = self.problem.bounds();
        let mut x = self.whole(y);
        for (strength, share) in &self.pairs {
            let least = LEAST_STRENGTH * bounds[*strength].1.min(1.0);
            x[*strength] = x[*strength].max(least);
            // Close to 0 either part may grow.
            if x[*strength] <= least {
                x[*share] = 0.5;
            }
        }
        let mut model = self.problem.linearise(&x);
        for (strength, share) in &self.pairs {
            let (s, p) = (x[*strength], x[*share]);
            // df/db = df/ds - p/s df/dp, and df/da = df/ds + (1 - p)/s df/dp.
            combine(&mut model, (*strength, *share), [[1.0, -p / s], [1.0, (1.0 - p) / s]]);
        }
        model
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        let mut bounds = self.problem.bounds();
        for (strength, share) in &self.pairs {
            bounds[*share] = bounds[*strength];
        }
        bounds
    }

    fn cost_floor(&self) -> f64 {
        self.problem.cost_floor()
    }
}

/// Replaces the columns of two parameters by the combinations whose factors are in the rows of `factors`.
fn combine(model: &mut Linearisation, (first, second): (usize, usize), factors: [[f64; 2]; 2]) {
    for rows in &mut model.blocks {
        let place = |parameter: usize| rows.columns.iter().position(|column| *column == parameter);
        let (Some(i), Some(j)) = (place(first), place(second)) else { continue };
        for row in 0..rows.jacobian.nrows() {
            let (u, v) = (rows.jacobian[(row, i)], rows.jacobian[(row, j)]);
            let [of_first, of_second] = factors.map(|[a, b]| a * u + b * v);
            (rows.jacobian[(row, i)], rows.jacobian[(row, j)]) = (of_first, of_second);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::DMatrix;

    /// f = s (p u + (1 - p) v) with the two rows u and v.
    struct Bilinear {
        u: DVector<f64>,
        v: DVector<f64>,
        measured: DVector<f64>,
    }

    impl LeastSquares for Bilinear {
        fn linearise(&self, x: &DVector<f64>) -> Linearisation {
            let (s, p) = (x[0], x[1]);
            let residual = &self.u * (s * p) + &self.v * (s * (1.0 - p)) - &self.measured;
            let of_s = &self.u * p + &self.v * (1.0 - p);
            Linearisation::dense(DMatrix::from_columns(&[of_s, (&self.u - &self.v) * s]), residual)
        }

        fn bounds(&self) -> Vec<(f64, f64)> {
            vec![(0.0, 1000.0), (0.0, 1.0)]
        }
    }

    fn bilinear(s: f64, p: f64) -> Bilinear {
        let u = DVector::from_fn(9, |i, _| f64::from(u32::try_from(i).unwrap()).cos());
        let v = DVector::from_fn(9, |i, _| 0.3 + 0.1 * f64::from(u32::try_from(i).unwrap()).sin());
        let measured = &u * (s * p) + &v * (s * (1.0 - p));
        Bilinear { u, v, measured }
    }

    /// In parts the problem is linear: one step finds its minimum, from anywhere, also from where the strength is 0.
    #[test]
    fn one_step_finds_the_minimum() {
        let limits = || Limits::iterations(20);
        for (s, p) in [(2.0, 0.7), (0.5, 0.0), (0.5, 1.0)] {
            let problem = bilinear(s, p);
            for start in [[1.0, 0.04], [0.0, 0.0], [0.0, 1.0], [900.0, 0.5]] {
                let start = DVector::from_row_slice(&start);
                let found =
                    minimise_in_parts(&problem, &[(0, 1)], &start, Tolerances::default(), limits()).unwrap();
                assert_relative_eq!(found.x[0], s, max_relative = 1e-9);
                assert_relative_eq!(found.x[1], p, epsilon = 1e-9);
            }
        }
    }

    /// The linear model of a solution is that of the problem itself.
    #[test]
    fn derivatives_are_those_of_the_problem() {
        let problem = bilinear(2.0, 0.7);
        let parts = InParts::new(&problem, &[(0, 1)]);
        let x = DVector::from_row_slice(&[1.5, 0.3]);
        let y = parts.parts(&x);
        assert_relative_eq!(parts.whole(&y), x, max_relative = 1e-14);
        let linearisation = parts.linearise(&y);
        // By differences in the parts.
        let cost = |y: &DVector<f64>| parts.linearise(y).cost;
        for axis in 0..2 {
            let mut there = y.clone();
            there[axis] += 1e-6;
            let up = cost(&there);
            there[axis] -= 2e-6;
            let slope = 2.0 * linearisation.slope_at(&DVector::zeros(2))[axis];
            assert_relative_eq!((up - cost(&there)) / 2e-6, slope, max_relative = 1e-6);
        }
        let solution = Solution {
            x: y,
            cost: linearisation.cost,
            linearisation,
            termination: crate::solver::Termination::ConvergedCost,
            iterations: 0,
            evaluations: 0,
        };
        let back = parts.solution(solution);
        assert_relative_eq!(
            back.linearisation.matrix(2),
            problem.linearise(&x).matrix(2),
            max_relative = 1e-12
        );
    }

    /// Other bounds than those of a strength and a share leave a pair as it is.
    #[test]
    fn other_bounds_are_left_alone() {
        struct Bounded(Bilinear);
        impl LeastSquares for Bounded {
            fn linearise(&self, x: &DVector<f64>) -> Linearisation {
                self.0.linearise(x)
            }
            fn bounds(&self) -> Vec<(f64, f64)> {
                vec![(0.0, 1000.0), (0.02, 0.08)]
            }
        }
        let problem = Bounded(bilinear(1.0, 0.05));
        let parts = InParts::new(&problem, &[(0, 1)]);
        let x = DVector::from_row_slice(&[1.5, 0.05]);
        assert_eq!(parts.parts(&x), x);
        assert_eq!(parts.bounds(), problem.bounds());
    }
}
