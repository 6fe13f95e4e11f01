//! A whole figure on paper: panels in rows, the legend and the caption below.

use super::curves::Room;
use super::legend::Legend;
use super::style::{PAPER, SIZE, TITLE};
use super::svg::{Anchor, Paint, Setting, Svg};
use super::{cartesian, map, polar, typeset};
use crate::error::Error;
use crate::figure::data::{Axes, Axis, Body, FigureData, Panel};
use crate::image::{Image, in_rows, png};
use crate::math::count;

/// How a figure is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drawing<'a> {
    /// Its width.
    pub width: Width,
    /// Whether the caption stands below it.
    pub caption: bool,
    /// What tells it from a figure of the same content in the same document; may be empty.
    pub place: &'a str,
}

/// The width of a figure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Width {
    /// One column of text, 85 mm.
    #[default]
    One,
    /// Two columns of text, 175 mm.
    Two,
}

impl Default for Drawing<'_> {
    fn default() -> Self {
        Self { width: Width::One, caption: true, place: "" }
    }
}

impl Width {
    /// In points of 1/72 inch.
    fn points(self) -> f64 {
        let millimetres = match self {
            Self::One => 85.0,
            Self::Two => 175.0,
        };
        millimetres / 25.4 * 72.0
    }
}

/// Room between panels, points.
const GAP: f64 = 8.0;
/// Room for the title of a panel, points.
const HEAD: f64 = TITLE + 4.0;
/// Distance of two lines of the caption, points.
const LINE: f64 = SIZE + 2.2;
/// Room at the edges, points.
const EDGE: f64 = 2.0;
/// Pixels along a cell of a map in a PNG.
const PIXELS: usize = 6;

/// A panel with the room that it takes.
struct Placed<'a> {
    panel: &'a Panel,
    /// The distance of its left edge from that of its row.
    x: f64,
    room: Room,
    height: f64,
}

/// Room to the left of the axis of a panel without numbers.
const UNLABELLED: f64 = 4.0;

impl FigureData {
    /// The figure as SVG: text that is text, no fonts and no scripts from elsewhere, and ids that begin with a word that follows from
    /// the content, so that several figures can stand in one page.
    ///
    /// # Errors
    /// [`Error::Encoding`] or [`Error::Invalid`] for an image that cannot be encoded.
    pub fn svg(&self, drawing: Drawing<'_>) -> Result<String, Error> {
        let whole = drawing.width.points();
        let width = whole - 2.0 * EDGE;
        let columns = match drawing.width {
            Width::One => self.side_by_side[0],
            Width::Two => self.side_by_side[1],
        };
        let columns = columns.clamp(1, self.panels.len().max(1));
        let cell = (width - GAP * count(columns - 1)) / count(columns);
        // A single panel in two columns of text would be too high: it takes two thirds of the width.
        let alone = columns == 1;
        let cell = if alone && drawing.width == Width::Two { 0.68 * cell } else { cell };

        let mut svg = Svg::new();
        let mut y = EDGE;
        let has_titles = self.panels.iter().any(|panel| !panel.title.is_empty());
        let head = if has_titles { HEAD } else { 0.0 };
        for row in self.panels.chunks(columns) {
            let placed = placed(row, columns, cell, alone);
            let height = placed.iter().map(|placed| placed.height).fold(0.0, f64::max);
            for placed in &placed {
                let x = EDGE + placed.x;
                if has_titles {
                    let at = [x + placed.room.left, y + TITLE];
                    let setting =
                        Setting { at, size: TITLE, anchor: Anchor::Start, upwards: false, bold: true };
                    svg.text(&placed.panel.title, setting);
                }
                draw(&mut svg, placed, [x, y + head], alone)?;
            }
            y += head + height + 2.0;
        }
        let legend = Legend::new(self, width);
        legend.draw(&mut svg, [EDGE, y], width);
        y += legend.height(width);
        if drawing.caption {
            y += 4.0;
            for line in typeset::lines(&self.caption, SIZE, width) {
                let at = [EDGE, y + SIZE];
                svg.text(
                    &line,
                    Setting { at, size: SIZE, anchor: Anchor::Start, upwards: false, bold: false },
                );
                y += LINE;
            }
        }
        let size = [whole, y + EDGE + 1.0];
        let title = format!("brdfit {}", self.kind);
        let mut page = Svg::new();
        page.rectangle([0.0, 0.0], size, &Paint::fill(PAPER));
        page.append(svg);
        Ok(page.document(size, drawing.place, &title, &self.caption.to_string()))
    }

