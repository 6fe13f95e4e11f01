//! The data that `select` fits models to: samples first, then the image of the scene.

use super::studio::Studio;
use super::target::Target;
use crate::error::{Error, OptionName};
use crate::fit::{Metric, Options, Shown, fit, fit_image};
use crate::measurement::{Filters, Measurement, Weighting};
use crate::parameters::ParameterTable;
use crate::progress::{Progress, Quiet};
use crate::tradeoff::Candidate;
use std::borrow::Cow;
use std::sync::Arc;

/// Default number of pairs of directions that the first fits use.
pub const DRAWN: usize = 20_000;

/// A set of samples that models are fitted to, and how.
#[derive(Clone)]
struct FitTo<'a> {
    data: Cow<'a, Measurement>,
    filters: Filters,
    metric: Metric,
}

/// The data that models are fitted to.
pub(super) struct Fits<'a> {
    /// Sets of samples, each of which gets a fit of its own.
    searched: Vec<FitTo<'a>>,
    /// The image that the model is then fitted to, starting from those fits. `None` if samples are weighted instead.
    shown: Option<Shown<Target>>,
}

impl<'a> Fits<'a> {
    /// Prepares fits to the scene's image or, if `options` set a weighting, to the measurement's own samples.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the scene shows no directions that the measurement covers.
    pub(super) fn new(
        measurement: &'a Measurement,
        studio: &Studio,
        options: &Options,
    ) -> Result<Self, Error> {
        let Options { filters, metric, .. } = options;
        let own = FitTo { data: Cow::Borrowed(measurement), filters: filters.clone(), metric: *metric };
        if filters.weighting.is_some() {
            return Ok(Self { searched: vec![own], shown: None });
        }
        let drawn = studio.draw(measurement, filters.samples.unwrap_or(DRAWN));
        let data = drawn
            .ok_or_else(|| Error::invalid(OptionName::MaxTheta, "light within it in the scene", "none"))?;
        let uniform = Some(Weighting::Uniform);
        let filters = Filters { samples: None, weighting: uniform, ..filters.clone() };
        let drawn = FitTo { data: Cow::Owned(data), filters, metric: *metric };
        // Where a sharp peak dominates the error there are many minima; cube roots also weigh the rest.
        let weighs_the_rest = matches!(metric, Metric::Cbrt | Metric::UnbiasedCbrt);
        let rest = (!weighs_the_rest).then(|| FitTo { metric: Metric::Cbrt, ..drawn.clone() });
        let searched = [Some(drawn), Some(own), rest].into_iter().flatten().collect();
        Ok(Self { searched, shown: Some(studio.shown(*metric)?) })
    }

    /// Fits a model, and returns its parameters and whether they are usable.
    ///
    /// # Errors
    /// As in [`fit`].
    pub(super) fn fit(
        &self,
        candidate: &Candidate,
        options: &Options,
    ) -> Result<(ParameterTable, bool), Error> {
        let quiet = Arc::new(Quiet) as Arc<dyn Progress>;
        let options = candidate.options(options)?;
        let mut found = Vec::new();
        let mut failure = None;
        for FitTo { data, filters, metric } in &self.searched {
            let options = Options { filters: filters.clone(), metric: *metric, ..options.clone() };
            match fit(data, &candidate.expression, &options, &quiet) {
                // The image shows every channel, dead or not.
                Ok(fitted) => found.push((fitted.table.rejoined(), fitted.unusable.is_none())),
                Err(error) => failure = Some(error),
            }
        }
        if let Some(shown) = &self.shown {
            let starts: Vec<&ParameterTable> = found.iter().map(|(table, _)| table).collect();
            if let Some(table) = fit_image(&candidate.expression, shown, &starts, &options)? {
                // A fit to the image is usable even if its starts were not: the image itself is compared.
                return Ok((table, true));
            }
        }
        found.into_iter().next().ok_or_else(|| {
            failure.unwrap_or_else(|| Error::invalid("measurement", "samples to fit to", "none"))
        })
    }
}
