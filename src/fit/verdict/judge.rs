//! Computes everything that follows from the parameters found: errors, covariance, criteria, warnings.

use super::bootstrap::Resampled;
use super::covariance::{CommonError, Covariance, Grouping, Method, Noise};
use super::errors::{ErrorTable, score_but};
use super::result::{Fit, Selection, selection};
use super::saturation::saturated;
use super::warning::{Unusable, Warning};
use super::warnings;
use crate::error::Error;
use crate::fit::options::{ScaleError, SigmaScale, Uncertainty};
use crate::fit::problem::loss::{LossKind, Objective};
use crate::fit::problem::metric::Metric;
use crate::fit::problem::reflectance::ReflectanceProblem;
use crate::fit::search::best_start::SearchOutcome;
use crate::fit::task::Task;
use crate::math::count;
use crate::measurement::{Clusters, Weighting};
use crate::parameters::{ParameterRow, ParameterTable, Status};
use crate::solver::inverse::arrow::Arrow;
use crate::solver::inverse::curvature::beyond_linear;
use crate::solver::inverse::jackknife::GroupedRows;
use crate::solver::{LeastSquares, Linearisation, Rows, Solution, Termination};
use nalgebra::{DMatrix, DVector};
use std::cell::OnceCell;

/// Number of samples on which the curvature of the cost is found. It does not depend on how many there are.
const CURVATURE_SAMPLES: usize = 3000;
/// Largest number of groups times parameters for which narrower groups are tried.
const MOST_WORK: usize = 20_000;
/// Largest number of samples for which the errors of independent samples are computed beside those of groups. With more, these are far below.
const MOST_FOR_INDEPENDENT_ERRORS: usize = 100_000;
/// Step of the differences by the measurement's scale.
const SCALE_STEP: f64 = 1e-3;
/// Number of samples on which freeing a parameter is tried.
const CHECK_SAMPLES: usize = 1500;
/// Largest number of iterations of such a trial.
const CHECK_ITERATIONS: u64 = 30;
/// Freeing a parameter is worth a warning if it lowers the cost by more than this fraction.
const WORTH_FREEING: f64 = 0.2;
/// If a loss leaves a parameter less than this fraction of its information, it treats the samples that determine the
/// parameter as outliers.
const LEAST_INFORMATION: f64 = 0.1;

/// The numbers of residuals, free parameters and degrees of freedom.
struct Counts {
    /// Number of residuals.
    n: usize,
    /// Number of free parameters.
    free: usize,
    /// Degrees of freedom, `n` less `free`: `dof` as an integer and `freedom` as a float.
    dof: i64,
    freedom: f64,
}

impl Counts {
    fn new(n: usize, free: usize) -> Self {
        let signed = |count: usize| i64::try_from(count).unwrap_or(i64::MAX);
        Self { n, free, dof: signed(n) - signed(free), freedom: count(n) - count(free) }
    }
}

/// What the covariance follows from.
struct Reached<'r, 'p> {
    problem: &'r ReflectanceProblem<'p>,
    table: &'r ParameterTable,
    solution: &'r Solution,
    counts: &'r Counts,
    /// Whether the cost is a likelihood for the given standard deviations.
    absolute: bool,
    /// Whether a loss other than least squares was minimised.
    robust: bool,
    /// The reduced chi-square, if `absolute` and there are degrees of freedom.
    reduced_chi2: Option<f64>,
}

impl Reached<'_, '_> {
    /// The covariance from the linear model.
    fn covariance(&self, method: Method, noise: &Noise<'_>) -> Option<Covariance> {
        Covariance::new(self.table, &self.solution.linearisation, method, noise, self.counts.freedom)
    }

    /// The rows of the sandwich for independent samples.
    fn scatter(&self, arrow: &Arrow) -> Linearisation {
        let typical = (self.solution.cost / self.counts.freedom).sqrt();
        self.problem.scatter(&self.solution.x, |columns| arrow.root(columns), typical)
    }
}

