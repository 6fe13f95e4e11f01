//! The interface of a format that can be written.

use crate::error::{Error, excerpt};
use crate::geometry::{Directions, Pair, direction};
use crate::measurement::samples::no_values;
use crate::measurement::{Channel, Measurement};
use std::borrow::Cow;

/// A function that returns f in 1/sr at pairs of directions, by channel and pair.
pub type Reflectance<'a> = dyn Fn(&[Pair]) -> Vec<Vec<f64>> + Sync + 'a;

/// A BRDF that is written to a file: a measurement, interpolated between its samples, or a fitted model.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// Its channels.
    pub channels: &'a [Channel],
    /// Its values at any directions.
    pub at: &'a Reflectance<'a>,
    /// Whether there are data around pairs of directions; elsewhere `at` extrapolates.
    pub covered: &'a (dyn Fn(&[Pair]) -> Vec<bool> + Sync + 'a),
    /// Its samples; `None` if it is a model.
    pub measurement: Option<&'a Measurement>,
    /// Whether f depends on the azimuths only through their difference.
    pub isotropic: bool,
    /// What it is, in one line, for the file's own description.
    pub about: &'a str,
    /// The angles at which it is written; `None` for those that suit the format.
    pub grid: Option<&'a AngleGrid>,
}

/// How many of the directions at which a BRDF is written have data around them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Covered {
    outside: usize,
    all: usize,
}

impl Covered {
    /// Counts some of the directions at which `subject` is written.
    pub(super) fn count(&mut self, subject: &Subject<'_>, pairs: &[Pair]) {
        self.outside += (subject.covered)(pairs).iter().filter(|covered| !**covered).count();
        self.all += pairs.len();
    }

    /// The sentence about those without data around them, if there are any.
    pub(super) fn loss(self) -> Option<String> {
        let Self { outside, all } = self;
        let sentence = || {
            format!(
                "{outside} of {all} directions lie outside the measured ones: their values are extrapolated"
            )
        };
        (outside > 0).then(sentence)
    }
}

impl Subject<'_> {
    /// Checks that every channel has a value somewhere: without any it cannot be interpolated.
    ///
    /// # Errors
    /// [`Error::NoSamples`] naming the channel.
    pub(super) fn check_channels(&self) -> Result<(), Error> {
        let Some(measurement) = self.measurement else { return Ok(()) };
        let samples = measurement.directions.len();
        let missing = measurement.missing();
        match self.channels.iter().zip(missing).find(|(_, missing)| *missing == samples) {
            None => Ok(()),
            Some((channel, _)) => Err(no_values(&measurement.source.path, &channel.name, samples)),
        }
    }

    /// The sentence about values that were not measured, if there are any, for a format that has values in all channels.
    pub(super) fn gaps(&self) -> Option<String> {
        let missing: usize = self.measurement?.missing().iter().sum();
        let sentence = || {
            format!(
                "{missing} values were not measured: they are interpolated between samples that have their channel"
            )
        };
        (missing > 0).then(sentence)
    }

    /// The samples of the measurement, or without one, or with a grid, the values at a grid of angles: by default every 10 degrees of
    /// theta_i, every 5 of theta_o and every 15 of phi, and of phi_i every 30 unless f is isotropic.
    #[must_use]
    pub fn sampled(&self) -> Cow<'_, Measurement> {
        match (self.measurement, self.grid) {
            (Some(measurement), None) => Cow::Borrowed(measurement),
            _ => {
                let pairs = self.grid.cloned().unwrap_or_default().pairs(self.isotropic);
                let values = (self.at)(&pairs);
                Cow::Owned(Measurement::of(self.channels.to_vec(), Directions::Scattered(pairs), values))
            }
        }
    }
}

/// What covers every pair of directions, as a model does.
#[must_use]
pub fn everywhere(pairs: &[Pair]) -> Vec<bool> {
    vec![true; pairs.len()]
}

/// The content of a file, and what it could not hold.
#[derive(Clone, Debug, Default)]
pub struct Written {
    /// The file.
    pub bytes: Vec<u8>,
    /// What the format could not hold, a sentence each.
    pub losses: Vec<String>,
}

/// A function that writes a BRDF in a format.
pub type Write = fn(&Subject<'_>) -> Result<Written, Error>;

/// Angles in degrees at which a BRDF is tabulated. An empty list leaves the choice to the format.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AngleGrid {
    /// Angles of incidence, 0 to 90.
    pub theta_i_deg: Vec<f64>,
    /// Azimuths of incidence, for anisotropic BRDFs.
    pub phi_i_deg: Vec<f64>,
    /// Viewing angles, 0 to 90.
    pub theta_o_deg: Vec<f64>,
    /// Azimuths of the viewer from that of the light.
    pub phi_deg: Vec<f64>,
}

