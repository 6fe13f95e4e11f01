//! One step of a bounded least-squares fit: the minimum of a damped linear model within a box.
//!
//! The free parameters are solved for by a QR factorisation of (J; sqrt(lambda) D), never by the normal equations,
//! which would halve the number of digits. Bounds are handled as an active set: parameters that would leave are held
//! at their bound, and are released once the model pushes them back inside.

use super::least_squares::{Linearisation, held};
use nalgebra::{DMatrix, DVector};

/// Least damping. It makes no difference, except that a rank-deficient model remains solvable.
const LAMBDA_FLOOR: f64 = 1e-16;

/// The damped linear model |J p + r|^2 + lambda |D p|^2 for p within `room`.
struct BoundedModel<'m> {
    model: &'m Linearisation,
    scale: &'m DVector<f64>,
    lambda: f64,
    room: &'m [(f64, f64)],
}

/// The point within the bounds that is closest to `x`.
pub(crate) fn within(mut x: DVector<f64>, bounds: &[(f64, f64)]) -> DVector<f64> {
    x.iter_mut().zip(bounds).for_each(|(value, (low, high))| *value = value.clamp(*low, *high));
    x
}

/// The distances that each parameter may move from `x` within the bounds, down and up.
pub(crate) fn room(x: &DVector<f64>, bounds: &[(f64, f64)]) -> Vec<(f64, f64)> {
    bounds.iter().zip(x.iter()).map(|((low, high), x)| (low - x, high - x)).collect()
}

/// The p within `room` that minimises |J p + r|^2 + lambda |D p|^2, where D is `scale`.
pub(crate) fn bounded_step(
    model: &Linearisation,
    scale: &DVector<f64>,
    lambda: f64,
    room: &[(f64, f64)],
) -> DVector<f64> {
    assert_eq!(room.len(), scale.len(), "number of parameters");
    let bounded = BoundedModel { model, scale, lambda, room };
    bounded.by_clamping().unwrap_or_else(|| bounded.by_descent())
}

impl BoundedModel<'_> {
    /// Half the gradient at `p`.
    fn slope_at(&self, p: &DVector<f64>) -> DVector<f64> {
        self.model.slope_at(p) + self.scale.component_mul(self.scale).component_mul(p) * self.lambda
    }

    /// Whether each parameter may move at step `p`.
    fn free_at(&self, p: &DVector<f64>) -> Vec<bool> {
        let slope = self.slope_at(p);
        let entries = slope.iter().zip(p.iter()).zip(self.room);
        entries.map(|((slope, p), room)| !held(*room, *p, *slope)).collect()
    }

    fn solve(&self, p: &DVector<f64>, free: &[bool]) -> DVector<f64> {
        damped_solution(self.model, self.scale, self.lambda, p, free)
    }

    /// Finds the minimum in a few solutions, however many parameters are held: all parameters that would leave stop at
    /// their bounds at once, and all that are pushed back inside are released at once. `None` if that does not settle.
    fn by_clamping(&self) -> Option<DVector<f64>> {
        /// Largest number of rounds of releasing parameters from their bounds; if it settles at all, it takes fewer.
        const ROUNDS: usize = 8;
        let mut p = DVector::zeros(self.scale.len());
        let mut free = self.free_at(&p);
        for _ in 0..ROUNDS {
            // Parameters that would leave stop at their bound, until the rest stay inside.
            while free.contains(&true) {
                let solved = self.solve(&p, &free);
                let mut outside = false;
                let entries = p.iter_mut().zip(solved.iter()).zip(&mut free).zip(self.room);
                for (((entry, value), free), &(low, high)) in entries.filter(|(((_, _), free), _)| **free) {
                    *entry = value.clamp(low, high);
                    if !(*value > low && *value < high) {
                        *free = false;
                        outside = true;
                    }
                }
                if !outside {
                    break;
                }
            }
            let wanted = self.free_at(&p);
            let mut released = false;
            for (flag, wanted) in free.iter_mut().zip(wanted) {
                released |= wanted && !*flag;
                *flag |= wanted;
            }
            if !released {
                return Some(p);
            }
        }
        None
    }

    /// Finds the minimum by steps that each lower the cost: towards the solution in the free parameters, as far as the
    /// first bound, whose parameter is then held. At a solution, the held parameter that is pushed back inside most
    /// strongly is released.
    fn by_descent(&self) -> DVector<f64> {
        let n = self.scale.len();
        let mut p = DVector::zeros(n);
        let mut free = self.free_at(&p);
        // Every parameter is held and released a few times at most; the limit only ends what rounding errors would
        // prolong.
        for _ in 0..10 * n {
            let mut direction = self.solve(&p, &free) - &p;
            let held = direction.iter_mut().zip(&free).filter(|(_, free)| !**free);
            held.for_each(|(entry, _)| *entry = 0.0);
            // The fraction of the way to the first bound.
            let mut share = 1.0;
            let mut blocking = None;
            for (j, ((d, p), &(low, high))) in direction.iter().zip(p.iter()).zip(self.room).enumerate() {
                let reach = if *d > 0.0 { (high - p) / d } else { (low - p) / d };
                if free[j] && *d != 0.0 && reach < share {
                    share = reach.max(0.0);
                    blocking = Some((j, if *d > 0.0 { high } else { low }));
                }
            }
            p.axpy(share, &direction, 1.0);
            if let Some((j, bound)) = blocking {
                p[j] = bound;
                free[j] = false;
                continue;
            }
            let slope = self.slope_at(&p);
            let pull = |j: usize| slope[j].abs() / self.scale[j];
            let wanted = self.free_at(&p);
            let candidates = (0..n).filter(|j| !free[*j] && wanted[*j]);
            let Some(j) = candidates.max_by(|a, b| pull(*a).total_cmp(&pull(*b))) else { break };
            free[j] = true;
        }
        p
    }
}

