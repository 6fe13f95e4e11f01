//! The numbers of a figure as CSV.

use super::data::{Axis, Body, Curves, FigureData, Map, Picture, Scale};
use crate::error::Error;
use crate::math::count;

impl FigureData {
    /// Every number of the figure as CSV, with the units in the header. Symbols are spelled out, such as `theta_o`.
    ///
    /// Where the axes of the panels differ, columns name the quantity and its unit.
    ///
    /// # Errors
    /// [`Error::Encoding`] if a row cannot be written.
    pub fn csv(&self) -> Result<Vec<u8>, Error> {
        let mut rows = vec![header(self)];
        for (number, panel) in self.panels.iter().enumerate() {
            let name = match panel.title.to_string() {
                title if title.is_empty() => (number + 1).to_string(),
                title => title,
            };
            match &panel.body {
                Body::Curves(curves) => add_curves(&mut rows, self, &name, curves),
                Body::Map(map) => add_map(&mut rows, &name, map),
                Body::Picture(picture) => add_picture(&mut rows, &name, picture),
            }
        }
        let failed = |error: csv::Error| Error::Encoding { format: "CSV", reason: error.to_string() };
        let mut writer = csv::Writer::from_writer(Vec::new());
        rows.iter().try_for_each(|row| writer.write_record(row)).map_err(failed)?;
        writer.into_inner().map_err(|error| Error::Encoding { format: "CSV", reason: error.to_string() })
    }
}

/// The name of an axis with its unit, such as `theta_o (deg)`.
fn column(axis: &Axis) -> String {
    match axis.unit {
        "" => axis.quantity.to_string(),
        unit => format!("{} ({unit})", axis.quantity),
    }
}

/// The axis that all panels have in common; `None` if they differ.
fn common(figure: &FigureData, axis: impl Fn(&Curves) -> String) -> Option<String> {
    let mut all = figure.panels.iter().filter_map(|panel| match &panel.body {
        Body::Curves(curves) => Some(axis(curves)),
        Body::Map(_) | Body::Picture(_) => None,
    });
    let first = all.next()?;
    all.all(|other| other == first).then_some(first)
}

fn header(figure: &FigureData) -> Vec<String> {
    let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    match figure.panels.first().map(|panel| &panel.body) {
        Some(Body::Curves(first)) => {
            let mut header: Vec<String> = names(&["panel", "series"]);
            match common(figure, |curves| column(&curves.x)) {
                Some(x) => header.push(x),
                None => header.extend(["x quantity".to_owned(), "x".to_owned()]),
            }
            let y = column(&first.y);
            header.extend([y.clone(), format!("low {y}"), format!("high {y}")]);
            header
        }
        Some(Body::Map(map)) => {
            let (x, y) = (column(&map.x), column(&map.y));
            vec!["panel".to_owned(), x, y, "quantity".to_owned(), "value".to_owned()]
        }
        Some(Body::Picture(_)) | None => {
            names(&["panel", "row", "column", "r (W/m^2 sr)", "g (W/m^2 sr)", "b (W/m^2 sr)"])
        }
    }
}

/// A number that reads back as the same number.
fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 || (1e-5..1e15).contains(&size) { format!("{x}") } else { format!("{x:e}") }
}

fn add_curves(rows: &mut Vec<Vec<String>>, figure: &FigureData, name: &str, curves: &Curves) {
    let same_x = common(figure, |curves| column(&curves.x)).is_some();
    let mut add = |series: String, x: f64, rest: [String; 3]| {
        let mut row = vec![name.to_owned(), series];
        if !same_x {
            row.push(column(&curves.x));
        }
        row.push(number(x));
        row.extend(rest);
        rows.push(row);
    };
    for series in &curves.series {
        for (k, [x, y]) in series.points.iter().enumerate() {
            let ends = series.band.as_ref().and_then(|band| band.get(k));
            let [low, high] = ends.map_or([String::new(), String::new()], |ends| ends.map(number));
            add(series.name.to_string(), *x, [number(*y), low, high]);
        }
    }
    for mark in &curves.marks {
        add(mark.name.to_string(), mark.x, [String::new(), String::new(), String::new()]);
    }
}

/// The middle of a cell on an axis.
fn middle(axis: &Axis, k: usize, cells: usize) -> f64 {
    let [low, high] = axis.range.unwrap_or([0.0, 1.0]);
    let t = (count(k) + 0.5) / count(cells.max(1));
    match axis.scale {
        Scale::Linear => low + t * (high - low),
        Scale::Root => (low.sqrt() + t * (high.sqrt() - low.sqrt())).powi(2),
        Scale::Log => low * (high / low).powf(t),
    }
}

fn add_map(rows: &mut Vec<Vec<String>>, name: &str, map: &Map) {
    let quantity = column(&map.value);
    for (k, cell) in map.cells.iter().enumerate() {
        let Some(value) = cell else { continue };
        let (row, column) = (k / map.columns.max(1), k % map.columns.max(1));
        let (x, y) = (middle(&map.x, column, map.columns), middle(&map.y, row, map.rows));
        rows.push(vec![name.to_owned(), number(x), number(y), quantity.clone(), number(*value)]);
    }
}

fn add_picture(rows: &mut Vec<Vec<String>>, name: &str, picture: &Picture) {
    let width = picture.image.width.max(1);
    for (k, pixel) in picture.image.pixels.iter().enumerate() {
        let [r, g, b] = pixel.map(number);
        rows.push(vec![name.to_owned(), (k / width).to_string(), (k % width).to_string(), r, g, b]);
    }
}
