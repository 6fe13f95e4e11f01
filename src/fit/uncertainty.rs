//! Standard errors, intervals and correlations at the optimum.
//!
//! With H = J^T J at the optimum, J weighted like the residuals:
//!
//! - given standard deviations make the residuals unit normal, and the covariance is H^-1, absolute;
//! - other weights are not inverse variances, and the covariance is the sandwich
//!   H^-1 (sum e^2 J J^T) H^-1 (Huber 1967, White 1980), which lets each sample tell its own noise.
//!
//! A fit follows the samples that decide it, and r, the residual it leaves them, is smaller than their noise.
//! Hence e = r/(1 - h) with h = J_s H^-1 J_s the leverage, the residual in a fit without the sample: the third
//! form of MacKinnon and White 1985 (HC3, doi:10.1016/0304-4076(85)90158-7), the jackknife of a linear model.
//!
//! Both assume independent errors from sample to sample. Neighbouring cells of a measured table are not
//! independent: read the errors as lower limits there.

use super::parameters::{ParameterTable, Row};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// How the covariance was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// From given standard deviations.
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

/// The covariance of the parameters that are neither held nor at a bound.
#[derive(Clone, Debug)]
pub struct Covariance {
    /// How it was found.
    pub method: Method,
    /// Rows of the parameter table, in order.
    pub rows: Vec<usize>,
    /// In the parameters' own units.
    pub matrix: DMatrix<f64>,
    /// Rows that the data do not determine: no standard error means anything for them.
    pub undetermined: Vec<usize>,
    /// Ratio of the largest to the smallest singular value of J with columns of unit length.
    pub condition: f64,
    /// Rows whose error would be far larger if some parameter at a bound could move: none is given.
    pub dependent: Vec<usize>,
    /// Rows whose samples a loss discards: no standard error means anything for them either.
    pub discarded: Vec<usize>,
    /// Rows that take part in the combination of parameters that is known worst.
    pub weakest: Vec<usize>,
    /// Factor between a standard error and half a 95 % interval.
    pub quantile: f64,
    pub(super) unbounded: Unbounded,
}

/// Far more than the decomposition of a finite matrix takes.
const SVD_ITERATIONS: usize = 10_000;

/// Below this share of the largest singular value a direction is not determined by double precision.
const RANK_TOLERANCE: f64 = 1e-11;

/// A parameter with so large a part in a direction of unit length belongs to the combination.
const IN_COMBINATION: f64 = 0.3;
/// The same for a direction that is not determined.
const IN_NULL_DIRECTION: f64 = 0.05;
/// A variance that holding others at their bounds makes so many times smaller says little.
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

/// The residual that a sample would have in a fit without it: r/(1 - h), to first order, with h = J_s H^-1 J_s
/// its leverage. `typical` is the root mean square of the residuals.
pub(super) fn left_out(r: f64, h: f64, typical: f64) -> f64 {
    // At leverage 1 a parameter follows its only sample: r is 0 whatever the noise, and r/(1 - h) rounding
    // over rounding. Under equal noise r/(1 - h) is about typical/sqrt(1 - h); beyond the limit it is taken
    // to be what that gives at the limit, or more if r asks for it.
    const LEAST: f64 = 0.01;
    let rest = 1.0 - h;
    if rest > LEAST { r / rest } else { (r.abs() / LEAST).max(typical / LEAST.sqrt()) }
}

/// The linear model in some of the parameters, its columns scaled to unit length, taken apart.
struct Decomposed {
    /// Columns of the Jacobian.
    columns: Vec<usize>,
    /// Rows of the parameter table.
    rows: Vec<usize>,
    /// Lengths of the columns.
    lengths: DVector<f64>,
    /// V S^-1 over the determined directions, so that its product with its transpose is H^-1.
    half_inverse: DMatrix<f64>,
    /// Unit vectors along the directions that are not determined.
    null: Vec<DVector<f64>>,
    /// Rows that take part in those.
    undetermined: Vec<usize>,
    /// Rows that take part in the direction known worst.
    weakest: Vec<usize>,
    condition: f64,
}

