//! A whole fit: select the samples, search for a start, polish, and judge the result.

use super::bootstrap::{self, Resampled, Uncertainty};
use super::coarse::{Candidate, search};
use super::errors::{ErrorTable, score};
use super::hold_out::{self, HeldOut};
use super::least_squares::LeastSquares;
use super::levenberg_marquardt::{Limits, Observer, Solution, StopSignal, Termination, Tolerances, minimise};
use super::metric::Metric;
use super::parameters::{ParameterTable, Row, Settings, Status};
use super::problem::ReflectanceProblem;
use super::solvers::{SolverKind, minimise_with};
use super::uncertainty::Covariance;
use crate::error::Error;
use crate::math::count;
use crate::measurement::{Filters, Measurement, Samples, Weighting};
use crate::model::{Expression, Role};
use nalgebra::DVector;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

/// What to fit and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// What is minimised.
    pub metric: Metric,
    /// Which samples count.
    pub filters: Filters,
    /// Wishes about parameters.
    pub settings: Settings,
    /// Seed of the draws of samples.
    pub seed: u64,
    /// Fraction of the angles of incidence that is left out of the fit, to judge it by; none if none.
    pub hold_out: Option<f64>,
    /// Where standard errors come from.
    pub uncertainty: Uncertainty,
    /// What minimises in the final fit.
    pub solver: SolverKind,
    /// Most iterations of the final fit by Levenberg-Marquardt; other solvers make more of them.
    pub iterations: u64,
    /// Set to true to stop with the best so far.
    pub stop: Option<StopSignal>,
    /// The moment to stop at.
    pub deadline: Option<Instant>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            metric: Metric::default(),
            filters: Filters::default(),
            settings: Vec::new(),
            seed: 0,
            hold_out: None,
            uncertainty: Uncertainty::default(),
            solver: SolverKind::default(),
            iterations: 300,
            stop: None,
            deadline: None,
        }
    }
}

/// Hears how a fit goes on.
pub trait Progress: Send + Sync {
    /// A new stage begins.
    fn stage(&self, name: &str);
    /// An iteration of the final fit is over.
    fn iteration(&self, iteration: u64, cost: f64);
}

/// Hears nothing.
#[derive(Clone, Copy, Debug)]
pub struct Quiet;

impl Progress for Quiet {
    fn stage(&self, _: &str) {}
    fn iteration(&self, _: u64, _: f64) {}
}

/// One start of the search and where it led.
#[derive(Clone, Debug)]
pub struct Start {
    /// Cost after polishing, on the samples of the search.
    pub cost: f64,
    /// The shapes that it started from: full name and value.
    pub shapes: Vec<(String, f64)>,
    /// Why the polishing stopped.
    pub termination: Termination,
}

/// Something that the user should know before relying on the result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Short name of the kind.
    pub kind: &'static str,
    /// The parameter concerned, if it is one.
    pub parameter: Option<String>,
    /// What it is and what to do next.
    pub text: String,
}

/// Criteria that weigh the error against the number of parameters.
#[derive(Clone, Copy, Debug)]
pub struct Selection {
    /// Akaike's information criterion, corrected for small samples.
    pub aicc: Option<f64>,
    /// Bayesian information criterion.
    pub bic: Option<f64>,
}

/// The result of a fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// All parameters at their final values.
    pub table: ParameterTable,
    /// How the samples were weighted.
    pub weighting: Weighting,
    /// Samples used.
    pub used: usize,
    /// Samples left out, by reason.
    pub dropped: BTreeMap<&'static str, usize>,
    /// Every error.
    pub errors: ErrorTable,
    /// Covariance of the free parameters.
    pub covariance: Option<Covariance>,
    /// The fits repeated on resampled angles of incidence, where the covariance is theirs.
    pub resampled: Option<Resampled>,
    /// The sum of squares that was minimised.
    pub cost: f64,
    /// Number of residuals.
    pub n: usize,
    /// Number of residuals less that of free parameters.
    pub dof: i64,
    /// chi^2/dof where the standard deviations were given.
    pub reduced_chi2: Option<f64>,
    /// Model selection.
    pub selection: Selection,
    /// Errors on the samples held out, where some were.
    pub held_out: Option<HeldOut>,
    /// The starts tried.
    pub starts: Vec<Start>,
    /// Why it stopped.
    pub termination: Termination,
    /// Why the result is not usable; none if it is.
    pub unusable: Option<String>,
    /// Iterations of the final fit.
    pub iterations: u64,
    /// Evaluations of the final fit.
    pub evaluations: u64,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// The end of a fit. A promised decrease of 1e-12 of the cost moves the parameters by about
