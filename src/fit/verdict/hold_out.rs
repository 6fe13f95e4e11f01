//! Whole angles of incidence left out of a fit in turn, to test it on them.
//!
//! Leaving out single samples would say little: their neighbours stay in the fit, and a model that follows the
//! measurement's own faults follows them there too. A whole angle requires the model to predict what it has not seen.

use super::errors::{Errors, Tally};
use super::warning::Warning;
use crate::error::{Error, OptionName, short};
use crate::fit::options::HoldOut;
use crate::fit::problem::metric::Metric;
use crate::math::count;
use crate::measurement::{IncidenceGroups, Measurement, Samples};
use crate::model::Expression;
use crate::parameters::ParameterTable;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// How well a model predicts samples that were left out of its fits. Each angle of incidence was left out once.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct HeldOut {
    /// Number of samples left out, in all folds.
    pub samples: usize,
    /// Smallest and largest `theta_i` of each group left out, in degrees, ascending; both the same for a single angle.
    pub theta_i_deg: Vec<[f64; 2]>,
    /// Every error on those samples, each predicted by the fit that left it out, all channels together.
    pub errors: Errors,
    /// The groups that were left out together.
    pub folds: Vec<Fold>,
}

/// Samples that were left out together, and how well the fit to all others predicts them.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Fold {
    /// Smallest and largest `theta_i` of each group left out, in degrees, ascending; both the same for a single angle.
    pub theta_i_deg: Vec<[f64; 2]>,
    /// Number of samples left out.
    pub samples: usize,
    /// Every error on those samples, all channels together; NaN if they have no values.
    pub errors: Errors,
    /// Whether the fit to the other samples reached a minimum.
    pub converged: bool,
}

impl HeldOut {
    /// The errors of each fold in a metric, of those that have values.
    fn errors_in(&self, metric: Metric) -> Vec<f64> {
        let errors = self.folds.iter().map(|fold| fold.errors.in_metric(metric));
        errors.filter(|error| error.is_finite()).collect()
    }

    /// The mean over the folds of the error in a metric; `None` if no fold has values.
    #[must_use]
    pub fn mean(&self, metric: Metric) -> Option<f64> {
        let errors = self.errors_in(metric);
        (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / count(errors.len()))
    }

    /// The standard deviation over the folds of the error in a metric; `None` if fewer than two folds have values.
    #[must_use]
    pub fn std_dev(&self, metric: Metric) -> Option<f64> {
        let (errors, mean) = (self.errors_in(metric), self.mean(metric)?);
        let squares: f64 = errors.iter().map(|error| (error - mean).powi(2)).sum();
        (errors.len() > 1).then(|| (squares / (count(errors.len()) - 1.0)).sqrt())
    }
}

/// The groups of samples, dealt into folds.
pub(in crate::fit) struct Folds {
    groups: IncidenceGroups,
    /// The fold of each group.
    of_group: Vec<usize>,
    /// The number of folds.
    pub(in crate::fit) len: usize,
}

/// The samples of one fold and all others.
pub(in crate::fit) struct Division {
    fold: usize,
    /// What is fitted.
    pub(in crate::fit) kept: Samples,
    /// What is left out, and the group of each of these samples.
    left_out: Samples,
    group_of: Vec<usize>,
}

/// A fold after its fit.
pub(in crate::fit) struct Judged {
    fold: Fold,
    tally: Tally,
    groups: Vec<Group>,
}

/// The errors on one group of samples.
struct Group {
    theta_i_deg: [f64; 2],
    /// Of the fit that left the group out.
    left_out: Tally,
    /// Of the fit to all samples.
    fitted: Tally,
}

/// Makes this draw of angles differ from the draws of samples with the same seed.
const HOLD_OUT_STREAM: u64 = 0x0068_656c_646f_7574;

impl Folds {
    /// Deals the groups of incidence angles into folds.
    ///
    /// # Errors
    /// [`Error::Unmet`] for a measurement with a single angle of incidence, or if a channel has no values outside of a fold.
    pub(in crate::fit) fn new(
        samples: &Samples,
        hold_out: HoldOut,
        seed: u64,
        measurement: &Measurement,
    ) -> Result<Self, Error> {
        let groups = samples.incidence_groups();
        let unmet = |expected: String, found: String| Error::Unmet {
            path: measurement.source.path.clone(),
            option: OptionName::HoldOut,
            expected,
            found,
        };
        if groups.len() < 2 {
            let expected = "at least 2 angles of incidence among the samples used".to_owned();
            return Err(unmet(expected, groups.len().to_string()));
        }
        let len = number_of_folds(groups.len(), hold_out);
        let of_group = deal(groups.len(), len, seed);
        let folds = Self { groups, of_group, len };
        if let Some(channel) = folds.channel_in_one_fold(samples) {
            let channel = short(&measurement.channels[channel].name);
            let expected = format!("values of channel {channel} at the angles of incidence that are fitted");
            return Err(unmet(expected, "none".to_owned()));
        }
        Ok(folds)
    }

