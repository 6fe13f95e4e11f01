//! Recognises MERL-like tables whose numbers are in another order, whose theta_h is stored linearly, or that were
//! scaled twice.
//!
//! A few thousand numbers of the file are looked at. Some cells of a table have directions below the horizon, and
//! programs leave these cells negative, NaN or 0. In the right order the filled cells are those above the horizon. In
//! another order they are not, and there is one that makes them so. A table that is filled everywhere is not judged.
//!
//! That theta_h is stored linearly is recognised in the same way. The shape of a lobe does not tell: a smooth one
//! would get a cusp at theta_h = 0, but some materials have lobes with a cusp.

use super::sizes::{SCALES, VALUES};
use crate::geometry::HalfDifferenceGrid;
use crate::math::count;
use crate::measurement::{TableAxis, TableFault};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::RangeInclusive;

/// Number of bins in theta_h.
const N_H: usize = HalfDifferenceGrid::DIMENSIONS[0];
/// Number of bins in theta_d.
const N_D: usize = HalfDifferenceGrid::DIMENSIONS[1];
/// Number of bins in phi_d.
const N_P: usize = HalfDifferenceGrid::DIMENSIONS[2];

/// Number of values by which the order is judged.
const SAMPLES: usize = 8192;
/// The smallest share of samples that disagree with the horizon in a wrong layout, which is at least 0.042: that with
/// theta_h and theta_d exchanged. Whether a cell stands for the middle of its bin or for an edge changes 0.012.
const DISAGREES: f64 = 0.03;
/// The largest share that disagrees in the right layout of a table without gaps.
const AGREES: f64 = 0.02;
/// The smallest difference between these shares.
const CLEARLY: f64 = 0.02;
/// The largest share of the cells below the horizon that are filled in the right order of a table with gaps. The edges of bins make
/// 0.042.
const FILLED_BELOW: f64 = 0.06;
/// By how much more of them are filled in a wrong order, at least: 0.08 with theta_h and theta_d exchanged.
const MORE_BELOW: f64 = 0.05;
/// The order with theta_h and theta_d exchanged is as good if it fills less than this more of them. Without gaps it is 0.05 to 0.09.
const AMBIGUOUS: f64 = 0.03;
/// The smallest share of the cells above the horizon that are filled in the right order of a table with gaps.
const FILLED_ABOVE: f64 = 0.65;
/// How many cells that are not filled above the horizon count as much as one that is filled below it.
const GAP: usize = 10;
/// The share of negative numbers and NaN from which on these alone mark cells that are not filled. If there are fewer,
/// zeros mark them, too.
const MARKED: f64 = 0.01;

/// Number of theta_h for which the reflection of light along the normal stays above the horizon.
const HALVES: usize = 64;
/// Number of values by which the level of a channel is judged.
const LEVELS: usize = HALVES + 1;
/// A lobe back to the light is narrower than a bin if its neighbour at theta_d = 0 is darker than it by this factor.
const NARROW: f64 = 0.1;
/// The largest number of these that may be missing.
const MISSING: usize = LEVELS / 10;
/// Albedos that a surface may have. Less is a table without light, more is measured in error.
const ALBEDOS: RangeInclusive<f64> = 0.003..=1.1;
/// How much channels may differ that are alike but for noise.
const ALIKE: f64 = 0.02;

/// Some numbers of a table that is being read.
pub struct Layout {
    samples: Probe,
    levels: Probe,
    /// Number of values read, all planes together.
    taken: usize,
}

impl Layout {
    pub fn new() -> Self {
        Self { samples: Probe::at(sampled()), levels: Probe::at(levels()), taken: 0 }
    }

    /// Takes the next numbers.
    pub fn take(&mut self, words: &[u64]) {
        self.samples.take(self.taken, words);
        self.levels.take(self.taken, words);
        self.taken += words.len();
    }

    /// What seems to be wrong with the table, whose cells are above the horizon or not; `None` if nothing is.
    pub fn fault(&self, above: &[bool]) -> Option<TableFault> {
        self.samples.wrong_order(above).or_else(|| self.levels.scaled_twice())
    }
}

/// Numbers at given positions of a table.
struct Probe {
    /// In ascending order.
    positions: Vec<usize>,
    /// As far as they were read.
    values: Vec<f64>,
}

impl Probe {
    fn at(positions: Vec<usize>) -> Self {
        let values = Vec::with_capacity(positions.len());
        Self { positions, values }
    }

    /// Takes those of the numbers, the first of which is at `first`, that are wanted.
    fn take(&mut self, first: usize, words: &[u64]) {
        let wanted = self.positions.get(self.values.len()..).unwrap_or_default();
        let words = wanted.iter().map_while(|position| words.get(position.checked_sub(first)?));
        self.values.extend(words.map(|word| f64::from_bits(u64::from_le(*word))));
    }

