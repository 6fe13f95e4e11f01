//! The solver of the final fit, chosen by the user.

#[cfg(feature = "solvers")]
use super::argmin_solvers::{ArgminSolver, minimise_by_argmin};
use super::least_squares::LeastSquares;
use super::levenberg_marquardt::minimise;
use super::termination::{Limits, Solution, Tolerances};
use crate::error::Error;
use nalgebra::DVector;

/// The optimiser of the final fit. All but the first need the feature `solvers` and are for comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum SolverKind {
    /// Our own Levenberg-Marquardt method, for least squares within bounds.
    #[default]
    LevenbergMarquardt,
    /// Limited-memory quasi-Newton method, which uses only the gradient.
    #[cfg(feature = "solvers")]
    LBfgs,
    /// Simplex method, which uses no derivatives.
    #[cfg(feature = "solvers")]
    NelderMead,
    /// Random search, which uses no derivatives.
    #[cfg(feature = "solvers")]
    ParticleSwarm,
}

impl SolverKind {
    /// Name on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::LevenbergMarquardt => "levenberg-marquardt",
            #[cfg(feature = "solvers")]
            Self::LBfgs => "l-bfgs",
            #[cfg(feature = "solvers")]
            Self::NelderMead => "nelder-mead",
            #[cfg(feature = "solvers")]
            Self::ParticleSwarm => "particle-swarm",
        }
    }
}

/// Minimises a problem from `start` with the solver given. `tolerances` apply to Levenberg-Marquardt only; the other
/// solvers have their own. `seed` is for the particle swarm.
///
/// # Errors
/// [`Error::Optimiser`] if argmin itself fails, which is a bug.
#[cfg_attr(not(feature = "solvers"), expect(unused_variables, reason = "one solver needs no seed"))]
pub fn minimise_with<P: LeastSquares>(
    kind: SolverKind,
    problem: &P,
    start: DVector<f64>,
    tolerances: Tolerances,
    limits: Limits,
    seed: u64,
) -> Result<Solution, Error> {
    #[cfg(feature = "solvers")]
    {
        let other = match kind {
            SolverKind::LevenbergMarquardt => None,
            SolverKind::LBfgs => Some(ArgminSolver::LBfgs),
            SolverKind::NelderMead => Some(ArgminSolver::NelderMead),
            SolverKind::ParticleSwarm => Some(ArgminSolver::ParticleSwarm),
        };
        // Without parameters there is nothing to search for.
        if let Some(other) = other.filter(|_| !start.is_empty()) {
            return minimise_by_argmin(other, problem, &start, limits, seed);
        }
    }
    minimise(problem, start, tolerances, limits)
}
