//! The legend: every series once, below the panels.

use super::style::{SIZE, band, line, marker};
use super::svg::{Anchor, Setting, Svg};
use super::typeset;
use crate::figure::data::{Body, FigureData, Look, Marker, Series};
use crate::figure::text::Text;

/// Length of a sample of a line, points.
const SAMPLE: f64 = 17.0;
/// Room between a sample and its name, and between entries.
const ROOM: f64 = 3.0;
const BETWEEN: f64 = 9.0;
/// Distance of two rows.
const ROW: f64 = SIZE + 3.0;

/// An entry of the legend.
struct Entry {
    look: Look,
    has_band: bool,
    name: Text,
}

/// The legend of a figure, in rows of entries.
pub(super) struct Legend {
    rows: Vec<Vec<Entry>>,
}

impl Legend {
    /// The legend of all panels, for a figure of this width.
    pub(super) fn new(figure: &FigureData, width: f64) -> Self {
        let mut entries: Vec<Entry> = Vec::new();
        for panel in &figure.panels {
            let Body::Curves(curves) = &panel.body else { continue };
            for Series { name, look, band, in_legend, .. } in &curves.series {
                let known = entries.iter().any(|entry| entry.look == *look && entry.name == *name);
                if *in_legend && !known {
                    entries.push(Entry { look: *look, has_band: band.is_some(), name: name.clone() });
                }
            }
        }
        // A single series needs no name.
        if entries.len() < 2 {
            entries.clear();
        }
        // Entries with a long name begin a row each.
        let widths: Vec<f64> = entries.iter().map(|entry| entry_width(entry).min(width)).collect();
        let widest = widths.iter().copied().fold(1.0, f64::max);
        let most = ((width + BETWEEN) / (widest + BETWEEN)).floor().max(1.0);
        // As many in each row as rows need: eight entries make two rows of four rather than five and three.
        let number = crate::math::count(entries.len().max(1));
        let columns = (number / (number / most).ceil()).ceil();
        let mut rows: Vec<Vec<Entry>> = Vec::new();
        for entry in entries {
            match rows.last_mut() {
                Some(row) if crate::math::count(row.len()) < columns => row.push(entry),
                _ => rows.push(vec![entry]),
            }
        }
        Self { rows }
    }

    /// Its height, points; 0 if there is nothing to say.
    pub(super) fn height(&self, width: f64) -> f64 {
        let lines: usize = self
            .rows
            .iter()
            .map(|row| row.iter().map(|entry| lines(entry, width).len()).max().unwrap_or(1))
            .sum();
        if lines == 0 { 0.0 } else { ROW * crate::math::count(lines) + 4.0 }
    }

    /// Draws it with its upper left corner at `at`.
    pub(super) fn draw(&self, svg: &mut Svg, at: [f64; 2], width: f64) {
        let all = || self.rows.iter().flatten();
        let widest = all().map(|entry| entry_width(entry).min(width)).fold(1.0, f64::max);
        let mut y = at[1] + 4.0;
        for row in &self.rows {
            let mut tallest = 1;
            for (k, entry) in row.iter().enumerate() {
                let x = at[0] + crate::math::count(k) * (widest + BETWEEN);
                let middle = y + 0.5 * ROW;
                sample(svg, entry, [x, middle]);
                let lines = lines(entry, width);
                tallest = tallest.max(lines.len());
                for (n, line) in lines.iter().enumerate() {
                    let at = [x + SAMPLE + ROOM, middle + 0.35 * SIZE + ROW * crate::math::count(n)];
                    svg.text(
                        line,
                        Setting { at, size: SIZE, anchor: Anchor::Start, upwards: false, bold: false },
                    );
                }
            }
            y += ROW * crate::math::count(tallest);
        }
    }
}

fn entry_width(entry: &Entry) -> f64 {
    SAMPLE + ROOM + typeset::width(&entry.name, SIZE)
}

fn lines(entry: &Entry, width: f64) -> Vec<Text> {
    typeset::lines(&entry.name, SIZE, width - SAMPLE - ROOM)
}

fn sample(svg: &mut Svg, entry: &Entry, [x, y]: [f64; 2]) {
    if entry.has_band {
        svg.rectangle([x, y - 2.5], [SAMPLE, 5.0], &band(&entry.look));
    }
    if let Some(paint) = line(&entry.look) {
        svg.line([x, y], [x + SAMPLE, y], &paint);
    }
    if let Some(Marker::Number(number)) = entry.look.marker {
        marker(svg, &entry.look, [x + 4.0, y]);
        let at = [x + SAMPLE, y + 0.35 * SIZE];
        let setting = Setting { at, size: SIZE, anchor: Anchor::End, upwards: false, bold: false };
        svg.text(&Text::from(number.to_string()), setting);
    } else {
        marker(svg, &entry.look, [x + 0.5 * SAMPLE, y]);
    }
}