    /// The order in which the filled cells lie above the horizon, if that is not MERL's.
    fn wrong_order(&self, above: &[bool]) -> Option<TableFault> {
        let marked = |value: f64| value < 0.0 || value.is_nan();
        let share = |number: usize| count(number) / count(SAMPLES);
        let by_mark = share(self.values.iter().filter(|value| marked(**value)).count()) >= MARKED;
        let is_filled = |value: &f64| if by_mark { !marked(*value) } else { *value > 0.0 };
        let filled: Vec<(usize, bool)> =
            self.positions.iter().copied().zip(self.values.iter().map(is_filled)).collect();

        let horizon = Horizon::new(above);
        let agreement = |order: &Order| {
            let mut cells = Agreement::default();
            filled.iter().for_each(|(at, filled)| cells.count(horizon.is_above(order, *at), *filled));
            cells
        };
        let stated = agreement(&MERL);
        if stated.disagreement() < DISAGREES {
            return None;
        }
        let all: Vec<(Agreement, Order)> = orders().map(|order| (agreement(&order), order)).collect();
        // Of several that agree equally well, the first.
        let best = all.iter().min_by_key(|(cells, _)| cells.empty_above + cells.filled_below)?;
        let is_exact =
            best.0.disagreement() <= AGREES && stated.disagreement() >= best.0.disagreement() + CLEARLY;
        let (cells, order) = if is_exact {
            best
        } else {
            // Gaps look like a horizon that comes early, as for a linear theta_h, but fill nothing below it.
            let square = all.iter().filter(|(_, order)| !order.linear);
            square.min_by_key(|(cells, _)| cells.empty_above + GAP * cells.filled_below)?
        };
        if is_exact && order.axes == MERL.axes {
            return Some(TableFault::LinearThetaH);
        }
        let clear = cells.below() <= FILLED_BELOW && stated.below() >= cells.below() + MORE_BELOW;
        if !(is_exact || clear && cells.above() >= FILLED_ABOVE) {
            return None;
        }
        let exchanged = agreement(&order.exchanged());
        Some(TableFault::Order {
            axes: order.axes,
            linear: order.linear,
            maybe_exchanged: exchanged.below() < cells.below() + AMBIGUOUS,
            below_horizon: count(stated.filled_below) / count(stated.filled_below + stated.filled_above),
        })
    }

    /// Whether the level is too low by the factors that turn stored numbers into f.
    fn scaled_twice(&self) -> Option<TableFault> {
        let mut channels = self.values.chunks_exact(LEVELS).zip(SCALES).map(|(values, scale)| {
            let albedo = scale * normal_albedo(values)?;
            ALBEDOS.contains(&(albedo / scale)).then_some(albedo)
        });
        let [r, g, b] = [channels.next()??, channels.next()??, channels.next()??];
        // Channels that are alike would hardly be alike without the factors, which differ: the surface is grey, and
        // really that dark.
        if (g / r - 1.0).abs() < ALIKE && (b / r - 1.0).abs() < ALIKE {
            return None;
        }
        Some(TableFault::ScaledTwice { albedo: r.max(g).max(b) })
    }
}

/// Numbers of samples above and below the horizon.
#[derive(Default)]
struct Agreement {
    filled_above: usize,
    empty_above: usize,
    filled_below: usize,
    empty_below: usize,
}

impl Agreement {
    fn count(&mut self, above: bool, filled: bool) {
        *match (above, filled) {
            (true, true) => &mut self.filled_above,
            (true, false) => &mut self.empty_above,
            (false, true) => &mut self.filled_below,
            (false, false) => &mut self.empty_below,
        } += 1;
    }

    /// The share of samples that are filled below the horizon, or not above it.
    fn disagreement(&self) -> f64 {
        count(self.empty_above + self.filled_below) / count(SAMPLES)
    }

    /// The share of the samples above the horizon that are filled.
    fn above(&self) -> f64 {
        count(self.filled_above) / count((self.filled_above + self.empty_above).max(1))
    }

    /// The share of the samples below the horizon that are filled.
    fn below(&self) -> f64 {
        count(self.filled_below) / count((self.filled_below + self.empty_below).max(1))
    }
}

/// An order in which the numbers may be stored.
#[derive(Clone, Copy)]
struct Order {
    /// The axes, that which runs slowest first.
    axes: [TableAxis; 4],
    /// Whether theta_h grows linearly with its index.
    linear: bool,
}

impl Order {
    /// The same with theta_h and theta_d exchanged.
    fn exchanged(&self) -> Self {
        let axes = self.axes.map(|axis| match axis {
            TableAxis::ThetaH => TableAxis::ThetaD,
            TableAxis::ThetaD => TableAxis::ThetaH,
            other => other,
        });
        Self { axes, ..*self }
    }
}

/// MERL's own.
const MERL: Order =
    Order { axes: [TableAxis::Colour, TableAxis::ThetaH, TableAxis::ThetaD, TableAxis::PhiD], linear: false };

/// All orders but MERL's, those first that are most like it.
fn orders() -> impl Iterator<Item = Order> {
    let axes = MERL.axes;
    let pairs = axes.into_iter().flat_map(move |a| axes.map(|b| (a, b)));
    let fours = pairs.flat_map(move |(a, b)| axes.into_iter().flat_map(move |c| axes.map(|d| [a, b, c, d])));
    let permutations = fours.filter(move |four| axes.iter().all(|axis| four.contains(axis)));
    let both = [false, true]
        .into_iter()
        .flat_map(move |linear| permutations.clone().map(move |axes| Order { axes, linear }));
    both.skip(1)
}

