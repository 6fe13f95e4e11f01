//! Minimising on part of the samples.

use super::absent_lobes::minimise_escaping_absent_lobes;
use crate::error::Error;
use crate::fit::problem::loss::Objective;
use crate::fit::problem::observed::Observed;
use crate::fit::task::Task;
use crate::parameters::ParameterTable;
use crate::solver::in_parts::minimise_in_parts;
use crate::solver::{Solution, Tolerances};
use nalgebra::DVector;
use std::sync::Arc;

/// The minima only need to be told apart.
const TOLERANCES: Tolerances = Tolerances { step: 1e-6, cost: 1e-7, gradient: 1e-6, refinements: 0 };

impl Task<'_> {
    /// Minimises from the parameters of `table`, as precisely as comparing minima requires.
    pub(in crate::fit) fn polish(
        &self,
        samples: &Arc<Observed<'_>>,
        table: ParameterTable,
        objective: Objective,
        iterations: u64,
    ) -> Result<Solution, Error> {
        let problem = self.problem(samples, table, objective);
        let start = DVector::from_vec(problem.table().coordinates());
        let products = problem.table().free_products();
        minimise_escaping_absent_lobes(&problem, problem.table(), start, |start| {
            minimise_in_parts(&problem, &products, &start, TOLERANCES, self.limits(iterations, None))
        })
    }
}