    /// The panels of a map or a picture as one PNG, without axes and words.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a figure that is made of lines.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        let image = |panel: &Panel| match &panel.body {
            Body::Map(map) => map::image(map, PIXELS),
            Body::Picture(picture) => Ok(picture.image.exposed(picture.exposure)),
            Body::Curves(_) => {
                Err(Error::invalid(self.kind, "SVG for a figure that is made of lines", "PNG"))
            }
        };
        let images: Vec<Image> = self.panels.iter().map(image).collect::<Result<_, _>>()?;
        png(&in_rows(&images, self.side_by_side[0])?, 1.0)
    }
}

/// The panels of a row of `columns` with the room that they take, each at most as wide as `cell`. Their axes have the same size; where
/// they have the same vertical axis, only the first has numbers at it.
fn placed(row: &[Panel], columns: usize, cell: f64, alone: bool) -> Vec<Placed<'_>> {
    let left = |panel: &Panel| match &panel.body {
        Body::Curves(curves) if curves.axes == Axes::Cartesian => cartesian::left(curves, cell),
        Body::Map(map) => map::left(map),
        Body::Curves(_) | Body::Picture(_) => 0.0,
    };
    let widest = row.iter().map(left).fold(0.0, f64::max);
    let shared =
        columns > 1 && row.first().is_some_and(|first| row.iter().all(|other| same_axis(first, other)));
    // What the numbers of the others would take is shared among all.
    let gained = if shared { (widest - UNLABELLED) * count(columns - 1) / count(columns) } else { 0.0 };
    let mut x = 0.0;
    let mut placed = Vec::new();
    for (k, panel) in row.iter().enumerate() {
        let labelled = k == 0 || !shared;
        let left = if labelled { widest } else { UNLABELLED };
        let width = cell - widest + gained + left;
        let (left, height) = match &panel.body {
            Body::Curves(curves) if curves.axes == Axes::Cartesian => {
                (left, cartesian::height(width, left, alone))
            }
            Body::Curves(_) => (0.0, polar::height(width)),
            Body::Map(_) => (left, map::height(width, left)),
            Body::Picture(picture) => {
                (0.0, width * count(picture.image.height) / count(picture.image.width.max(1)))
            }
        };
        placed.push(Placed { panel, x, room: Room { width, left, labelled }, height });
        x += width + GAP;
    }
    placed
}

/// Whether two panels have the same vertical axis, at right angles.
fn same_axis(a: &Panel, b: &Panel) -> bool {
    let axis = |panel: &Panel| -> Option<Axis> {
        match &panel.body {
            Body::Curves(curves) if curves.axes == Axes::Cartesian => Some(curves.y.clone()),
            Body::Map(map) => Some(map.y.clone()),
            Body::Curves(_) | Body::Picture(_) => None,
        }
    };
    match (axis(a), axis(b)) {
        (Some(a), Some(b)) => {
            a.range.is_some()
                && (a.range, a.scale, a.unit, a.quantity) == (b.range, b.scale, b.unit, b.quantity)
        }
        _ => false,
    }
}

fn draw(svg: &mut Svg, placed: &Placed<'_>, at: [f64; 2], alone: bool) -> Result<(), Error> {
    let Placed { panel, room, height, .. } = placed;
    match &panel.body {
        Body::Curves(curves) if curves.axes == Axes::Cartesian => {
            cartesian::draw(svg, curves, at, *room, alone)
        }
        Body::Curves(curves) => polar::draw(svg, curves, at, room.width),
        Body::Map(map) => map::draw(svg, map, at, *room)?,
        Body::Picture(picture) => {
            svg.image(at, [room.width, *height], &png(&picture.image, picture.exposure)?)
        }
    }
    Ok(())
}