/// 1e-6 sqrt(n) standard errors.
const FINAL: Tolerances = Tolerances { step: 1e-11, cost: 1e-12, gradient: 1e-11 };
/// Samples of the scan, of the polishing of its best points, and of the check of default-fixed parameters.
const SCAN_SAMPLES: usize = 800;
const POLISH_SAMPLES: usize = 6000;
const CHECK_SAMPLES: usize = 1500;
/// Points of the scan that are polished.
const POLISHED: usize = 5;
/// A parameter that would lower the cost by this share when freed is worth a warning.
const WORTH_FREEING: f64 = 0.1;
/// An amplitude whose whole effect is below this share of the data is nothing but rounding.
const NEGLIGIBLE_EFFECT: f64 = 1e-9;
/// Starts whose costs agree to this have found the same minimum.
const SAME_MINIMUM: f64 = 1e-6;
/// Correlations beyond this are worth a warning.
const STRONG_CORRELATION: f64 = 0.98;

/// Fits `expression` to `measurement`.
///
/// # Errors
/// [`Error::Usage`] for settings that do not fit, [`Error::NoSamples`] if the filters leave nothing,
/// [`Error::Optimiser`] for a defect. A fit that does not converge is not an error: see [`Fit::unusable`].
pub fn fit(
    measurement: &Measurement,
    expression: &Expression,
    options: &Options,
    progress: &Arc<dyn Progress>,
) -> Result<Fit, Error> {
    let (mut samples, table) = prepare(measurement, expression, options)?;
    let mut unseen = None;
    if let Some(fraction) = options.hold_out {
        let (fitted, left_out) = hold_out::split(&samples, fraction, options.seed, measurement)?;
        samples = fitted;
        unseen = Some(left_out);
    }
    let groups = match options.uncertainty {
        Uncertainty::Formula => None,
        Uncertainty::BlockBootstrap => Some(bootstrap::groups(&samples, measurement)?),
    };
    let task = Task { expression, samples: &samples, options };

    progress.stage("searching");
    let (table, starts) = task.search(table)?;

    progress.stage("fitting");
    let problem = task.problem(&samples, table.clone());
    // The search has left its best values in the table; `initial` remembers where they came from.
    let start = DVector::from_vec(table.coordinates());
    let heard = Arc::clone(progress);
    let observer: Observer = Arc::new(move |iteration, cost| heard.iteration(iteration, cost));
    let limits = task.limits(options.iterations, Some(observer));
    let mut solution = minimise_with(options.solver, &problem, start, FINAL, limits, options.seed)?;
    let mut table = table;
    table.set_coordinates(solution.x.as_slice());
    if task.drop_negligible(&mut table) {
        solution.x = DVector::from_vec(table.coordinates());
        solution.linearisation = problem.linearise(&solution.x);
        solution.cost = solution.linearisation.cost;
    }

    let (resampled, doubt) = match &groups {
        None => (None, None),
        Some(groups) => bootstrap::resample(&task, groups, &table, &solution, progress)?,
    };

    progress.stage("judging");
    let mut fit = task.judge(&problem, table, solution, starts, resampled)?;
    fit.warnings.extend(doubt);
    fit.held_out = unseen.map(|unseen| unseen.judge(expression, &fit.table));
    fit.warnings.splice(0..0, doubts(measurement));
    Ok(fit)
}

/// The samples that count, and the parameters as the options want them.
fn prepare(
    measurement: &Measurement,
    expression: &Expression,
    options: &Options,
) -> Result<(Samples, ParameterTable), Error> {
    let samples = Samples::select(measurement, &options.filters)?;
    let names: Vec<String> = measurement.channels.iter().map(|channel| channel.name.clone()).collect();
    let table = ParameterTable::new(expression, &names, measurement.directions.is_grid(), &options.settings)?;
    Ok((samples, table))
}

/// The reader's doubts about a file.
fn doubts(measurement: &Measurement) -> impl Iterator<Item = Warning> {
    measurement.doubts.iter().map(|(kind, text)| Warning { kind, parameter: None, text: text.clone() })
}

