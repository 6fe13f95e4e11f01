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

use super::parameters::ParameterTable;
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
    /// Rows that take part in the combination of parameters that is known worst.
    pub weakest: Vec<usize>,
    /// Factor between a standard error and half a 95 % interval.
    pub quantile: f64,
}

/// Far more than the decomposition of a finite matrix takes.
const SVD_ITERATIONS: usize = 10_000;

/// Below this share of the largest singular value a direction is not determined by double precision.
const RANK_TOLERANCE: f64 = 1e-11;

/// A parameter with so large a part in a direction of unit length belongs to the combination.
const IN_COMBINATION: f64 = 0.3;

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
        let inside: Vec<(usize, usize)> = table
            .free()
            .iter()
            .copied()
            .enumerate()
            .filter(|(_, row)| table.rows().get(*row).is_some_and(|r| !r.at_lower() && !r.at_upper()))
            .collect();
        if inside.is_empty() || dof <= 0.0 {
            return None;
        }
        let columns: Vec<usize> = inside.iter().map(|(column, _)| *column).collect();
        let rows: Vec<usize> = inside.iter().map(|(_, row)| *row).collect();
        let lengths = DVector::from_iterator(
            columns.len(),
            columns.iter().map(|c| match jacobian.column(*c).norm() {
                length if length > 0.0 => length,
                _ => 1.0,
            }),
        );
        let scaled = |matrix: &DMatrix<f64>| {
            let mut selected = matrix.select_columns(&columns);
            for (mut column, length) in selected.column_iter_mut().zip(lengths.iter()) {
                column /= *length;
            }
            selected
        };
        // Values close to the largest double overflow on the way; there is no covariance to be had then.
        let finite = |matrix: &DMatrix<f64>| matrix.iter().all(|v| v.is_finite());
        let design = scaled(jacobian);
        if !finite(&design) {
            return None;
        }
        let svd = design.try_svd(false, true, f64::EPSILON, SVD_ITERATIONS)?;
        let v_t = svd.v_t?;
        let largest = svd.singular_values.max();
        let smallest = if jacobian.nrows() < columns.len() { 0.0 } else { svd.singular_values.min() };
        // V S^-1 over the determined directions; the others mark the parameters that they involve.
        let mut half_inverse = v_t.transpose();
        let mut undetermined = Vec::new();
        for (k, s) in svd.singular_values.iter().enumerate() {
            if *s > RANK_TOLERANCE * largest {
                half_inverse.column_mut(k).scale_mut(1.0 / s);
                continue;
            }
            for (entry, row) in half_inverse.column(k).iter().zip(&rows) {
                if entry.abs() > 0.05 && !undetermined.contains(row) {
                    undetermined.push(*row);
                }
            }
            half_inverse.column_mut(k).fill(0.0);
        }
        let direction = v_t.row(svd.singular_values.imin());
        let in_combination = direction.iter().zip(&rows).filter(|(entry, _)| entry.abs() > IN_COMBINATION);
        let weakest = in_combination.map(|(_, row)| *row).collect();
        let inverse = &half_inverse * half_inverse.transpose();
        let (method, mut matrix) = match scatter {
            None => (Method::Absolute, inverse),
            Some(scatter) => {
                // The inverse's root in the units of the Jacobian; what is held has no part in it.
                let mut root = DMatrix::zeros(jacobian.ncols(), half_inverse.ncols());
                for ((column, length), row) in columns.iter().zip(lengths.iter()).zip(half_inverse.row_iter())
                {
                    root.row_mut(*column).copy_from(&(row / *length));
                }
                let scatter = scatter(&root);
                if !finite(&scatter) {
                    return None;
                }
                let spread = scaled(&scatter) * &inverse;
                (Method::Sandwich, spread.tr_mul(&spread))
            }
        };
        let units: Vec<f64> = rows
            .iter()
            .zip(lengths.iter())
            .map(|(row, length)| table.rows().get(*row).map_or(0.0, super::parameters::Row::stretch) / length)
            .collect();
        let units = DVector::from_vec(units);
        matrix.component_mul_assign(&(&units * units.transpose()));
        // A given sigma leaves nothing to estimate: that is Student's distribution in the limit.
        let quantile = half_interval(if method == Method::Absolute { f64::INFINITY } else { dof });
        Some(Self { method, rows, matrix, undetermined, condition: largest / smallest, weakest, quantile })
    }

    fn position(&self, row: usize) -> Option<usize> {
        self.rows.iter().position(|r| *r == row).filter(|_| !self.undetermined.contains(&row))
    }

    /// Standard error of the parameter in a row of the table; none at a bound, held or undetermined.
    #[must_use]
    pub fn std_error(&self, row: usize) -> Option<f64> {
        let i = self.position(row)?;
        self.matrix.get((i, i)).map(|variance| variance.sqrt()).filter(|e| e.is_finite())
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
