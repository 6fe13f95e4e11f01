//! Options about parameters: `P=V`, `P=LO..HI`, `P=Q`, `P`.

use crate::cli::messages::typed;
use brdfit::parameters::SettingTexts;
use clap::Args;

/// The options that fix, start, bound, free, tie and share parameters.
#[derive(Args)]
pub struct SettingArguments {
    /// Fix a parameter at a value; repeat the option for several parameters
    #[arg(long, value_name = "P=V")]
    fix: Vec<String>,
    /// Start a parameter from a value
    #[arg(long, value_name = "P=V")]
    init: Vec<String>,
    /// Bound a parameter by two values
    #[arg(long, value_name = "P=LO..HI")]
    bounds: Vec<String>,
    /// Fit a parameter that is fixed by default
    #[arg(long, value_name = "P")]
    free: Vec<String>,
    /// Make a parameter equal to another
    #[arg(long, value_name = "P=Q")]
    tie: Vec<String>,
    /// Give a parameter one value per channel
    #[arg(long, value_name = "P")]
    per_channel: Vec<String>,
    /// Give a parameter one value for all channels
    #[arg(long, value_name = "P")]
    shared: Vec<String>,
}

impl SettingArguments {
    /// The options as the user typed them, for the report.
    pub fn as_given(&self) -> Vec<String> {
        self.texts()
            .as_given()
            .into_iter()
            .map(|(option, text)| format!("{} {text}", typed(option)))
            .collect()
    }

    /// The options as given.
    pub fn texts(&self) -> SettingTexts {
        SettingTexts {
            fix: self.fix.clone(),
            init: self.init.clone(),
            bounds: self.bounds.clone(),
            free: self.free.clone(),
            tie: self.tie.clone(),
            per_channel: self.per_channel.clone(),
            shared: self.shared.clone(),
        }
    }
}