impl Decomposed {
    /// Of `selected` columns of the Jacobian, each with its row of the parameter table.
    fn new(jacobian: &DMatrix<f64>, selected: &[(usize, usize)]) -> Option<Self> {
        let columns: Vec<usize> = selected.iter().map(|(column, _)| *column).collect();
        let rows: Vec<usize> = selected.iter().map(|(_, row)| *row).collect();
        let length = |column: &usize| match jacobian.column(*column).norm() {
            length if length > 0.0 => length,
            _ => 1.0,
        };
        let lengths = DVector::from_iterator(columns.len(), columns.iter().map(length));
        let design = select_scaled(jacobian, &columns, &lengths);
        // Values close to the largest double overflow on the way; there is no covariance to be had then.
        if !is_finite(&design) {
            return None;
        }
        let svd = design.try_svd(false, true, f64::EPSILON, SVD_ITERATIONS)?;
        let v_t = svd.v_t?;
        let largest = svd.singular_values.max();
        let smallest = if jacobian.nrows() < columns.len() { 0.0 } else { svd.singular_values.min() };
        let mut half_inverse = v_t.transpose();
        let mut null = Vec::new();
        for (k, s) in svd.singular_values.iter().enumerate() {
            if *s > RANK_TOLERANCE * largest {
                half_inverse.column_mut(k).scale_mut(1.0 / s);
            } else {
                null.push(half_inverse.column(k).into_owned());
                half_inverse.column_mut(k).fill(0.0);
            }
        }
        let involved = |direction: &DVector<f64>, least: f64| -> Vec<usize> {
            let entries = direction.iter().zip(&rows).filter(|(entry, _)| entry.abs() > least);
            entries.map(|(_, row)| *row).collect()
        };
        let mut undetermined: Vec<usize> = Vec::new();
        for row in null.iter().flat_map(|direction| involved(direction, IN_NULL_DIRECTION)) {
            if !undetermined.contains(&row) {
                undetermined.push(row);
            }
        }
        let direction = v_t.row(svd.singular_values.imin()).transpose();
        let weakest = involved(&direction, IN_COMBINATION);
        let condition = largest / smallest;
        Some(Self { columns, rows, lengths, half_inverse, null, undetermined, weakest, condition })
    }

    /// A root of H^-1 with a row for each of `n` free parameters; what is held has no part in it.
    fn root(&self, n: usize) -> DMatrix<f64> {
        let mut root = DMatrix::zeros(n, self.half_inverse.ncols());
        let rows = self.columns.iter().zip(self.lengths.iter()).zip(self.half_inverse.row_iter());
        for ((column, length), row) in rows {
            root.row_mut(*column).copy_from(&(row / *length));
        }
        root
    }

    /// The parameters' own units per unit of their scaled coordinates.
    fn units(&self, table: &ParameterTable) -> DVector<f64> {
        let unit = |(row, length): (&usize, &f64)| table.rows().get(*row).map_or(0.0, Row::stretch) / length;
        DVector::from_iterator(self.rows.len(), self.rows.iter().zip(self.lengths.iter()).map(unit))
    }

    /// H^-1, or the sandwich around `scatter`, in the parameters' own units.
    fn covariance(&self, table: &ParameterTable, scatter: Option<&DMatrix<f64>>) -> DMatrix<f64> {
        let inverse = &self.half_inverse * self.half_inverse.transpose();
        let mut matrix = match scatter {
            None => inverse,
            Some(scatter) => {
                let spread = select_scaled(scatter, &self.columns, &self.lengths) * inverse;
                spread.tr_mul(&spread)
            }
        };
        let units = self.units(table);
        matrix.component_mul_assign(&(&units * units.transpose()));
        matrix
    }
}

fn select_scaled(matrix: &DMatrix<f64>, columns: &[usize], lengths: &DVector<f64>) -> DMatrix<f64> {
    let mut selected = matrix.select_columns(columns);
    for (mut column, length) in selected.column_iter_mut().zip(lengths.iter()) {
        column /= *length;
    }
    selected
}

fn is_finite(matrix: &DMatrix<f64>) -> bool {
    matrix.iter().all(|v| v.is_finite())
}

/// The covariance of all free parameters, those at a bound too, as if there were no bounds.
#[derive(Clone, Debug)]
pub(super) struct Unbounded {
    rows: Vec<usize>,
    matrix: DMatrix<f64>,
    /// Own units per unit of the coordinates that `null` is in.
    units: DVector<f64>,
    /// Directions that are not determined.
    null: Vec<DVector<f64>>,
}

