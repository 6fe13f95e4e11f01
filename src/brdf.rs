//! A model at given parameters: the BRDF itself.

use crate::error::Error;
use crate::geometry::{Azimuths, Directions, Pair};
use crate::model::{Expression, LobeValues};
use crate::parameters::{ParameterTable, Selector, Setting, Settings};
use glam::DVec3;

/// A BRDF that can be evaluated: a model at given values of its parameters, for one or more channels.
///
/// ```
/// use brdfit::glam::DVec3;
/// use brdfit::{Brdf, Expression};
///
/// let model: Expression = "lambert".parse()?;
/// let brdf = Brdf::new(&model, &["r", "g"], &[("kd.r", 0.5), ("kd.g", 0.25)])?;
/// let [red, green] = brdf.value(DVec3::Z, DVec3::new(1.0, 0.0, 1.0))[..] else { unreachable!() };
/// assert!((red - 0.5 / std::f64::consts::PI).abs() < 1e-15 && green == red / 2.0);
/// # Ok::<(), brdfit::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Brdf {
    expression: Expression,
    channels: Vec<String>,
    /// Shapes and amplitudes by channel and lobe, in the units of the formulas.
    values: Vec<Vec<LobeValues>>,
}

impl Brdf {
    /// Creates a BRDF from a model and the values of some parameters, each in its own unit, by names such as `m`,
    /// `lambert.kd.r` or `cook-torrance#2.f0[700]`. A parameter that is not named has its default value.
    ///
    /// # Errors
    /// [`Error::UnknownName`] if the model has no such parameter, [`Error::AmbiguousParameter`] if several lobes have
    /// it, [`Error::Invalid`] for a value outside the bounds of its parameter.
    pub fn new(expression: &Expression, channels: &[&str], values: &[(&str, f64)]) -> Result<Self, Error> {
        let channels: Vec<String> = channels.iter().map(|name| (*name).to_owned()).collect();
        let set = |(name, value): &(&str, f64)| Ok((Selector::parse(name)?, Setting::Set(*value)));
        let settings: Settings = values.iter().map(set).collect::<Result<_, Error>>()?;
        Ok(Self::of_table(
            expression,
            &ParameterTable::new(expression, &channels, Azimuths::Several, &settings)?,
        ))
    }

    /// Creates a BRDF from a model at the values in a table of its parameters.
    pub(crate) fn of_table(expression: &Expression, table: &ParameterTable) -> Self {
        let channels = table.channels().to_vec();
        let values = (0..channels.len()).map(|channel| table.formula_values(channel)).collect();
        Self { expression: expression.clone(), channels, values }
    }

    /// The model.
    #[must_use]
    pub fn expression(&self) -> &Expression {
        &self.expression
    }

    /// Names of the channels.
    #[must_use]
    pub fn channels(&self) -> &[String] {
        &self.channels
    }

    /// f in 1/sr for each channel, given a vector to the light and one to the viewer in the local frame, where z is
    /// the normal. The vectors need not be unit. f is 0 if either is not above the horizon.
    #[must_use]
    pub fn value(&self, wi: DVec3, wo: DVec3) -> Vec<f64> {
        let pair = Pair { wi: wi.normalize_or_zero(), wo: wo.normalize_or_zero() };
        let above = pair.wi.z > 0.0 && pair.wo.z > 0.0;
        let value = |values: &Vec<LobeValues>| {
            if above { self.expression.value(&pair.geometry(), values) } else { 0.0 }
        };
        self.values.iter().map(value).collect()
    }

    /// f in 1/sr by channel and pair of directions: the same as [`Brdf::value`] for each pair, but faster. f is 0 if
    /// either direction is not above the horizon.
    #[must_use]
    pub fn values(&self, directions: &Directions) -> Vec<Vec<f64>> {
        self.expression.values(directions, &self.values)
    }
}
