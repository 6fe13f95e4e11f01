//! Other solvers for the final fit, from argmin, to measure the benefit of Levenberg-Marquardt.
//!
//! They know neither least squares nor bounds: they see only one number, the cost, and for L-BFGS its gradient.
//!
//! - `l-bfgs` (Liu and Nocedal 1989, doi:10.1007/BF01589116) with the line search of More and Thuente 1994
//!   (doi:10.1145/192115.192132), on variables u with x = lo + (hi - lo) (1 + sin u)/2, which cannot leave
//!   the bounds.
//! - `nelder-mead` (Nelder and Mead 1965, doi:10.1093/comjnl/7.4.308) on the same variables.
//! - `particle-swarm` (Kennedy and Eberhart 1995, doi:10.1109/ICNN.1995.488968): 40 particles in the box of
//!   the bounds, one of them at the start of the fit. It has no test of convergence: it ends at the
//!   limit of iterations.
//!
//! The result is the best point that the solver evaluated, so none makes the start worse.

use super::least_squares::{LeastSquares, Linearisation};
use super::termination::{Limits, Observer, Solution, Termination};
use crate::error::Error;
use argmin::core::observers::{Observe, ObserverMode};
use argmin::core::{
    CostFunction, Executor, Gradient, IterState, KV, LineSearch, PopulationState, Problem, Solver, State,
    TerminationReason, TerminationStatus,
};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::neldermead::NelderMead;
use argmin::solver::particleswarm::{Particle, ParticleSwarm};
use argmin::solver::quasinewton::LBFGS;
use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::cell::RefCell;

/// The choice of argmin's solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ArgminSolver {
    /// Limited-memory quasi-Newton method, which uses only the gradient.
    LBfgs,
    /// Simplex method, which uses no derivatives.
    NelderMead,
    /// Random search, which uses no derivatives.
    ParticleSwarm,
}

impl ArgminSolver {
    /// Number of iterations, for `n` parameters, that take about as long as `wanted` iterations of
    /// Levenberg-Marquardt.
    fn iterations(self, wanted: u64, n: usize) -> u64 {
        match self {
            Self::ParticleSwarm => wanted,
            Self::LBfgs => wanted.saturating_mul(10),
            Self::NelderMead => wanted.saturating_mul(u64::try_from(n + 1).unwrap_or(u64::MAX)),
        }
    }
}

/// L-BFGS ends if the cost changes by less than this fraction of the start's cost. Nelder-Mead ends if the standard
/// deviation of the simplex's costs is below it.
const COST_TOLERANCE: f64 = 1e-13;
/// L-BFGS ends if the gradient of cost/start cost in the variables u is shorter than this.
const GRADIENT_TOLERANCE: f64 = 1e-9;
/// If the line search fails although the residuals are orthogonal to every parameter's effect to within this cosine,
/// it failed because of rounding at a minimum.
const COSINE_TOLERANCE: f64 = 1e-6;
/// Number of pairs of steps and gradients that L-BFGS keeps.
const MEMORY: usize = 10;
/// Largest number of trials of one line search; few take more than five.
const LINE_SEARCH_ITERATIONS: u64 = 40;
/// Edge length of the first simplex in the variables u, which span pi between two bounds.
const SIMPLEX_EDGE: f64 = 0.1;
/// Number of particles of the swarm.
const PARTICLES: usize = 40;
/// At a bound dx/du is 0 and no gradient leads away, so a start at a bound is moved inside by this fraction of the
/// range.
const START_INSIDE: f64 = 1e-6;
/// A result this close to a bound, as a fraction of the range, is also tried at the bound, because u approaches it
/// only slowly.
const NEAR_BOUND: f64 = 1e-5;
/// Makes the swarm's random numbers differ from the other draws with the same seed.
const SWARM_STREAM: u64 = 0x0073_7761_726d;

/// A point in the variables of argmin's solvers, or a gradient there.
type Point = Vec<f64>;
type PointState = IterState<Point, Point, (), (), (), f64>;
type SimplexState = IterState<Point, (), (), (), (), f64>;
type Swarm = PopulationState<Particle<Point, f64>, f64>;

