//! One row of the parameter table.

use crate::model::{ParamSpec, Scale};
use serde::Serialize;

/// How the fit treats a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// It is fitted.
    Free,
    /// It keeps its value.
    Fixed,
    /// It is kept equal to the parameter in another row.
    Tied(usize),
    /// It has no effect, because its lobe is absent.
    Absent,
    /// It belongs to a dead channel: it is fitted to that channel after the others, and has no say in what channels share.
    Apart,
}

/// A parameter as it is written to reports.
#[derive(Clone, Debug, Serialize)]
pub struct ParameterValue {
    /// Full name.
    pub name: String,
    /// Its value, in `unit`.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
}

/// A row of the parameter table: the value of one parameter, for one channel unless the channels share it.
#[derive(Clone, Debug)]
pub struct ParameterRow {
    /// Index of the lobe in the expression.
    pub lobe: usize,
    /// Index of the parameter in the lobe's declaration.
    pub parameter: usize,
    /// The parameter's declaration.
    pub spec: ParamSpec,
    /// Index of the channel; `None` if the channels share the parameter.
    pub channel: Option<usize>,
    /// The current value, in the parameter's unit.
    pub value: f64,
    /// The value that the fit started from.
    pub initial: f64,
    /// Whether the user gave that value.
    pub given: bool,
    /// Smallest and largest value.
    pub bounds: (f64, f64),
    /// Free, fixed or tied.
    pub status: Status,
    /// Whether it is held at the value that leaves its model isotropic, because the data cannot show another.
    pub held: bool,
    /// Whether the user asked for something else.
    pub overruled: bool,
}

impl ParameterRow {
    /// The solver's coordinate for a value.
    pub(super) fn coordinate(&self, value: f64) -> f64 {
        match self.spec.scale {
            Scale::Linear => value,
            Scale::Log => value.ln(),
            Scale::Square => value * value,
        }
    }

    /// The value for one of the solver's coordinates.
    pub(super) fn value_at(&self, coordinate: f64) -> f64 {
        match self.spec.scale {
            Scale::Linear => coordinate,
            Scale::Log => coordinate.exp(),
            Scale::Square => coordinate.max(0.0).sqrt(),
        }
    }

    /// d(value)/d(coordinate) at the current value.
    #[must_use]
    pub fn slope(&self) -> f64 {
        match self.spec.scale {
            Scale::Linear => 1.0,
            Scale::Log => self.value,
            Scale::Square => 0.5 / self.value.max(self.least_square()),
        }
    }

    /// For values smaller than this, the derivative with respect to the square is taken here. It is close enough to 0
    /// to change a model by no more than 1e-10 of its value, and far enough from 0 for the quotient to keep its
    /// digits.
    pub(super) fn least_square(&self) -> f64 {
        1e-6 * self.spec.typical.1
    }

    /// The width of the range between the bounds, in the solver's coordinate.
    pub(crate) fn width(&self) -> f64 {
        self.coordinate(self.bounds.1) - self.coordinate(self.bounds.0)
    }

    /// Whether the value is at its lower bound, to within rounding.
    #[must_use]
    pub fn at_lower(&self) -> bool {
        let (lower, upper) = self.bounds;
        self.value - lower <= 1e-12 * (upper - lower).min(lower.abs().max(1e-3))
    }

    /// Whether the value is at its upper bound, to within rounding.
    #[must_use]
    pub fn at_upper(&self) -> bool {
        let (lower, upper) = self.bounds;
        upper - self.value <= 1e-12 * (upper - lower).min(upper.abs().max(1e-3))
    }
}
