//! A plot of error against cost, as SVG.

use super::{Entry, Tradeoff};
use crate::error::{Error, OptionName};
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use std::ops::Range;

/// Width and height of the plot without the lines below it, pixels.
const SIZE: (u32, u32) = (900, 480);
/// Height of each model's line below the plot, pixels.
const LINE: u32 = 15;
/// Colour of models on the front.
const FRONT: RGBColor = RGBColor(0, 90, 160);
/// Colour of the other models.
const BEHIND: RGBColor = RGBColor(150, 150, 150);

/// A point of the plot: one model.
struct Point<'a> {
    cost: f64,
    error: f64,
    entry: &'a Entry,
}

/// A logarithmic axis that has labelled ticks even if its range is short.
struct LogAxis {
    range: Range<f64>,
    logarithm: RangedCoordf64,
}

impl LogAxis {
    /// An axis over a range of positive numbers.
    fn new(range: Range<f64>) -> Self {
        let logarithm = (range.start.ln()..range.end.ln()).into();
        Self { range, logarithm }
    }
}

impl Ranged for LogAxis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.logarithm.map(&value.ln(), limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        ticks(&self.range)
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

/// The labelled ticks of a logarithmic axis: powers of ten and their multiples by 2 and 5; only powers of ten if those
/// are too many, and finer steps if they are fewer than two.
fn ticks(range: &Range<f64>) -> Vec<f64> {
    const MOST: usize = 20;
    // Multiples of a tenth of a power of ten: factors from 10 to 99.
    let finer: [Vec<u32>; 3] = [vec![10, 20, 50], (10..100).step_by(10).collect(), (10..100).collect()];
    let mut found = Vec::new();
    for tenths in &finer {
        found = multiples(range, tenths);
        if found.len() >= 2 {
            break;
        }
    }
    if found.len() > MOST {
        let decades = multiples(range, &[10]);
        let every = decades.len().div_ceil(MOST).max(1);
        found = decades.into_iter().step_by(every).collect();
    }
    found
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

/// Plots the errors of the usable models against their weighted operations, both on logarithmic axes, with the front.
///
/// # Errors
/// [`Error::Invalid`] if no usable model has a positive error, [`Error::Encoding`] if the plot cannot be drawn.
pub fn svg(found: &Tradeoff) -> Result<String, Error> {
    let mut points: Vec<Point<'_>> = found
        .models
        .iter()
        .filter(|entry| entry.usable)
        .filter_map(|entry| {
            let error = entry.errors.of(found.metric).filter(|error| *error > 0.0)?;
            // A model that is a constant costs 0 operations, which a logarithmic axis cannot show.
            Some(Point { cost: as_f64(entry.cost.weighted.max(1)), error, entry })
        })
        .collect();
    if points.is_empty() {
        return Err(Error::invalid(OptionName::Svg, "a usable model with an error above 0", "none"));
    }
    points.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(b.error.total_cmp(&a.error)));
    let mut text = String::new();
    draw(&mut text, found, &points)
        .map_err(|error| Error::Encoding { format: "SVG", reason: error.to_string() })?;
    Ok(text)
}

#[expect(clippy::cast_precision_loss, reason = "operations stay far below 2^53")]
fn as_f64(count: u64) -> f64 {
    count as f64
}

fn draw(text: &mut String, found: &Tradeoff, points: &[Point<'_>]) -> Result<(), Box<dyn std::error::Error>> {
    let range = |of: fn(&Point<'_>) -> f64| {
        let (low, high) =
            points.iter().map(of).fold((f64::MAX, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
        low / 1.25..high * 1.25
    };
    let lines = u32::try_from(points.len()).unwrap_or(u32::MAX).saturating_add(1);
    let height = SIZE.1.saturating_add(LINE.saturating_mul(lines));
    let whole = SVGBackend::with_string(text, (SIZE.0, height)).into_drawing_area();
    whole.fill(&WHITE)?;
    let (area, legend) = whole.split_vertically(SIZE.1);
    let mut chart = ChartBuilder::on(&area)
        .caption(&found.data.path, ("sans-serif", 18))
        .margin(14)
        .margin_right(30)
        .x_label_area_size(44)
        .y_label_area_size(76)
        .build_cartesian_2d(LogAxis::new(range(|p| p.cost)), LogAxis::new(range(|p| p.error)))?;
    chart
        .configure_mesh()
        .x_desc("cost of an evaluation, operations (a quotient 4, an exponential 25)")
        .y_desc(format!("{} error", found.metric.name()))
        .x_label_formatter(&|cost| cost.to_string())
        .y_label_formatter(&|error| format!("{error:.1e}"))
        .light_line_style(WHITE.mix(0.0))
        .draw()?;
    let front = points.iter().filter(|p| p.entry.on_front).map(|p| (p.cost, p.error));
    chart.draw_series(LineSeries::new(front, FRONT.stroke_width(2)))?;
    for (index, point) in points.iter().enumerate() {
        let colour = if point.entry.on_front { FRONT } else { BEHIND };
        let at = (point.cost, point.error);
        chart.draw_series([Circle::new(at, 4, colour.filled())])?;
        let style = ("sans-serif", 13).into_font().color(&colour);
        chart.draw_series([Text::new(format!(" {}", index + 1), at, style)])?;
    }
    for (line, (number, point)) in (0_i32..).zip((1..).zip(points)) {
        let colour = if point.entry.on_front { FRONT } else { BEHIND };
        let style = ("sans-serif", 12).into_font().color(&colour);
        let place = (24, i32::try_from(LINE)?.saturating_mul(line));
        legend.draw(&Text::new(format!("{number}  {}", point.entry.model), place, style))?;
    }
    whole.present()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_axis_carries_two_numbers_at_least_and_twenty_at_most() {
        // The shortest axis is that of a single point: it extends by a factor of 1.25 on either side.
        for step in 0..2000 {
            let middle = 10_f64.powf(-8.0 + 0.01 * f64::from(step));
            for factor in [1.25, 2.0, 7.0, 100.0, 1e6, 1e30] {
                let range = middle / factor..middle * factor;
                let found = ticks(&range);
                assert!((2..=20).contains(&found.len()), "{range:?}: {found:?}");
                assert!(found.iter().all(|x| range.start <= *x && *x <= range.end), "{range:?}: {found:?}");
                assert!(found.is_sorted_by(|a, b| a < b), "{range:?}: {found:?}");
            }
        }
    }

    #[test]
    fn numbers_are_round() {
        assert_eq!(ticks(&(4.0..560.0)), [5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0]);
        assert_eq!(ticks(&(0.012..0.054)), [0.02, 0.05]);
        assert_eq!(ticks(&(0.022..0.034)).first(), Some(&0.022));
        assert_eq!(ticks(&(0.51..0.79)), [0.6, 0.7]);
    }
}
