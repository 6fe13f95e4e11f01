//! Options that say how far a fit can be trusted.

use brdfit::Error;
use brdfit::fit::{Options, Uncertainty, checked_fraction};
use brdfit::report::OptionRecord;
use clap::{Args, ValueEnum};

/// What is done to judge a fit.
#[derive(Args)]
pub struct TrustArguments {
    /// Leave this fraction of the angles of incidence out of the fit, and report the errors on them
    #[arg(long, value_name = "FRACTION")]
    hold_out: Option<f64>,
    /// Standard errors by formula, or from fits repeated on resampled angles of incidence
    #[arg(long, value_enum, default_value_t = UncertaintyName::Formula)]
    uncertainty: UncertaintyName,
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
            ..options
        })
    }

    /// The record of the options with these.
    pub fn record(&self, record: OptionRecord) -> OptionRecord {
        OptionRecord {
            hold_out: self.hold_out,
            uncertainty: Some(Uncertainty::from(self.uncertainty).name()),
            ..record
        }
    }
}
