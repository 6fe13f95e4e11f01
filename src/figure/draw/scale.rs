//! From values to places along an axis, and the ticks of an axis.

use crate::figure::data::{Axis, Scale};
use crate::figure::text::Text;
use std::ops::Range;

/// An axis with its ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Along {
    pub(super) scale: Scale,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Along {
    /// An axis with ends of its own, or with those of some values and a little room.
    pub(super) fn new(axis: &Axis, values: impl Iterator<Item = f64>) -> Self {
        let scale = axis.scale;
        let shown = |v: &f64| v.is_finite() && (scale != Scale::Log || *v > 0.0);
        let (low, high) = match axis.range {
            Some([low, high]) => (low, high),
            None => {
                let (low, high) = values
                    .filter(shown)
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
                room(scale, low, high)
            }
        };
        let usable = low < high && low.is_finite() && high.is_finite() && (scale != Scale::Log || low > 0.0);
        if usable { Self { scale, low, high } } else { Self { scale, low: 0.1, high: 1.0 } }
    }

    /// Where a value lies, from 0 to 1; `None` for one that the scale does not have.
    pub(super) fn place(&self, value: f64) -> Option<f64> {
        let on = |v: f64| match self.scale {
            Scale::Linear => v,
            Scale::Log => v.ln(),
            Scale::Root => v.max(0.0).sqrt(),
        };
        let (low, high, at) = (on(self.low), on(self.high), on(value));
        let place = (at - low) / (high - low);
        if place.is_nan() || (self.scale == Scale::Log && value <= 0.0) { None } else { Some(place) }
    }

    /// The same, with values that a logarithmic scale does not have, or that lie far outside, at a place just outside.
    pub(super) fn place_or_outside(&self, value: f64) -> f64 {
        self.place(value).unwrap_or(-10.0).clamp(-10.0, 10.0)
    }

    /// The ticks, with their labels; about `wanted` of them. Minor ones have no label.
    pub(super) fn ticks(&self, wanted: f64) -> Vec<(f64, Text)> {
        match self.scale {
            Scale::Log => {
                let all = log_ticks(&(self.low..self.high), wanted);
                all.into_iter().map(|v| (v, label(v))).collect()
            }
            Scale::Root => {
                // Only angles have this scale.
                const MANY: &[f64] = &[0.0, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0, 90.0];
                const FEW: &[f64] = &[0.0, 5.0, 20.0, 45.0, 90.0];
                let all = if wanted > 5.0 { MANY } else { FEW };
                let inside = all.iter().filter(|v| self.low <= **v && **v <= self.high);
                inside.map(|v| (*v, label(*v))).collect()
            }
            Scale::Linear => {
                // Two numbers do not show a scale.
                const FEWEST: usize = 3;
                let ticks = self.linear_ticks(wanted);
                if ticks.len() < FEWEST { self.linear_ticks(1.7 * wanted) } else { ticks }
            }
        }
    }

    /// The multiples of a round step within a linear axis, about `wanted` of them.
    fn linear_ticks(&self, wanted: f64) -> Vec<(f64, Text)> {
        let step = step((self.high - self.low) / wanted, self.is_angle());
        let first = (self.low / step - 1e-9).ceil();
        let mut ticks = Vec::new();
        let mut k = first;
        while k * step <= self.high + 1e-9 * step && ticks.len() < 50 {
            let value = rounded(k * step, step);
            ticks.push((value, label(value)));
            k += 1.0;
        }
        ticks
    }

    /// The places of ticks without a number: between those of a logarithmic axis over a few decades.
    pub(super) fn minor_ticks(&self) -> Vec<f64> {
        const MOST_DECADES: f64 = 8.0;
        if self.scale != Scale::Log || (self.high / self.low).log10() > MOST_DECADES {
            return Vec::new();
        }
        let tenths: Vec<u32> = (10..100).step_by(10).collect();
        multiples(&(self.low..self.high), &tenths)
    }

    /// Whether the axis is that of an angle to the normal, whose ticks are multiples of 15 or 30 degrees.
    fn is_angle(&self) -> bool {
        self.high == 90.0 && (self.low == 0.0 || self.low == -90.0)
    }
}

/// The ends with a little room beyond them.
fn room(scale: Scale, low: f64, high: f64) -> (f64, f64) {
    match scale {
        Scale::Log if low < high => {
            let factor = (high / low).powf(0.06).max(1.1);
            (low / factor, high * factor)
        }
        Scale::Log => (low / 1.5, high * 1.5),
        _ if low < high => {
            let room = 0.05 * (high - low);
            (low - room, high + room)
        }
        _ => (low - 0.5 * low.abs().max(1.0), high + 0.5 * high.abs().max(1.0)),
    }
}

/// A round step of at least this size.
fn step(least: f64, angle: bool) -> f64 {
    if angle {
        return [5.0, 10.0, 15.0, 30.0, 45.0].into_iter().find(|step| *step >= least).unwrap_or(90.0);
    }
    let power = 10_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|digit| digit * power)
        .find(|step| *step >= 0.999 * least)
        .unwrap_or(power * 10.0)
}

/// A multiple of a step without the digits that rounding adds.
fn rounded(value: f64, step: f64) -> f64 {
    let digits = (-(step.log10().floor())).clamp(0.0, 300.0);
    let scale = 10_f64.powf(digits);
    (value * scale).round() / scale + 0.0
}

