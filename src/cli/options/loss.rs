//! Options for data with outliers.

use brdfit::Error;
use brdfit::error::{OptionName, excerpt};
use brdfit::fit::{LOSS_SCALES, LossKind, Options};
use clap::{Args, ValueEnum};

/// The loss function and its scale.
#[derive(Args)]
pub struct LossArguments {
    /// Loss function: how strongly outliers are down-weighted (none is least squares)
    #[arg(long, value_enum, default_value_t = LossName::None)]
    loss: LossName,
    /// Residual above which the loss down-weights a sample [default: estimated from the residuals]
    #[arg(long, value_name = "S|auto")]
    loss_scale: Option<String>,
}

#[derive(Clone, Copy, ValueEnum)]
enum LossName {
    /// Least squares
    None,
    /// Squares up to the scale, absolute values above it
    Huber,
    /// The logarithm of one plus the square
    Cauchy,
}

impl From<LossName> for LossKind {
    fn from(name: LossName) -> Self {
        match name {
            LossName::None => Self::None,
            LossName::Huber => Self::Huber,
            LossName::Cauchy => Self::Cauchy,
        }
    }
}

impl LossArguments {
    /// Returns `options` with these set.
    pub fn apply(&self, options: Options) -> Result<Options, Error> {
        let mut options = options.with_loss(self.loss.into());
        options.loss_scale = self.scale()?;
        Ok(options)
    }

    /// The scale that the user gave. `None` means `auto`.
    fn scale(&self) -> Result<Option<f64>, Error> {
        let Some(text) = self.loss_scale.as_deref() else { return Ok(None) };
        if matches!(self.loss, LossName::None) {
            return Err(Error::invalid(
                OptionName::LossScale,
                "--loss huber or --loss cauchy as well",
                "none",
            ));
        }
        if text == "auto" {
            return Ok(None);
        }
        let scale = text.parse().ok().filter(|scale: &f64| LOSS_SCALES.contains(scale));
        scale.map(Some).ok_or_else(|| {
            let expected = "a number from 1e-100 to 1e100, or 'auto'";
            Error::invalid(OptionName::LossScale, expected, excerpt(text))
        })
    }
}
