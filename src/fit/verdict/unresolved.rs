//! Parameters that hardly any sample decides: lobes that are narrower than the spacing of the samples at their peak.
//!
//! What a sample says of a parameter is the square of how far its residual moves the parameter, and the number of samples that decide is 1 over
//! the sum of the squares of the samples' shares in that. A peak that falls between the samples of a sweep is seen by one of them, whose height
//! depends on where exactly it lies; formulas then give small errors to a width that the next measurement, half a degree beside, would not
//! confirm. So no error is given, and what is known of the width is said by the samples beside the peak: how wide it would have to be for them
//! to see it.

use super::covariance::Covariance;
use super::profile::HALF_INTERVAL;
use super::profiled_interval::ProfiledInterval;
use super::result::Fit;
use super::warning::Warning;
use crate::error::Error;
use crate::fit::problem::kernels::Combinations;
use crate::fit::problem::reflectance::ReflectanceProblem;
use crate::fit::task::Task;
use crate::math::count;
use crate::model::Role;
use crate::parameters::ParameterTable;
use crate::solver::{LeastSquares, Solution};
use nalgebra::DVector;

/// A parameter has a standard error if at least this many samples decide it.
const LEAST_DECIDING: f64 = 3.0;
/// Largest number of samples for which that is looked at. A peak between the samples of a dense table is seen by many of them.
const MOST_FOR_PEAKS_BETWEEN_SAMPLES: usize = 100_000;
/// A sample is in the peak if it has more than this share in what is known of the peak's width.
const IN_PEAK: f64 = 0.02;

impl Task<'_> {
    /// The rows that fewer than three samples decide.
    pub(super) fn decided_by_few(
        &self,
        problem: &ReflectanceProblem<'_>,
        table: &ParameterTable,
        solution: &Solution,
        covariance: &Covariance,
    ) -> Vec<usize> {
        if self.samples.len() > MOST_FOR_PEAKS_BETWEEN_SAMPLES {
            return Vec::new();
        }
        let Some(combinations) = covariance.combinations(table, &solution.linearisation) else {
            return Vec::new();
        };
        let parts: Vec<Vec<Deciding>> =
            problem.shares(&solution.x, &combinations, covariance.rows.len(), Deciding::add);
        let mut all = vec![Deciding::default(); covariance.rows.len()];
        parts.iter().for_each(|part| all.iter_mut().zip(part).for_each(|(all, part)| all.merge(part)));
        let few = covariance.rows.iter().zip(&all).filter(|(_, all)| all.samples() < LEAST_DECIDING);
        few.map(|(row, _)| *row).collect()
    }

    /// A warning for each lobe that is narrower than the spacing of the samples at its peak, with the widths that the samples beside it
    /// leave open, and one for the other parameters that fewer than three samples decide.
    ///
    /// # Errors
    /// Those of the optimiser.
    pub(super) fn unresolved(
        &self,
        problem: &ReflectanceProblem<'_>,
        fit: &Fit,
    ) -> Result<Vec<Warning>, Error> {
        let Some(covariance) = fit.covariance.as_ref().filter(|c| !c.decided_by_few.is_empty()) else {
            return Ok(Vec::new());
        };
        let table = &fit.table;
        let mut warnings = Vec::new();
        let mut lobes: Vec<usize> = Vec::new();
        let mut others: Vec<String> = Vec::new();
        for row in &covariance.decided_by_few {
            let of_row = &table.rows()[*row];
            let is_width = of_row.spec.role == Role::Shape && table.has_width(of_row.lobe);
            if !is_width {
                others.push(table.name(*row));
            } else if !lobes.contains(&of_row.lobe) {
                lobes.push(of_row.lobe);
                let Some(interval) = self.beside_the_peak(problem, fit, covariance, *row)? else { continue };
                warnings.push(Warning::UnresolvedLobe {
                    parameter: table.parameter_name(of_row),
                    lobe: table.lobes()[of_row.lobe].clone(),
                    value: of_row.value,
                    range: interval.ends,
                    open: interval.open.map(|open| open.is_some()),
                });
            }
        }
        if !others.is_empty() {
            warnings.push(Warning::DecidedByFew { parameters: others });
        }
        Ok(warnings)
    }

    /// The values of a width that fit the samples beside the peak, with the other parameters as fitted; `None` if there are no such
    /// samples.
    fn beside_the_peak(
        &self,
        problem: &ReflectanceProblem<'_>,
        fit: &Fit,
        covariance: &Covariance,
        row: usize,
    ) -> Result<Option<ProfiledInterval>, Error> {
        let x = DVector::from_vec(fit.table.coordinates());
        let (Some(combinations), Ok(place)) = (
            covariance.combinations(&fit.table, &problem.linearise(&x)),
            covariance.rows.binary_search(&row),
        ) else {
            return Ok(None);
        };
        let of_row = combinations.into_iter().map(|of_channel| {
            of_channel
                .into_iter()
                .filter(|(other, _)| *other == place)
                .map(|(_, weights)| (0, weights))
                .collect()
        });
        let parts =
            problem.shares(&x, &of_row.collect::<Vec<Combinations>>(), 1, |all: &mut Vec<f64>, part| {
                all.extend_from_slice(part);
            });
        let shares: Vec<f64> = parts.concat().concat();
        let total: f64 = shares.iter().sum();
        let is_beside = |(_, share): &(usize, &f64)| **share <= IN_PEAK * total;
        let beside: Vec<usize> = shares.iter().enumerate().filter(is_beside).map(|(k, _)| k).collect();
        if beside.is_empty() {
            return Ok(None);
        }
        let samples = self.samples.at(&beside);
        let others = fit.table.free().iter().filter(|other| **other != row);
        let alone = others.fold(fit.table.clone(), |table, other| table.with_fixed_row(*other));
        let valley = self.valley(&samples, &alone, problem.objective())?;
        let residuals = count((samples.len() * samples.values.len()).max(1));
        let rise = HALF_INTERVAL * (valley.cost / residuals).sqrt();
        valley.interval(row, rise, covariance).map(Some)
    }
}

/// How many samples decide a parameter.
#[derive(Clone, Copy, Default)]
struct Deciding {
    /// The sum of what the samples say of it, and of the squares of that.
    sum: f64,
    squares: f64,
}

impl Deciding {
    /// Adds samples, given what each says.
    fn add(&mut self, shares: &[f64]) {
        self.merge(&Self {
            sum: shares.iter().sum(),
            squares: shares.iter().map(|share| share * share).sum(),
        });
    }

    fn merge(&mut self, other: &Self) {
        self.sum += other.sum;
        self.squares += other.squares;
    }

    /// The number of samples, where those that say little count less.
    fn samples(&self) -> f64 {
        self.sum * self.sum / self.squares
    }
}

#[cfg(test)]
mod tests {
    use super::Deciding;
    use approx::assert_relative_eq;

    #[test]
    fn equal_samples_count_fully() {
        let deciding = |shares: &[f64]| {
            let mut all = Deciding::default();
            all.add(shares);
            all.samples()
        };
        assert_relative_eq!(deciding(&[2.0; 7]), 7.0);
        assert_relative_eq!(deciding(&[1.0, 0.0, 0.0]), 1.0);
    }
}
