//! The Levenberg-Marquardt method within bounds, as a solver for argmin.
//!
//! Each step minimises the linear model |J p + r|^2 over all p that stay within the bounds and within the trust region
//! |D p| <= radius. D holds the largest column norms of J seen so far (More 1978), which makes the steps independent
//! of the parameters' units. The radius is adapted to how well the model agrees with the true cost. A step on the edge
//! of the trust region minimises the damped model |J p + r|^2 + lambda |D p|^2 for the lambda that makes it as long as
//! the radius; `bounded_step` solves for it.
//!
//! If the residuals stay large and are curved, undamped steps converge slowly: along several directions at once, each
//! step is a fixed fraction of the last. The last few steps reveal those fractions, and the point where the sequence
//! would end (Anderson 1965; Walker and Ni 2011, doi:10.1137/10078356X) is tried first.
//!
//! Near a minimum the cost is flat: if the parameters change by the square root of the rounding error, the cost
//! changes by no more than rounding, so a search that judges steps by the cost stops there with half of the digits.
//! The gradient is not flat. So once the search has ended, undamped steps continue as long as each is shorter than the
//! last, however the cost changes within its rounding error.

use super::bounded_step::{bounded_step, room, within};
use super::extrapolation::Extrapolation;
use super::least_squares::{LeastSquares, Linearisation};
use super::termination::{Limits, Observer, Solution, Termination, Tolerances};
use crate::error::Error;
use argmin::core::observers::{Observe, ObserverMode};
use argmin::core::{Executor, IterState, KV, Problem, Solver, State, TerminationReason, TerminationStatus};
use nalgebra::DVector;

/// The solver; see the module documentation.
#[derive(Clone)]
pub struct LevenbergMarquardt {
    tolerances: Tolerances,
    limits: Limits,
    bounds: Vec<(f64, f64)>,
    /// Damping of the last step.
    lambda: f64,
    /// Radius of the trust region; `None` before the first step.
    radius: Option<f64>,
    /// D, the largest column norms so far.
    scale: DVector<f64>,
    /// The cost below which only rounding errors are left.
    cost_floor: f64,
    current: Option<Point>,
    /// Why the search ended.
    termination: Option<Termination>,
    phase: Phase,
    /// The last points at which an undamped step was solved for, each with that step.
    history: Extrapolation,
}

/// What the next iteration does.
#[derive(Clone)]
enum Phase {
    Search,
    Refinement(Refinement),
    Over,
}

/// The state of a sequence of undamped steps.
#[derive(Clone)]
struct Refinement {
    /// Column lengths at the point where the sequence began.
    scale: DVector<f64>,
    /// The next step.
    step: DVector<f64>,
    /// The step to the point where the sequence would end, which is tried first.
    far: Option<DVector<f64>>,
    /// The length of the step in units of `scale`, which must shrink.
    length: f64,
    /// The number of steps that may still follow.
    left: u32,
    /// Whether the search has not yet met any test. Then it continues if these steps do not shrink to a length that
    /// meets one, however many steps that takes.
    open: bool,
}

/// A point and the linear model there.
type Point = (DVector<f64>, Linearisation);

/// A step within the trust region.
struct Proposal {
    /// D.
    scale: DVector<f64>,
    /// Radius of the trust region; like all lengths, in units of D.
    radius: f64,
    /// p.
    step: DVector<f64>,
    /// |D p|.
    length: f64,
    /// The decrease of the cost that the linear model predicts for the undamped step.
    promise: f64,
    /// The decrease that it predicts for p.
    predicted: f64,
    /// Whether p changes no parameter noticeably.
    is_small: bool,
    /// Whether the predicted decrease for the undamped step is not noticeable.
    promises_little: bool,
}

/// The parabola c(t) = c(0) + slope t + curvature t^2 through what is known about the cost along a step p, which ends
/// at t = 1.
#[derive(Clone, Copy)]
struct AlongStep {
    slope: f64,
    curvature: f64,
}

impl AlongStep {
    /// The parabola from the linear model at the beginning of the step and the `gain` at its end.
    fn new(model: &Linearisation, step: &DVector<f64>, gain: f64) -> Self {
        let slope = 2.0 * model.slope_at(&DVector::zeros(step.len())).dot(step);
        Self { slope, curvature: -gain - slope }
    }

    /// The t of the minimum after a step that gained nothing; 0 if the cost is not finite at the end of the step.
    fn share_to_minimum(self) -> f64 {
        if self.curvature.is_finite() { -self.slope / (2.0 * self.curvature) } else { 0.0 }
    }

