//! Predictions of a great many samples from those next to them on a curve through all of them.
//!
//! The curve is Morton's (1966, A Computer Oriented Geodetic Data Base): the bits of the coordinates in turn make a number, and the
//! samples are sorted by it. Samples next to each other on the curve are mostly next to each other in space, but not always, because
//! the curve leaps; so the extremes among four are left out.

#![allow(
    clippy::indexing_slicing,
    reason = "lengths are checked where they come in; an index beyond the end is a mistake in the program"
)]

use super::cloud::{SAME, Symmetry, place};
use super::tree::{Point, square};
use crate::geometry::Pair;
use rayon::prelude::*;

/// Number of bits of the position on the curve.
const BITS: u32 = 60;
/// Number of samples on either side that are sought, and how far along the curve.
const SIDE: usize = 2;
const REACH: usize = 8;

/// The values of every sample as the others predict them that do not coincide with it, by row; its own where there are no others.
pub(in crate::measurement) fn leave_each_out_along_curve(
    pairs: &[Pair],
    rows: &[&Vec<f64>],
    isotropic: bool,
) -> Vec<Vec<f64>> {
    let symmetry = Symmetry { isotropic, reciprocal: false };
    let points: Vec<Point> = pairs.par_iter().map(|pair| place(pair, symmetry)).collect();
    let order = along_curve(&points);
    let near = |position: usize| -> [usize; 2 * SIDE] {
        let own = order[position];
        let differs = |other: &usize| square(&points[own], &points[*other]) > SAME;
        let after = order.iter().skip(position + 1).take(REACH).copied().filter(differs).take(SIDE);
        let before = order[..position].iter().rev().take(REACH).copied().filter(differs).take(SIDE);
        let mut near = [own; 2 * SIDE];
        near.iter_mut().zip(before.chain(after)).for_each(|(place, sample)| *place = sample);
        near
    };
    let near: Vec<[usize; 2 * SIDE]> = (0..order.len()).into_par_iter().map(near).collect();
    let predict = |row: &&Vec<f64>| {
        let mut predicted = row.to_vec();
        for (own, near) in order.iter().zip(&near) {
            let others = near.iter().filter(|sample| *sample != own);
            let mut values = [0.0; 2 * SIDE];
            let mut found = 0;
            for sample in others {
                (values[found], found) = (row[*sample], found + 1);
            }
            let values = &mut values[..found];
            values.sort_unstable_by(f64::total_cmp);
            predicted[*own] = match *values {
                [] => row[*own],
                [only] => only,
                [a, b] | [_, a, b, _] => 0.5 * (a + b),
                [.., middle, _] => middle,
            };
        }
        predicted
    };
    rows.par_iter().map(predict).collect()
}

/// The indices of points in the order of the curve.
fn along_curve(points: &[Point]) -> Vec<usize> {
    let (mut low, mut high) = ([f64::INFINITY; 5], [f64::NEG_INFINITY; 5]);
    for point in points {
        for (axis, x) in point.iter().enumerate() {
            (low[axis], high[axis]) = (low[axis].min(*x), high[axis].max(*x));
        }
    }
    let axes: Vec<usize> = (0..low.len()).filter(|axis| high[*axis] > low[*axis]).collect();
    let bits = BITS.checked_div(u32::try_from(axes.len()).unwrap_or(BITS)).unwrap_or(0);
    let key = |point: &Point| {
        let cells: Vec<u64> = axes
            .iter()
            .map(|axis| whole((point[*axis] - low[*axis]) / (high[*axis] - low[*axis]), bits))
            .collect();
        (0..bits)
            .rev()
            .flat_map(|bit| cells.iter().map(move |cell| (cell >> bit) & 1))
            .fold(0, |key, bit| 2 * key + bit)
    };
    let mut order: Vec<(u64, usize)> =
        points.par_iter().enumerate().map(|(index, point)| (key(point), index)).collect();
    order.par_sort_unstable();
    order.into_iter().map(|(_, index)| index).collect()
}

/// A share of 0 to 1 as a whole number of so many bits. Adding 2^52 puts it into the last bits of a double.
fn whole(share: f64, bits: u32) -> u64 {
    let most = (1_u64 << bits) - 1;
    let steps = f64::from(u32::try_from(most).unwrap_or(u32::MAX));
    (share.clamp(0.0, 1.0) * steps + 4_503_599_627_370_496.0).to_bits() & most
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::scattered_directions;

    #[test]
    fn numbers_are_cut_to_bits() {
        assert_eq!((whole(0.0, 12), whole(1.0, 12), whole(0.5, 3)), (0, 4095, 4));
        assert_eq!(whole(2.0, 20), (1 << 20) - 1);
    }

    /// The smooth function cos(theta_i) is predicted from its neighbours, and the sample's own value has no say.
    #[test]
    fn neighbours_on_the_curve_are_neighbours_in_space() {
        let pairs = scattered_directions(20_000, 80.0, 3);
        let row: Vec<f64> = pairs.iter().map(|pair| pair.wi.z).collect();
        let predicted = leave_each_out_along_curve(&pairs, &[&row], true);
        let mut errors: Vec<f64> = row.iter().zip(&predicted[0]).map(|(f, p)| (f - p).abs()).collect();
        errors.sort_by(f64::total_cmp);
        assert!(errors[10_000] < 0.05, "{}", errors[10_000]);
        let mut other = row.clone();
        other[77] = 1e3;
        assert_eq!(leave_each_out_along_curve(&pairs, &[&other], true)[0][77], predicted[0][77]);
    }

    #[test]
    fn coinciding_samples_do_not_predict_each_other() {
        let pairs = scattered_directions(50, 80.0, 3);
        let twice: Vec<Pair> = pairs.iter().flat_map(|pair| [*pair; 2]).collect();
        let row: Vec<f64> = (0..100).map(|i| if i / 2 == 20 { 7.0 } else { 1.0 }).collect();
        assert_eq!(leave_each_out_along_curve(&twice, &[&row], true)[0][40], 1.0);
        let lone = leave_each_out_along_curve(&pairs[..1], &[&vec![3.0]], true);
        assert_eq!(lone, [[3.0]]);
    }
}
