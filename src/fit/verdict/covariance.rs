//! Standard errors, intervals and correlations at the optimum.
//!
//! With H = J^T J at the optimum and J weighted like the residuals:
//!
//! - If standard deviations are given, the residuals are unit normal and the covariance is H^-1 (`absolute`).
//! - Other weights are not inverse variances, and the covariance is the sandwich H^-1 (sum e^2 J J^T) H^-1
//!   (Huber 1967, White 1980), in which each sample reveals its own noise.
//!
//! A fit follows the samples that decide it, so the residual r that remains at such a sample is smaller than its noise.
//! Hence e = r/(1 - h), where h = J_s H^-1 J_s is the leverage: the residual that the sample would have in a fit without
//! it. This is the third form of MacKinnon and White 1985 (HC3, doi:10.1016/0304-4076(85)90158-7), the jackknife of a
//! linear model.
//!
//! Both assume that the samples' errors are independent. Those of neighbouring cells of a measured table are not, so the
//! standard errors are lower limits there.
//!
//! Matrices over all parameters are never formed: `arrow` decomposes the model channel by channel.

use crate::parameters::ParameterTable;
use crate::solver::Linearisation;
use crate::solver::inverse::arrow::Arrow;
use crate::solver::inverse::block_matrix::BlockMatrix;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// The method by which the covariance was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// From the standard deviations given with the data.
    Absolute,
    /// From the scatter of the residuals.
    Sandwich,
    /// From fits repeated on resampled angles of incidence.
    BlockBootstrap,
}

impl Method {
    /// Name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Absolute => "absolute",
            Self::Sandwich => "sandwich",
            Self::BlockBootstrap => "block-bootstrap",
        }
    }
}

/// The covariance of the parameters that are free and not at a bound.
#[derive(Clone, Debug)]
pub struct Covariance {
    /// The method by which it was found.
    pub method: Method,
    /// Rows of the parameter table, ascending.
    pub rows: Vec<usize>,
    /// The covariances, in the parameters' own units.
    pub(super) entries: BlockMatrix,
    /// Rows that the data do not determine, for which a standard error has no meaning.
    pub undetermined: Vec<usize>,
    /// Ratio of the largest to the smallest singular value of J with columns of unit length.
    pub condition: f64,
    /// Rows whose error would be far larger if some parameter at a bound could move. They have no standard error.
    pub dependent: Vec<usize>,
    /// Rows whose samples a loss discards, for which a standard error has no meaning either.
    pub discarded: Vec<usize>,
    /// Rows that belong to the combination of parameters that is known worst.
    pub weakest: Vec<usize>,
    /// Ratio of half a 95 % interval to a standard error.
    pub quantile: f64,
    pub(super) unbounded: Unbounded,
}

/// A parameter belongs to a combination if its component of the unit direction is larger than this.
const IN_COMBINATION: f64 = 0.3;
/// A unit direction is not determined if its projection onto the undetermined directions is longer than this.
const IN_NULL_DIRECTION: f64 = 0.05;
/// If holding others at their bounds makes a variance this many times smaller, the smaller variance says little.
const INFLATION: f64 = 5.0;

/// Half of a 95 % interval in standard errors: the 0.975 quantile of Student's t.
fn half_interval(dof: f64) -> f64 {
    /// The 0.975 quantile of the normal distribution.
    const NORMAL: f64 = 1.959_963_984_540_054;
    if dof > 1e3 {
        // Abramowitz and Stegun 1964, 26.7.5; the next term is below 1e-5 / dof.
        return NORMAL + (NORMAL.powi(3) + NORMAL) / (4.0 * dof);
    }
    StudentsT::new(0.0, 1.0, dof).map_or(f64::NAN, |t| t.inverse_cdf(0.975))
}

/// The linear model in some of the parameters, and how well it determines them.
struct Known {
    /// Rows of the parameter table, ascending.
    rows: Vec<usize>,
    arrow: Arrow,
    /// H^-1, in scaled coordinates.
    inverse: BlockMatrix,
    /// The projection onto the directions that are not determined.
    unknown: BlockMatrix,
    /// The parameters' own units per unit of their scaled coordinates.
    units: DVector<f64>,
}

impl Known {
    /// The model of the `selected` columns of the Jacobian of `n` parameters; each column comes with its row of the
    /// parameter table.
    fn new(
        table: &ParameterTable,
        model: &Linearisation,
        n: usize,
        selected: &[(usize, usize)],
    ) -> Option<Self> {
        let (columns, rows): (Vec<usize>, Vec<usize>) = selected.iter().copied().unzip();
        let arrow = Arrow::new(model, n, columns)?;
        let unit = |(row, length): (&usize, &f64)| table.rows()[*row].slope() / length;
        let units = DVector::from_iterator(rows.len(), rows.iter().zip(arrow.lengths.iter()).map(unit));
        Some(Self { inverse: arrow.inverse(), unknown: arrow.unknown(), rows, arrow, units })
    }

