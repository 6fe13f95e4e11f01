//! Maps over theta_h and theta_d: measurement, fit and relative error.

use crate::error::Error;
use crate::figure::data::{Axis, Body, FigureData, Map, Panel, Scale};
use crate::figure::kind::{
    Kind, Needs, Subject, Wanted, channel_title, channels_shown, chosen_channels, only,
};
use crate::figure::text::Text;
use crate::geometry::{Directions, HalfDifferenceGrid};
use crate::image::{ColourMap, VIK, VIRIDIS};
use crate::math::{Real as _, count};

/// The entry of the registry.
pub const KIND: Kind = Kind {
    name: "map",
    summary: "maps over theta_h and theta_d: measurement, fit and relative error",
    needs: Needs::Measurement,
    raster: true,
    compute,
};

/// Number of cells along each side for a half/difference table, as many as it has.
const MOST_CELLS: usize = HalfDifferenceGrid::DIMENSIONS[0];
/// The fewest cells along each side.
const FEWEST_CELLS: usize = 15;
/// A logarithmic scale of colours shows this many decades at most.
const DECADES: f64 = 5.0;
/// The bins of `phi_d` that are shown of a table: those on either side of 90 degrees.
const ACROSS: [usize; 2] = [89, 90];

/// Sums over the samples of a cell.
#[derive(Clone, Copy, Default)]
struct Sums {
    measured: f64,
    fitted: f64,
    samples: usize,
}

fn compute(subjects: &[Subject], wanted: &Wanted) -> Result<FigureData, Error> {
    let subject = only(subjects, KIND.name)?;
    let measurement = subject.measured()?;
    let channels = subject.channels();
    // Three maps of one channel fill a row, so that one channel is enough unless the user names several.
    let chosen = chosen_channels(&channels, &Wanted { most_channels: 1, ..wanted.clone() })?;
    let (cells, places) = places(&measurement.directions);
    let fitted = subject.recorded.as_ref().map(|recorded| {
        Ok::<_, Error>(recorded.expression.values(&measurement.directions, &subject.values()?))
    });
    let fitted = fitted.transpose()?;

    let mut panels = Vec::new();
    for &channel in &chosen {
        let empty = Vec::new();
        let measured = measurement.values.get(channel).unwrap_or(&empty);
        let of_model = fitted.as_ref().and_then(|rows| rows.get(channel));
        let mut sums = vec![Sums::default(); cells * cells];
        for (sample, place) in places.iter().enumerate() {
            let (Some(place), Some(f)) = (place, measured.get(sample)) else { continue };
            let Some(sum) = sums.get_mut(*place) else { continue };
            sum.measured += f;
            sum.fitted += of_model.and_then(|row| row.get(sample)).copied().unwrap_or(0.0);
            sum.samples += 1;
        }
        let mean = |of: fn(&Sums) -> f64| -> Vec<Option<f64>> {
            sums.iter().map(|sum| (sum.samples > 0).then(|| of(sum) / count(sum.samples))).collect()
        };
        let (measured, of_fit) = (mean(|sum| sum.measured), mean(|sum| sum.fitted));
        let values = magnitude_axis(&measured);
        let title = channels.get(channel).map(channel_title).unwrap_or_default();
        let of_channel = |what: &str| match chosen.len() {
            1 => Text::from(what),
            _ => Text::from(format!("{what}, {title}")),
        };
        let panel = |what: &str, value: Axis, values: Vec<Option<f64>>, colours| Panel {
            title: of_channel(what),
            body: Body::Map(map(cells, value, values, colours)),
        };
        panels.push(panel("measured", values.clone(), measured.clone(), &VIRIDIS));
        if fitted.is_some() {
            let relative: Vec<Option<f64>> =
                measured.iter().zip(&of_fit).map(|(m, f)| relative((*m)?, (*f)?)).collect();
            panels.push(panel("fit", values, of_fit, &VIRIDIS));
            panels.push(panel("error", difference_axis(&relative), relative, &VIK));
        }
    }
    let side_by_side = if fitted.is_some() { [3, 3] } else { [1, panels.len().min(3)] };
    let mut caption = Text::from(format!("{}: mean ", subject.stem())).symbol("f").words(" of ");
    caption = match measurement.directions.is_grid() {
        true => caption.words("the cells on either side of ").symbol("phi_d").words(" = ").degrees(90.0),
        false => {
            caption.words("the samples in each cell of ").symbol("theta_h").words(" and ").symbol("theta_d")
        }
    };
    if let Some(recorded) = &subject.recorded {
        caption = caption.words(format!(
            ", measured and for {}, and the relative error (fit - measured)/measured",
            recorded.expression.canonical()
        ));
    }
    let caption = caption.words(". Grey: no samples.").words(channels_shown(&channels, &chosen));
    Ok(FigureData { kind: KIND.name, panels, caption, side_by_side })
}