    /// The first channel all of whose values are in one fold, so that nothing is left to fit without it.
    fn channel_in_one_fold(&self, samples: &Samples) -> Option<usize> {
        let incomplete = samples.values.iter().zip(&samples.missing).enumerate();
        incomplete
            .filter(|(_, (_, missing))| **missing > 0)
            .map(|(channel, (row, _))| (channel, row))
            .find_map(|(channel, row)| {
                let measured = row.iter().zip(&self.groups.of_sample).filter(|(value, _)| !value.is_nan());
                let mut folds = measured.map(|(_, group)| self.of_group[*group]);
                let first = folds.next();
                folds.all(|fold| Some(fold) == first).then_some(channel)
            })
    }

    /// Divides the samples into those of a fold and all others.
    pub(in crate::fit) fn divide(&self, samples: &Samples, fold: usize) -> Division {
        let out = self.groups.samples_of(|group| self.of_group[group] == fold);
        let kept = samples.at(&self.groups.samples_of(|group| self.of_group[group] != fold));
        // What is left out has no say in the fit, not even in its weights.
        Division {
            fold,
            kept: kept.with_predictions(),
            left_out: samples.at(&out).with_predictions(),
            group_of: out.iter().map(|sample| self.groups.of_sample[*sample]).collect(),
        }
    }

    /// Compares the fit without a fold, and that to all samples, with the fold.
    pub(in crate::fit) fn judge(
        &self,
        division: &Division,
        expression: &Expression,
        found: &ParameterTable,
        converged: bool,
        fitted_to_all: Option<&ParameterTable>,
    ) -> Judged {
        let Division { fold, left_out, group_of, .. } = division;
        let tally = Tally::new(expression, left_out, found);
        let groups: Vec<usize> = (0..self.of_group.len()).filter(|g| self.of_group[*g] == *fold).collect();
        let theta_i_deg = |group: &usize| self.groups.theta_i_deg[*group];
        let fold = Fold {
            theta_i_deg: groups.iter().map(theta_i_deg).collect(),
            samples: left_out.len(),
            errors: tally.errors(),
            converged,
        };
        let compare = |(group, all): (&usize, &ParameterTable)| {
            let of_group = (0..group_of.len()).filter(|sample| group_of[*sample] == *group);
            let samples = left_out.at(&of_group.collect::<Vec<_>>());
            Group {
                theta_i_deg: theta_i_deg(group),
                left_out: Tally::new(expression, &samples, found),
                fitted: Tally::new(expression, &samples, all),
            }
        };
        let groups = groups.iter().zip(fitted_to_all.into_iter().cycle()).map(compare).collect();
        Judged { fold, tally, groups }
    }
}

/// Puts the folds together. The warning says where leaving out an angle at the edge made the model extrapolate.
pub(in crate::fit) fn put_together(judged: Vec<Judged>, metric: Metric) -> (HeldOut, Option<Warning>) {
    let mut all = Tally::default();
    judged.iter().for_each(|judged| all.add(&judged.tally));
    let warning = extrapolated(judged.iter().flat_map(|judged| &judged.groups).collect(), metric);
    let folds: Vec<Fold> = judged.into_iter().map(|judged| judged.fold).collect();
    let mut theta_i_deg: Vec<[f64; 2]> = folds.iter().flat_map(|fold| fold.theta_i_deg.clone()).collect();
    theta_i_deg.sort_by(|[a, _], [b, _]| a.total_cmp(b));
    let samples = folds.iter().map(|fold| fold.samples).sum();
    (HeldOut { samples, theta_i_deg, errors: all.errors(), folds }, warning)
}

/// An angle at the edge is extrapolated if leaving it out makes the error there this many times as large, and as many times as large
/// as leaving out the angles between does to theirs.
const CLEARLY_WORSE: f64 = 1.5;
/// A mean distance from the data below this fraction of them is no fault of a model.
const FAULTLESS: f64 = 1e-3;