    /// The t of the minimum after a step that gained; at most [`LARGEST_MULTIPLE`].
    fn multiple_to_minimum(self) -> f64 {
        let least_curvature = -self.slope / LARGEST_MULTIPLE;
        (-self.slope / (2.0 * self.curvature).max(least_curvature)).min(LARGEST_MULTIPLE)
    }
}

/// The state that argmin keeps for the solver.
type LmState = IterState<DVector<f64>, (), (), (), (), f64>;

/// Name under which argmin counts evaluations.
const EVALUATIONS: &str = "linearise_count";

/// Relative tolerance of the length of a step on the edge of the trust region; the radius itself is only a rough
/// number.
const RIM: f64 = 0.1;
/// Largest number of values of lambda tried for a step on the edge; five are rarely needed.
const RIM_TRIALS: u32 = 30;
/// If the residuals are this many times as large as the effect of the start, they decide how long the first step may
/// be.
const FAR: f64 = 1e6;
/// A gain below this fraction of the predicted one shrinks the trust region.
const POOR_GAIN: f64 = 0.25;
/// A gain above this fraction of the predicted one lets the trust region grow.
const GOOD_GAIN: f64 = 0.75;
/// A step that gains this many times what the linear model predicted is too short: the residuals' own curvature, which
/// the model ignores, cancels most of J^T J. Further steps would creep in the same direction, so the minimum along it
/// is tried at once.
const FAR_BETTER: f64 = 1.4;
/// Largest multiple of its length at which such a step is tried.
const LARGEST_MULTIPLE: f64 = 100.0;
/// A search that wants no more digits ends without a last step if that promises less than this share of the tolerance.
const NEXT_TO_NOTHING: f64 = 0.1;
/// Steps that shrink faster than this need no extrapolation.
const FAST_SHRINKING: f64 = 0.1;
/// Residuals stay large only if the decrease predicted for a step is below this fraction of the cost.
const LARGE_RESIDUAL_PROMISE: f64 = 0.1;
/// The least gain at the end of a converging sequence of steps, relative to the decrease predicted for its next step.
/// If the cost along it has the curvature 1 + s in units of the model's, with |s| < 1, the gain is 1/(1 + s).
const GAIN_AT_THE_END: f64 = 0.5;

impl LevenbergMarquardt {
    /// A solver within `bounds`.
    #[must_use]
    pub fn new(bounds: Vec<(f64, f64)>, tolerances: Tolerances, limits: Limits) -> Self {
        let scale = DVector::zeros(bounds.len());
        Self {
            tolerances,
            limits,
            bounds,
            lambda: 0.0,
            radius: None,
            scale,
            cost_floor: 0.0,
            current: None,
            termination: None,
            phase: Phase::Search,
            history: Extrapolation::default(),
        }
    }

    fn update_scale(&mut self, model: &Linearisation) {
        let lengths = model.column_lengths(self.scale.len());
        self.scale.zip_apply(&lengths, |scale, length| *scale = scale.max(length));
    }

    /// D, with 1 for parameters that have had no effect yet.
    fn effective_scale(&self) -> DVector<f64> {
        self.scale.map(|s| if s > 0.0 { s } else { 1.0 })
    }

    /// Tries one step of the search from `x`. Returns the next point; `None` if the search stays where it is, or ends.
    fn step(
        &mut self,
        x: &DVector<f64>,
        model: &Linearisation,
        mut evaluate: impl FnMut(&DVector<f64>) -> Result<Linearisation, argmin::core::Error>,
    ) -> Result<Option<Point>, argmin::core::Error> {
        // Find the minimum of the linear model within the bounds and the trust region.
        let proposal = self.propose(x, model);
        if !proposal.length.is_finite() {
            self.termination = Some(Termination::Stalled);
            return Ok(None);
        }

        // A step that promises next to nothing is not worth an evaluation, unless more digits are wanted.
        let next_to_nothing = (NEXT_TO_NOTHING * self.tolerances.cost * model.cost).max(self.cost_floor);
        if self.tolerances.refinements == 0 && self.lambda == 0.0 && proposal.promise <= next_to_nothing {
            self.termination = self.converged_by(&proposal);
            return Ok(None);
        }

        // If undamped steps shrink slowly, try the end of their sequence first.
        if let Some(end) = self.extrapolate(x, model, &proposal) {
            let reached = evaluate(&end)?;
            if reached.is_finite() && model.cost - reached.cost >= GAIN_AT_THE_END * proposal.promise {
                return Ok(Some((end, reached)));
            }
        }

        // Evaluate the true cost at the end of the step, and decide whether the step ends the search, whether it is
        // taken or not.
        let trial = within(x + &proposal.step, &self.bounds);
        let next = evaluate(&trial)?;
        let gain = model.cost - next.cost;
        let along = AlongStep::new(model, &proposal.step, gain);
        self.termination = self.converged_by(&proposal);

        // This is not `gain <= 0`, because a cost that is NaN is no gain either.
        if !(next.is_finite() && gain > 0.0) {
            return Ok(self.refuse(x, model, &proposal, along, (trial, next)));
        }
        let ratio = self.accept(&proposal, gain);

        // A step that gains far more than predicted is too short.
        if ratio > FAR_BETTER && self.termination.is_none() {
            let far = within(x + &proposal.step * along.multiple_to_minimum(), &self.bounds);
            let reached = evaluate(&far)?;
            if reached.is_finite() && reached.cost < next.cost {
                return Ok(Some((far, reached)));
            }
        }
        Ok(Some((trial, next)))
    }

