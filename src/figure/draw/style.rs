//! Colours, dashes, markers and sizes of all figures.

use super::svg::{Paint, Svg, number};
use crate::figure::data::{Colour, Dash, Look, Marker};

/// Size of labels, points.
pub(super) const SIZE: f64 = 7.0;
/// Size of the titles of panels, points.
pub(super) const TITLE: f64 = 7.5;
/// The colour of paper, behind a figure and inside open markers.
pub(super) const PAPER: &str = "#fff";
/// The colour of axes.
pub(super) const AXIS: &str = "#333";
/// The colour of the lines of a grid.
pub(super) const GRID: &str = "#e2e2e2";
/// The colour of a cell or an area without data, sRGB.
pub(super) const NOTHING: [f64; 3] = [205.0; 3];
/// Width of a curve, points.
const CURVE: f64 = 1.0;

/// The palette of Okabe and Ito (2008, "Color Universal Design"), in the order of use: blue, vermilion, bluish green, reddish purple,
/// orange, sky blue, black. Its yellow is too light on white paper.
const PALETTE: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000"];

/// The colours of a figure on dark paper: each colour above, and what takes its place in a document that is read in the dark.
pub const IN_THE_DARK: [(&str, &str); 11] = [
    (PAPER, "#1b1e23"),
    (AXIS, "#c4c7cc"),
    (GRID, "#34383f"),
    ("#000", "#e8eaed"),
    ("#8c8c8c", "#92979e"),
    ("#0072b2", "#4fa8e0"),
    ("#d55e00", "#ff8f45"),
    ("#009e73", "#2fc79b"),
    ("#cc79a7", "#e39cc3"),
    ("#e69f00", "#f0b73f"),
    ("#56b4e9", "#8bcdf3"),
];

/// Lengths of dashes and gaps, points.
const DASHES: [&str; 6] = ["", "4 1.6", "1.2 1.4", "6 1.5 1.2 1.5", "8 2", "3 1.2 1.2 1.2 1.2 1.2"];

/// The colour of a series.
pub(super) fn colour(colour: Colour) -> &'static str {
    match colour {
        Colour::Of(k) => PALETTE.get(k % PALETTE.len()).copied().unwrap_or("#000"),
        Colour::Ink => "#000",
        Colour::Grey => "#8c8c8c",
    }
}

/// The line of a series; `None` if it has none.
pub(super) fn line(look: &Look) -> Option<Paint<'static>> {
    let (width, dash) = match look.line? {
        Dash::Of(k) => (CURVE, DASHES.get(k % DASHES.len()).copied().unwrap_or("")),
        Dash::Thin => (0.4, ""),
        Dash::Level => (0.5, "3 2"),
    };
    Some(Paint { dash, ..Paint::stroke(colour(look.colour), width) })
}

/// The band of a series.
pub(super) fn band(look: &Look) -> Paint<'static> {
    Paint { opacity: 0.25, ..Paint::fill(colour(look.colour)) }
}

/// Draws the marker of a series at a place.
pub(super) fn marker(svg: &mut Svg, look: &Look, at: [f64; 2]) {
    let Some(marker) = look.marker else { return };
    let own = colour(look.colour);
    let open = Paint { fill: PAPER, opacity: 1.0, ..Paint::stroke(own, 0.5) };
    let [x, y] = at;
    match marker {
        Marker::Dot => svg.circle(at, 0.5, &Paint { opacity: 0.6, ..Paint::fill(own) }),
        Marker::Number(_) => svg.circle(at, 1.8, &Paint::fill(own)),
        Marker::Of(k) => {
            let outline: &[[f64; 2]] = match k % 5 {
                0 => return svg.circle(at, 1.15, &open),
                1 => &[[-1.05, -1.05], [1.05, -1.05], [1.05, 1.05], [-1.05, 1.05]],
                2 => &[[0.0, -1.4], [1.3, 1.0], [-1.3, 1.0]],
                3 => &[[0.0, -1.55], [1.3, 0.0], [0.0, 1.55], [-1.3, 0.0]],
                _ => &[[0.0, 1.4], [1.3, -1.0], [-1.3, -1.0]],
            };
            let points: Vec<[f64; 2]> = outline.iter().map(|[dx, dy]| [x + dx, y + dy]).collect();
            svg.path(&format!("{}Z", polyline(&points)), &open);
        }
    }
}

/// Draws many dots, in one path of lines that are too short to be seen but for their round ends.
pub(super) fn dots(svg: &mut Svg, look: &Look, points: &[[f64; 2]]) {
    let mut data = String::new();
    for [x, y] in points {
        data.push_str(&format!("M{} {}h.01", number(*x), number(*y)));
    }
    svg.path(&data, &Paint { round: true, ..Paint::stroke(colour(look.colour), 1.0) });
}

/// The data of a path through points.
pub(super) fn polyline(points: &[[f64; 2]]) -> String {
    let mut data = String::new();
    for (k, [x, y]) in points.iter().enumerate() {
        data.push(if k == 0 { 'M' } else { 'L' });
        data.push_str(&number(*x));
        data.push(' ');
        data.push_str(&number(*y));
    }
    data
}