/// The largest number of angles in one list.
const MOST_ANGLES: f64 = 10_000.0;

impl AngleGrid {
    /// All pairs of its directions, with angles of their own choice for those that are not given. Without azimuths of incidence the
    /// light is at 0 degrees.
    #[must_use]
    pub fn pairs(&self, isotropic: bool) -> Vec<Pair> {
        let or = |own: &[f64], first: f64, step: f64, last: f64| {
            if own.is_empty() { stepped(first, step, last) } else { own.to_vec() }
        };
        let phi_i = if isotropic && self.phi_i_deg.is_empty() {
            vec![0.0]
        } else {
            or(&self.phi_i_deg, 0.0, 30.0, 330.0)
        };
        let theta_i = or(&self.theta_i_deg, 0.0, 10.0, 80.0);
        let theta_o = or(&self.theta_o_deg, 0.0, 5.0, 85.0);
        let phi = or(&self.phi_deg, 0.0, 15.0, if isotropic { 180.0 } else { 345.0 });
        let mut pairs = Vec::new();
        for phi_i in &phi_i {
            for theta_i in &theta_i {
                let wi = direction(theta_i.to_radians(), phi_i.to_radians());
                for theta_o in &theta_o {
                    // At the normal every azimuth is the same direction.
                    let turns = if *theta_o == 0.0 { 1 } else { phi.len() };
                    pairs.extend(phi.iter().take(turns).map(|phi| Pair {
                        wi,
                        wo: direction(theta_o.to_radians(), (phi_i + phi).to_radians()),
                    }));
                }
            }
        }
        pairs
    }

    /// Parses lists such as `theta_i=0:10:80,theta_o=0:5:85,phi=0:15:180`: first angle, step and last angle in degrees.
    ///
    /// # Errors
    /// [`Error::Invalid`] that says what was expected.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let expected = "lists such as theta_i=0:10:80,phi_i=0:30:330,theta_o=0:5:85,phi=0:15:180 (first, step, last angle in degrees)";
        let wrong = |found: &str| Error::invalid("--grid", expected, excerpt(found));
        let mut grid = Self::default();
        for item in text.split(',').map(str::trim) {
            let (name, list) = item.split_once('=').ok_or_else(|| wrong(item))?;
            let numbers: Vec<f64> = list
                .split(':')
                .map(|word| word.trim().parse().ok().filter(|x: &f64| x.is_finite()))
                .collect::<Option<_>>()
                .ok_or_else(|| wrong(item))?;
            let angles = match *numbers.as_slice() {
                [only] => vec![only],
                [first, step, last] if step > 0.0 && last >= first && (last - first) / step < MOST_ANGLES => {
                    stepped(first, step, last)
                }
                _ => return Err(wrong(item)),
            };
            let (place, range) = match name.trim() {
                "theta_i" => (&mut grid.theta_i_deg, 0.0..=90.0),
                "theta_o" => (&mut grid.theta_o_deg, 0.0..=90.0),
                "phi_i" => (&mut grid.phi_i_deg, -360.0..=360.0),
                "phi" => (&mut grid.phi_deg, -360.0..=360.0),
                _ => return Err(wrong(item)),
            };
            if angles.iter().any(|angle| !range.contains(angle)) || !place.is_empty() {
                return Err(wrong(item));
            }
            *place = angles;
        }
        Ok(grid)
    }
}

/// `first`, `first + step` and so on up to `last`.
fn stepped(first: f64, step: f64, last: f64) -> Vec<f64> {
    // Enough to reach the last angle in spite of rounding, and not to pass it.
    (0..).map(|k: u32| first + f64::from(k) * step).take_while(|angle| *angle <= last + 1e-9 * step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_angles_are_read() {
        let grid = AngleGrid::parse("theta_i=0:10:30, phi=0:0.1:0.3,theta_o=45").unwrap();
        assert_eq!(grid.theta_i_deg, [0.0, 10.0, 20.0, 30.0]);
        assert_eq!(grid.phi_deg.len(), 4);
        assert_eq!(grid.theta_o_deg, [45.0]);
        assert!(grid.phi_i_deg.is_empty());
        for bad in [
            "",
            "theta_i",
            "theta=0",
            "theta_i=0:0:9",
            "theta_i=0:1:91",
            "phi=a",
            "phi=0:1e-9:360",
            "phi=1,phi=2",
            "phi=nan",
        ] {
            assert!(AngleGrid::parse(bad).unwrap_err().to_string().contains("--grid"), "{bad}");
        }
    }
}