/// Minimises a problem from `start`, which has at least one parameter, with one of argmin's own solvers.
///
/// # Errors
/// [`Error::Optimiser`] if argmin itself fails, which is a bug.
pub(super) fn minimise_by_argmin<P: LeastSquares>(
    kind: ArgminSolver,
    problem: &P,
    start: &DVector<f64>,
    limits: Limits,
    seed: u64,
) -> Result<Solution, Error> {
    let bounds = problem.bounds();
    let n = start.len();
    let inside = start.iter().zip(&bounds).map(|(x, &(low, high))| x.clamp(low, high));
    let first = DVector::from_iterator(n, inside);
    let model = problem.linearise(&first);
    let end = |(x, model): (DVector<f64>, Linearisation), termination, iterations, evaluations| Solution {
        x,
        cost: model.cost,
        linearisation: model,
        termination,
        iterations,
        evaluations,
    };
    if !model.cost.is_finite() {
        return Ok(end((first, model), Termination::Invalid, 0, 1));
    }
    if model.cost <= problem.cost_floor() {
        return Ok(end((first, model), Termination::ConvergedGradient, 0, 1));
    }
    let swarm = kind == ArgminSolver::ParticleSwarm;
    let plain = PlainCost {
        problem,
        axes: bounds.iter().map(|b| Axis::new(*b, swarm)).collect(),
        scale: model.cost,
        record: RefCell::new(Record { last: None, best: (first.clone(), model), evaluations: 1 }),
    };
    let observer = limits.observer.clone().map(|observer| ScaledObserver { observer, scale: plain.scale });
    let limits = Limits { iterations: kind.iterations(limits.iterations, n), ..limits };
    let (ended, iterations) = match kind {
        ArgminSolver::LBfgs => plain.l_bfgs(&first, limits, observer),
        ArgminSolver::NelderMead => plain.nelder_mead(&first, limits, observer),
        ArgminSolver::ParticleSwarm => plain.particle_swarm(&first, limits, observer, seed),
    }
    .map_err(|error| Error::Optimiser(error.to_string()))?;
    plain.try_bounds(&bounds);
    let Record { best, evaluations, .. } = plain.record.into_inner();
    let termination = match ended {
        Ended::With(termination) => termination,
        Ended::LineSearchFailed if best.1.largest_cosine(&best.0, &bounds) <= COSINE_TOLERANCE => {
            Termination::ConvergedGradient
        }
        Ended::LineSearchFailed => Termination::Stalled,
    };
    Ok(end(best, termination, iterations, evaluations))
}

/// How a solver ended.
enum Ended {
    With(Termination),
    LineSearchFailed,
}

/// A solver that also ends when it is stopped from outside.
#[derive(Clone)]
struct Watched<S> {
    solver: S,
    limits: Limits,
    /// Why it was stopped; `None` until it is.
    stopped: Option<Termination>,
}

impl<S> Watched<S> {
    fn new(solver: S, limits: Limits) -> Self {
        Self { solver, limits, stopped: None }
    }
}

impl<O, I: State, S: Solver<O, I>> Solver<O, I> for Watched<S> {
    fn name(&self) -> &str {
        self.solver.name()
    }

    fn init(&mut self, problem: &mut Problem<O>, state: I) -> Result<(I, Option<KV>), argmin::core::Error> {
        self.solver.init(problem, state)
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<O>,
        state: I,
    ) -> Result<(I, Option<KV>), argmin::core::Error> {
        self.solver.next_iter(problem, state)
    }

    fn terminate(&mut self, state: &I) -> TerminationStatus {
        let own = self.solver.terminate(state);
        if own.terminated() {
            return own;
        }
        self.stopped = self.limits.reason(state.get_iter());
        match self.stopped {
            Some(reason) => {
                TerminationStatus::Terminated(TerminationReason::SolverExit(reason.name().to_owned()))
            }
            None => TerminationStatus::NotTerminated,
        }
    }
}

/// A line search that fails if it is stopped or takes too long.
///
/// If it only ended, it would leave no point behind, which argmin's quasi-Newton methods do not expect.
#[derive(Clone)]
struct Capped<S> {
    search: S,
    limits: Limits,
}

