//! Creates a measurement from arrays in memory.

use super::missing::leave_out;
use super::{Channel, Measurement, Source};
use crate::error::{Error, excerpt};
use crate::geometry::Directions;

impl Measurement {
    /// Creates a measurement of `directions` from the name and the values of each channel: f in 1/sr, one value per
    /// pair of directions. A name that is a number, alone or followed by `nm`, is taken as a wavelength in nanometres.
    ///
    /// A value that was not measured is NaN. A pair of directions at which all channels are NaN is left out, and counted in `dropped` as
    /// `not-measured`.
    ///
    /// ```
    /// use brdfit::{Directions, Measurement};
    ///
    /// // theta_i, phi_i, theta_o, phi_o in degrees.
    /// let directions = Directions::from_degrees([[30.0, 0.0, 30.0, 180.0], [30.0, 0.0, 60.0, 180.0]])?;
    /// let measurement = Measurement::new(directions, [("450nm", vec![0.31, 0.12]), ("650nm", vec![0.42, 0.22])])?;
    /// assert_eq!(measurement.channels[1].wavelength_nm, Some(650.0));
    /// # Ok::<(), brdfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Invalid`] if there is no channel, if a name is empty or has control characters, if two channels have
    /// the same name, if the number of values differs from the number of directions, or if a value is infinite.
    pub fn new<Name: AsRef<str>>(
        directions: Directions,
        channels: impl IntoIterator<Item = (Name, Vec<f64>)>,
    ) -> Result<Self, Error> {
        let (names, values): (Vec<Name>, Vec<Vec<f64>>) = channels.into_iter().unzip();
        let channels: Vec<Channel> = names.iter().map(|name| Channel::named(name.as_ref())).collect();
        for (index, channel) in channels.iter().enumerate() {
            if channel.name.is_empty() || channel.name.contains(char::is_control) {
                let expected = "the name of a channel, without control characters";
                return Err(Error::invalid("measurement", expected, excerpt(&channel.name)));
            }
            if channels.iter().take(index).any(|earlier| earlier.name == channel.name) {
                let found = format!("two {}", excerpt(&channel.name));
                return Err(Error::invalid("measurement", "channels of different names", found));
            }
        }
        let mut measurement = Self {
            source: Source { path: "arrays".into(), format: "arrays", sha256: String::new() },
            ..Self::of(channels, directions, values)
        };
        measurement.check_lengths()?;
        let found = |value: &f64| !value.is_infinite();
        measurement.check_values(
            &measurement.values,
            "finite values, or NaN where nothing was measured",
            found,
        )?;
        measurement.empty = measurement.leave_out_empty();
        Ok(measurement)
    }

    /// The same measurement with the standard deviation of every value in 1/sr: one array per channel, in the order of
    /// the channels. [`Weighting::Sigma`](super::Weighting::Sigma) weights samples by them, and requires that they are
    /// above 0. The standard deviation of a value that was not measured is ignored.
    ///
    /// The arrays are as long as those of [`Measurement::new`], also if that left samples out.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the number of channels or of standard deviations is wrong, or if that of a value is negative or not
    /// finite.
    pub fn with_sigma(self, mut sigma: Vec<Vec<f64>>) -> Result<Self, Error> {
        let given = self.directions.len() + self.empty.len();
        if sigma.iter().all(|row| row.len() == given) {
            leave_out(&mut sigma, &self.empty);
        }
        let measurement = Self { sigma: Some(sigma), ..self };
        measurement.check_lengths()?;
        if let Some(sigma) = &measurement.sigma {
            let found = |sigma: &f64| sigma.is_finite() && *sigma >= 0.0;
            measurement.check_values(sigma, "finite standard deviations of at least 0", found)?;
        }
        Ok(measurement)
    }

    /// The same measurement under another name for reports and messages. The name of a file is its path.
    #[must_use]
    pub fn named(mut self, name: &str) -> Self {
        self.source.path = name.into();
        self
    }

