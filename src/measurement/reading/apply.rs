//! Applies conventions to a measurement that was read without regard to them.

use super::{Conventions, polarised};
use crate::error::{Error, OptionName, excerpt};
use crate::geometry::Directions;
use crate::measurement::{Doubt, Measurement};
use rayon::prelude::*;
use std::sync::Arc;

/// The smallest cosine by which a value is divided: at the horizon there is no f to be had from f cos(theta).
const LEAST_COSINE: f64 = 1e-6;

impl Conventions {
    /// Applies these conventions to a measurement. The directions of a reader that knows `angles` itself are left as they are.
    pub(crate) fn apply(&self, measurement: &mut Measurement, angles_done: bool) -> Result<(), Error> {
        self.check_grid(measurement)?;
        self.mark_missing(measurement);
        if !angles_done
            && self.angles.change_directions()
            && let Some(pairs) = self.angles.changed(&measurement.directions)
        {
            measurement.directions = Directions::Scattered(pairs);
        }
        self.make_f(measurement)?;
        if self.mean_of_s_and_p {
            if !polarised::average(measurement) {
                let names = measurement.channel_names().join(", ");
                let expected = "channels in pairs for s- and p-polarised light, such as s and p";
                return Err(Error::invalid(OptionName::MeanOfSAndP, expected, excerpt(&names)));
            }
        } else if !polarised::polarised(&measurement.channels).is_empty() {
            measurement.doubts.push(Doubt::Polarised);
        }
        if !self.leave_out.is_empty() {
            let left = |g: &_| !self.leave_out.iter().any(|rule| rule.holds(g));
            let keep = measurement.directions.each(left);
            measurement.retain(&keep, "left-out");
        }
        Ok(())
    }

    /// Fails for what a grid or a BRDF that is defined everywhere cannot have.
    fn check_grid(&self, measurement: &Measurement) -> Result<(), Error> {
        let option = if self.angles.azimuth.is_some() {
            OptionName::Azimuth
        } else if self.angles.light != super::LightDirection::Towards {
            OptionName::LightDirection
        } else {
            return Ok(());
        };
        if measurement.directions.is_grid() || measurement.continuous.is_some() {
            let expected = "a file that states the directions of each sample";
            return Err(Error::invalid(option, expected, "one whose layout defines them"));
        }
        Ok(())
    }

    /// Replaces values that mark what was not measured.
    fn mark_missing(&self, measurement: &mut Measurement) {
        if self.missing.is_empty() {
            return;
        }
        measurement.values.par_iter_mut().flatten().for_each(|value| {
            if self.missing.contains(value) {
                *value = f64::NAN;
            }
        });
    }

    /// Turns values into f.
    fn make_f(&self, measurement: &mut Measurement) -> Result<(), Error> {
        if self.quantity.is_f() && self.scale.is_none() {
            return Ok(());
        }
        if measurement.continuous.is_some() {
            let option = if self.scale.is_some() { OptionName::Scale } else { OptionName::Quantity };
            let expected = "a file of samples";
            return Err(Error::invalid(option, expected, "one that defines f everywhere"));
        }
        if self.quantity.has_cosine() {
            let keep = measurement.directions.each(|g| g.cos_i() > LEAST_COSINE && g.cos_o() > LEAST_COSINE);
            measurement.retain(&keep, "below-horizon");
        }
        let scale = self.scale.unwrap_or(1.0);
        let cosines = Arc::new(measurement.directions.each(|g| (g.cos_i(), g.cos_o())));
        let mut sigma = measurement.sigma.take();
        for (channel, values) in measurement.values.iter_mut().enumerate() {
            let mut deviations = sigma.as_mut().and_then(|rows| rows.get_mut(channel));
            for (index, (value, (cos_i, cos_o))) in values.iter_mut().zip(cosines.iter()).enumerate() {
                let (f, slope) = self.quantity.f(*value, *cos_i, *cos_o);
                *value = scale * f;
                if let Some(deviation) = deviations.as_mut().and_then(|row| row.get_mut(index)) {
                    *deviation *= (scale * slope).abs();
                }
                if value.is_infinite() {
                    let found = format!("infinity at sample {}", index + 1);
                    return Err(Error::invalid(
                        OptionName::Quantity,
                        "a quantity that makes f finite",
                        found,
                    ));
                }
            }
        }
        measurement.sigma = sigma;
        Ok(())
    }
}
