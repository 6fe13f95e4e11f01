//! Error against cost, as SVG.

use super::{Entry, Tradeoff, recorded_in};
use crate::error::Error;
use plotters::prelude::*;

/// Width, and height of the plot alone, pixels.
const SIZE: (u32, u32) = (900, 480);
/// Height of the line that each model has below the plot, pixels.
const LINE: u32 = 15;
/// Colour of models on the front.
const FRONT: RGBColor = RGBColor(0, 90, 160);
/// Colour of the others.
const BEHIND: RGBColor = RGBColor(150, 150, 150);

/// A point of the plot.
struct Point<'a> {
    cost: f64,
    error: f64,
    entry: &'a Entry,
}

/// The usable models, error against weighted operations, both logarithmic, with the front drawn.
///
/// # Errors
/// [`Error::Usage`] where no usable model has a positive error, and where the plot cannot be drawn.
pub fn svg(found: &Tradeoff) -> Result<String, Error> {
    let mut points: Vec<Point<'_>> = found
        .models
        .iter()
        .filter(|entry| entry.usable)
        .filter_map(|entry| {
            let error = recorded_in(&entry.errors, found.metric).filter(|error| *error > 0.0)?;
            // A model may cost nothing beyond a constant.
            Some(Point { cost: as_f64(entry.cost.weighted.max(1)), error, entry })
        })
        .collect();
    if points.is_empty() {
        return Err(Error::Usage(
            "--svg: expected a usable model with an error above 0, found none".to_owned(),
        ));
    }
    points.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(b.error.total_cmp(&a.error)));
    let mut text = String::new();
    draw(&mut text, found, &points)
        .map_err(|error| Error::Usage(format!("--svg: cannot be drawn: {error}")))?;
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
        .build_cartesian_2d(range(|p| p.cost).log_scale(), range(|p| p.error).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("cost of an evaluation, operations (a quotient 4, an exponential 25)")
        .y_desc(format!("{} error", found.metric))
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