/// (fit - measured)/measured; `None` where nothing was measured to relate to.
fn relative(measured: f64, fitted: f64) -> Option<f64> {
    (measured > 0.0).then(|| (fitted - measured) / measured)
}

fn map(cells: usize, value: Axis, values: Vec<Option<f64>>, colours: &'static ColourMap) -> Map {
    // The square root gives the peak, which is at theta_h = 0, the room that it needs.
    let x = Axis::angle("theta_h").from_to(0.0, 90.0).scaled(Scale::Root);
    let y = Axis::angle("theta_d").from_to(0.0, 90.0);
    Map { x, y, value, columns: cells, rows: cells, cells: values, colours }
}

/// The number of cells along each side, and the cell of each sample; `None` for samples that are not shown.
fn places(directions: &Directions) -> (usize, Vec<Option<usize>>) {
    if let Directions::Grid { cells, .. } = directions {
        let place = |cell: &u32| {
            let (i, j, k) = HalfDifferenceGrid::indices(*cell);
            ACROSS.contains(&k).then_some(j * MOST_CELLS + i)
        };
        return (MOST_CELLS, cells.iter().map(place).collect());
    }
    // About two samples per cell.
    let side = (count(directions.len()) / 2.0).sqrt().whole().clamp(FEWEST_CELLS, MOST_CELLS);
    let place = |g: &crate::geometry::Geometry<f64>| {
        let theta_d = (2.0 * (0.5 * g.one_less_cos_d).max(0.0).sqrt().min(1.0).asin()).to_degrees();
        let column = ((g.theta_h_deg() / 90.0).sqrt() * count(side)).whole().min(side - 1);
        let row = (theta_d / 90.0 * count(side)).whole().min(side - 1);
        Some(row * side + column)
    };
    (side, directions.each(place))
}

/// The axis of the colours of f, logarithmic over the range of the data.
fn magnitude_axis(values: &[Option<f64>]) -> Axis {
    let mut sorted: Vec<f64> = values.iter().flatten().copied().filter(|f| *f > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    let axis = Axis::new(Text::of_symbol("f"), "1/sr").scaled(Scale::Log);
    let (Some(&least), Some(&high)) = (sorted.get(sorted.len() / 100), sorted.last()) else {
        return axis.from_to(0.1, 1.0);
    };
    let low = least.max(high * 10_f64.powf(-DECADES));
    if low < 0.999 * high { axis.from_to(low, high) } else { axis.from_to(low / 2.0, high * 2.0) }
}

/// The axis of the colours of the error: as far on either side of 0 as 95 % of the cells need, at most 100 %.
fn difference_axis(values: &[Option<f64>]) -> Axis {
    let mut sizes: Vec<f64> = values.iter().flatten().map(|e| e.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let far = sizes.get(sizes.len() * 95 / 100).copied().unwrap_or(1.0);
    let top = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5].into_iter().find(|top| far <= *top).unwrap_or(1.0);
    Axis::new("relative error", "").from_to(-top, top)
}