impl<O, I: State, S: Solver<O, I>> Solver<O, I> for Capped<S> {
    fn name(&self) -> &str {
        self.search.name()
    }

    fn init(&mut self, problem: &mut Problem<O>, state: I) -> Result<(I, Option<KV>), argmin::core::Error> {
        self.search.init(problem, state)
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<O>,
        state: I,
    ) -> Result<(I, Option<KV>), argmin::core::Error> {
        match self.limits.reason(state.get_iter()) {
            Some(reason) => Err(argmin::core::Error::msg(reason.name())),
            None => self.search.next_iter(problem, state),
        }
    }

    fn terminate(&mut self, state: &I) -> TerminationStatus {
        self.search.terminate(state)
    }
}

impl<S: LineSearch<Point, f64>> LineSearch<Point, f64> for Capped<S> {
    fn search_direction(&mut self, direction: Point) {
        self.search.search_direction(direction);
    }

    fn initial_step_length(&mut self, step: f64) -> Result<(), argmin::core::Error> {
        self.search.initial_step_length(step)
    }
}

/// Passes each iteration to an observer, with the cost in the problem's own unit.
struct ScaledObserver {
    observer: Observer,
    scale: f64,
}

impl<I: State<Float = f64>> Observe<I> for ScaledObserver {
    fn observe_iter(&mut self, state: &I, _: &KV) -> Result<(), argmin::core::Error> {
        (self.observer)(state.get_iter(), state.get_cost() * self.scale);
        Ok(())
    }
}

/// The relation between a variable u of a solver and a parameter x.
#[derive(Clone, Copy)]
enum Axis {
    /// x = lo + (hi - lo) (1 + sin u)/2.
    Sine(f64, f64),
    /// x = u, kept within bounds that may be infinite.
    Plain(f64, f64),
}

impl Axis {
    fn new((low, high): (f64, f64), plain: bool) -> Self {
        if plain || !(low.is_finite() && high.is_finite()) {
            Self::Plain(low, high)
        } else {
            Self::Sine(low, high)
        }
    }

    /// x and dx/du.
    fn at(self, u: f64) -> (f64, f64) {
        match self {
            Self::Plain(low, high) => (u.clamp(low, high), if u > low && u < high { 1.0 } else { 0.0 }),
            Self::Sine(low, high) => {
                let half = (high - low) / 2.0;
                ((low + half * (1.0 + u.sin())).clamp(low, high), half * u.cos())
            }
        }
    }

    /// The variable of a parameter at the start, moved a little inside its bounds.
    fn start(self, x: f64) -> f64 {
        match self {
            Self::Plain(..) => x,
            Self::Sine(low, high) => {
                let share = ((x - low) / (high - low)).clamp(START_INSIDE, 1.0 - START_INSIDE);
                (2.0 * share - 1.0).asin()
            }
        }
    }
}

/// The cost as argmin's solvers see it: a function of the variables u, relative to the cost at the start.
struct PlainCost<'p, P> {
    problem: &'p P,
    axes: Vec<Axis>,
    scale: f64,
    record: RefCell<Record>,
}

/// The points evaluated so far.
struct Record {
    /// The last point, because the gradient is requested after the cost.
    last: Option<(Point, Linearisation)>,
    best: (DVector<f64>, Linearisation),
    evaluations: u64,
}