    /// The rows of the parameters that the data do not determine.
    fn undetermined(&self) -> Vec<usize> {
        let lost = |i: usize| self.unknown.square(&[(i, 1.0)]).sqrt() > IN_NULL_DIRECTION;
        self.rows.iter().enumerate().filter(|(i, _)| lost(*i)).map(|(_, row)| *row).collect()
    }

    /// The rows that belong to the direction known worst.
    fn weakest(&self) -> Vec<usize> {
        let entries = self.arrow.weakest.iter().zip(&self.rows);
        entries.filter(|(entry, _)| entry.abs() > IN_COMBINATION).map(|(_, row)| *row).collect()
    }

    /// H^-1, or the sandwich around `scatter`, in the parameters' own units.
    fn covariance(&self, scatter: Option<&Linearisation>) -> BlockMatrix {
        let scaled = scatter.map_or_else(|| self.inverse.clone(), |scatter| self.arrow.sandwich(scatter));
        scaled.in_units(&self.units)
    }
}

/// The covariance of all free parameters as if there were no bounds, including those at a bound.
#[derive(Clone, Debug)]
pub(super) struct Unbounded {
    rows: Vec<usize>,
    entries: BlockMatrix,
    /// The parameters' own units per unit of the coordinates of `unknown`.
    units: DVector<f64>,
    /// The projection onto the directions that are not determined.
    unknown: BlockMatrix,
}

impl Covariance {
    /// The covariance from the linear model and, for the sandwich, the scatter rows, which come in the same blocks.
    /// `scatter` computes these rows from the decomposed model. `None` if no parameter is left or there are no degrees
    /// of freedom.
    pub(super) fn new(
        table: &ParameterTable,
        model: &Linearisation,
        method: Method,
        scatter: impl FnOnce(&Arrow) -> Option<Linearisation>,
        dof: f64,
    ) -> Option<Self> {
        let all: Vec<(usize, usize)> = table.free().iter().copied().enumerate().collect();
        let n = all.len();
        let at_bound = |row: usize| table.rows()[row].at_lower() || table.rows()[row].at_upper();
        let inside: Vec<(usize, usize)> = all.iter().copied().filter(|(_, row)| !at_bound(*row)).collect();
        if inside.is_empty() || dof <= 0.0 {
            return None;
        }
        let bounded = inside.len() < n;
        let inside = Known::new(table, model, n, &inside)?;
        let scatter = scatter(&inside.arrow);
        if !scatter.as_ref().is_none_or(Linearisation::is_finite) {
            return None;
        }
        let entries = inside.covariance(scatter.as_ref());
        let all = if bounded { Known::new(table, model, n, &all) } else { None };
        let free = all.as_ref().unwrap_or(&inside);
        let unbounded = Unbounded {
            rows: free.rows.clone(),
            entries: free.covariance(scatter.as_ref()),
            units: free.units.clone(),
            unknown: free.unknown.clone(),
        };
        // If an error exceeds the whole range of its parameter, the data say nothing about it.
        let lost_inside = inside.undetermined();
        let mut undetermined = lost_inside.clone();
        for (i, index) in inside.rows.iter().enumerate() {
            let row = &table.rows()[*index];
            let error = entries.entry(i, i).sqrt() / row.slope();
            if !(error <= row.width() || lost_inside.contains(index)) {
                undetermined.push(*index);
            }
        }
        // Errors that would be far larger if the parameters at a bound could move, whatever the noise.
        let (held, moving) = (inside.covariance(None), free.covariance(None));
        let lost_free = free.undetermined();
        let depends = |(i, row): (usize, &usize)| {
            let j = free.rows.binary_search(row).ok()?;
            let larger = moving.entry(j, j) > INFLATION * held.entry(i, i);
            let lost = lost_free.contains(row) && !lost_inside.contains(row);
            (larger || lost).then_some(*row)
        };
        let dependent = inside.rows.iter().enumerate().filter_map(depends).collect();
        // If sigma is given, no variance is estimated; that is the limit of Student's distribution for infinitely many
        // degrees of freedom.
        let quantile = half_interval(if method == Method::Absolute { f64::INFINITY } else { dof });
        Some(Self {
            method,
            entries,
            dependent,
            discarded: Vec::new(),
            condition: inside.arrow.condition,
            quantile,
            unbounded,
            weakest: inside.weakest(),
            rows: inside.rows,
            undetermined,
        })
    }

    /// All entries, row by row in the order of `rows`.
    #[must_use]
    pub fn matrix(&self) -> DMatrix<f64> {
        self.entries.dense()
    }