    /// The step to the minimum of the linear model within the bounds and the trust region, with the model's
    /// predictions for it.
    fn propose(&mut self, x: &DVector<f64>, model: &Linearisation) -> Proposal {
        let scale = self.effective_scale();
        let size = x.component_mul(&scale).norm();
        // At first no parameter is assumed to be right to better than its own size. At the origin, the residuals give
        // the size, because they are in the same unit. If the data are far larger than the effect of the start,
        // growing from the start's size would take too long.
        let residual = model.cost.sqrt();
        let near = size > 0.0 && residual < FAR * size;
        let radius = self.radius.unwrap_or(if near { size } else { residual });

        let room = room(x, &self.bounds);
        let undamped = bounded_step(model, &scale, 0.0, &room);
        let promise = model.decrease(&undamped);
        let step = self.step_within(radius, undamped, model, &scale, &room);

        let length = step.component_mul(&scale).norm();
        let is_small = length <= self.tolerances.step * (size + self.tolerances.step);
        let promises_little = promise <= (self.tolerances.cost * model.cost).max(self.cost_floor);
        let predicted = model.decrease(&step);
        Proposal { scale, radius, step, length, promise, predicted, is_small, promises_little }
    }

    /// The point where the sequence of undamped steps would end; `None` if it is not worth trying.
    fn extrapolate(
        &mut self,
        x: &DVector<f64>,
        model: &Linearisation,
        proposal: &Proposal,
    ) -> Option<DVector<f64>> {
        if self.lambda > 0.0 {
            self.history.clear();
            return None;
        }
        let step = self.extrapolation(x, &proposal.step, &proposal.scale)?;
        let worth_trying = !proposal.is_small
            && !proposal.promises_little
            && proposal.promise < LARGE_RESIDUAL_PROMISE * model.cost
            && step.component_mul(&proposal.scale).norm() <= proposal.radius;
        worth_trying.then(|| within(x + step, &self.bounds))
    }

    /// Why a step ends the search, whether it is taken or not; `None` if it does not.
    ///
    /// The search ends if a step is short by itself, or if the decrease predicted for an undamped step is small. A
    /// step that is only short because the trust region is small says nothing.
    fn converged_by(&self, proposal: &Proposal) -> Option<Termination> {
        match (proposal.is_small, proposal.promises_little) {
            (true, _) if self.lambda == 0.0 => Some(Termination::ConvergedStep),
            (_, true) => Some(Termination::ConvergedCost),
            (true, _) => Some(Termination::Stalled),
            _ => None,
        }
    }

    /// Shrinks the trust region after a step that gained nothing. Returns `trial`, the end of the step, if it is kept
    /// nevertheless, because the cost cannot resolve a difference so close to the minimum.
    fn refuse(
        &mut self,
        x: &DVector<f64>,
        model: &Linearisation,
        proposal: &Proposal,
        along: AlongStep,
        (trial, next): Point,
    ) -> Option<Point> {
        if self.lambda == 0.0 && next.is_finite() && lost_in_rounding(next.cost - model.cost, model.cost) {
            // The length of the next step shows whether this one was right.
            let reason = self.termination;
            self.termination = reason.or(Some(Termination::Stalled));
            if let Some(refinement) = self.refinement(x, model) {
                let refinement = Refinement { open: reason.is_none(), ..refinement };
                if let Some(taken) = self.settle(refinement, trial, next, model.cost) {
                    return Some(taken);
                }
            }
            self.termination = reason;
            if reason.is_some() {
                self.phase = Phase::Over;
            }
        }
        self.radius = Some(along.share_to_minimum().clamp(0.1, 0.5) * proposal.length);
        None
    }