impl<P: LeastSquares> PlainCost<'_, P> {
    /// Evaluates the problem at the parameters themselves, and stores the best point.
    fn linearise(&self, x: DVector<f64>) -> Linearisation {
        let model = self.problem.linearise(&x);
        let mut record = self.record.borrow_mut();
        record.evaluations += 1;
        if model.cost < record.best.1.cost {
            record.best = (x, model.clone());
        }
        model
    }

    /// The cost at `u`, and its gradient if requested.
    fn evaluate(&self, u: &[f64], gradient: bool) -> (f64, Point) {
        let known = self.record.borrow_mut().last.take().filter(|(at, _)| at == u);
        let (x, slopes): (Point, Point) = self.axes.iter().zip(u).map(|(axis, u)| axis.at(*u)).unzip();
        let n = x.len();
        let model = known.map_or_else(|| self.linearise(DVector::from_vec(x)), |(_, model)| model);
        // A cost that is not a number counts as worse than any other.
        let cost = if model.cost.is_finite() { model.cost / self.scale } else { f64::INFINITY };
        let mut g = Point::new();
        if gradient {
            let half = model.slope_at(&DVector::zeros(n));
            g.extend(half.iter().zip(slopes).map(|(half, slope)| 2.0 * half * slope / self.scale));
        }
        self.record.borrow_mut().last = Some((u.to_vec(), model));
        (cost, g)
    }

    fn start(&self, x: &DVector<f64>) -> Point {
        self.axes.iter().zip(x.iter()).map(|(axis, x)| axis.start(*x)).collect()
    }

    /// Moves parameters that ended next to a bound onto it, if that is no worse.
    fn try_bounds(&self, bounds: &[(f64, f64)]) {
        let (mut x, cost) = {
            let record = self.record.borrow();
            (record.best.0.clone(), record.best.1.cost)
        };
        let mut moved = false;
        for (x, &(low, high)) in x.iter_mut().zip(bounds) {
            let near = NEAR_BOUND * (high - low);
            for bound in [low, high] {
                if near.is_finite() && *x != bound && (*x - bound).abs() <= near {
                    *x = bound;
                    moved = true;
                }
            }
        }
        if moved {
            let model = self.problem.linearise(&x);
            let mut record = self.record.borrow_mut();
            record.evaluations += 1;
            if model.cost <= cost {
                record.best = (x, model);
            }
        }
    }

    fn l_bfgs(
        &self,
        start: &DVector<f64>,
        limits: Limits,
        observer: Option<ScaledObserver>,
    ) -> Result<(Ended, u64), argmin::core::Error> {
        let search: MoreThuenteLineSearch<Point, Point, f64> = MoreThuenteLineSearch::new();
        let search =
            Capped { search, limits: Limits { iterations: LINE_SEARCH_ITERATIONS, ..limits.clone() } };
        let solver: LBFGS<_, Point, Point, f64> = LBFGS::new(search, MEMORY)
            .with_tolerance_grad(GRADIENT_TOLERANCE)?
            .with_tolerance_cost(COST_TOLERANCE)?;
        let start = self.start(start);
        let mut executor = Executor::new(self, Watched::new(solver, limits))
            .configure(|state: PointState| state.param(start))
            .ctrlc(false)
            .timer(false);
        if let Some(observer) = observer {
            executor = executor.add_observer(observer, ObserverMode::Always);
        }
        let result = executor.run()?;
        let state = result.state;
        let ended = match (state.get_termination_reason(), result.solver.stopped) {
            (Some(TerminationReason::SolverConverged), _) => {
                let gradient = state.get_gradient().map_or(f64::INFINITY, |g| norm(g));
                Ended::With(if gradient < GRADIENT_TOLERANCE {
                    Termination::ConvergedGradient
                } else {
                    Termination::ConvergedCost
                })
            }
            (_, Some(stopped)) => Ended::With(stopped),
            // The line search may have been stopped instead of the solver.
            _ => match result.solver.limits.reason(0) {
                Some(stopped) => Ended::With(stopped),
                None => Ended::LineSearchFailed,
            },
        };
        Ok((ended, state.get_iter()))
    }

    fn nelder_mead(
        &self,
        start: &DVector<f64>,
        limits: Limits,
        observer: Option<ScaledObserver>,
    ) -> Result<(Ended, u64), argmin::core::Error> {
        let corner = self.start(start);
        let mut simplex = vec![corner.clone()];
        for j in 0..corner.len() {
            let mut other = corner.clone();
            other[j] += SIMPLEX_EDGE;
            simplex.push(other);
        }
        let solver: NelderMead<Point, f64> = NelderMead::new(simplex).with_sd_tolerance(COST_TOLERANCE)?;
        let mut executor = Executor::new(self, Watched::new(solver, limits))
            .configure(|state: SimplexState| state)
            .ctrlc(false)
            .timer(false);
        if let Some(observer) = observer {
            executor = executor.add_observer(observer, ObserverMode::Always);
        }
        let result = executor.run()?;
        let converged =
            matches!(result.state.get_termination_reason(), Some(TerminationReason::SolverConverged));
        let stopped = result.solver.stopped.unwrap_or(Termination::IterationLimit);
        let ended = if converged { Termination::ConvergedCost } else { stopped };
        Ok((Ended::With(ended), result.state.get_iter()))
    }

    fn particle_swarm(
        &self,
        start: &DVector<f64>,
        limits: Limits,
        observer: Option<ScaledObserver>,
        seed: u64,
    ) -> Result<(Ended, u64), argmin::core::Error> {
        // If there is no bound, the box extends ten times as far as the start.
        let edge = |bound: f64, x: f64| {
            if bound.is_finite() { bound } else { x + bound.signum() * 10.0 * (1.0 + x.abs()) }
        };
        let edges = self.axes.iter().zip(start.iter()).map(|(axis, x)| match *axis {
            Axis::Plain(low, high) | Axis::Sine(low, high) => (edge(low, *x), edge(high, *x)),
        });
        let (low, high): (Point, Point) = edges.unzip();
        let mut rng = Pcg64Mcg::seed_from_u64(seed ^ SWARM_STREAM);
        let mut particles = Vec::with_capacity(PARTICLES);
        let at_rest = vec![0.0; start.len()];
        particles.push(Particle::new(start.as_slice().to_vec(), 1.0, at_rest));
        while particles.len() < PARTICLES {
            let ranges = low.iter().zip(&high);
            let place: Point = ranges.clone().map(|(l, h)| l + (h - l) * rng.random::<f64>()).collect();
            let velocity = ranges.map(|(l, h)| (h - l) * (2.0 * rng.random::<f64>() - 1.0)).collect();
            let (cost, _) = self.evaluate(&place, false);
            particles.push(Particle::new(place, cost, velocity));
        }
        // argmin's random numbers use another version of rand than ours.
        let numbers =
            <Xoshiro256PlusPlus as rand_xoshiro::rand_core::SeedableRng>::seed_from_u64(seed ^ SWARM_STREAM);
        let solver = ParticleSwarm::new((low, high), PARTICLES).with_rng_generator(numbers);
        let mut executor = Executor::new(self, Watched::new(solver, limits))
            .configure(|state: Swarm| state.population(particles))
            .ctrlc(false)
            .timer(false);
        if let Some(observer) = observer {
            executor = executor.add_observer(observer, ObserverMode::Always);
        }
        let result = executor.run()?;
        let stopped = result.solver.stopped.unwrap_or(Termination::IterationLimit);
        Ok((Ended::With(stopped), result.state.get_iter()))
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

impl<P: LeastSquares> CostFunction for &PlainCost<'_, P> {
    type Param = Point;
    type Output = f64;

    fn cost(&self, u: &Point) -> Result<f64, argmin::core::Error> {
        Ok(self.evaluate(u, false).0)
    }
}