/// Scores the parameters that `options` set, without a fit.
///
/// # Errors
/// Like [`fit`].
pub fn evaluate(measurement: &Measurement, expression: &Expression, options: &Options) -> Result<Fit, Error> {
    let (samples, table) = prepare(measurement, expression, options)?;
    let defaults: Vec<String> = (0..table.rows().len())
        .filter(|index| table.rows().get(*index).is_some_and(|row| !row.given && row.status == Status::Free))
        .map(|index| table.name(index))
        .collect();
    let table = table.with_fixed(Role::Shape).with_fixed(Role::Amplitude);
    let task = Task { expression, samples: &samples, options };
    let problem = task.problem(&samples, table.clone());
    let solution = minimise(&problem, DVector::zeros(0), Tolerances::default(), Limits::iterations(0))?;
    let mut fit = task.judge(&problem, table, solution, Vec::new(), None)?;
    fit.warnings.retain(|warning| warning.kind == "not-usable");
    fit.warnings.splice(0..0, doubts(measurement));
    if !defaults.is_empty() {
        fit.warnings.push(Warning {
            kind: "default-used",
            parameter: defaults.first().cloned(),
            text: format!(
                "no value given for {}: the default was used; give one with --set",
                defaults.join(", ")
            ),
        });
    }
    Ok(fit)
}

/// A fit in progress.
pub(super) struct Task<'a> {
    pub(super) expression: &'a Expression,
    pub(super) samples: &'a Samples,
    pub(super) options: &'a Options,
}

