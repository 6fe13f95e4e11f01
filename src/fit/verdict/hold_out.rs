//! Whole angles of incidence left out of a fit, to test it on them.
//!
//! Leaving out single samples would say little: their neighbours stay in the fit, and a model that follows the
//! measurement's own faults follows them there too. A whole angle requires the model to predict what it has not seen.

use super::errors::{Errors, score};
use crate::error::{Error, OptionName, short};
use crate::math::count;
use crate::measurement::{Measurement, Samples};
use crate::model::Expression;
use crate::parameters::ParameterTable;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// How well a fit predicts samples that were left out of it.
#[derive(Clone, Debug)]
pub struct HeldOut {
    /// Number of samples left out.
    pub samples: usize,
    /// Smallest and largest `theta_i` of each group left out, in degrees; both the same for a single angle.
    pub theta_i_deg: Vec<[f64; 2]>,
    /// Every error on those samples, all channels together.
    pub errors: Errors,
}

/// Samples left out of a fit, before the fit is made.
pub(in crate::fit) struct LeftOut {
    samples: Samples,
    theta_i_deg: Vec<[f64; 2]>,
}

impl LeftOut {
    /// Computes the errors of the model at the values in `table`.
    pub(in crate::fit) fn judge(&self, expression: &Expression, table: &ParameterTable) -> HeldOut {
        HeldOut {
            samples: self.samples.len(),
            theta_i_deg: self.theta_i_deg.clone(),
            errors: score(expression, &self.samples, table).all,
        }
    }
}

/// Makes this draw of angles differ from the draws of samples with the same seed.
const HOLD_OUT_STREAM: u64 = 0x0068_656c_646f_7574;

/// Checks that `fraction` can be left out, and returns it.
///
/// # Errors
/// [`Error::Invalid`] unless it is above 0 and below 1.
pub fn checked_fraction(fraction: f64) -> Result<f64, Error> {
    if fraction > 0.0 && fraction < 1.0 {
        return Ok(fraction);
    }
    Err(Error::invalid(OptionName::HoldOut, "a fraction above 0 and below 1", fraction.to_string()))
}

/// Divides the samples into those to fit and those left out: `fraction` of the groups of incidence angles, at least
/// one and at most all but one.
///
/// # Errors
/// [`Error::Invalid`] for a fraction outside 0..1, [`Error::Unmet`] for a measurement with a single angle of incidence, or if a channel
/// has no values at the angles that are fitted.
pub(in crate::fit) fn split(
    samples: &Samples,
    fraction: f64,
    seed: u64,
    measurement: &Measurement,
) -> Result<(Samples, LeftOut), Error> {
    let fraction = checked_fraction(fraction)?;
    let groups = samples.incidence_groups();
    if groups.len() < 2 {
        return Err(Error::Unmet {
            path: measurement.source.path.clone(),
            option: OptionName::HoldOut,
            expected: "at least 2 angles of incidence among the samples used".to_owned(),
            found: groups.len().to_string(),
        });
    }
    let left_out = draw(groups.len(), fraction, seed);
    let is_out = |group: usize| left_out.binary_search(&group).is_ok();
    let out = groups.samples_of(is_out);
    let mut fitted = samples.at(&groups.samples_of(|group| !is_out(group)));
    if let Some(channel) = fitted.without_values() {
        let channel = short(&measurement.channels[channel].name);
        return Err(Error::Unmet {
            path: measurement.source.path.clone(),
            option: OptionName::HoldOut,
            expected: format!("values of channel {channel} at the angles of incidence that are fitted"),
            found: "none".to_owned(),
        });
    }
    fitted.dropped.insert("held-out", out.len());
    let theta_i_deg = left_out.iter().map(|group| groups.theta_i_deg[*group]).collect();
    // What was left out has no say in the fit, not even in its weights.
    let left_out = samples.at(&out).with_predictions();
    Ok((fitted.with_predictions(), LeftOut { samples: left_out, theta_i_deg }))
}

/// Draws `fraction` of the numbers below `n`, at least one and at most all but one, in ascending order.
fn draw(n: usize, fraction: f64, seed: u64) -> Vec<usize> {
    // The integer closest to fraction x n; halves are rounded up.
    let distance = |k: &usize| (count(*k) - fraction * count(n)).abs();
    let wanted = (1..n).rev().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(1);
    let mut rng = Pcg64Mcg::seed_from_u64(seed ^ HOLD_OUT_STREAM);
    // The first numbers of a shuffled list (Fisher and Yates 1938).
    let mut numbers: Vec<usize> = (0..n).collect();
    for place in 0..wanted {
        numbers.swap(place, rng.random_range(place..n));
    }
    numbers.truncate(wanted);
    numbers.sort_unstable();
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_the_closest_number_of_groups() {
        for (n, fraction, wanted) in
            [(8, 0.2, 2), (8, 0.25, 2), (8, 0.01, 1), (8, 0.99, 7), (2, 0.5, 1), (10, 0.25, 3), (50, 0.1, 5)]
        {
            let drawn = draw(n, fraction, 0);
            assert_eq!(drawn.len(), wanted, "{fraction} of {n}");
            assert!(drawn.is_sorted() && drawn.iter().all(|k| *k < n));
        }
    }

    #[test]
    fn every_group_is_drawn_as_often() {
        // 2 of 8 with 4000 seeds: each is drawn about 1000 times, with a standard deviation of sqrt(4000 x 1/4 x 3/4)
        // = 27.
        let mut times = [0; 8];
        (0..4000).for_each(|seed| draw(8, 0.25, seed).into_iter().for_each(|k| times[k] += 1));
        assert!(times.iter().all(|n| (880..1120).contains(n)), "{times:?}");
    }

    #[test]
    fn fractions_are_checked() {
        for wrong in [0.0, 1.0, -0.1, 1.5, f64::NAN, f64::INFINITY] {
            assert!(checked_fraction(wrong).unwrap_err().to_string().contains("hold-out"), "{wrong}");
        }
        assert!(checked_fraction(0.5).is_ok());
    }
}