/// A block's own parameters x, solved for as a function of the shared ones s: R x = right - coupling s.
struct Eliminated {
    own: Vec<usize>,
    /// R.
    factor: DMatrix<f64>,
    /// The right-hand side, then one column per shared parameter of the block.
    coupling: DMatrix<f64>,
    shared: Vec<usize>,
}

/// The damped least-squares solution in the parameters that are `free`; the others are held at their value in `p`.
///
/// Parameters that only one block of rows involves are eliminated there by an orthogonal transformation, which leaves
/// rows in the shared parameters only. The shared parameters are then solved for together, and the eliminated ones
/// follow. With one block per channel, the cost grows with the number of channels, not with its cube.
fn damped_solution(
    model: &Linearisation,
    scale: &DVector<f64>,
    lambda: f64,
    p: &DVector<f64>,
    free: &[bool],
) -> DVector<f64> {
    let n = scale.len();
    let damping = lambda.max(LAMBDA_FLOOR).sqrt();
    let mut held = p.clone();
    held.iter_mut().zip(free).filter(|(_, free)| **free).for_each(|(value, _)| *value = 0.0);

    let uses = model.uses(n);
    // Free parameters that no row involves stay where they are, because only damping acts on them.
    let shared: Vec<usize> = (0..n).filter(|j| free[*j] && uses[*j] > 1).collect();

    let mut eliminated: Vec<Eliminated> = Vec::with_capacity(model.blocks.len());
    let mut remainders: Vec<(DMatrix<f64>, Vec<usize>)> = Vec::with_capacity(model.blocks.len());
    for rows in &model.blocks {
        let pick = |own: bool| -> Vec<usize> {
            rows.columns.iter().copied().filter(|j| free[*j] && (uses[*j] == 1) == own).collect()
        };
        let (own, others) = (pick(true), pick(false));
        let (height, width) = (rows.jacobian.nrows(), own.len());
        // The right-hand side and the shared columns, with zeros in the rows that damp the own parameters. The columns
        // are scaled, so that the solution does not depend on the parameters' units.
        let mut coupling = DMatrix::zeros(height + width, 1 + others.len());
        let fixed = rows.columns.iter().map(|j| held[*j]);
        let fixed = DVector::from_iterator(rows.columns.len(), fixed);
        coupling.view_mut((0, 0), (height, 1)).copy_from(&-(&rows.jacobian * fixed + &rows.residual));
        coupling.view_mut((0, 1), (height, others.len())).copy_from(&rows.scaled(&others, scale));
        let mut stacked = DMatrix::zeros(height + width, width);
        stacked.rows_mut(0, height).copy_from(&rows.scaled(&own, scale));
        stacked.rows_mut(height, width).fill_diagonal(damping);
        let qr = stacked.qr();
        qr.q_tr_mul(&mut coupling);
        remainders.push((coupling.rows(width, height).into_owned(), others.clone()));
        let coupling = coupling.rows(0, width).into_owned();
        eliminated.push(Eliminated { own, factor: qr.r(), coupling, shared: others });
    }

    // The remaining rows, all in the shared parameters.
    let mut position = vec![usize::MAX; n];
    shared.iter().enumerate().for_each(|(k, j)| position[*j] = k);
    let height: usize = remainders.iter().map(|(rows, _)| rows.nrows()).sum();
    let mut stacked = DMatrix::zeros(height + shared.len(), shared.len());
    let mut right = DVector::zeros(height + shared.len());
    let mut first = 0;
    for (rows, others) in &remainders {
        right.rows_mut(first, rows.nrows()).copy_from(&rows.column(0));
        for (column, k) in rows.column_iter().skip(1).zip(others.iter().map(|j| position[*j])) {
            stacked.view_mut((first, k), (rows.nrows(), 1)).copy_from(&column);
        }
        first += rows.nrows();
    }
    stacked.rows_mut(height, shared.len()).fill_diagonal(damping);
    let qr = stacked.qr();
    qr.q_tr_mul(&mut right);
    let failed = |count: usize| DVector::from_element(count, f64::NAN);
    let solved = qr.r().solve_upper_triangular(&right.rows(0, shared.len()).into_owned());
    let common = solved.unwrap_or_else(|| failed(shared.len()));

    let mut solution = DVector::zeros(n);
    for (j, value) in shared.iter().zip(common.iter()) {
        solution[*j] = value / scale[*j];
    }
    for block in &eliminated {
        let mut right = block.coupling.column(0).into_owned();
        for (column, j) in block.coupling.column_iter().skip(1).zip(&block.shared) {
            right.axpy(-common[position[*j]], &column, 1.0);
        }
        let own = block.factor.solve_upper_triangular(&right).unwrap_or_else(|| failed(block.own.len()));
        for (j, value) in block.own.iter().zip(own.iter()) {
            solution[*j] = value / scale[*j];
        }
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounded_steps_are_minima_of_the_model() {
        // Nearly equal columns push each other through their bounds and back.
        let n = 9;
        let mut state = 1_u64;
        let mut random = || {
            // Knuth's linear congruential generator (MMIX).
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            f64::from(u32::try_from(state >> 32).unwrap()) / f64::from(u32::MAX) - 0.5
        };
        let mut by_descent = 0;
        for trial in 0..400 {
            let likeness = f64::from(trial % 20);
            let common: Vec<f64> = (0..12).map(|_| random()).collect();
            let jacobian = DMatrix::from_fn(12, n, |i, _| likeness * common[i] + random());
            let residual = DVector::from_fn(12, |_, _| random());
            let model = Linearisation::dense(jacobian, residual);
            let room: Vec<(f64, f64)> =
                (0..n)
                    .map(|j| {
                        if j % 3 == 0 {
                            (0.0, 0.5 + random())
                        } else {
                            (random().min(0.0), random().max(0.0))
                        }
                    })
                    .collect();
            let scale = model.column_lengths(n);
            let bounded = BoundedModel { model: &model, scale: &scale, lambda: 1e-6, room: &room };
            by_descent += i32::from(bounded.by_clamping().is_none());
            for p in [bounded_step(&model, &scale, 1e-6, &room), bounded.by_descent()] {
                let slope = bounded.slope_at(&p);
                for (j, (p, &(low, high))) in p.iter().zip(&room).enumerate() {
                    assert!(*p >= low && *p <= high, "trial {trial}: {p} outside {low}..{high}");
                    let rest = if held((low, high), *p, slope[j]) { 0.0 } else { slope[j].abs() / scale[j] };
                    assert!(rest < 1e-9, "trial {trial}: slope {rest:e} left along {j}");
                }
            }
        }
        println!("clamping went round in circles in {by_descent} of 400");
    }
}
