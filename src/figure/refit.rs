//! Parameters of a report set up for its measurement again.

use crate::error::Error;
use crate::fit::{LossKind, Options};
use crate::measurement::{Filters, Measurement, Samples};
use crate::parameters::{ParameterTable, Setting, Settings, channel_suffix};
use crate::report::{Parameter, Recorded, Report};

/// Refits use at most this many samples: the shape of a cost needs no more.
pub(super) const MOST_SAMPLES: usize = 5_000;

/// The table of a report's parameters at their values, for the channels of its measurement.
pub(super) fn problem_table(
    recorded: &Recorded,
    measurement: &Measurement,
    samples: &Samples,
) -> Result<ParameterTable, Error> {
    let names = measurement.channel_names();
    let settings = recorded.settings(&names)?;
    ParameterTable::new(&recorded.expression, &names, samples.directions.azimuths(), &settings)
}

/// What a report says about the parameter in a row of its table; `None` if it says nothing.
pub(super) fn reported<'r>(report: &'r Report, table: &ParameterTable, row: usize) -> Option<&'r Parameter> {
    let name = table.name(row);
    let full = |p: &Parameter| {
        let channel = p.channel.as_deref().map_or_else(String::new, channel_suffix);
        format!("{}.{}{channel}", p.lobe, p.name)
    };
    report.parameters.iter().find(|p| full(p) == name)
}

/// Filters that leave no more than `most` samples.
pub(super) fn at_most(most: usize, filters: Filters) -> Filters {
    Filters { samples: Some(filters.samples.map_or(most, |n| n.min(most))), ..filters }
}

/// The options of a refit of a report: those of the subject, with the loss of the report and no more than [`MOST_SAMPLES`].
pub(super) fn refit_options(options: &Options, recorded: &Recorded) -> Options {
    let mut options = options.clone();
    options.filters = at_most(MOST_SAMPLES, options.filters);
    options.loss = recorded.report.options.loss.known().unwrap_or(LossKind::None);
    options.loss_scale = recorded.report.options.loss_scale;
    options
}

/// The settings of a refit that begins at a report's values: its bounds and what channels share, with starts in place of values.
pub(super) fn starts(recorded: &Recorded, channels: &[String]) -> Result<Settings, Error> {
    let as_start = |setting: Setting| match setting {
        Setting::Set(value) => Setting::Init(value),
        other => other,
    };
    Ok(recorded.settings(channels)?.into_iter().map(|(name, setting)| (name, as_start(setting))).collect())
}