    /// Adapts the trust region to a step with a `gain`. Returns the ratio of the gain to the predicted one.
    fn accept(&mut self, proposal: &Proposal, gain: f64) -> f64 {
        let ratio = if proposal.predicted > 0.0 { gain / proposal.predicted } else { 1.0 };
        self.radius = Some(if ratio < POOR_GAIN {
            0.5 * proposal.length
        } else if ratio > GOOD_GAIN {
            proposal.radius.max(2.0 * proposal.length)
        } else {
            proposal.radius
        });
        ratio
    }

    /// Stores the undamped `step` at `x`. If such steps shrink slowly, returns the step to the point where their
    /// sequence would end.
    fn extrapolation(
        &mut self,
        x: &DVector<f64>,
        step: &DVector<f64>,
        scale: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let share = self.history.shrinking(x, step, scale);
        let end = self.history.end(x, step, scale);
        end.filter(|_| share.is_some_and(|share| (FAST_SHRINKING..1.0).contains(&share)))
    }

    /// The step to the minimum of the model within `radius`: the `undamped` step if it is short enough. Stores the
    /// damping for the next call.
    fn step_within(
        &mut self,
        radius: f64,
        undamped: DVector<f64>,
        model: &Linearisation,
        scale: &DVector<f64>,
        room: &[(f64, f64)],
    ) -> DVector<f64> {
        let length = |p: &DVector<f64>| p.component_mul(scale).norm();
        // If the length is NaN, the model has no unique minimum; damping gives it one.
        let mut short = (0.0, length(&undamped));
        if short.1 <= (1.0 + RIM) * radius {
            self.lambda = 0.0;
            return undamped;
        }
        // At the damped minimum, lambda |D p|^2 <= -g.p <= |D^-1 g| |D p|, where g is the gradient.
        let gradient = model.slope_at(&DVector::zeros(scale.len())).component_div(scale).norm();
        let mut long = (gradient / radius, 0.0);
        let mut lambda = if self.lambda > 0.0 && self.lambda < long.0 { self.lambda } else { 1e-3 * long.0 };
        let mut p = undamped;
        for _ in 0..RIM_TRIALS {
            p = bounded_step(model, scale, lambda, room);
            let reached = length(&p);
            if (reached - radius).abs() <= RIM * radius {
                break;
            }
            if reached <= radius {
                long = (lambda, reached)
            } else {
                short = (lambda, reached)
            }
            // The inverse of the length grows nearly linearly with lambda (Hebden 1973).
            let share = (1.0 / radius - 1.0 / short.1) / (1.0 / long.1 - 1.0 / short.1);
            let secant = short.0 + share * (long.0 - short.0);
            lambda = if long.1 > 0.0 && secant > short.0 && secant < long.0 {
                secant
            } else {
                (short.0.max(1e-4 * long.0) * long.0).sqrt()
            };
        }
        self.lambda = lambda;
        p
    }

    /// The undamped steps that may follow the search when it ends at `x`; `None` if they are disabled or cannot gain
    /// anything.
    fn refinement(&mut self, x: &DVector<f64>, model: &Linearisation) -> Option<Refinement> {
        if self.tolerances.refinements == 0 || model.cost <= self.cost_floor {
            return None;
        }
        // D is for damping, which these steps do not have, and it may contain the lengths of columns that were once
        // much longer.
        let scale = model.column_lengths(x.len()).map(|s| if s > 0.0 { s } else { 1.0 });
        let step = bounded_step(model, &scale, 0.0, &room(x, &self.bounds));
        let length = step.component_mul(&scale).norm();
        let worthwhile = length > self.tolerances.step * x.component_mul(&scale).norm();
        let far = self.extrapolation(x, &step, &scale);
        worthwhile.then_some(Refinement {
            scale,
            step,
            far,
            length,
            left: self.tolerances.refinements,
            open: false,
        })
    }

    /// Takes one undamped step from `x`, trying the end of the sequence first, and sets what comes next. Returns the
    /// next point; `None` if it is no improvement.
    fn refine(
        &mut self,
        mut refinement: Refinement,
        x: &DVector<f64>,
        model: &Linearisation,
        mut evaluate: impl FnMut(&DVector<f64>) -> Result<Linearisation, argmin::core::Error>,
    ) -> Result<Option<Point>, argmin::core::Error> {
        let far = refinement.far.take();
        let trial = within(x + far.as_ref().unwrap_or(&refinement.step), &self.bounds);
        let next = evaluate(&trial)?;
        let (open, length) = (refinement.open, refinement.length);
        // If the end of the sequence is no improvement, the plain step may be.
        let plain = far.filter(|_| open || refinement.left > 1).map(|_| refinement.clone());
        let taken = self.settle(refinement, trial, next, model.cost);
        match (&taken, plain) {
            (None, Some(plain)) => {
                let left = if open { plain.left } else { plain.left.saturating_sub(1) };
                self.phase = Phase::Refinement(Refinement { left, ..plain });
            }
            // No test has been met yet, so the search continues with steps that are judged by the cost.
            (None, None) if open => {
                self.phase = Phase::Search;
                self.termination = None;
                self.radius = Some(0.5 * length);
            }
            _ => {}
        }
        Ok(taken)
    }

