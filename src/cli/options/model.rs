//! Models with values for their parameters: from a report, or from an expression and `--set`.

use super::channels::{RGB, channels};
use super::settings::is_file;
use brdfit::Error;
use brdfit::error::{OptionName, excerpt};
use brdfit::geometry::Azimuths;
use brdfit::model::Expression;
use brdfit::parameters::{ParameterTable, Setting, Settings, ranges, values};
use brdfit::report::Recorded;
use clap::Args;
use std::path::{Path, PathBuf};

/// A model and values for its parameters.
#[derive(Args)]
pub struct ModelArguments {
    /// Use this model, such as 'lambert + cook-torrance(d=beckmann)'
    #[arg(short, long = "model", value_name = "EXPR")]
    model: Option<String>,
    /// Set parameters to values, per channel as P.r=V; the others keep their defaults or the values of the report
    #[arg(long, value_name = "P=V", num_args = 1..)]
    set: Vec<String>,
    /// Accept values of a parameter between these two
    #[arg(long, value_name = "P=LO..HI")]
    bounds: Vec<String>,
}

impl ModelArguments {
    /// Whether `-m` names a model.
    pub fn is_named(&self) -> bool {
        self.model.is_some()
    }

    /// The model that `-m` names.
    pub fn expression(&self) -> Result<Expression, Error> {
        let none = || Error::invalid("model", "a report, or -m EXPR", "neither");
        Expression::parse(self.model.as_deref().ok_or_else(none)?)
    }

    /// Fails if there are values of parameters, which belong to a model.
    pub fn check_absent(&self) -> Result<(), Error> {
        if self.set.is_empty() && self.bounds.is_empty() {
            return Ok(());
        }
        let expected = "a report, or -m EXPR, the model that has the parameters";
        Err(Error::invalid("--set, --bounds", expected, "a measurement"))
    }

    /// Files that stand behind `--set`: in `--set kd=0.5 FILE` the parser takes FILE for another value.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> {
        self.set.iter().filter(|text| is_file(text)).map(PathBuf::from)
    }

    /// The last of the values if it has no `=`: probably a file that does not exist.
    pub fn missing_file(&self) -> Option<&Path> {
        self.set.last().filter(|text| !text.contains('=') && !is_file(text)).map(Path::new)
    }

    /// The values without files among them.
    pub fn texts(&self) -> Vec<String> {
        self.set.iter().filter(|text| !is_file(text)).cloned().collect()
    }

    /// The values and the bounds.
    pub fn settings(&self) -> Result<Settings, Error> {
        Ok([ranges(&self.bounds)?, values(OptionName::Set, &self.texts(), Setting::Set)?].concat())
    }

    /// The options as the user typed them, for the report.
    pub fn as_given(&self) -> Vec<String> {
        let bounds = self.bounds.iter().map(|text| format!("--bounds {text}"));
        bounds.chain(self.texts().into_iter().map(|text| format!("--set {text}"))).collect()
    }

    /// The model and its values: of the report if there is one, or else of `-m`, with the values of `--set`. A model that is
    /// evaluated on a grid has the channels r, g and b.
    pub fn with_values(
        &self,
        recorded: Option<Recorded>,
        on_grid: bool,
    ) -> Result<(Expression, ParameterTable), Error> {
        let settings = self.settings()?;
        if let Some(recorded) = recorded {
            let recorded = recorded.with(&settings)?;
            let channels = recorded.table.channels();
            if on_grid && channels != RGB {
                let found = excerpt(&channels.join(", "));
                return Err(Error::invalid("--grid merl", "a report with channels r, g and b", found));
            }
            return Ok((recorded.expression, recorded.table));
        }
        let expression = self.expression()?;
        let channels = channels(&[expression.settings()?, settings.clone()].concat(), on_grid)?;
        let azimuths = if on_grid { Azimuths::Lost } else { Azimuths::Several };
        let table = ParameterTable::new(&expression, &channels, azimuths, &settings)?;
        Ok((expression, table))
    }
}