/// Which cells are above the horizon.
struct Horizon<'a> {
    /// By number of the cell, if theta_h grows with the square of its index.
    above: &'a [bool],
    /// Tangents of theta_d by index, and of theta_h if that grows linearly.
    tangents: Vec<f64>,
    /// Absolute cosines of phi_d, by index.
    cosines: Vec<f64>,
}

impl<'a> Horizon<'a> {
    fn new(above: &'a [bool]) -> Self {
        let middles = |n: usize| (0..n).map(move |index| (count(index) + 0.5) / count(n));
        Self {
            above,
            tangents: middles(N_D).map(|part| (part * FRAC_PI_2).tan()).collect(),
            cosines: middles(N_P).map(|part| (part * PI).cos().abs()).collect(),
        }
    }

    /// Whether the directions of the number at a position of the file are above the horizon.
    fn is_above(&self, order: &Order, position: usize) -> bool {
        let mut left = position;
        let [mut h, mut d, mut p] = [0; 3];
        for axis in order.axes.iter().rev() {
            let (size, index) = match axis {
                TableAxis::Colour => (SCALES.len(), &mut 0),
                TableAxis::ThetaH => (N_H, &mut h),
                TableAxis::ThetaD => (N_D, &mut d),
                TableAxis::PhiD => (N_P, &mut p),
            };
            (*index, left) = (left % size, left / size);
        }
        if !order.linear {
            return self.above.get(p + N_P * (d + N_D * h)) == Some(&true);
        }
        let tangent = |index: usize| self.tangents.get(index);
        // cos(theta_h) cos(theta_d) > sin(theta_h) sin(theta_d) |cos(phi_d)|, divided by both cosines.
        let product = || Some(tangent(h)? * tangent(d)? * self.cosines.get(p)?);
        product().is_some_and(|product| product < 1.0)
    }
}

/// Positions spread over the whole table, at irregular distances.
fn sampled() -> Vec<usize> {
    let distance = VALUES / SAMPLES;
    // The fractions of the multiples of the golden ratio are spread evenly, and do not repeat with any axis of a table.
    let fraction = |n: u64| n.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
    let offset = |n: u64| (fraction(n) * u64::try_from(distance).unwrap_or(0)) >> 32;
    let offsets = (0..).map(|n| usize::try_from(offset(n)).unwrap_or(0));
    (0..SAMPLES).zip(offsets).map(|(n, offset)| n * distance + offset).collect()
}

/// The theta_h of an index and a place in its bin, radians.
fn theta_h(index: usize, place: f64) -> f64 {
    ((count(index) + place) / count(N_H)).powi(2) * FRAC_PI_2
}

/// Positions of the cells from which [`normal_albedo`] is computed, for each channel: those of light nearest to the normal by theta_h, and
/// after the first of these its neighbour in theta_d.
fn levels() -> Vec<usize> {
    let mirrored = N_P - 1;
    let degree = FRAC_PI_2 / count(N_D);
    // The difference angle is as large as the half vector's, so that the light comes along the normal.
    let theta_d = |h: usize| (0..N_D).rev().find(|d| count(*d) * degree <= theta_h(h, 0.5)).unwrap_or(0);
    let cells = (0..HALVES).map(|h| (h, theta_d(h)));
    let cells: Vec<(usize, usize)> = [(0, 0), (0, 1)].into_iter().chain(cells.skip(1)).collect();
    let planes = (0..SCALES.len()).map(|plane| plane * HalfDifferenceGrid::CELLS);
    planes.flat_map(|plane| cells.iter().map(move |(h, d)| plane + mirrored + N_P * (d + N_D * h))).collect()
}

/// The share of light along the normal that is reflected, from the numbers of a channel at [`levels`]. `None` if too
/// many are missing, or if the light goes where the cells do not show it.
fn normal_albedo(values: &[f64]) -> Option<f64> {
    let [first, neighbour, rest @ ..] = values else { return None };
    let usable = |value: f64| (0.0..=f64::MAX).contains(&value).then_some(value);
    let mut last = usable(*first)?;
    // A lobe back to the light is brightest at theta_d = 0, and may be narrower than a bin.
    if usable(*neighbour)? < NARROW * last || rest.iter().filter(|v| usable(**v).is_none()).count() > MISSING
    {
        return None;
    }
    let mut albedo = 0.0;
    for (h, value) in std::iter::once(first).chain(rest).enumerate() {
        // In place of a missing value stands the last one, which is nearer to the peak.
        last = usable(*value).unwrap_or(last);
        let middle = theta_h(h, 0.5);
        let solid_angle = TAU * (theta_h(h, 0.0).cos() - theta_h(h, 1.0).cos());
        // theta_o is twice theta_h, and the solid angle of the viewer 4 cos(theta_h) times that of the half vector.
        albedo += last * (2.0 * middle).cos() * 4.0 * middle.cos() * solid_angle;
    }
    Some(albedo)
}