    /// Accepts `trial`, the end of an undamped step from a point with this `cost`, if the step after it is shorter,
    /// and prepares that step. `next` is the linear model at `trial`.
    fn settle(
        &mut self,
        Refinement { scale, length, left, open, .. }: Refinement,
        trial: DVector<f64>,
        next: Linearisation,
        cost: f64,
    ) -> Option<Point> {
        // The cost may only change by rounding: a shorter step at a point of higher cost is no improvement.
        if !(next.is_finite() && lost_in_rounding(next.cost - cost, cost)) {
            return None;
        }
        let step = bounded_step(&next, &scale, 0.0, &room(&trial, &self.bounds));
        let shorter = step.component_mul(&scale).norm();
        if shorter.is_nan() || shorter >= length {
            return None;
        }
        let arrived = shorter <= self.tolerances.step * trial.component_mul(&scale).norm();
        if arrived && self.termination == Some(Termination::Stalled) {
            self.termination = Some(Termination::ConvergedStep);
        }
        let left = if open { left } else { left.saturating_sub(1) };
        self.phase = if arrived || left == 0 {
            Phase::Over
        } else {
            let far = self.extrapolation(&trial, &step, &scale);
            Phase::Refinement(Refinement { scale, step, far, length: shorter, left, open })
        };
        Some((trial, next))
    }

    /// Whether the cost is only rounding error, or the residuals are orthogonal to the effect of every parameter that
    /// may move.
    fn is_flat(&self) -> bool {
        self.current.as_ref().is_some_and(|(x, model)| {
            model.cost <= self.cost_floor || model.largest_cosine(x, &self.bounds) <= self.tolerances.gradient
        })
    }

    /// What the next iteration does; `limited` says that a limit has been reached.
    fn next_phase(&mut self, limited: bool) -> Phase {
        let at_rest =
            self.termination.is_some_and(|reason| reason.converged() || reason == Termination::Stalled);
        let current = self.current.take();
        let next = match (std::mem::replace(&mut self.phase, Phase::Over), &current) {
            (Phase::Search, _) if self.termination.is_none() => Phase::Search,
            (Phase::Search, Some((x, model))) if at_rest && !limited => {
                self.refinement(x, model).map_or(Phase::Over, Phase::Refinement)
            }
            (Phase::Refinement(refinement), _) if !limited => Phase::Refinement(refinement),
            _ => Phase::Over,
        };
        self.current = current;
        next
    }
}

/// Whether a rise of the cost can be explained by the rounding of the residuals near a minimum. This limit is far
/// above the rounding of a sum, because residuals are differences of larger numbers, and far below what anyone would
/// notice.
fn lost_in_rounding(rise: f64, cost: f64) -> bool {
    rise <= f64::EPSILON.sqrt() * cost
}