    /// Checks that there is a channel, and that every channel has one value, and one standard deviation if any, per
    /// pair of directions.
    pub(super) fn check_lengths(&self) -> Result<(), Error> {
        let (channels, samples) = (self.channels.len(), self.directions.len());
        if channels == 0 {
            return Err(Error::invalid("measurement", "at least one channel", "none"));
        }
        let rows = std::iter::once((&self.values, "values"));
        let rows = rows.chain(self.sigma.iter().map(|sigma| (sigma, "standard deviations")));
        for (rows, what) in rows {
            if rows.len() != channels {
                let expected = format!("{what} of {channels} channels");
                return Err(Error::invalid("measurement", expected, rows.len().to_string()));
            }
            for (row, channel) in rows.iter().zip(&self.channels) {
                if row.len() != samples {
                    let name = excerpt(&channel.name);
                    let expected = format!("{samples} {what} of channel {name}, one per pair of directions");
                    return Err(Error::invalid("measurement", expected, row.len().to_string()));
                }
            }
        }
        Ok(())
    }

    /// Checks the numbers of every channel, `rows`, where it has a value.
    fn check_values(
        &self,
        rows: &[Vec<f64>],
        expected: &str,
        is_right: impl Fn(&f64) -> bool,
    ) -> Result<(), Error> {
        for ((row, values), channel) in rows.iter().zip(&self.values).zip(&self.channels) {
            let mut numbers = row.iter().zip(values).enumerate();
            if let Some((index, (number, _))) =
                numbers.find(|(_, (number, value))| !(value.is_nan() || is_right(number)))
            {
                let name = excerpt(&channel.name);
                let found = format!("{number} for sample {} of channel {name}", index + 1);
                return Err(Error::invalid("measurement", expected, found));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn directions() -> Directions {
        Directions::from_degrees([[30.0, 0.0, 30.0, 180.0], [30.0, 0.0, 60.0, 180.0]]).unwrap()
    }

    #[test]
    fn arrays_that_do_not_fit_are_refused() {
        let good = || Measurement::new(directions(), [("grey", vec![0.1, 0.2])]).unwrap();
        assert_eq!(good().total(), 2);
        let refused = |channels: Vec<(&str, Vec<f64>)>, words: &str| {
            let message = Measurement::new(directions(), channels).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        };
        refused(vec![], "at least one channel");
        refused(vec![("r", vec![0.1])], "expected 2 values of channel 'r'");
        refused(vec![("r", vec![0.1, 0.2]), ("r", vec![0.1, 0.2])], "found two 'r'");
        refused(vec![("a\nb", vec![0.1, 0.2])], "without control characters");
        refused(vec![("r", vec![0.1, f64::INFINITY])], "found inf for sample 2");
        refused(
            vec![("r", vec![f64::NAN, f64::NEG_INFINITY])],
            "or NaN where nothing was measured, found -inf",
        );
        let refused = |sigma: Vec<Vec<f64>>, words: &str| {
            let message = good().with_sigma(sigma).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        };
        refused(vec![], "standard deviations of 1 channels, found 0");
        refused(vec![vec![0.1]], "expected 2 standard deviations");
        refused(vec![vec![0.1, -0.1]], "of at least 0, found -0.1");
        refused(vec![vec![0.1, f64::NAN]], "found NaN for sample 2");
        assert!(good().with_sigma(vec![vec![0.1, 0.0]]).is_ok());
        let one = Measurement::new(directions(), [("grey", vec![f64::NAN, 0.2])]).unwrap();
        assert_eq!(one.total(), 2);
        let message = one.clone().with_sigma(vec![vec![0.1; 3]]).unwrap_err().to_string();
        assert!(message.contains("expected 1 standard deviations"), "{message}");
        assert_eq!(one.with_sigma(vec![vec![-1.0, 0.2]]).unwrap().sigma, Some(vec![vec![0.2]]));
    }
}
