//! What cartesian and polar panels have in common: bands, lines and markers, wherever their points are on paper.

use super::scale::Along;
use super::style::{band, dots, line, marker, polyline};
use super::svg::{Anchor, Paint, Setting, Svg};
use super::typeset;
use crate::figure::data::{Axis, Curves, Marker, Series};
use crate::figure::text::Text;

/// The room of a panel on paper.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    /// All of it, points.
    pub(super) width: f64,
    /// From its left edge to its axis.
    pub(super) left: f64,
    /// Whether the vertical axis has numbers and a name; if not, they stand at the panel to the left.
    pub(super) labelled: bool,
}

/// Room between the numbers of an axis and its name, points.
pub(super) const GAP: f64 = 3.0;

/// Draws all series; `place` says where a point is on paper.
pub(super) fn series(svg: &mut Svg, curves: &Curves, place: impl Fn([f64; 2]) -> [f64; 2]) {
    for series in &curves.series {
        if let Some(ends) = &series.band {
            let edge = |end: usize| {
                let xs = series.points.iter().zip(ends);
                xs.map(move |([x, _], ends)| [*x, ends.get(end).copied().unwrap_or(f64::NAN)])
            };
            let outline: Vec<[f64; 2]> = edge(0).chain(edge(1).rev()).map(&place).collect();
            if !outline.is_empty() {
                svg.path(&format!("{}Z", polyline(&thinned(&outline))), &band(&series.look));
            }
        }
    }
    // Markers without a line are samples, which must not hide the curve through them.
    for has_line in [false, true] {
        for series in curves.series.iter().filter(|series| series.look.line.is_some() == has_line) {
            if let Some(paint) = line(&series.look) {
                let points: Vec<[f64; 2]> = series.points.iter().map(|point| place(*point)).collect();
                svg.path(&polyline(&thinned(&points)), &paint);
            }
            if series.look.marker == Some(Marker::Dot) {
                let points: Vec<[f64; 2]> = series.points.iter().map(|point| place(*point)).collect();
                dots(svg, &series.look, &points);
                continue;
            }
            for point in &series.points {
                marker(svg, &series.look, place(*point));
            }
        }
    }
}

/// The points without those that lie within a hundredth of a point of the line between their neighbours.
fn thinned(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    const OFF: f64 = 0.01;
    let mut kept: Vec<[f64; 2]> = Vec::new();
    let mut waiting: Vec<[f64; 2]> = Vec::new();
    for &point in points {
        if let Some(&last) = kept.last() {
            let straight = waiting.iter().all(|between| distance(*between, last, point) < OFF);
            if !straight {
                kept.extend(waiting.last());
                waiting.clear();
            }
            waiting.push(point);
        } else {
            kept.push(point);
        }
    }
    kept.extend(waiting.last());
    kept
}

/// The distance of a point from the line through `a` and `b`; from `a` if the two are the same.
fn distance([x, y]: [f64; 2], [ax, ay]: [f64; 2], [bx, by]: [f64; 2]) -> f64 {
    let (dx, dy) = (bx - ax, by - ay);
    let length = dx.hypot(dy);
    if length < 1e-9 { (x - ax).hypot(y - ay) } else { ((x - ax) * dy - (y - ay) * dx).abs() / length }
}

/// Writes the numbers beside numbered points, where they do not cover one another if possible.
pub(super) fn numbers(svg: &mut Svg, curves: &Curves, size: f64, place: impl Fn([f64; 2]) -> [f64; 2]) {
    let mut taken: Vec<[f64; 2]> = Vec::new();
    for Series { look, points, .. } in &curves.series {
        let (Some(Marker::Number(number)), Some(point)) = (look.marker, points.first()) else { continue };
        let [x, y] = place(*point);
        // Around the point, of which the first free place is taken.
        let places = [[4.5, -2.0], [-4.5, 7.0], [4.5, 7.0], [-4.5, -2.0], [0.0, -4.5], [8.0, 2.4]];
        let free = |[dx, dy]: &[f64; 2]| {
            taken.iter().all(|[tx, ty]| (x + dx - tx).abs() > 7.0 || (y + dy - ty).abs() > 6.0)
        };
        let [dx, dy] = places.into_iter().find(free).unwrap_or([4.5, -2.0]);
        taken.push([x + dx, y + dy]);
        taken.push([x, y + 2.4]);
        let text = Text::from(number.to_string());
        let own = Setting { at: [x + dx, y + dy], size, anchor: Anchor::Middle, upwards: false, bold: false };
        svg.text(&text, own);
    }
}

/// The name of an axis with its unit.
pub(super) fn name(axis: &Axis) -> Text {
    match axis.unit {
        "" => axis.quantity.clone(),
        unit => axis.quantity.clone().words(format!(" ({unit})")),
    }
}

/// The widest of some labels, points.
pub(super) fn widest(ticks: &[(f64, Text)], size: f64) -> f64 {
    ticks.iter().map(|(_, label)| typeset::width(label, size)).fold(0.0, f64::max)
}

/// The axes of a panel with the ends of its data.
pub(super) fn both(curves: &Curves) -> (Along, Along) {
    let xs = curves.series.iter().flat_map(|series| series.points.iter().map(|[x, _]| *x));
    let ys = curves.series.iter().flat_map(|series| series.points.iter().map(|[_, y]| *y));
    (Along::new(&curves.x, xs), Along::new(&curves.y, ys))
}

/// A short line.
pub(super) fn tick(svg: &mut Svg, from: [f64; 2], to: [f64; 2]) {
    svg.line(from, to, &Paint::stroke(super::style::AXIS, 0.5));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_corners_and_ends() {
        let straight: Vec<[f64; 2]> = (0..100).map(|k| [f64::from(k), 2.0 * f64::from(k)]).collect();
        assert_eq!(thinned(&straight), [[0.0, 0.0], [99.0, 198.0]]);
        let peak = [[0.0, 0.0], [1.0, 0.0], [2.0, 5.0], [3.0, 0.0], [4.0, 0.0]];
        assert_eq!(thinned(&peak), peak);
        let spike = [[0.0, 0.0], [0.0, 9.0], [0.0, 0.0], [1.0, 0.0]];
        assert!(thinned(&spike).contains(&[0.0, 9.0]));
        assert_eq!(thinned(&[[1.0, 1.0]]), [[1.0, 1.0]]);
    }
}
