//! How uncertain a quantity is that follows from the parameters of a report.

use super::Recorded;
use crate::parameters::ParameterTable;

/// The covariance of the parameters of a report, from its standard errors and correlations.
#[derive(Clone, Debug)]
pub struct Spread<'a> {
    table: &'a ParameterTable,
    /// The rows with a standard error, and that error.
    rows: Vec<(usize, f64)>,
    /// Their correlations.
    correlation: Vec<Vec<f64>>,
    /// Whether every parameter that was fitted has a standard error.
    pub complete: bool,
    half_interval: f64,
}

/// Standard errors on either side of a value that 95 % of normal errors lie within.
pub const BAND: f64 = 1.96;

/// The step of a difference quotient, in standard errors: small enough for every formula to be linear, large enough to keep half the
/// digits.
const STEP: f64 = 1e-3;

impl<'a> Spread<'a> {
    /// The covariance that a report keeps; `None` if it keeps none.
    #[must_use]
    pub fn of(recorded: &'a Recorded) -> Option<Self> {
        let kept = recorded.report.correlation.as_ref()?;
        let table = &recorded.table;
        let names: Vec<String> = (0..table.rows().len()).map(|index| table.name(index)).collect();
        let mut rows = Vec::new();
        let mut places = Vec::new();
        let mut half_interval = BAND;
        for (place, name) in kept.parameters.iter().enumerate() {
            let row = names.iter().position(|known| known == name);
            let reported = recorded.report.parameters.get(row?)?;
            if let (Some(row), Some(error)) = (row, reported.std_error.filter(|error| *error > 0.0)) {
                rows.push((row, error));
                if let Some([low, high]) = reported.ci95 {
                    half_interval = half_interval.max(0.5 * (high - low) / error);
                }
                places.push(place);
            }
        }
        let entry = |a: &usize, b: &usize| {
            if a == b { Some(1.0) } else { *kept.matrix.get(*a)?.get(*b)? }
        };
        // An unknown correlation belongs to a parameter that the data do not determine, which has no standard error.
        let correlation =
            places.iter().map(|a| places.iter().map(|b| entry(a, b).unwrap_or(0.0)).collect()).collect();
        let complete = rows.len() == kept.parameters.len();
        (!rows.is_empty()).then_some(Self { table, rows, correlation, complete, half_interval })
    }

    /// The standard error of each of several quantities that follow from the parameters, to first order.
    #[must_use]
    pub fn std_errors(&self, quantities: impl Fn(&ParameterTable) -> Vec<f64>) -> Vec<f64> {
        // The change of every quantity per standard error of each parameter.
        let slopes: Vec<Vec<f64>> =
            self.rows.iter().map(|(row, error)| self.slope(*row, *error, &quantities)).collect();
        let count = slopes.first().map_or(0, Vec::len);
        let variance = |k: usize| -> f64 {
            let at = |slope: &Vec<f64>| slope.get(k).copied().unwrap_or(f64::NAN);
            let of_row = |(slope, correlations): (&Vec<f64>, &Vec<f64>)| {
                let sum: f64 = slopes.iter().zip(correlations).map(|(other, r)| r * at(other)).sum();
                at(slope) * sum
            };
            slopes.iter().zip(&self.correlation).map(of_row).sum()
        };
        (0..count).map(|k| variance(k).max(0.0).sqrt()).collect()
    }

    /// Standard errors on either side of a value that hold 95 %: as many as in the interval of the parameter whose error is known worst.
    #[must_use]
    pub fn half_interval(&self) -> f64 {
        self.half_interval
    }

    /// The change of every quantity per standard error of a row. At a bound the quotient is one-sided.
    fn slope(&self, row: usize, error: f64, quantities: impl Fn(&ParameterTable) -> Vec<f64>) -> Vec<f64> {
        let at = |shift: f64| {
            let mut table = self.table.clone();
            let value = table.rows().get(row).map_or(0.0, |row| row.value);
            table.set_value(row, value + shift);
            let moved = table.rows().get(row).map_or(0.0, |row| row.value);
            (moved, quantities(&table))
        };
        // A standard error that is tiny beside the value leaves a step of a few roundings.
        let step = (STEP * error).max(1e-9 * self.table.rows().get(row).map_or(0.0, |row| row.value.abs()));
        let ((low, below), (high, above)) = (at(-step), at(step));
        below.iter().zip(above).map(|(below, above)| (above - below) / (high - low) * error).collect()
    }
}