impl Covariance {
    /// The covariance from the Jacobian and, for the sandwich, the scatter rows; both have one column per
    /// free parameter of `table`. `scatter` makes the latter from a root of H^-1 with a row per parameter.
    /// None if no parameter is left or there are no degrees of freedom.
    pub(super) fn new(
        table: &ParameterTable,
        jacobian: &DMatrix<f64>,
        scatter: Option<impl FnOnce(&DMatrix<f64>) -> DMatrix<f64>>,
        dof: f64,
    ) -> Option<Self> {
        let all: Vec<(usize, usize)> = table.free().iter().copied().enumerate().collect();
        let at_bound = |row: usize| table.rows().get(row).is_some_and(|r| r.at_lower() || r.at_upper());
        let inside: Vec<(usize, usize)> = all.iter().copied().filter(|(_, row)| !at_bound(*row)).collect();
        if inside.is_empty() || dof <= 0.0 {
            return None;
        }
        let bounded = inside.len() < all.len();
        let inside = Decomposed::new(jacobian, &inside)?;
        let method = if scatter.is_some() { Method::Sandwich } else { Method::Absolute };
        let scatter = scatter.map(|scatter| scatter(&inside.root(jacobian.ncols())));
        if !scatter.as_ref().is_none_or(is_finite) {
            return None;
        }
        let matrix = inside.covariance(table, scatter.as_ref());
        let all = if bounded { Decomposed::new(jacobian, &all) } else { None };
        let free = all.as_ref().unwrap_or(&inside);
        let unbounded = Unbounded {
            rows: free.rows.clone(),
            matrix: free.covariance(table, scatter.as_ref()),
            units: free.units(table),
            null: free.null.clone(),
        };
        // An error beyond the whole range of its parameter says that the data know nothing of it.
        let mut undetermined = inside.undetermined.clone();
        for (i, index) in inside.rows.iter().enumerate() {
            let Some(row) = table.rows().get(*index) else { continue };
            let error = matrix.get((i, i)).map_or(f64::NAN, |variance| variance.sqrt()) / row.stretch();
            if !(error <= row.width() || undetermined.contains(index)) {
                undetermined.push(*index);
            }
        }
        // Errors that would be far larger if what is at a bound could move, whatever the noise.
        let (held, moving) = (inside.covariance(table, None), free.covariance(table, None));
        let depends = |(i, row): (usize, &usize)| {
            let j = free.rows.iter().position(|r| r == row)?;
            let larger = *moving.get((j, j))? > INFLATION * *held.get((i, i))?;
            let lost = free.undetermined.contains(row) && !inside.undetermined.contains(row);
            (larger || lost).then_some(*row)
        };
        let dependent = inside.rows.iter().enumerate().filter_map(depends).collect();
        // A given sigma leaves nothing to estimate: that is Student's distribution in the limit.
        let quantile = half_interval(if method == Method::Absolute { f64::INFINITY } else { dof });
        Some(Self {
            method,
            matrix,
            dependent,
            discarded: Vec::new(),
            condition: inside.condition,
            quantile,
            unbounded,
            rows: inside.rows,
            undetermined,
            weakest: inside.weakest,
        })
    }

    /// Takes the errors of some rows back.
    pub(super) fn discard(&mut self, rows: Vec<usize>) {
        self.discarded = rows;
    }

    fn position(&self, row: usize) -> Option<usize> {
        let no_error = [&self.undetermined, &self.dependent, &self.discarded];
        self.rows.iter().position(|r| *r == row).filter(|_| !no_error.iter().any(|rows| rows.contains(&row)))
    }

    /// Standard error of the parameter in a row of the table; none at a bound, held, undetermined, dependent
    /// or discarded, and none of 0: data without noise do not tell how large it is.
    #[must_use]
    pub fn std_error(&self, row: usize) -> Option<f64> {
        let i = self.position(row)?;
        self.matrix.get((i, i)).map(|variance| variance.sqrt()).filter(|e| e.is_finite() && *e > 0.0)
    }

    /// Covariance of the parameters in two rows.
    #[must_use]
    pub fn between(&self, a: usize, b: usize) -> Option<f64> {
        self.matrix.get((self.position(a)?, self.position(b)?)).copied()
    }

    /// Correlation of the parameters in two rows, -1..1.
    #[must_use]
    pub fn correlation(&self, a: usize, b: usize) -> Option<f64> {
        let scale = self.std_error(a)? * self.std_error(b)?;
        if a == b {
            return Some(1.0);
        }
        (scale > 0.0).then(|| self.between(a, b).map(|c| (c / scale).clamp(-1.0, 1.0))).flatten()
    }

    /// Standard error of a sum of parameters, each given by its row and its weight.
    ///
    /// The sum may be determined where its terms are not, and where one of them is at a bound, which is
    /// left out of account. None if it is not determined itself, or none of the rows is free.
    #[must_use]
    pub fn combined_error(&self, terms: &[(usize, f64)]) -> Option<f64> {
        let Unbounded { rows, matrix, units, null } = &self.unbounded;
        if terms.iter().any(|(row, _)| self.discarded.contains(row)) {
            return None;
        }
        let weight = |row: &usize| terms.iter().filter(|(r, _)| r == row).map(|(_, weight)| weight).sum();
        let weights = DVector::from_iterator(rows.len(), rows.iter().map(weight));
        let direction = weights.component_mul(units);
        let length = direction.norm();
        let lost = |unknown: &DVector<f64>| direction.dot(unknown).abs() > IN_NULL_DIRECTION * length;
        if length == 0.0 || null.iter().any(lost) {
            return None;
        }
        let variance = weights.dot(&(matrix * &weights));
        Some(variance.max(0.0).sqrt()).filter(|error| error.is_finite() && *error > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::half_interval;
    use approx::assert_relative_eq;

    #[test]
    fn quantiles_of_students_t() {
        // Abramowitz and Stegun 1964, table 26.10, and the two branches against each other.
        assert_relative_eq!(half_interval(1.0), 12.706, max_relative = 1e-4);
        assert_relative_eq!(half_interval(10.0), 2.228, max_relative = 1e-3);
        assert_relative_eq!(half_interval(999.0), half_interval(1001.0), max_relative = 1e-5);
        assert_relative_eq!(half_interval(f64::INFINITY), 1.959_964, max_relative = 1e-6);
    }
}
