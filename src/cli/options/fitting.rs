//! Options about how a fit is made and judged: samples held out, resampled errors, other solvers, budgets.

use brdfit::Error;
use brdfit::fit::{
    Budget, Fit, Options, SigmaScale, Uncertainty, checked_target, fit, fit_to_target, fit_within,
};
use brdfit::measurement::Measurement;
use brdfit::model::Expression;
use brdfit::progress::Progress;
use brdfit::solver::SolverKind;
use clap::{Args, ValueEnum};
use std::sync::Arc;

/// How a fit is made and judged.
#[derive(Args)]
pub struct FittingArguments {
    /// Fit again without some of the incidence angles, until each was left out once, and report the errors on
    /// what was left out: a fraction of them at a time (0.2 makes five more fits), or `each`
    #[arg(long, value_name = "FRACTION|each")]
    hold_out: Option<String>,
    /// Find standard errors from groups of samples that err together, by the formula for independent samples, or by refitting resampled
    /// incidence angles (200 fits); or intervals from profiles of the cost (some 20 fits per parameter)
    #[arg(long, value_enum, default_value_t = UncertaintyName::Clustered)]
    uncertainty: UncertaintyName,
    /// Take the standard deviations of --weights sigma as the noise itself, or up to a factor that chi-square gives
    #[arg(long, value_enum, default_value_t = SigmaScaleName::Absolute)]
    sigma_scale: SigmaScaleName,
    /// Include this error of the measurement's scale in standard errors: such as 2%, or 2%,per-channel if each channel was calibrated by itself
    #[arg(long, value_name = "SIZE")]
    scale_error: Option<String>,
    /// Optimiser of the final fit; the default is the one to use, the others are for comparison
    #[arg(long, value_enum, default_value_t = SolverName::LevenbergMarquardt, value_name = "NAME")]
    solver: SolverName,
    /// Limit the samples and iterations: fast 2000 and 60, balanced 20000 and 120, full all and 300
    #[arg(long, value_enum, value_name = "NAME", conflicts_with_all = ["samples", "target_error"])]
    budget: Option<BudgetName>,
    /// Use the cheapest budget whose fit reaches this error on all samples
    #[arg(long, value_name = "E", conflicts_with = "samples")]
    target_error: Option<f64>,
}

#[derive(Clone, Copy, ValueEnum)]
enum BudgetName {
    Fast,
    Balanced,
    Full,
}

impl From<BudgetName> for Budget {
    fn from(name: BudgetName) -> Self {
        match name {
            BudgetName::Fast => Self::Fast,
            BudgetName::Balanced => Self::Balanced,
            BudgetName::Full => Self::Full,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum SolverName {
    LevenbergMarquardt,
    LBfgs,
    NelderMead,
    ParticleSwarm,
}

impl From<SolverName> for SolverKind {
    fn from(name: SolverName) -> Self {
        match name {
            SolverName::LevenbergMarquardt => Self::LevenbergMarquardt,
            SolverName::LBfgs => Self::LBfgs,
            SolverName::NelderMead => Self::NelderMead,
            SolverName::ParticleSwarm => Self::ParticleSwarm,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum UncertaintyName {
    Clustered,
    Formula,
    BlockBootstrap,
    Profile,
}

#[derive(Clone, Copy, ValueEnum)]
enum SigmaScaleName {
    Absolute,
    Auto,
}

impl From<SigmaScaleName> for SigmaScale {
    fn from(name: SigmaScaleName) -> Self {
        match name {
            SigmaScaleName::Absolute => Self::Absolute,
            SigmaScaleName::Auto => Self::Auto,
        }
    }
}

impl From<UncertaintyName> for Uncertainty {
    fn from(name: UncertaintyName) -> Self {
        match name {
            UncertaintyName::Clustered => Self::Clustered,
            UncertaintyName::Formula => Self::Formula,
            UncertaintyName::BlockBootstrap => Self::BlockBootstrap,
            UncertaintyName::Profile => Self::Profile,
        }
    }
}

impl FittingArguments {
    /// Returns `options` with these set.
    pub fn apply(&self, options: Options) -> Result<Options, Error> {
        self.target_error.map(checked_target).transpose()?;
        let mut options = options
            .with_uncertainty(self.uncertainty.into())
            .with_sigma_scale(self.sigma_scale.into())
            .with_solver(self.solver.into());
        options.scale_error = self.scale_error.as_deref().map(str::parse).transpose()?;
        options.hold_out = self.hold_out.as_deref().map(str::parse).transpose()?;
        Ok(options)
    }

    /// Fits within the budget, or until the target error is reached.
    pub fn fit(
        &self,
        measurement: &Measurement,
        expression: &Expression,
        options: &Options,
        progress: &Arc<dyn Progress>,
    ) -> Result<Fit, Error> {
        match (self.target_error, self.budget) {
            (Some(target), _) => fit_to_target(target, measurement, expression, options, progress),
            (None, Some(name)) => fit_within(name.into(), measurement, expression, options, progress),
            (None, None) => fit(measurement, expression, options, progress),
        }
    }

    /// The error that the fit should reach; `None` if there is no target.
    pub fn target_error(&self) -> Option<f64> {
        self.target_error
    }
}
