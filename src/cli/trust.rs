//! Options about how a fit is made and judged: samples held out, resampled errors, other solvers.

use brdfit::Error;
use brdfit::fit::{Options, SolverKind, Uncertainty, checked_fraction};
use brdfit::report::OptionRecord;
use clap::{Args, ValueEnum};

/// How a fit is made and judged.
#[derive(Args)]
pub struct TrustArguments {
    /// Leave this fraction of the angles of incidence out of the fit, and report the errors on them
    #[arg(long, value_name = "FRACTION")]
    hold_out: Option<f64>,
    /// Standard errors by formula, or from fits repeated on resampled angles of incidence
    #[arg(long, value_enum, default_value_t = UncertaintyName::Formula)]
    uncertainty: UncertaintyName,
    /// What minimises in the final fit; all but the first serve to compare
    #[arg(long, value_enum, default_value_t = SolverName::LevenbergMarquardt, value_name = "NAME")]
    solver: SolverName,
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
    Formula,
    BlockBootstrap,
}

impl From<UncertaintyName> for Uncertainty {
    fn from(name: UncertaintyName) -> Self {
        match name {
            UncertaintyName::Formula => Self::Formula,
            UncertaintyName::BlockBootstrap => Self::BlockBootstrap,
        }
    }
}

impl TrustArguments {
    /// The fit's options with these.
    pub fn apply(&self, options: Options) -> Result<Options, Error> {
        Ok(Options {
            hold_out: self.hold_out.map(checked_fraction).transpose()?,
            uncertainty: self.uncertainty.into(),
            solver: self.solver.into(),
            ..options
        })
    }

    /// The record of the options with these.
    pub fn record(&self, record: OptionRecord) -> OptionRecord {
        OptionRecord {
            hold_out: self.hold_out,
            solver: Some(SolverKind::from(self.solver).name()),
            uncertainty: Some(Uncertainty::from(self.uncertainty).name()),
            ..record
        }
    }
}