impl Task<'_> {
    pub(super) fn limits(&self, iterations: u64, observer: Option<Observer>) -> Limits {
        Limits { iterations, stop: self.options.stop.clone(), deadline: self.options.deadline, observer }
    }

    pub(super) fn problem<'s>(
        &'s self,
        samples: &'s Samples,
        table: ParameterTable,
    ) -> ReflectanceProblem<'s> {
        ReflectanceProblem::new(self.expression, samples, table, self.options.metric)
    }

    /// The best start found, polished on part of the samples, and a record of all starts.
    fn search(&self, table: ParameterTable) -> Result<(ParameterTable, Vec<Start>), Error> {
        if table.free().is_empty() {
            return Ok((table, Vec::new()));
        }
        let seed = self.options.seed;
        let few = self.samples.subset(SCAN_SAMPLES, seed);
        let limits = self.limits(0, None);
        let candidates = search(self.expression, &few, &table, self.options.metric, POLISHED, &limits)?;
        let more = self.samples.subset(POLISH_SAMPLES, seed);
        let mut best: Option<(f64, ParameterTable)> = None;
        let mut starts = Vec::new();
        for Candidate { table, .. } in candidates {
            let solution = self.polish(&more, table.clone(), 60)?;
            let shapes = table
                .free()
                .iter()
                .filter_map(|index| table.rows().get(*index).map(|row| (index, row)))
                .filter(|(_, row)| row.spec.role == Role::Shape)
                .map(|(index, row)| (table.name(*index), row.value))
                .collect();
            starts.push(Start { cost: solution.cost, shapes, termination: solution.termination });
            // Of starts that lead to the same minimum the scan's favourite is kept.
            if best.as_ref().is_none_or(|(cost, _)| solution.cost < (1.0 - SAME_MINIMUM) * cost) {
                let mut polished = table;
                polished.set_coordinates(solution.x.as_slice());
                best = Some((solution.cost, polished));
            }
        }
        Ok((best.map_or(table, |(_, polished)| polished), starts))
    }

    fn polish(&self, samples: &Samples, table: ParameterTable, iterations: u64) -> Result<Solution, Error> {
        let problem = self.problem(samples, table);
        let start = DVector::from_vec(problem.table().coordinates());
        let tolerances = Tolerances { step: 1e-6, cost: 1e-7, gradient: 1e-6 };
        minimise(&problem, start, tolerances, self.limits(iterations, None))
    }

    /// Sets amplitudes without any effect to their bound; returns whether there were any.
    fn drop_negligible(&self, table: &mut ParameterTable) -> bool {
        let samples = self.samples.subset(POLISH_SAMPLES, self.options.seed);
        let problem = ReflectanceProblem::new(self.expression, &samples, table.clone(), Metric::L2);
        let x = DVector::from_vec(table.coordinates());
        let lengths = problem.linearise(&x).column_lengths(x.len());
        let data = problem.magnitude();
        let free = table.free().to_vec();
        let mut any = false;
        for (column, index) in free.into_iter().enumerate() {
            let Some(row) = table.rows().get(index) else { continue };
            let effect = row.value.abs() * lengths.get(column).copied().unwrap_or(0.0);
            if row.spec.role == Role::Amplitude
                && row.bounds.0 == 0.0
                && row.value > 0.0
                && effect < NEGLIGIBLE_EFFECT * data
            {
                table.set_value(index, 0.0);
                any = true;
            }
        }
        any
    }

    /// Everything that follows from the parameters found.
    fn judge(
        &self,
        problem: &ReflectanceProblem<'_>,
        table: ParameterTable,
        solution: Solution,
        starts: Vec<Start>,
        resampled: Option<Resampled>,
    ) -> Result<Fit, Error> {
        let samples = self.samples;
        let errors = score(self.expression, samples, &table);
        let n = problem.residuals();
        let free = table.free().len();
        let signed = |count: usize| i64::try_from(count).unwrap_or(i64::MAX);
        let dof = signed(n) - signed(free);
        let freedom = count(n) - count(free);
        let absolute = samples.weighting == Weighting::Sigma;
        let scatter = (!absolute).then(|| problem.scatter(&solution.x));
        let covariance =
            Covariance::new(&table, &solution.linearisation.matrix(free), scatter.as_ref(), freedom);
        // Without a covariance by the formula nothing says which parameters are determined.
        let resampled = resampled.filter(|_| covariance.is_some());
        let covariance = match &resampled {
            Some(resampled) => covariance.map(|formula| resampled.covariance(formula)),
            None => covariance,
        };
        let unusable = unusable(&solution, free, dof, &errors);
        let mut fit = Fit {
            weighting: samples.weighting,
            used: samples.len(),
            dropped: samples.dropped.clone(),
            reduced_chi2: (absolute && dof > 0).then(|| solution.cost / freedom),
            selection: selection(solution.cost, n, free, absolute),
            errors,
            held_out: None,
            covariance,
            resampled,
            cost: solution.cost,
            n,
            dof,
            starts,
            termination: solution.termination,
            unusable,
            iterations: solution.iterations,
            evaluations: solution.evaluations,
            warnings: Vec::new(),
            table,
        };
        let mut warnings = self.general_warnings(&fit);
        warnings.extend(bound_warnings(&fit.table));
        warnings.extend(identifiability_warnings(&fit));
        if fit.unusable.is_none() {
            warnings.extend(self.worth_freeing(&fit.table)?);
        }
        fit.warnings = warnings;
        Ok(fit)
    }

    fn general_warnings(&self, fit: &Fit) -> Vec<Warning> {
        let mut warnings = Vec::new();
        if let Some(reason) = &fit.unusable {
            warnings.push(Warning { kind: "not-usable", parameter: None, text: reason.clone() });
        }
        if self.samples.directions.is_grid() {
            let tied = fit.table.rows().iter().enumerate();
            let tied = tied
                .filter(|(_, row)| row.spec.isotropic_as.is_some() && matches!(row.status, Status::Tied(_)));
            for (index, row) in tied {
                warnings.push(Warning {
                    kind: "isotropic",
                    parameter: Some(fit.table.name(index)),
                    text: format!(
                        "tied to {}: a half/difference grid does not hold the half vector's azimuth; measure \
                         with varied phi_i to tell them apart",
                        row.spec.isotropic_as.unwrap_or_default()
                    ),
                });
            }
        }
        warnings
    }

    /// Parameters that are fixed by default and should not have been.
    fn worth_freeing(&self, table: &ParameterTable) -> Result<Vec<Warning>, Error> {
        let mut warnings = Vec::new();
        let mut seen: Vec<(usize, usize)> = Vec::new();
        // Drawn and fitted as it is once, for the first parameter that asks.
        let mut baseline: Option<(Samples, f64)> = None;
        for row in table.rows() {
            let place = (row.lobe, row.parameter);
            if !row.spec.fixed || row.status != Status::Fixed || row.given || seen.contains(&place) {
                continue;
            }
            seen.push(place);
            let (few, held) = match baseline.take() {
                Some(known) => known,
                None => {
                    let few = self.samples.subset(CHECK_SAMPLES, self.options.seed);
                    let held = self.polish(&few, table.clone(), 30)?.cost;
                    (few, held)
                }
            };
            let freed = table.with_freed(table.places(row.lobe, row.parameter));
            let loose = self.polish(&few, freed, 30)?.cost;
            if loose < (1.0 - WORTH_FREEING) * held {
                let name = parameter_name(table, row);
                warnings.push(Warning {
                    kind: "worth-freeing",
                    parameter: Some(name.clone()),
                    text: format!(
                        "fixed at {}, but the cost falls by {:.0} % without that: try --free {name}",
                        row.value,
                        100.0 * (1.0 - loose / held)
                    ),
                });
            }
            baseline = Some((few, held));
        }
        Ok(warnings)
    }
}