impl Task<'_> {
    /// Computes everything that follows from the parameters found.
    pub(in crate::fit) fn judge(
        &self,
        problem: &ReflectanceProblem<'_>,
        table: ParameterTable,
        solution: Solution,
        found: SearchOutcome,
        resampled: Option<Resampled>,
    ) -> Result<Fit, Error> {
        // The errors of the model, and whether there are enough residuals to determine the parameters.
        let samples = self.samples;
        let known = self.known_squares(&solution, found.objective);
        let errors = score_but(self.expression, samples, &table, known.as_deref());
        let counts = Counts::new(problem.residuals(), table.free().len());
        let unusable = unusable(&solution, &counts, &errors);

        // The uncertainty of the parameters. Under a loss other than least squares, the cost is not a likelihood for
        // the given standard deviations.
        let robust = found.objective.loss != LossKind::None;
        let absolute = samples.weighting == Weighting::Sigma && !robust;
        let likelihood = if absolute && self.options.metric == Metric::UnbiasedCbrt {
            self.chi_square_of(samples, &table)
        } else {
            solution.cost
        };
        let Counts { n, free, dof, freedom } = counts;
        let reduced_chi2 = (absolute && dof > 0).then(|| likelihood / freedom);
        let reached = Reached {
            problem,
            table: &table,
            solution: &solution,
            counts: &counts,
            absolute,
            robust,
            reduced_chi2,
        };
        let covariance = self.covariance(&reached);
        // Without the formula's covariance it is unknown which parameters are determined.
        let resampled = resampled.filter(|_| covariance.is_some());
        let covariance = match &resampled {
            Some(resampled) => covariance.map(|formula| resampled.covariance(formula)),
            None => covariance,
        };

        // Criteria that weigh the error against the number of parameters.
        let selection = if robust { Selection::default() } else { selection(likelihood, n, free, absolute) };

        let misfit = self.misfit(&table, reduced_chi2, errors.all.relative);
        let mut fit = Fit {
            model: self.expression.clone(),
            weighting: samples.weighting,
            used: samples.len(),
            dropped: samples.dropped.clone(),
            missing: samples.missing.clone(),
            reduced_chi2,
            misfit,
            sigma_unused: self.with_sigma.is_some(),
            selection,
            loss_scale: robust.then_some(found.objective.scale),
            errors,
            budget: None,
            errors_on_all: None,
            held_out: None,
            covariance,
            resampled,
            profiled: None,
            cost: solution.cost,
            n,
            dof,
            starts: found.starts,
            termination: solution.termination,
            unusable,
            iterations: solution.iterations,
            evaluations: solution.evaluations,
            warnings: Vec::new(),
            table,
        };

        // The warnings.
        let mut warnings = self.general_warnings(&fit);
        warnings.extend(warnings::misfit(&fit));
        warnings.extend(self.biased(&fit, found.objective)?);
        warnings.extend(warnings::strengths(&fit));
        warnings.extend(warnings::at_bounds(&fit));
        warnings.extend(warnings::identifiability(&fit, samples, &found.profiles));
        warnings.extend(self.unresolved(problem, &fit)?);
        warnings.extend(warnings::ties(&fit));
        warnings.extend(warnings::discarded(&fit));
        // A model that fits needs no other parameters.
        let fits = fit.misfit.is_some_and(|misfit| !misfit.is_significant());
        if fit.unusable.is_none() && !fits {
            warnings.extend(self.worth_freeing(&fit.table, found.objective)?);
        }
        fit.warnings = warnings;
        Ok(fit)
    }

    /// The mean square in `unbiased-cbrt` of each channel, if it is what was minimised and the channels have as many values each.
    fn known_squares(&self, solution: &Solution, objective: Objective) -> Option<Vec<f64>> {
        let samples = self.samples;
        let minimised = objective == Objective::from(Metric::UnbiasedCbrt) && samples.sigma.is_none();
        let costs = &solution.linearisation.costs;
        let all_count = costs.len() == samples.values.len() && !samples.dead.contains(&true);
        let complete = samples.missing.iter().all(|missing| *missing == 0);
        (minimised && all_count && complete)
            .then(|| costs.iter().map(|cost| cost * count(costs.len())).collect())
    }

    /// The covariance; `None` if the fit was cut short, because then it is not at a minimum.
    fn covariance(&self, reached: &Reached<'_, '_>) -> Option<Covariance> {
        let Reached { problem, table, solution, .. } = *reached;
        if !solution.termination.converged() {
            return None;
        }
        let by_groups = matches!(self.options.uncertainty, Uncertainty::Clustered | Uncertainty::Profile);
        let grouped = by_groups && !self.suffices(reached);
        let curvature =
            if grouped || self.options.scale_error.is_some() { self.curvature(reached) } else { Vec::new() };
        let clustered = if grouped { self.clustered(reached, &curvature) } else { None };
        let clustered =
            clustered.map(|covariance| self.as_refits_scatter(covariance, table, problem.objective()));
        let mut covariance = clustered.or_else(|| self.formula(reached))?;
        if let Some(scale_error) = self.options.scale_error {
            let error = self.common_error(scale_error, reached, &curvature);
            covariance = covariance.with_common_error(table, &solution.linearisation, &error);
        }
        if reached.robust {
            covariance.discard(self.discarded(table, solution));
        }
        covariance.decided_by_few(self.decided_by_few(problem, table, solution, &covariance));
        Some(covariance)
    }

    /// Whether the given standard deviations suffice for the covariance: the user says that they have the right proportions, or the
    /// residuals are no larger than they say.
    fn suffices(&self, reached: &Reached<'_, '_>) -> bool {
        let Some(reduced) = reached.reduced_chi2 else { return false };
        let exceeds = reduced > 1.0 && warnings::is_far_from_one(reduced, reached.counts.freedom);
        self.options.sigma_scale == SigmaScale::Auto || !exceeds
    }

    /// The covariance from groups of samples that err together: the widest groups of which none decides a parameter alone or, if there are
    /// no such groups, the widest. `None` if there are too few groups.
    fn clustered(&self, reached: &Reached<'_, '_>, curvature: &[DMatrix<f64>]) -> Option<Covariance> {
        let cached = OnceCell::new();
        let scatter =
            |arrow: &Arrow| -> Linearisation { cached.get_or_init(|| reached.scatter(arrow)).clone() };
        let compares = self.samples.len() <= MOST_FOR_INDEPENDENT_ERRORS;
        let mut first = None;
        for clusters in self.samples.clusters(reached.problem.most_columns()) {
            let Clusters { kind, width_deg, groups, of_sample } = clusters;
            if first.is_some() && groups * reached.table.free().len() > MOST_WORK {
                break;
            }
            let sums = reached.problem.group_sums(&reached.solution.x, groups, &of_sample);
            let rows = GroupedRows { sums: &sums, curvature };
            let scatter: Option<&dyn Fn(&Arrow) -> Linearisation> = compares.then_some(&scatter);
            let noise = Noise::Groups(Grouping { kind, width_deg, groups, refits: None }, rows, scatter);
            let found = reached.covariance(Method::Clustered, &noise)?;
            if found.decided_by_one.is_empty() {
                return Some(found);
            }
            first = first.or(Some(found));
        }
        first
    }

    /// The curvature of the cost beyond that of the linear model, in the blocks of the model.
    fn curvature(&self, reached: &Reached<'_, '_>) -> Vec<DMatrix<f64>> {
        let samples = self.draws.part(CURVATURE_SAMPLES, self.options.seed);
        let objective = reached.problem.objective();
        let problem = self.problem(&self.observe(&samples), reached.table.clone(), objective);
        let mut curvature = beyond_linear(&problem, &reached.solution.x);
        let share = self.share_of_cost(&samples);
        curvature.iter_mut().for_each(|matrix| *matrix /= share);
        curvature
    }

    /// How an error of the measurement's scale changes the slope of the cost.
    fn common_error<'c>(
        &self,
        scale_error: ScaleError,
        reached: &Reached<'_, '_>,
        curvature: &'c [DMatrix<f64>],
    ) -> CommonError<'c> {
        let slopes = |factor: f64| -> Vec<DVector<f64>> {
            let samples = self.samples.clone().scaled(&vec![factor; self.samples.values.len()]);
            let objective = reached.problem.objective();
            let problem = self.problem(&self.observe(&samples), reached.table.clone(), objective);
            problem.linearise(&reached.solution.x).blocks.iter().map(Rows::slope).collect()
        };
        let (below, above) = (slopes(1.0 - SCALE_STEP), slopes(1.0 + SCALE_STEP));
        let by = scale_error.relative / (2.0 * SCALE_STEP);
        CommonError {
            slopes: below.iter().zip(&above).map(|(below, above)| (above - below) * by).collect(),
            each_channel: scale_error.per_channel,
            curvature,
        }
    }

    /// The covariance by the formula for independent samples.
    fn formula(&self, reached: &Reached<'_, '_>) -> Option<Covariance> {
        let Reached { problem, solution, absolute, .. } = *reached;
        let given = if absolute { problem.given_noise(&solution.x) } else { None };
        let scatter = |arrow: &Arrow| given.clone().unwrap_or_else(|| reached.scatter(arrow));
        let method = if absolute { Method::Absolute } else { Method::Sandwich };
        let noise = if absolute && given.is_none() { Noise::Unit } else { Noise::Rows(&scatter) };
        let covariance = reached.covariance(method, &noise)?;
        Some(match (self.options.sigma_scale, reached.reduced_chi2) {
            (SigmaScale::Auto, Some(chi2)) => covariance.scaled(chi2, reached.counts.freedom),
            _ => covariance,
        })
    }

    /// The rows for which a loss discards most of the information in the samples.
    fn discarded(&self, table: &ParameterTable, solution: &Solution) -> Vec<usize> {
        let plain = self.problem(&self.observe(self.samples), table.clone(), self.options.metric.into());
        let lengths = |model: &Linearisation| model.column_lengths(solution.x.len());
        let (kept, all) = (lengths(&solution.linearisation), lengths(&plain.linearise(&solution.x)));
        let lost = |((row, kept), all): ((&usize, &f64), &f64)| {
            (kept * kept < LEAST_INFORMATION * all * all).then_some(*row)
        };
        table.free().iter().zip(kept.iter()).zip(all.iter()).filter_map(lost).collect()
    }

    /// The warnings that do not depend on how well the parameters are known.
    fn general_warnings(&self, fit: &Fit) -> Vec<Warning> {
        let mut warnings = Vec::new();
        if let Some(reason) = &fit.unusable {
            warnings.push(Warning::NotUsable(*reason));
        }
        warnings.extend(saturated(fit.table.channels(), self.samples, self.options.loss));
        for (index, row) in fit.table.rows().iter().enumerate().filter(|(_, row)| row.held) {
            // What is fixed by default is worth a word only if the user wanted to fit it.
            let Some(isotropy) = row.spec.isotropy.filter(|_| row.overruled || !row.spec.fixed) else {
                continue;
            };
            let (parameter, azimuths) = (fit.table.name(index), fit.table.azimuths());
            warnings.push(Warning::Isotropic { parameter, isotropy, azimuths });
        }
        warnings
    }

    /// Warns of parameters that are fixed by default but should have been fitted.
    fn worth_freeing(&self, table: &ParameterTable, objective: Objective) -> Result<Vec<Warning>, Error> {
        let mut doubted: Vec<&ParameterRow> = Vec::new();
        for (index, row) in table.rows().iter().enumerate() {
            // The strength of a body is part of its albedo.
            let of_body = !table.has_width(row.lobe) && table.scales(row.lobe).contains(&index);
            let by_default =
                row.spec.fixed && row.status == Status::Fixed && !row.given && !row.held && !of_body;
            let same = |other: &&ParameterRow| (other.lobe, other.parameter) == (row.lobe, row.parameter);
            if by_default && !doubted.iter().any(same) {
                doubted.push(row);
            }
        }
        let mut warnings = Vec::new();
        if doubted.is_empty() {
            return Ok(warnings);
        }
        let check_samples = self.draws.part(CHECK_SAMPLES, self.options.seed);
        let check_samples = self.observe(&check_samples);
        let held = self.polish(&check_samples, table.clone(), objective, CHECK_ITERATIONS)?.cost;
        for row in doubted {
            let freed = table.with_freed(table.places(row.lobe, row.parameter));
            let solution = self.polish(&check_samples, freed.clone(), objective, CHECK_ITERATIONS)?;
            let (loose, mut there) = (solution.cost, freed);
            there.set_coordinates(solution.x.as_slice());
            if loose < (1.0 - WORTH_FREEING) * held && leads_somewhere(&there, row) {
                warnings.push(Warning::WorthFreeing {
                    parameter: table.parameter_name(row),
                    value: row.value,
                    gain: 1.0 - loose / held,
                });
            }
        }
        Ok(warnings)
    }
}