impl<P: LeastSquares> Gradient for &PlainCost<'_, P> {
    type Param = Point;
    type Gradient = Point;

    fn gradient(&self, u: &Point) -> Result<Point, argmin::core::Error> {
        Ok(self.evaluate(u, true).1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::{SolverKind, Tolerances, minimise_with};
    use approx::assert_relative_eq;
    use nalgebra::DMatrix;
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    const OTHERS: [SolverKind; 3] = [SolverKind::LBfgs, SolverKind::NelderMead, SolverKind::ParticleSwarm];

    /// Rosenbrock's valley (1960) as two residuals: 10 (y - x^2) and 1 - x.
    struct Rosenbrock {
        bounds: Vec<(f64, f64)>,
    }

    impl LeastSquares for Rosenbrock {
        fn linearise(&self, v: &DVector<f64>) -> Linearisation {
            let (x, y) = (v[0], v[1]);
            for (value, (low, high)) in v.iter().zip(&self.bounds) {
                assert!(
                    value.is_nan() || (value >= low && value <= high),
                    "{value} is not within {low}..{high}"
                );
            }
            let residual = DVector::from_vec(vec![10.0 * (y - x * x), 1.0 - x]);
            let jacobian = DMatrix::from_row_slice(2, 2, &[-20.0 * x, 10.0, -1.0, 0.0]);
            Linearisation::dense(jacobian, residual)
        }
        fn bounds(&self) -> Vec<(f64, f64)> {
            self.bounds.clone()
        }
    }

    fn solve(kind: SolverKind, bounds: [(f64, f64); 2], start: [f64; 2], limits: Limits) -> Solution {
        let problem = Rosenbrock { bounds: bounds.to_vec() };
        let start = DVector::from_row_slice(&start);
        minimise_with(kind, &problem, start, Tolerances::default(), limits, 0).unwrap()
    }

    #[test]
    fn every_solver_finds_the_floor_of_the_valley() {
        for (kind, reasons, digits) in [
            (SolverKind::LevenbergMarquardt, &[Termination::ConvergedStep][..], 1e-12),
            (SolverKind::LBfgs, &[Termination::ConvergedGradient, Termination::ConvergedCost], 1e-5),
            (SolverKind::NelderMead, &[Termination::ConvergedCost], 1e-5),
            (SolverKind::ParticleSwarm, &[Termination::IterationLimit], 1e-3),
        ] {
            let solution = solve(kind, [(-2.0, 2.0), (-1.0, 3.0)], [-1.2, 1.0], Limits::iterations(300));
            assert!(reasons.contains(&solution.termination), "{kind:?}: {:?}", solution.termination);
            assert_relative_eq!(solution.x[0], 1.0, epsilon = digits);
            assert_relative_eq!(solution.x[1], 1.0, epsilon = 2.0 * digits);
            assert_relative_eq!(solution.cost, solution.linearisation.cost);
            assert!(solution.evaluations > solution.iterations, "{kind:?}");
        }
    }

    #[test]
    fn bounds_are_kept_reached_and_left() {
        // With x at most 0.5 the minimum is at x = 0.5, y = 0.25: on the valley's floor at the bound.
        for kind in OTHERS {
            let solution = solve(kind, [(-2.0, 0.5), (-10.0, 10.0)], [-1.2, 1.0], Limits::iterations(300));
            assert_eq!(solution.x[0], 0.5, "{kind:?}");
            assert_relative_eq!(solution.x[1], 0.25, max_relative = 1e-3);
            // The start lies on two bounds, and the minimum inside.
            let solution = solve(kind, [(-2.0, 2.0), (-1.0, 1.5)], [-2.0, 1.5], Limits::iterations(300));
            assert_relative_eq!(solution.x[0], 1.0, max_relative = 1e-2);
        }
    }

    #[test]
    fn without_bounds_the_variables_are_the_parameters() {
        let free = (f64::NEG_INFINITY, f64::INFINITY);
        for kind in OTHERS {
            let solution = solve(kind, [free, free], [-1.2, 1.0], Limits::iterations(300));
            assert_relative_eq!(solution.x[0], 1.0, max_relative = 1e-2);
        }
    }

    #[test]
    fn solvers_stop_when_told() {
        let bounds = [(-2.0, 2.0), (-1.0, 3.0)];
        for kind in OTHERS {
            let stop = Some(Arc::new(AtomicBool::new(true)));
            let solution = solve(kind, bounds, [-1.2, 1.0], Limits { stop, ..Limits::iterations(300) });
            assert_eq!(solution.termination, Termination::Interrupted);
            let deadline = Some(std::time::Instant::now());
            let solution = solve(kind, bounds, [-1.2, 1.0], Limits { deadline, ..Limits::iterations(300) });
            assert_eq!(solution.termination, Termination::Timeout);
            let solution = solve(kind, bounds, [-1.2, 1.0], Limits::iterations(0));
            assert_eq!(solution.termination, Termination::IterationLimit);
            assert!(solution.cost <= 24.2 + 1e-9, "no worse than the start");
            let solution = solve(kind, bounds, [f64::NAN, 1.0], Limits::iterations(300));
            assert_eq!(solution.termination, Termination::Invalid);
        }
    }
}