/// The label of a tick: a short number, or a power of ten.
pub(super) fn label(value: f64) -> Text {
    let size = value.abs();
    if value == 0.0 || (1e-3..1e5).contains(&size) {
        let text = format!("{}", (value * 1e9).round() / 1e9);
        return Text::from(text.replace('-', "\u{2212}"));
    }
    let exponent = size.log10().floor();
    // The factor of a tick is a whole number or has one decimal.
    let factor = (size / 10_f64.powf(exponent) * 100.0).round() / 100.0;
    let sign = if value < 0.0 { "\u{2212}" } else { "" };
    if factor == 1.0 { format!("{sign}10^{exponent}") } else { format!("{sign}{factor}\u{b7}10^{exponent}") }
        .into()
}

/// The labelled ticks of a logarithmic axis: powers of ten and their multiples by 2 and 5; only powers of ten if those
/// are too many, and finer steps if they are fewer than two.
fn log_ticks(range: &Range<f64>, most: f64) -> Vec<f64> {
    let most = most.clamp(2.0, 20.0);
    // Multiples of a tenth of a power of ten: factors from 10 to 99.
    let finer: [Vec<u32>; 3] = [vec![10, 20, 50], (10..100).step_by(10).collect(), (10..100).collect()];
    let mut found = Vec::new();
    for tenths in &finer {
        found = multiples(range, tenths);
        if found.len() >= 2 {
            break;
        }
    }
    let number = |all: &Vec<f64>| crate::math::count(all.len());
    if number(&found) <= most {
        return found;
    }
    let decades = multiples(range, &[10]);
    if decades.len() < 2 {
        // Within a decade or two the ends of the list tell enough.
        let mut every = found.len();
        for step in 2..=found.len() {
            if crate::math::count(found.len().div_ceil(step)) <= most {
                every = step;
                break;
            }
        }
        return found.into_iter().step_by(every).collect();
    }
    let mut every = 1;
    while crate::math::count(decades.len().div_ceil(every)) > most {
        every += 1;
    }
    decades.into_iter().step_by(every).collect()
}

/// The numbers within a range that are a power of ten times one of `tenths`/10, in ascending order.
fn multiples(range: &Range<f64>, tenths: &[u32]) -> Vec<f64> {
    #[expect(clippy::cast_possible_truncation, reason = "the exponent of a finite number")]
    let exponent = |x: f64| x.log10().floor() as i32;
    let mut found = Vec::new();
    // One decade more on either side, in case a logarithm is rounded across a whole number.
    for power in exponent(range.start) - 2..=exponent(range.end) {
        for &count in tenths {
            let count = f64::from(count);
            // Dividing by a power of ten rounds only once, so the number prints without spurious digits.
            let x = if power < 0 { count / 10_f64.powi(-power) } else { count * 10_f64.powi(power) };
            if range.start <= x && x <= range.end {
                found.push(x);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_logarithmic_axis_carries_two_numbers_at_least_and_twenty_at_most() {
        // The shortest axis is that of a single point: it extends by a factor of 1.25 on either side.
        for step in 0..2000 {
            let middle = 10_f64.powf(-8.0 + 0.01 * f64::from(step));
            for factor in [1.25, 2.0, 7.0, 100.0, 1e6, 1e30] {
                for wanted in [3.0, 6.0, 20.0] {
                    let range = middle / factor..middle * factor;
                    let found = log_ticks(&range, wanted);
                    assert!((2..=20).contains(&found.len()), "{range:?}: {found:?}");
                    assert!(
                        found.iter().all(|x| range.start <= *x && *x <= range.end),
                        "{range:?}: {found:?}"
                    );
                    assert!(found.is_sorted_by(|a, b| a < b), "{range:?}: {found:?}");
                }
            }
        }
    }

    #[test]
    fn numbers_are_round() {
        assert_eq!(log_ticks(&(4.0..560.0), 20.0), [5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0]);
        assert_eq!(log_ticks(&(0.012..0.054), 20.0), [0.02, 0.05]);
        assert_eq!(log_ticks(&(0.022..0.034), 20.0).first(), Some(&0.022));
        assert_eq!(log_ticks(&(0.51..0.79), 20.0), [0.6, 0.7]);
        let linear = |low: f64, high: f64| {
            let along = Along { scale: Scale::Linear, low, high };
            along.ticks(5.0).into_iter().map(|(_, label)| label.to_string()).collect::<Vec<_>>()
        };
        assert_eq!(linear(-0.31, 0.31), ["\u{2212}0.2", "0", "0.2"]);
        assert_eq!(linear(0.0, 90.0), ["0", "30", "60", "90"]);
        assert_eq!(linear(0.0, 0.0042), ["0", "0.001", "0.002", "0.003", "0.004"]);
        assert_eq!(label(1e-6).to_string(), "10^-6");
        assert_eq!(label(2.5e7).to_string(), "2.5\u{b7}10^7");
    }

    #[test]
    fn places_run_from_0_to_1() {
        let log = Along { scale: Scale::Log, low: 0.01, high: 100.0 };
        assert!((log.place(1.0).unwrap() - 0.5).abs() < 1e-12);
        assert_eq!(log.place(0.0), None);
        let root = Along { scale: Scale::Root, low: 0.0, high: 90.0 };
        assert!((root.place(22.5).unwrap() - 0.5).abs() < 1e-12);
    }
}
