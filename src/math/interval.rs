//! Half of a 95 % interval in standard errors, where the variance is itself an estimate.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Half of a 95 % interval for a variance with `dof` degrees of freedom: the 0.975 quantile of Student's t.
#[must_use]
pub fn half_interval_of_student(dof: f64) -> f64 {
    /// The 0.975 quantile of the normal distribution.
    const NORMAL: f64 = 1.959_963_984_540_054;
    if dof > 1e3 {
        // Abramowitz and Stegun 1964, 26.7.5; the next term is below 1e-5 / dof.
        return NORMAL + (NORMAL.powi(3) + NORMAL) / (4.0 * dof);
    }
    StudentsT::new(0.0, 1.0, dof).map_or(f64::NAN, |t| t.inverse_cdf(0.975))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn quantiles_of_students_t() {
        // Abramowitz and Stegun 1964, table 26.10, and a comparison of the two branches.
        assert_relative_eq!(half_interval_of_student(1.0), 12.706, max_relative = 1e-4);
        assert_relative_eq!(half_interval_of_student(10.0), 2.228, max_relative = 1e-3);
        assert_relative_eq!(
            half_interval_of_student(999.0),
            half_interval_of_student(1001.0),
            max_relative = 1e-5
        );
        assert_relative_eq!(half_interval_of_student(f64::INFINITY), 1.959_964, max_relative = 1e-7);
    }
}