/// The warning about angles at the edge of those measured; `None` if they are predicted about as well as the others.
fn extrapolated(mut groups: Vec<&Group>, metric: Metric) -> Option<Warning> {
    groups.sort_by(|a, b| a.theta_i_deg[0].total_cmp(&b.theta_i_deg[0]));
    let ratio = |left_out: &Tally, fitted: &Tally| {
        left_out.errors().in_metric(metric) / fitted.errors().in_metric(metric)
    };
    let [first, between @ .., last] = groups.as_slice() else { return None };
    let (mut left_out, mut fitted) = (Tally::default(), Tally::default());
    for group in between {
        left_out.add(&group.left_out);
        fitted.add(&group.fitted);
    }
    let inner = Some(ratio(&left_out, &fitted)).filter(|ratio| ratio.is_finite());
    let is_clear = |group: &Group| {
        let there = ratio(&group.left_out, &group.fitted);
        let matters = group.left_out.errors().relative.is_none_or(|relative| relative > FAULTLESS);
        let clear = there > CLEARLY_WORSE && there > CLEARLY_WORSE * inner.unwrap_or(1.0);
        (clear && matters).then_some((group.theta_i_deg, there))
    };
    let edges: Vec<([f64; 2], f64)> = [first, last].into_iter().filter_map(|group| is_clear(group)).collect();
    (!edges.is_empty()).then_some(Warning::Extrapolated { edges, inner })
}

/// The number of folds: at least two, and at most one per group.
fn number_of_folds(groups: usize, hold_out: HoldOut) -> usize {
    match hold_out {
        HoldOut::Each => groups,
        // The integer closest to 1/fraction; halves are rounded up.
        HoldOut::Fraction(fraction) => {
            let distance = |k: &usize| (count(*k) - fraction.recip()).abs();
            (2..=groups).rev().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(groups)
        }
    }
}

/// The fold of each of `groups` angles, which are in ascending order. Of as many neighbours as there are folds, each is in another,
/// so that every fold extends over all angles.
fn deal(groups: usize, folds: usize, seed: u64) -> Vec<usize> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed ^ HOLD_OUT_STREAM);
    let mut of_group = Vec::with_capacity(groups);
    while of_group.len() < groups {
        // A shuffled list (Fisher and Yates 1938).
        let mut order: Vec<usize> = (0..folds).collect();
        for place in 0..folds {
            order.swap(place, rng.random_range(place..folds));
        }
        of_group.extend(order);
    }
    of_group.truncate(groups);
    of_group
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fraction(fraction: f64) -> HoldOut {
        HoldOut::fraction(fraction).unwrap()
    }

    #[test]
    fn a_fraction_makes_the_closest_number_of_folds() {
        for (groups, left_out, wanted) in [
            (8, 0.2, 5),
            (8, 0.25, 4),
            (8, 0.01, 8),
            (8, 0.99, 2),
            (2, 0.5, 2),
            (3, 0.2, 3),
            (50, 0.1, 10),
            (9, 0.4, 3),
        ] {
            assert_eq!(number_of_folds(groups, fraction(left_out)), wanted, "{left_out} of {groups}");
        }
        assert_eq!(number_of_folds(17, HoldOut::Each), 17);
    }

    #[test]
    fn folds_are_spread_over_the_angles() {
        for (groups, folds) in [(8, 5), (8, 8), (17, 4), (3, 2), (2, 2)] {
            for seed in 0..50 {
                let dealt = deal(groups, folds, seed);
                assert_eq!(dealt.len(), groups);
                // In every row of neighbours each fold occurs once, so that sizes differ by one at most.
                for row in dealt.chunks(folds) {
                    let mut seen = row.to_vec();
                    seen.sort_unstable();
                    seen.dedup();
                    assert_eq!(seen.len(), row.len(), "{dealt:?}");
                    assert!(row.iter().all(|fold| *fold < folds));
                }
            }
        }
        assert_ne!(deal(8, 4, 0), deal(8, 4, 1));
        assert_eq!(deal(8, 4, 3), deal(8, 4, 3));
    }

    #[test]
    fn fractions_are_checked() {
        for wrong in [0.0, 1.0, -0.1, 1.5, f64::NAN, f64::INFINITY] {
            assert!(HoldOut::fraction(wrong).unwrap_err().to_string().contains("hold-out"), "{wrong}");
        }
    }
}