/// Whether a parameter that was freed found a value of its own: within its bounds in every channel and, for a strength of a surface
/// lobe, without the lobe reflecting more than its facets receive.
fn leads_somewhere(table: &ParameterTable, row: &ParameterRow) -> bool {
    let strength = table.scales(row.lobe);
    table.places(row.lobe, row.parameter).iter().all(|index| {
        let freed = &table.rows()[*index];
        let too_strong = strength.contains(index) && freed.value > 1.0;
        !(freed.at_lower() || freed.at_upper() || too_strong)
    })
}

/// Why a result must not be used; `None` if it may be used.
fn unusable(solution: &Solution, counts: &Counts, errors: &ErrorTable) -> Option<Unusable> {
    let finite = [errors.all.l2, errors.all.log, errors.all.cbrt].iter().all(|e| e.is_finite());
    if !finite || !solution.cost.is_finite() {
        return Some(Unusable::NotFinite);
    }
    // As many parameters as values fit anything, and say nothing about noise.
    if counts.dof <= 0 {
        return Some(Unusable::TooFewValues { free: counts.free });
    }
    match solution.termination {
        reason if reason.converged() => None,
        Termination::IterationLimit => Some(Unusable::IterationLimit),
        Termination::Interrupted => Some(Unusable::Interrupted),
        Termination::Timeout => Some(Unusable::Timeout),
        _ => Some(Unusable::Stuck),
    }
}