/// Why a result is not to be used.
fn unusable(solution: &Solution, free: usize, dof: i64, errors: &ErrorTable) -> Option<String> {
    let finite = [errors.all.l2, errors.all.log, errors.all.cbrt].iter().all(|e| e.is_finite());
    if !finite || !solution.cost.is_finite() {
        return Some("the model is not finite at some samples".to_owned());
    }
    if dof < 0 {
        return Some(format!(
            "fewer values than the {free} free parameters: measure more directions, or --fix some parameters"
        ));
    }
    match solution.termination {
        reason if reason.converged() => None,
        Termination::IterationLimit => Some(
            "the iteration limit was reached before a minimum: start closer with --init, or fit fewer parameters"
                .to_owned(),
        ),
        Termination::Interrupted => Some("interrupted before a minimum was reached".to_owned()),
        Termination::Timeout => Some("the time limit was reached before a minimum: raise --timeout".to_owned()),
        _ => Some("no step lowers the error, though it should: the model may be too flat or not smooth here"
            .to_owned()),
    }
}

fn selection(cost: f64, n: usize, free: usize, absolute: bool) -> Selection {
    let (n, k) = (count(n), count(free));
    // With unknown noise its variance is estimated too.
    let (deviance, k) = if absolute { (cost, k) } else { (n * cost.ln(), k + 1.0) };
    let finite = |value: f64| value.is_finite().then_some(value);
    let correction = 2.0 * k * (k + 1.0) / (n - k - 1.0);
    Selection {
        aicc: if n > k + 1.0 { finite(deviance + 2.0 * k + correction) } else { None },
        bic: finite(deviance + k * n.ln()),
    }
}

/// Lobe and parameter, without the channel.
fn parameter_name(table: &ParameterTable, row: &Row) -> String {
    format!("{}.{}", table.lobes().get(row.lobe).map_or("", String::as_str), row.spec.name)
}

/// One warning per parameter at a bound, its channels together.
fn bound_warnings(table: &ParameterTable) -> Vec<Warning> {
    let mut groups: Vec<(String, bool, f64, Vec<String>)> = Vec::new();
    for row in table.free_rows() {
        for (at, upper, bound) in
            [(row.at_lower(), false, row.bounds.0), (row.at_upper(), true, row.bounds.1)]
        {
            if !at {
                continue;
            }
            let name = parameter_name(table, row);
            let channel = row.channel.and_then(|c| table.channels().get(c)).cloned();
            match groups.iter_mut().find(|(n, u, ..)| *n == name && *u == upper) {
                Some((.., channels)) => channels.extend(channel),
                None => groups.push((name, upper, bound, channel.into_iter().collect())),
            }
        }
    }
    let text = |(name, upper, bound, channels): (String, bool, f64, Vec<String>)| {
        let side = if upper { "upper" } else { "lower" };
        let of = if channels.is_empty() { String::new() } else { format!(" for {}", channels.join(", ")) };
        let advice = if !upper && bound == 0.0 {
            "the data do not ask for it; fit without it, or check the data's zero".to_owned()
        } else {
            format!("it has no error there; widen it with --bounds {name}=LO..HI if that makes sense")
        };
        Warning {
            kind: "at-bound",
            text: format!("at its {side} bound {bound}{of}: {advice}"),
            parameter: Some(name),
        }
    };
    groups.into_iter().map(text).collect()
}

/// Parameters that the data do not tell apart.
fn identifiability_warnings(fit: &Fit) -> Vec<Warning> {
    let Some(covariance) = &fit.covariance else { return Vec::new() };
    let mut warnings = Vec::new();
    if !covariance.undetermined.is_empty() {
        let names: Vec<String> = covariance.undetermined.iter().map(|row| fit.table.name(*row)).collect();
        warnings.push(Warning {
            kind: "not-identifiable",
            parameter: names.first().cloned(),
            text: format!(
                "the data do not determine {} separately: --fix one of them, or use a model without it",
                names.join(", ")
            ),
        });
    }
    let mut strongest: Option<(f64, usize, usize)> = None;
    for (i, &a) in covariance.rows.iter().enumerate() {
        for &b in covariance.rows.iter().skip(i + 1) {
            if let Some(c) = covariance.correlation(a, b)
                && c.abs() > STRONG_CORRELATION
                && strongest.is_none_or(|(s, ..)| c.abs() > s.abs())
            {
                strongest = Some((c, a, b));
            }
        }
    }
    if let Some((correlation, a, b)) = strongest {
        let (a, b) = (fit.table.name(a), fit.table.name(b));
        warnings.push(Warning {
            kind: "correlated",
            text: format!(
                "correlation {correlation:.4} with {b}: the data hardly tell them apart; --fix one, or measure \
                 closer to grazing"
            ),
            parameter: Some(a),
        });
    }
    warnings
}
