//! Options that say how far a fit can be trusted.

use brdfit::Error;
use brdfit::fit::{Options, checked_fraction};
use brdfit::report::OptionRecord;
use clap::Args;

/// What is done to judge a fit.
#[derive(Args)]
pub struct TrustArguments {
    /// Leave this fraction of the angles of incidence out of the fit, and report the errors on them
    #[arg(long, value_name = "FRACTION")]
    hold_out: Option<f64>,
}

impl TrustArguments {
    /// The fit's options with these.
    pub fn apply(&self, options: Options) -> Result<Options, Error> {
        Ok(Options { hold_out: self.hold_out.map(checked_fraction).transpose()?, ..options })
    }

    /// The record of the options with these.
    pub fn record(&self, record: OptionRecord) -> OptionRecord {
        OptionRecord { hold_out: self.hold_out, ..record }
    }
}