    /// The same with every variance `factor` times as large, estimated with `dof` degrees of freedom.
    pub(super) fn scaled(mut self, factor: f64, dof: f64) -> Self {
        let scale = |entries: &BlockMatrix| {
            entries.clone().in_units(&DVector::from_element(entries.len(), factor.sqrt()))
        };
        self.entries = scale(&self.entries);
        self.unbounded.entries = scale(&self.unbounded.entries);
        self.quantile = half_interval(dof);
        self
    }

    /// Removes the errors of some rows.
    pub(super) fn discard(&mut self, rows: Vec<usize>) {
        self.discarded = rows;
    }

    /// The position in `rows` of a row of the table; `None` if it has no error.
    fn position(&self, row: usize) -> Option<usize> {
        let no_error = [&self.undetermined, &self.dependent, &self.discarded];
        self.rows.binary_search(&row).ok().filter(|_| !no_error.iter().any(|rows| rows.contains(&row)))
    }

    /// The standard error of the parameter in a row of the table. `None` if the parameter is at a bound, held,
    /// undetermined, dependent or discarded. Also `None` instead of 0, because data without noise do not determine how
    /// large the error is.
    #[must_use]
    pub fn std_error(&self, row: usize) -> Option<f64> {
        let i = self.position(row)?;
        Some(self.entries.entry(i, i).sqrt()).filter(|e| e.is_finite() && *e > 0.0)
    }

    /// The covariance of the parameters in two rows.
    #[must_use]
    pub fn between(&self, a: usize, b: usize) -> Option<f64> {
        Some(self.entries.entry(self.position(a)?, self.position(b)?))
    }

    /// The correlation of the parameters in two rows, -1..1.
    #[must_use]
    pub fn correlation(&self, a: usize, b: usize) -> Option<f64> {
        let scale = self.std_error(a)? * self.std_error(b)?;
        if a == b {
            return Some(1.0);
        }
        (scale > 0.0).then(|| self.between(a, b).map(|c| (c / scale).clamp(-1.0, 1.0))).flatten()
    }

    /// The pairs of rows whose correlation exceeds `least` in magnitude, in order.
    pub(super) fn correlated_pairs(&self, least: f64) -> Vec<(f64, usize, usize)> {
        let known = |(i, row): (usize, &usize)| Some((i, *row, self.std_error(*row)?));
        let known: Vec<(usize, usize, f64)> = self.rows.iter().enumerate().filter_map(known).collect();
        let mut pairs = Vec::new();
        for (k, (i, a, error_a)) in known.iter().enumerate() {
            for (j, b, error_b) in known.iter().skip(k + 1) {
                let correlation = (self.entries.entry(*i, *j) / (error_a * error_b)).clamp(-1.0, 1.0);
                if correlation.abs() > least {
                    pairs.push((correlation, *a, *b));
                }
            }
        }
        pairs
    }

    /// The standard error of a sum of parameters, each given by its row and its weight.
    ///
    /// The sum may be determined even if its terms are not, or if one of them is at a bound; such a term is ignored.
    /// `None` if the sum itself is not determined, or if none of the rows is free.
    #[must_use]
    pub fn combined_error(&self, terms: &[(usize, f64)]) -> Option<f64> {
        let Unbounded { rows, entries, units, unknown } = &self.unbounded;
        if terms.iter().any(|(row, _)| self.discarded.contains(row)) {
            return None;
        }
        let place = |(row, weight): &(usize, f64)| Some((rows.binary_search(row).ok()?, *weight));
        let weights: Vec<(usize, f64)> = terms.iter().filter_map(place).collect();
        let scaled = |(i, weight): &(usize, f64)| (*i, weight * units[*i]);
        let direction: Vec<(usize, f64)> = weights.iter().map(scaled).collect();
        // The same row may occur twice.
        let along = |(i, x): &(usize, f64)| -> f64 {
            x * direction.iter().filter(|(j, _)| j == i).map(|(_, y)| y).sum::<f64>()
        };
        let length = direction.iter().map(along).sum::<f64>().sqrt();
        let lost = unknown.square(&direction).max(0.0).sqrt();
        if length == 0.0 || lost > IN_NULL_DIRECTION * length {
            return None;
        }
        Some(entries.square(&weights).max(0.0).sqrt()).filter(|error| error.is_finite() && *error > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::half_interval;
    use approx::assert_relative_eq;

    #[test]
    fn quantiles_of_students_t() {
        // Abramowitz and Stegun 1964, table 26.10, and a comparison of the two branches.
        assert_relative_eq!(half_interval(1.0), 12.706, max_relative = 1e-4);
        assert_relative_eq!(half_interval(10.0), 2.228, max_relative = 1e-3);
        assert_relative_eq!(half_interval(999.0), half_interval(1001.0), max_relative = 1e-5);
        assert_relative_eq!(half_interval(f64::INFINITY), 1.959_964, max_relative = 1e-6);
    }
}
