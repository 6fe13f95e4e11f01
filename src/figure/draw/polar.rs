//! A panel with polar axes: the half plane above a surface, with the normal upwards.

use super::curves::{both, name, series};
use super::style::{AXIS, GRID, SIZE, colour, polyline};
use super::svg::{Anchor, Paint, Setting, Svg};
use super::typeset;
use crate::figure::data::{Curves, MarkForm};
use crate::math::count;

/// Room around the half disc, for the numbers of the angle.
const AROUND: f64 = 16.0;
/// Room below the surface, for the numbers and the name of the radius.
const BELOW: f64 = 2.0 * SIZE + 9.0;
/// Angles with a number, degrees.
const ANGLES: [f64; 7] = [-90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0];

/// The height of a panel of this width, all of it.
pub(super) fn height(width: f64) -> f64 {
    AROUND + radius(width) + BELOW
}

fn radius(width: f64) -> f64 {
    0.5 * width - AROUND
}

/// Draws a panel with its upper left corner at `at`.
pub(super) fn draw(svg: &mut Svg, curves: &Curves, at: [f64; 2], width: f64) {
    let (_, along) = both(curves);
    let whole = radius(width);
    let [cx, cy] = [at[0] + 0.5 * width, at[1] + AROUND + whole];
    let on_circle = |degrees: f64, r: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        [cx + r * sin, cy - r * cos]
    };
    let setting = |at, anchor| Setting { at, size: SIZE, anchor, upwards: false, bold: false };

    // Rings and rays.
    let arc = |r: f64| {
        let points: Vec<[f64; 2]> = (0..=90).map(|k| on_circle(2.0 * count(k) - 90.0, r)).collect();
        polyline(&points)
    };
    let mut free_from = f64::NEG_INFINITY;
    for (value, label) in along.ticks((whole / 26.0).clamp(2.0, 6.0)) {
        let r = whole * along.place_or_outside(value).clamp(0.0, 1.0);
        svg.path(&arc(r), &Paint::stroke(GRID, 0.5));
        let half = 0.5 * typeset::width(&label, SIZE);
        if r - half > free_from {
            svg.text(&label, setting([cx + r, cy + 3.0 + 0.75 * SIZE], Anchor::Middle));
            free_from = r + half + 2.0;
        }
    }
    for angle in ANGLES {
        svg.line([cx, cy], on_circle(angle, whole), &Paint::stroke(GRID, 0.5));
        let [x, y] = on_circle(angle, whole + 8.5);
        let label = crate::figure::text::Text::default().degrees(angle.abs());
        svg.text(&label, setting([x, y + 0.35 * SIZE], Anchor::Middle));
    }
    svg.path(&arc(whole), &Paint::stroke(AXIS, 0.6));
    svg.line([cx - whole, cy], [cx + whole, cy], &Paint::stroke(AXIS, 0.6));

    svg.begin_clip([cx - whole, cy - whole], [2.0 * whole, whole]);
    let place =
        |[angle, value]: [f64; 2]| on_circle(angle, whole * along.place_or_outside(value).clamp(0.0, 1.5));
    series(svg, curves, place);
    svg.end_group();
    for mark in curves.marks.iter().filter(|mark| mark.form == MarkForm::Arrow) {
        let head = [
            on_circle(mark.x - 1.3, whole + 3.4),
            on_circle(mark.x + 1.3, whole + 3.4),
            on_circle(mark.x, whole - 1.6),
        ];
        svg.path(&format!("{}Z", polyline(&head)), &Paint::fill(colour(mark.colour)));
    }
    let below = [cx + 0.5 * whole, cy + BELOW - 4.5];
    svg.text(&name(&curves.y), setting(below, Anchor::Middle));
    let beside = [cx - 0.5 * whole, cy + 3.0 + 0.75 * SIZE];
    svg.text(&name(&curves.x), setting(beside, Anchor::Middle));
}
