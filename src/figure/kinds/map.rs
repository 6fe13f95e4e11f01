//! Maps over theta_h and theta_d: measurement, fit and relative error.

use crate::error::Error;
use crate::figure::data::{Axis, Body, FigureData, Map, Panel, Scale};
use crate::figure::kind::{
    Kind, Needs, Several, Subject, Wanted, channel_title, channels_shown, chosen_channels, fits,
    of_one_measurement, which,
};
use crate::figure::text::Text;
use crate::geometry::{Directions, HalfDifferenceGrid};
use crate::image::{ColourMap, VIK, VIRIDIS};
use crate::math::{Real as _, count};
use crate::report::Recorded;

/// The entry of the registry.
pub const KIND: Kind = Kind {
    name: "map",
    summary: "maps over theta_h and theta_d: measurement, fit and relative error; of several models a row each",
    needs: Needs::Measurement,
    several: Several::Rows,
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

fn compute(subjects: &[Subject], wanted: &Wanted) -> Result<FigureData, Error> {
    let subject = of_one_measurement(subjects, KIND.name)?;
    let measurement = subject.measured()?;
    let channels = subject.channels();
    // Three maps of one channel fill a row, so that one channel is enough unless the user names several.
    let chosen = chosen_channels(&channels, &Wanted { most_channels: 1, ..wanted.clone() })?;
    let cells = Cells::of(&measurement.directions);
    let fits: Vec<(&Recorded, Vec<Vec<f64>>)> = fits(subjects)?
        .into_iter()
        .map(|(recorded, values)| (recorded, recorded.expression.values(&cells.directions, &values)))
        .collect();

    let mut panels = Vec::new();
    for &channel in &chosen {
        let title = channels.get(channel).map(channel_title).unwrap_or_default();
        let panel = |what: &str, value: Axis, values: Vec<Option<f64>>, colours| Panel {
            title: if chosen.len() > 1 { format!("{what}, {title}") } else { what.to_owned() }.into(),
            body: Body::Map(map(cells.side, value, values, colours)),
        };
        let shown: Vec<f64> =
            measurement.values.get(channel).map_or_else(Vec::new, |row| cells.shown_of(row));
        let measured = cells.means(&shown, &shown);
        let values = magnitude_axis(&measured);
        if fits.is_empty() {
            panels.push(panel("measured", values, measured, &VIRIDIS));
            continue;
        }
        let fitted: Vec<Vec<Option<f64>>> = fits
            .iter()
            .map(|(_, rows)| rows.get(channel).map_or_else(Vec::new, |row| cells.means(row, &shown)))
            .collect();
        let errors: Vec<Vec<Option<f64>>> = fitted
            .iter()
            .map(|fitted| measured.iter().zip(fitted).map(|(m, f)| relative((*m)?, (*f)?)).collect())
            .collect();
        // One scale for all, so that models can be compared.
        let apart = difference_axis(&errors.concat());
        for (k, (fitted, errors)) in fitted.into_iter().zip(errors).enumerate() {
            let which = which(fits.len(), k);
            panels.push(panel("measured", values.clone(), measured.clone(), &VIRIDIS));
            panels.push(panel(&format!("fit{which}"), values.clone(), fitted, &VIRIDIS));
            panels.push(panel(&format!("error{which}"), apart.clone(), errors, &VIK));
        }
    }
    let side_by_side = if fits.is_empty() { [1, panels.len().min(3)] } else { [3, 3] };
    let mut caption = Text::from(format!("{}: mean ", subject.stem())).symbol("f").words(" of ");
    caption = match measurement.directions.is_grid() {
        true => caption.words("the cells on either side of ").symbol("phi_d").words(" = ").degrees(90.0),
        false => {
            caption.words("the samples in each cell of ").symbol("theta_h").words(" and ").symbol("theta_d")
        }
    };
    if !fits.is_empty() {
        caption = caption.words(", measured and fitted, and the relative error (fit - measured)/measured.");
    }
    for (k, (recorded, _)) in fits.iter().enumerate() {
        let which = which(fits.len(), k);
        caption = caption.words(format!(" Fit{which}: {}.", recorded.expression.canonical()));
    }
    let end = if fits.is_empty() { ". Grey: no samples." } else { " Grey: no samples." };
    let caption = caption.words(end).words(channels_shown(&channels, &chosen));
    Ok(FigureData { kind: KIND.name, panels, caption, side_by_side })
}

/// The cells of a map, and the samples in them.
struct Cells {
    /// The number of cells along each side.
    side: usize,
    /// The samples that are shown, and the cell of each.
    places: Vec<(usize, usize)>,
    /// The directions of the samples that are shown.
    directions: Directions,
}

impl Cells {
    fn of(directions: &Directions) -> Self {
        let (side, places) = places(directions);
        let places: Vec<(usize, usize)> =
            places.into_iter().enumerate().filter_map(|(sample, place)| Some((sample, place?))).collect();
        let samples: Vec<usize> = places.iter().map(|(sample, _)| *sample).collect();
        Self { side, places, directions: directions.select(&samples) }
    }

    /// The values of a channel for the samples that are shown.
    fn shown_of(&self, row: &[f64]) -> Vec<f64> {
        self.places.iter().map(|(sample, _)| row.get(*sample).copied().unwrap_or(f64::NAN)).collect()
    }

    /// The mean of a row in each cell, over the samples for which `measured` has a value; `None` for a cell without any.
    fn means(&self, row: &[f64], measured: &[f64]) -> Vec<Option<f64>> {
        let mut sums = vec![(0.0, 0_usize); self.side * self.side];
        for (((_, place), f), known) in self.places.iter().zip(row).zip(measured) {
            if let Some((sum, samples)) = sums.get_mut(*place).filter(|_| !known.is_nan()) {
                *sum += f;
                *samples += 1;
            }
        }
        sums.iter().map(|(sum, samples)| (*samples > 0).then(|| sum / count(*samples))).collect()
    }
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
