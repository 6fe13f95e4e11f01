//! How uncertain a quantity is that follows from the parameters of a report.

use super::{Parameter, Recorded};
use crate::math::half_interval_of_student;
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
        let mut half_interval = half_interval_of_student(f64::INFINITY);
        for (place, name) in kept.parameters.iter().enumerate() {
            let row = names.iter().position(|known| known == name);
            let reported = recorded.report.parameters.get(row?)?;
            if let (Some(row), Some(error)) = (row, reported.std_error.filter(|error| *error > 0.0)) {
                rows.push((row, error));
                half_interval = half_interval.max(closed_half(reported).map_or(0.0, |half| half / error));
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

    /// The 95 % band about the values `at` of several quantities that follow from the parameters.
    #[must_use]
    pub fn band(&self, at: &[f64], quantities: impl Fn(&ParameterTable) -> Vec<f64>) -> Vec<[f64; 2]> {
        let errors = self.std_errors(quantities);
        let about = |(value, error): (&f64, f64)| {
            let half = self.half_interval * error;
            [value - half, value + half]
        };
        at.iter().zip(errors).map(about).collect()
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

/// Half the 95 % interval of a parameter. An open end is only the last value that was tried: it counts for nothing, and the other end is
/// taken for both. `None` if there is no interval, or both ends are open.
fn closed_half(parameter: &Parameter) -> Option<f64> {
    let [low, high] = parameter.ci95?;
    let [below, above] = [parameter.value - low, high - parameter.value];
    match parameter.ci95_open {
        [None, None] => Some(0.5 * (below + above)),
        [None, Some(_)] => Some(below),
        [Some(_), None] => Some(above),
        [Some(_), Some(_)] => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use serde_json::{Value, json};

    /// A report of kd = 0.5 +/- 0.1 and n = 20 +/- 1, not correlated. What differs is the interval of kd, and which of its ends are
    /// open.
    fn recorded(ci95: [f64; 2], open: [Value; 2]) -> Recorded {
        let report = json!({
            "schema": "brdfit.report/1",
            "model": "lambert + phong",
            "data": {"path": "a.csv", "channels": ["f"]},
            "parameters": [
                {"lobe": "lambert", "name": "kd", "channel": "f", "value": 0.5, "bounds": [0.0, 2.0], "unit": "1",
                 "std_error": 0.1, "ci95": ci95, "ci95_open": open},
                {"lobe": "phong", "name": "ks", "channel": "f", "value": 0.125, "bounds": [0.0, 1000.0], "unit": "1"},
                {"lobe": "phong", "name": "n", "channel": null, "value": 20.0, "bounds": [0.01, 1e6], "unit": "1",
                 "std_error": 1.0, "ci95": [17.9, 22.1]},
            ],
            "correlation": {"parameters": ["lambert.kd.f", "phong.n"], "matrix": [[1.0, 0.0], [0.0, 1.0]]},
        });
        Recorded::of(serde_json::from_value(report).unwrap()).unwrap()
    }

    #[test]
    fn the_widest_interval_gives_the_band_and_an_open_end_does_not() {
        let closed = [Value::Null, Value::Null];
        let at_bound = json!("at-bound");
        let unfinished = json!("unfinished");
        for (ci95, open, half_interval) in [
            // 2.1 standard errors of n on either side, and 3 of kd.
            ([0.2, 0.8], closed.clone(), 3.0),
            // On average 2.5 of kd.
            ([0.2, 0.7], closed.clone(), 2.5),
            // 3 of kd below; above only what was tried last.
            ([0.2, 2.0], [Value::Null, at_bound.clone()], 3.0),
            ([0.0, 0.75], [unfinished.clone(), Value::Null], 2.5),
            // Nothing known of kd: 2.1 of n.
            ([0.0, 2.0], [unfinished, at_bound], 2.1),
            // Less than that of n.
            ([0.3, 0.7], closed, 2.1),
        ] {
            let recorded = recorded(ci95, open);
            let spread = Spread::of(&recorded).unwrap();
            assert_relative_eq!(spread.half_interval(), half_interval, max_relative = 1e-12);
            // The band of kd itself.
            let kd = |table: &ParameterTable| vec![table.rows()[0].value];
            let [low, high] = spread.band(&[0.5], kd)[0];
            assert_relative_eq!(low, 0.5 - 0.1 * half_interval, max_relative = 1e-9);
            assert_relative_eq!(high, 0.5 + 0.1 * half_interval, max_relative = 1e-9);
        }
    }
}
