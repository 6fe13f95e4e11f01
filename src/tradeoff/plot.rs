//! Error against cost, as SVG.

use super::{Entry, Tradeoff, recorded_in};
use crate::error::Error;
use plotters::prelude::*;

const SIZE: (u32, u32) = (900, 560);
const FRONT: RGBColor = RGBColor(0, 90, 160);
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
    let area = SVGBackend::with_string(text, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
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
    let longest = 110;
    for (index, point) in points.iter().enumerate() {
        let colour = if point.entry.on_front { FRONT } else { BEHIND };
        let line = i32::try_from(index).unwrap_or(i32::MAX);
        let name: String = format!("{}  {}", index + 1, point.entry.model).chars().take(longest).collect();
        let style = ("sans-serif", 11).into_font().color(&colour);
        area.draw(&Text::new(name, (330, 44 + 14 * line), style))?;
    }
    area.present()?;
    Ok(())
}
