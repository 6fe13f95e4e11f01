//! A panel of coloured cells, with the bar of its colours below.

use super::curves::{GAP, Room, name, tick, widest};
use super::scale::Along;
use super::style::{AXIS, NOTHING, SIZE};
use super::svg::{Anchor, Paint, Setting, Svg};
use super::typeset;
use crate::error::Error;
use crate::figure::data::Map;
use crate::image::{Image, decode, png};
use crate::math::count;

/// Pixels of an image along a cell: viewers smooth images that they enlarge.
const FINE: usize = 4;
/// Colours of the bar.
const STEPS: usize = 128;
/// Height of the bar, points.
const BAR: f64 = 5.0;
/// Length of a tick, points.
const TICK: f64 = 2.0;
/// Room on the right.
const RIGHT: f64 = 6.0;
/// Room from the cells down to the bar, for numbers and the name of the axis.
const TO_BAR: f64 = TICK + 1.5 + SIZE + GAP + SIZE + 5.0;
/// Room from the bar down to the end, for the same.
const BELOW: f64 = TO_BAR - 4.0;

fn along(map: &Map) -> [Along; 3] {
    [&map.x, &map.y, &map.value].map(|axis| Along::new(axis, std::iter::empty()))
}

/// The room that a panel needs from its left edge to its axis.
pub(super) fn left(map: &Map) -> f64 {
    let [_, y, _] = along(map);
    SIZE + GAP + widest(&y.ticks(4.0), SIZE) + TICK + 1.5
}

/// The height of a panel of this width, all of it.
pub(super) fn height(width: f64, left: f64) -> f64 {
    let side = width - left - RIGHT;
    3.0 + side + TO_BAR + BAR + BELOW
}

/// The cells as an image, from the top, each of `fine` pixels along a side.
pub(super) fn image(map: &Map, fine: usize) -> Result<Image, Error> {
    let [_, _, value] = along(map);
    let colour = |cell: Option<f64>| {
        let bytes = match cell {
            None => NOTHING,
            // What a logarithmic scale does not have is below all that it has.
            Some(v) => map.colours.at(value.place_or_outside(v)),
        };
        bytes.map(|byte| decode(byte / 255.0))
    };
    let colours: Vec<[f64; 3]> = map.cells.iter().map(|cell| colour(*cell)).collect();
    let mut pixels = Vec::with_capacity(colours.len() * fine * fine);
    for row in colours.chunks(map.columns.max(1)).rev() {
        let wide: Vec<[f64; 3]> = row.iter().flat_map(|pixel| std::iter::repeat_n(*pixel, fine)).collect();
        (0..fine).for_each(|_| pixels.extend_from_slice(&wide));
    }
    Image::new(map.columns * fine, map.rows * fine, pixels)
}

/// Draws a panel with its upper left corner at `at`.
pub(super) fn draw(svg: &mut Svg, map: &Map, at: [f64; 2], room: Room) -> Result<(), Error> {
    let Room { width, left, labelled } = room;
    let [along_x, along_y, along_value] = along(map);
    let side = width - left - RIGHT;
    let [x0, y0] = [at[0] + left, at[1] + 3.0];
    let bottom = y0 + side;
    svg.image([x0, y0], [side, side], &png(&image(map, FINE)?, 1.0)?);
    svg.rectangle([x0, y0], [side, side], &Paint::stroke(AXIS, 0.6));

    let setting = |at, anchor| Setting { at, size: SIZE, anchor, upwards: false, bold: false };
    let horizontal = |svg: &mut Svg, along: &Along, y: f64| {
        let mut free_from = f64::NEG_INFINITY;
        for (value, label) in along.ticks((side / 20.0).clamp(3.0, 7.0)) {
            let x = x0 + side * along.place_or_outside(value);
            tick(svg, [x, y], [x, y + TICK]);
            let half = 0.5 * typeset::width(&label, SIZE);
            if x - half > free_from {
                svg.text(&label, setting([x, y + TICK + 1.5 + 0.75 * SIZE], Anchor::Middle));
                free_from = x + half + 1.5;
            }
        }
    };
    horizontal(svg, &along_x, bottom);
    for (value, label) in along_y.ticks(4.0) {
        let y = bottom - side * along_y.place_or_outside(value);
        tick(svg, [x0 - TICK, y], [x0, y]);
        if labelled {
            svg.text(&label, setting([x0 - TICK - 1.5, y + 0.35 * SIZE], Anchor::End));
        }
    }
    let middle = x0 + 0.5 * side;
    svg.text(&name(&map.x), setting([middle, bottom + TO_BAR - 8.0], Anchor::Middle));
    let beside = [at[0] + 0.8 * SIZE, y0 + 0.5 * side];
    if labelled {
        svg.text(&name(&map.y), Setting { upwards: true, ..setting(beside, Anchor::Middle) });
    }

    // The bar of the colours.
    let top = bottom + TO_BAR;
    let colours =
        (0..STEPS).map(|k| map.colours.at((count(k) + 0.5) / count(STEPS)).map(|byte| decode(byte / 255.0)));
    let bar = Image::new(STEPS, 1, colours.collect())?;
    svg.image([x0, top], [side, BAR], &png(&bar, 1.0)?);
    svg.rectangle([x0, top], [side, BAR], &Paint::stroke(AXIS, 0.4));
    horizontal(svg, &along_value, top + BAR);
    svg.text(&name(&map.value), setting([middle, top + BAR + BELOW - 4.0], Anchor::Middle));
    Ok(())
}
