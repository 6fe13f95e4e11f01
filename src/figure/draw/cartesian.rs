//! A panel with axes at right angles.

use super::curves::{GAP, Room, both, name, numbers, series, tick, widest};
use super::style::{AXIS, GRID, SIZE, colour, polyline};
use super::svg::{Anchor, Paint, Setting, Svg};
use super::typeset;
use crate::figure::data::{Colour, Curves, MarkForm, Scale};

/// Height of the drawing area relative to its width, for one panel in a row and for several.
const FLAT: f64 = 0.68;
const TALL: f64 = 0.86;
/// Room on the right, for half of the last number of the axis.
const RIGHT: f64 = 8.0;
/// Room above, for half of the uppermost number.
const TOP: f64 = 4.0;
/// Length of a tick, points.
const TICK: f64 = 2.0;
/// Room for the name of the horizontal axis and its numbers.
const BELOW: f64 = TICK + 1.5 + SIZE + GAP + SIZE + 2.0;

/// The room that a panel needs from its left edge to its axis.
pub(super) fn left(curves: &Curves, width: f64) -> f64 {
    let (_, y) = both(curves);
    let labels = widest(&y.ticks(wanted_up(height_for(width, false))), SIZE);
    SIZE + GAP + labels + TICK + 1.5
}

fn height_for(width: f64, alone: bool) -> f64 {
    if alone { FLAT * width } else { TALL * width }
}

/// About how many ticks a vertical axis has room for.
fn wanted_up(height: f64) -> f64 {
    (height / 22.0).clamp(2.5, 7.0)
}

/// The height of a panel of this width, all of it.
pub(super) fn height(width: f64, left: f64, alone: bool) -> f64 {
    TOP + height_for(width - left - RIGHT, alone) + BELOW
}

/// Draws a panel with its upper left corner at `at`.
pub(super) fn draw(svg: &mut Svg, curves: &Curves, at: [f64; 2], room: Room, alone: bool) {
    let Room { width, left, labelled } = room;
    let (along_x, along_y) = both(curves);
    let [x0, y0] = [at[0] + left, at[1] + TOP];
    let size = [width - left - RIGHT, height_for(width - left - RIGHT, alone)];
    let [w, h] = size;
    let bottom = y0 + h;
    let place =
        |[x, y]: [f64; 2]| [x0 + w * along_x.place_or_outside(x), bottom - h * along_y.place_or_outside(y)];

    // The grid and its numbers. Numbers that would touch are left out.
    let setting = |at, anchor| Setting { at, size: SIZE, anchor, upwards: false, bold: false };
    let mut free_from = f64::NEG_INFINITY;
    for (value, label) in along_x.ticks((w / 26.0).clamp(2.0, 8.0)) {
        let [x, _] = place([value, along_y.low]);
        svg.line([x, y0], [x, bottom], &Paint::stroke(GRID, 0.4));
        tick(svg, [x, bottom], [x, bottom + TICK]);
        let half = 0.5 * typeset::width(&label, SIZE);
        if x - half > free_from {
            svg.text(&label, setting([x, bottom + TICK + 1.5 + 0.75 * SIZE], Anchor::Middle));
            free_from = x + half + 2.0;
        }
    }
    let up = along_y.ticks(wanted_up(h));
    for (value, label) in &up {
        let [_, y] = place([along_x.low, *value]);
        svg.line([x0, y], [x0 + w, y], &Paint::stroke(GRID, 0.4));
        tick(svg, [x0 - TICK, y], [x0, y]);
        if labelled {
            svg.text(label, setting([x0 - TICK - 1.5, y + 0.35 * SIZE], Anchor::End));
        }
    }
    for value in along_y.minor_ticks() {
        let [_, y] = place([along_x.low, value]);
        tick(svg, [x0 - 0.5 * TICK, y], [x0, y]);
    }
    for value in along_x.minor_ticks() {
        let [x, _] = place([value, along_y.low]);
        tick(svg, [x, bottom], [x, bottom + 0.5 * TICK]);
    }
    if along_y.scale == Scale::Linear && along_y.low < 0.0 && along_y.high > 0.0 {
        let [_, y] = place([along_x.low, 0.0]);
        svg.line([x0, y], [x0 + w, y], &Paint::stroke(AXIS, 0.4));
    }

    svg.begin_clip([x0, y0], size);
    for mark in curves.marks.iter().filter(|mark| mark.form == MarkForm::Line) {
        let [x, _] = place([mark.x, along_y.low]);
        let dash = if mark.colour == Colour::Ink { "" } else { "3 2" };
        svg.line([x, y0], [x, bottom], &Paint { dash, ..Paint::stroke(colour(mark.colour), 0.6) });
    }
    series(svg, curves, place);
    svg.end_group();
    svg.rectangle([x0, y0], size, &Paint::stroke(AXIS, 0.6));
    for mark in curves.marks.iter().filter(|mark| mark.form == MarkForm::Arrow) {
        let [x, _] = place([mark.x, along_y.low]);
        let head = [[x - 2.2, y0 - 3.2], [x + 2.2, y0 - 3.2], [x, y0 + 1.2]];
        svg.path(&format!("{}Z", polyline(&head)), &Paint::fill(colour(mark.colour)));
    }
    numbers(svg, curves, SIZE, place);

    let middle = [x0 + 0.5 * w, bottom + BELOW - 3.5];
    svg.text(&name(&curves.x), setting(middle, Anchor::Middle));
    if labelled {
        let beside = [at[0] + 0.8 * SIZE, y0 + 0.5 * h];
        svg.text(&name(&curves.y), Setting { upwards: true, ..setting(beside, Anchor::Middle) });
    }
}