impl<P: LeastSquares> Solver<&P, LmState> for LevenbergMarquardt {
    fn name(&self) -> &'static str {
        "Levenberg-Marquardt within bounds"
    }

    fn init(
        &mut self,
        problem: &mut Problem<&P>,
        mut state: LmState,
    ) -> Result<(LmState, Option<KV>), argmin::core::Error> {
        let x = state.take_param().unwrap_or_else(|| DVector::zeros(self.bounds.len()));
        let x = within(x, &self.bounds);
        let model = problem.problem(EVALUATIONS, |p| Ok(p.linearise(&x)))?;
        if !model.cost.is_finite() {
            self.termination = Some(Termination::Invalid);
        }
        self.update_scale(&model);
        self.cost_floor = problem.problem("cost_floor_count", |p| Ok(p.cost_floor()))?;
        let cost = model.cost;
        self.current = Some((x.clone(), model));
        Ok((state.param(x).cost(cost), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<&P>,
        state: LmState,
    ) -> Result<(LmState, Option<KV>), argmin::core::Error> {
        let Some((x, model)) = self.current.take() else { return Ok((state, None)) };
        let mut evaluate = |trial: &DVector<f64>| problem.problem(EVALUATIONS, |p| Ok(p.linearise(trial)));
        let next = match std::mem::replace(&mut self.phase, Phase::Over) {
            Phase::Refinement(refinement) => self.refine(refinement, &x, &model, &mut evaluate)?,
            Phase::Search | Phase::Over => {
                self.phase = Phase::Search;
                self.step(&x, &model, &mut evaluate)?
            }
        };
        let (x, model) = match next {
            Some((x, model)) => {
                self.update_scale(&model);
                (x, model)
            }
            None => (x, model),
        };
        let state = state.param(x.clone()).cost(model.cost);
        self.current = Some((x, model));
        Ok((state, None))
    }

    fn terminate(&mut self, state: &LmState) -> TerminationStatus {
        // A search that has not ended by its own tests ends if the cost is flat, or at a limit.
        let limit = self.limits.reason(state.get_iter());
        if self.termination.is_none() {
            self.termination = if self.is_flat() { Some(Termination::ConvergedGradient) } else { limit };
        }

        // Undamped steps may follow the end of a search, unless a limit forbids them.
        self.phase = self.next_phase(limit.is_some());
        if let Phase::Refinement(_) = self.phase {
            return TerminationStatus::NotTerminated;
        }

        // If columns are nearly equal, rounding prevents the decrease that the model predicts. Independent columns
        // would predict a decrease of the square of the cosine; if that is below the tolerance, this is the minimum.
        if self.termination == Some(Termination::Stalled)
            && self.current.as_ref().is_some_and(|(x, model)| {
                model.largest_cosine(x, &self.bounds) <= self.tolerances.cost.sqrt()
            })
        {
            self.termination = Some(Termination::ConvergedGradient);
        }
        match self.termination {
            Some(reason) if reason.converged() => {
                TerminationStatus::Terminated(TerminationReason::SolverConverged)
            }
            Some(reason) => {
                TerminationStatus::Terminated(TerminationReason::SolverExit(reason.name().into()))
            }
            None => TerminationStatus::NotTerminated,
        }
    }
}

/// Passes argmin's iterations on to an observer.
struct Listener(Observer);

impl Observe<LmState> for Listener {
    fn observe_iter(&mut self, state: &LmState, _: &KV) -> Result<(), argmin::core::Error> {
        (self.0)(state.get_iter(), state.get_cost());
        Ok(())
    }
}

/// Minimises a problem from `start`, or from the closest point within the bounds.
///
/// See [`LeastSquares`] for an example. A search that does not converge is not an error: see
/// [`Solution::termination`].
///
/// # Errors
/// [`Error::Invalid`] if `start` and the bounds differ in length, or if a lower bound is above its upper one;
/// [`Error::Optimiser`] if argmin itself fails, which is a bug.
pub fn minimise<P: LeastSquares>(
    problem: &P,
    start: DVector<f64>,
    tolerances: Tolerances,
    limits: Limits,
) -> Result<Solution, Error> {
    let failed = |error: argmin::core::Error| Error::Optimiser(error.to_string());
    let bounds = problem.bounds();
    if bounds.len() != start.len() {
        let expected = format!("a pair for each of {} parameters", start.len());
        return Err(Error::invalid("bounds", expected, bounds.len().to_string()));
    }
    let senseless = |(lower, upper): &&(f64, f64)| lower.is_nan() || upper.is_nan() || lower > upper;
    if let Some((lower, upper)) = bounds.iter().find(senseless) {
        return Err(Error::invalid("bounds", "the lower at most the upper", format!("{lower} and {upper}")));
    }
    let observer = limits.observer.clone();
    let solver = LevenbergMarquardt::new(bounds, tolerances, limits);
    let mut executor = Executor::new(problem, solver)
        .configure(|state: LmState| state.param(start))
        .ctrlc(false)
        .timer(false);
    if let Some(observer) = observer {
        executor = executor.add_observer(Listener(observer), ObserverMode::Always);
    }
    let result = executor.run().map_err(failed)?;
    let evaluations = result.problem.counts.get(EVALUATIONS).copied().unwrap_or(0);
    let iterations = result.state.get_iter();
    let termination = result.solver.termination.unwrap_or(Termination::IterationLimit);
    let (x, linearisation) =
        result.solver.current.ok_or_else(|| Error::Optimiser("no point was evaluated".to_owned()))?;
    Ok(Solution { x, cost: linearisation.cost, linearisation, termination, iterations, evaluations })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::DMatrix;

    /// Rosenbrock's valley (1960) as two residuals: 10 (y - x^2) and 1 - x.
    struct Rosenbrock {
        bounds: Vec<(f64, f64)>,
    }

    impl LeastSquares for Rosenbrock {
        fn linearise(&self, v: &DVector<f64>) -> Linearisation {
            let (x, y) = (v[0], v[1]);
            let residual = DVector::from_vec(vec![10.0 * (y - x * x), 1.0 - x]);
            let jacobian = DMatrix::from_row_slice(2, 2, &[-20.0 * x, 10.0, -1.0, 0.0]);
            Linearisation::dense(jacobian, residual)
        }
        fn bounds(&self) -> Vec<(f64, f64)> {
            self.bounds.clone()
        }
    }

    fn solve(bounds: Vec<(f64, f64)>) -> Solution {
        let start = DVector::from_vec(vec![-1.2, 1.0]);
        minimise(&Rosenbrock { bounds }, start, Tolerances::default(), Limits::iterations(200)).unwrap()
    }

    #[test]
    fn finds_the_floor_of_the_valley() {
        let free = (f64::NEG_INFINITY, f64::INFINITY);
        let solution = solve(vec![free, free]);
        assert!(solution.termination.converged(), "{:?}", solution.termination);
        assert_relative_eq!(solution.x[0], 1.0, epsilon = 1e-12);
        assert_relative_eq!(solution.x[1], 1.0, epsilon = 1e-12);
    }

    #[test]
    fn stops_at_an_active_bound() {
        // With x at most 0.5 the minimum is at x = 0.5, y = 0.25: on the valley's floor at the bound.
        let solution = solve(vec![(-2.0, 0.5), (-10.0, 10.0)]);
        assert!(solution.termination.converged(), "{:?}", solution.termination);
        assert_relative_eq!(solution.x[0], 0.5);
        assert_relative_eq!(solution.x[1], 0.25, max_relative = 1e-9);
    }

    #[test]
    fn leaves_a_bound_that_it_starts_at() {
        let solution = solve(vec![(-2.0, 2.0), (-1.0, 1.0)]);
        assert!(solution.termination.converged(), "{:?}", solution.termination);
        assert_relative_eq!(solution.x[0], 1.0, epsilon = 1e-9);
    }

    /// A problem with one parameter, given by a function that returns residuals and their derivatives.
    struct Single<F>(F);

    impl<F: Fn(f64) -> (Vec<f64>, Vec<f64>)> LeastSquares for Single<F> {
        fn linearise(&self, x: &DVector<f64>) -> Linearisation {
            let (residual, slope) = (self.0)(x[0]);
            Linearisation::dense(DMatrix::from_vec(slope.len(), 1, slope), DVector::from_vec(residual))
        }
        fn bounds(&self) -> Vec<(f64, f64)> {
            vec![(f64::NEG_INFINITY, f64::INFINITY)]
        }
    }

    fn solve_single(
        problem: impl Fn(f64) -> (Vec<f64>, Vec<f64>),
        start: f64,
        tolerances: Tolerances,
        limits: Limits,
    ) -> Solution {
        minimise(&Single(problem), DVector::from_element(1, start), tolerances, limits).unwrap()
    }

    /// Residuals e^x - 1 and e^-x - 3. At the minimum e^2x - e^x = e^-2x - 3 e^-x, and the residuals do not vanish.
    fn two_exponentials(x: f64) -> (Vec<f64>, Vec<f64>) {
        let e = x.exp();
        (vec![e - 1.0, 1.0 / e - 3.0], vec![e, -1.0 / e])
    }

    /// The gradient of `two_exponentials` relative to its terms, which is 0 at the minimum.
    fn slope_left(x: f64) -> f64 {
        let e = x.exp();
        ((e * e - e) - (1.0 / (e * e) - 3.0 / e)).abs() / (3.0 / e)
    }

    #[test]
    fn undamped_steps_win_the_digits_that_the_cost_cannot_tell() {
        let loose = Tolerances { step: 1e-15, cost: 1e-8, gradient: 0.0, refinements: 0 };
        let found = solve_single(two_exponentials, 3.0, loose, Limits::default());
        assert_eq!(found.termination, Termination::ConvergedCost);
        assert!(slope_left(found.x[0]) > 1e-9, "{}", slope_left(found.x[0]));
        let refined =
            solve_single(two_exponentials, 3.0, Tolerances { refinements: 50, ..loose }, Limits::default());
        // The reason why the search ended does not change.
        assert_eq!(refined.termination, Termination::ConvergedCost);
        assert!(slope_left(refined.x[0]) < 1e-14, "{}", slope_left(refined.x[0]));
    }

    #[test]
    fn undamped_steps_count_as_iterations() {
        let loose = Tolerances { step: 0.0, cost: 1e-8, gradient: 0.0, refinements: 0 };
        let search = solve_single(two_exponentials, 3.0, loose, Limits::default());
        let two = Tolerances { refinements: 2, ..loose };
        let refined = solve_single(two_exponentials, 3.0, two, Limits::default());
        assert!(refined.iterations > search.iterations && refined.iterations <= search.iterations + 2);
        // A limit that the search exactly meets leaves no iterations for undamped steps.
        let limited = solve_single(two_exponentials, 3.0, two, Limits::iterations(search.iterations));
        assert_eq!(limited.iterations, search.iterations);
        assert_eq!(limited.termination, search.termination);
    }

    /// Residuals u, v, 10 - 0.9 u^2/20 and 10 - 0.6 v^2/20 with u = x + y - 3 and v = x - y - 1. The curvature of the
    /// last two cancels 0.9 and 0.6 of J^T J, and these fractions of u and v remain after an undamped step.
    struct TwoSlowDirections;

    impl LeastSquares for TwoSlowDirections {
        fn linearise(&self, x: &DVector<f64>) -> Linearisation {
            let (u, v) = (x[0] + x[1] - 3.0, x[0] - x[1] - 1.0);
            let residual = DVector::from_vec(vec![u, v, 10.0 - 0.045 * u * u, 10.0 - 0.03 * v * v]);
            let (du, dv) = (-0.09 * u, -0.06 * v);
            let jacobian = DMatrix::from_row_slice(4, 2, &[1.0, 1.0, 1.0, -1.0, du, du, dv, -dv]);
            Linearisation::dense(jacobian, residual)
        }
        fn bounds(&self) -> Vec<(f64, f64)> {
            vec![(f64::NEG_INFINITY, f64::INFINITY); 2]
        }
    }

    #[test]
    fn large_curved_residuals_do_not_slow_it_down() {
        let start = DVector::from_vec(vec![2.8, 1.5]);
        let found = minimise(&TwoSlowDirections, start, Tolerances::default(), Limits::default()).unwrap();
        assert!(found.termination.converged(), "{:?}", found.termination);
        assert_relative_eq!(found.x[0], 2.0, max_relative = 1e-11);
        assert_relative_eq!(found.x[1], 1.0, max_relative = 1e-11);
        // 0.9^n only falls below 1e-11 after 240 steps.
        assert!(found.evaluations < 30, "{}", found.evaluations);
    }

    #[test]
    fn keeps_away_from_where_the_residuals_are_not_finite() {
        // ln x = -1 from above: the undamped step leads to a negative x.
        let logarithm = |x: f64| (vec![x.ln() + 1.0], vec![1.0 / x]);
        let found = solve_single(logarithm, 10.0, Tolerances::default(), Limits::default());
        assert!(found.termination.converged(), "{:?}", found.termination);
        assert_relative_eq!(found.x[0], (-1.0_f64).exp(), max_relative = 1e-14);
        let invalid = solve_single(logarithm, -1.0, Tolerances::default(), Limits::default());
        assert_eq!(invalid.termination, Termination::Invalid);
    }

    #[test]
    fn starts_at_the_origin() {
        let line = |x: f64| (vec![x - 3.0, 2.0 * x - 5.0], vec![1.0, 2.0]);
        let found = solve_single(line, 0.0, Tolerances::default(), Limits::default());
        assert!(found.termination.converged(), "{:?}", found.termination);
        assert_relative_eq!(found.x[0], 13.0 / 5.0, max_relative = 1e-15);
    }

    #[test]
    fn a_wrong_derivative_is_no_convergence() {
        let wrong = |x: f64| (vec![x - 3.0, 1.0], vec![-1.0, 0.0]);
        let found = solve_single(wrong, 1.0, Tolerances::default(), Limits::default());
        assert_eq!(found.termination, Termination::Stalled);
        assert_relative_eq!(found.x[0], 1.0);
    }

    #[test]
    fn bounds_that_make_no_sense_are_errors() {
        let limits = || Limits::iterations(1);
        let start = || DVector::from_vec(vec![0.0, 0.0]);
        for bounds in [vec![(0.0, 1.0)], vec![(0.0, 1.0), (1.0, 0.0)], vec![(0.0, f64::NAN), (0.0, 1.0)]] {
            let result = minimise(&Rosenbrock { bounds }, start(), Tolerances::default(), limits());
            assert!(matches!(result, Err(Error::Invalid { .. })), "{result:?}");
        }
    }
}
