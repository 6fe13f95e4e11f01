//! Fitting an image: pixels that are weighted sums of f.
//!
//! ```text
//! x(p, k) = sum_s w_s,k f_c(k)(s)          s: pairs of directions that pixel p sees; k: red, green, blue
//! minimised: sum_p |r_p(x(p, .))|^2        r_p: what tells the pixel from the measured one
//! ```
//!
//! f_c(k) is the channel of its own where the measurement has red, green and blue, and its only channel otherwise. Errors along
//! single directions that cancel within a pixel are none: they cannot be seen.

use super::absent::past_absent_lobes;
use super::formula::{Formula, Layout};
use super::kernels::Evaluation;
use super::problem::stretches;
use super::run::Options;
use crate::error::Error;
use crate::geometry::{BLOCK, Block, Pair, Row};
use crate::model::{BasisBlock, Expression, Role, Scale};
use crate::parameters::{ParameterTable, Row as Parameter, Status};
use crate::solver::triangle::{Triangle, dot};
use crate::solver::{LeastSquares, Limits, Linearisation, Tolerances, minimise};
use nalgebra::{DVector, Matrix3, Vector3};
use pulp::Arch;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Mutex;

/// Colours of a pixel.
const COLOURS: usize = 3;
/// A minimum of an image is not asked for more digits than an image shows.
const TOLERANCES: Tolerances = Tolerances { step: 1e-7, cost: 1e-9, gradient: 1e-7, refinements: 0 };
/// Most iterations; few fits take more than thirty.
const ITERATIONS: u64 = 100;
/// How starts are tried, and how the best of them go on.
const TRIED: Effort = Effort { pixels: 150, iterations: 8 };
const SEARCHED: Effort = Effort { pixels: 400, iterations: 30 };
/// Pixels whose rows are compressed together.
const PIXELS: usize = 64;

/// How much is looked at, and how often.
struct Effort {
    pixels: usize,
    iterations: u64,
}

/// What a pixel is to be.
pub(crate) trait Target: Clone + Sync {
    /// The residuals of a pixel of red, green and blue `x`, and their derivatives: a row each, with a column per colour.
    fn compare(&self, x: [f64; COLOURS]) -> (Vector3<f64>, Matrix3<f64>);
}

/// What the pixels of an image see, and what they are to be.
#[derive(Clone, Debug)]
pub(crate) struct Shown<T> {
    pairs: Vec<Pair>,
    /// Per pair: its pixel, in rising order.
    pixel_of: Vec<usize>,
    /// Per colour and pair.
    weights: [Vec<f64>; COLOURS],
    targets: Vec<T>,
}

impl<T: Target> Shown<T> {
    pub(crate) fn new() -> Self {
        Self { pairs: Vec::new(), pixel_of: Vec::new(), weights: Default::default(), targets: Vec::new() }
    }

    /// A further pixel; what is added after it is what it sees.
    pub(crate) fn add_pixel(&mut self, target: T) {
        self.targets.push(target);
    }

    /// A pair of directions that the last pixel sees, and what its reflectance is multiplied by.
    pub(crate) fn add_pair(&mut self, pair: Pair, weights: [f64; COLOURS]) {
        let Some(pixel) = self.targets.len().checked_sub(1) else { return };
        self.pairs.push(pair);
        self.pixel_of.push(pixel);
        self.weights.iter_mut().zip(weights).for_each(|(row, weight)| row.push(weight));
    }

    /// About `wanted` of the pixels, evenly from their order.
    fn some(&self, wanted: usize) -> Self {
        let step = self.targets.len().div_ceil(wanted.max(1)).max(1);
        let mut some = Self::new();
        let mut last = None;
        for (index, (pair, pixel)) in self.pairs.iter().zip(&self.pixel_of).enumerate() {
            let Some(target) = self.targets.get(*pixel).filter(|_| pixel.is_multiple_of(step)) else {
                continue;
            };
            if last != Some(pixel) {
                some.add_pixel(target.clone());
                last = Some(pixel);
            }
            some.add_pair(*pair, self.weights.each_ref().map(|row| row.get(index).copied().unwrap_or(0.0)));
        }
        some
    }
}

/// Parameters that make an image as near as it gets to what is `shown`, sought from `starts`; none without starts.
///
/// Images have many minima where lobes are sharp. Every start is tried with its widths as they are, a third and three times
/// as large, for a few iterations on few of the pixels; the best two of those are improved on more pixels, and the better one on
/// all. The result is no farther from what is shown than any of the starts.
///
/// # Errors
/// Those of [`minimise`].
pub(crate) fn fit_image<T: Target>(
    expression: &Expression,
    shown: &Shown<T>,
    starts: &[&ParameterTable],
    options: &Options,
) -> Result<Option<ParameterTable>, Error> {
    let improved = |shown: &Shown<T>, tables: Vec<ParameterTable>, iterations: u64| {
        let improved = |table| PixelProblem::new(expression, shown, table).improved(options, iterations);
        let mut found = tables.into_iter().map(improved).collect::<Result<Vec<_>, Error>>()?;
        found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        Ok::<_, Error>(found)
    };
    let best = |found: Vec<(f64, ParameterTable)>, n: usize| -> Vec<ParameterTable> {
        found.into_iter().take(n).map(|(_, table)| table).collect()
    };
    let tried: Vec<ParameterTable> = starts.iter().flat_map(|start| stretched(start)).collect();
    let tried = improved(&shown.some(TRIED.pixels), tried, TRIED.iterations)?;
    let searched = improved(&shown.some(SEARCHED.pixels), best(tried, 2), SEARCHED.iterations)?;
    let mut found = improved(shown, best(searched, 1), ITERATIONS)?;
    let cost = |table: &&ParameterTable| PixelProblem::new(expression, shown, (*table).clone()).cost();
    let least = starts.iter().map(cost).fold(f64::INFINITY, f64::min);
    if found.first().is_some_and(|(cost, _)| *cost > least) {
        // Some of the pixels were not like the others.
        found.extend(improved(shown, starts.iter().map(|table| (*table).clone()).collect(), ITERATIONS)?);
        found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    }
    Ok(best(found, 1).into_iter().next())
}

/// A start with its widths as they are, narrower and wider; itself alone if it has none to move.
fn stretched(start: &ParameterTable) -> Vec<ParameterTable> {
    let is_width = |row: &Parameter| {
        row.status == Status::Free && row.spec.role == Role::Shape && row.spec.scale == Scale::Log
    };
    let widths: Vec<(usize, f64)> = (0..)
        .zip(start.rows())
        .filter(|(_, row)| is_width(row))
        .map(|(index, row)| (index, row.value))
        .collect();
    let factors: &[f64] = if widths.is_empty() { &[1.0] } else { &[1.0, 1.0 / 3.0, 3.0] };
    let with = |factor: &f64| {
        let mut table = start.clone();
        widths.iter().for_each(|(index, value)| table.set_value(*index, factor * value));
        table
    };
    factors.iter().map(with).collect()
}

/// The least-squares problem of an image.
struct PixelProblem<'a, T> {
    expression: &'a Expression,
    shown: &'a Shown<T>,
    table: ParameterTable,
    /// Per channel.
    layouts: Vec<Layout>,
    /// Per colour: the channel that makes it.
    channels: [usize; COLOURS],
    bases: Mutex<Vec<BasisBlock>>,
}

/// Sums over what pixels see: per pixel those of the Jacobian's columns, then that of the reflectance.
struct PixelSums {
    /// The first pixel.
    first: usize,
    /// Per colour.
    sums: [Vec<f64>; COLOURS],
}

impl<'a, T: Target> PixelProblem<'a, T> {
    fn new(expression: &'a Expression, shown: &'a Shown<T>, table: ParameterTable) -> Self {
        let last = table.channels().len().saturating_sub(1);
        let layouts = (0..=last).map(|channel| Layout::new(&table, channel)).collect();
        let channels = std::array::from_fn(|colour: usize| colour.min(last));
        Self { expression, shown, table, layouts, channels, bases: Mutex::default() }
    }

    fn cost(&self) -> f64 {
        self.linearise(&DVector::from_vec(self.table.coordinates())).cost
    }

    /// The minimum that the parameters lead to, with its cost.
    fn improved(&self, options: &Options, iterations: u64) -> Result<(f64, ParameterTable), Error> {
        let start = DVector::from_vec(self.table.coordinates());
        let (stop, deadline) = (options.stop.clone(), options.deadline);
        let limits = Limits { iterations, stop, deadline, observer: None };
        let solution = past_absent_lobes(self, &self.table, start, |start| {
            minimise(self, start, TOLERANCES, limits.clone())
        })?;
        let mut table = self.table.clone();
        table.set_coordinates(solution.x.as_slice());
        table.sort_lobes();
        Ok((solution.cost, table))
    }

    /// The free parameters that a colour depends on.
    fn columns(&self, colour: usize) -> &[usize] {
        let channel = self.channels.get(colour);
        channel.and_then(|channel| self.layouts.get(*channel)).map_or(&[][..], Layout::columns)
    }

    /// Sums per pixel of a colour: a column each, and one for the image itself.
    fn width(&self, colour: usize) -> usize {
        self.columns(colour).len() + 1
    }

    /// The image and its derivatives.
    fn render(&self, formula: &Formula<'_>) -> PixelSums {
        let arch = Arch::new();
        let workspace = || (Block::new(), formula.bases(), Vec::new());
        let all_samples = self.shown.pixel_of.len();
        let parts: Vec<PixelSums> = stretches(all_samples)
            .into_par_iter()
            .map_init(workspace, |(block, bases, rows), blocks| {
                let of = |index: usize| self.shown.pixel_of.get(index).copied().unwrap_or(0);
                let first = of(blocks.start * BLOCK);
                let last = of(all_samples.min(blocks.end * BLOCK) - 1);
                let mut part = self.no_sums(first, last + 1 - first);
                for index in blocks {
                    let samples = index * BLOCK..all_samples.min((index + 1) * BLOCK);
                    block.fill_pairs(self.shown.pairs.get(samples.clone()).unwrap_or_default());
                    bases.iter_mut().for_each(BasisBlock::forget);
                    for (channel, sums) in formula.sums().iter().enumerate() {
                        formula.evaluate(channel, block, bases);
                        arch.dispatch(Evaluation { bases, sums, rows });
                        self.add(channel, rows, samples.clone(), &mut part);
                    }
                }
                part
            })
            .collect();
        let mut all = self.no_sums(0, self.shown.targets.len());
        for part in parts {
            for (colour, (sums, part_sums)) in all.sums.iter_mut().zip(&part.sums).enumerate() {
                let places = sums.iter_mut().skip(part.first * self.width(colour));
                places.zip(part_sums).for_each(|(place, sum)| *place += sum);
            }
        }
        all
    }

    fn no_sums(&self, first: usize, pixels: usize) -> PixelSums {
        PixelSums { first, sums: std::array::from_fn(|colour| vec![0.0; pixels * self.width(colour)]) }
    }

    /// Adds rows of a channel over a block of samples to the pixels that they belong to.
    fn add(&self, channel: usize, rows: &[Row], samples: Range<usize>, part: &mut PixelSums) {
        let pixel_of = self.shown.pixel_of.get(samples.clone()).unwrap_or_default();
        let mut start = 0;
        for run in pixel_of.chunk_by(|a, b| a == b) {
            let within = start..start + run.len();
            start = within.end;
            let pixel = run.first().map_or(0, |pixel| pixel - part.first);
            let of_colours = self.channels.iter().zip(&self.shown.weights).zip(&mut part.sums);
            for ((_, weights), sums) in of_colours.filter(|((made_by, _), _)| **made_by == channel) {
                let weights = weights.get(samples.start + within.start..samples.start + within.end);
                let weights = weights.unwrap_or_default();
                let places = sums.iter_mut().skip(pixel * rows.len());
                for (place, row) in places.zip(rows) {
                    *place += dot(weights, row.get(within.clone()).unwrap_or_default());
                }
            }
        }
    }

    /// The residuals of all pixels and their derivatives, as a triangular factor, and their cost.
    fn compress(&self, image: &PixelSums) -> (Triangle, f64) {
        let free = self.table.free().len();
        let mut triangle = Triangle::new(free + 1);
        let mut cost = 0.0;
        for (first, targets) in self.shown.targets.chunks(PIXELS).enumerate() {
            let mut rows = vec![vec![0.0; 3 * targets.len()]; free + 1];
            for (within, target) in targets.iter().enumerate() {
                let pixel = first * PIXELS + within;
                let of_colour = |colour: usize| -> &[f64] {
                    let (sums, width) = (image.sums.get(colour), self.width(colour));
                    sums.and_then(|sums| sums.get(pixel * width..(pixel + 1) * width)).unwrap_or_default()
                };
                let colours = [of_colour(0), of_colour(1), of_colour(2)];
                let (residual, slopes) =
                    target.compare(colours.map(|sums| sums.last().copied().unwrap_or(0.0)));
                cost += residual.norm_squared();
                let mut add = |column: usize, entries: Vector3<f64>| {
                    let places = rows.get_mut(column).and_then(|row| row.get_mut(3 * within..3 * within + 3));
                    places.into_iter().flatten().zip(&entries).for_each(|(place, entry)| *place += entry);
                };
                add(free, residual);
                for (colour, (sums, slope)) in colours.into_iter().zip(slopes.column_iter()).enumerate() {
                    for (column, sum) in self.columns(colour).iter().zip(sums) {
                        add(*column, slope * *sum);
                    }
                }
            }
            triangle.append(&mut rows);
        }
        (triangle, cost)
    }
}

impl<T: Target> LeastSquares for PixelProblem<'_, T> {
    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        let mut table = self.table.clone();
        table.set_coordinates(x.as_slice());
        let table = table.off_zero();
        let formula = Formula::new(self.expression, &table, &self.layouts, &self.bases);
        let (triangle, cost) = self.compress(&self.render(&formula));
        let columns: Vec<usize> = (0..self.table.free().len()).collect();
        Linearisation { cost, blocks: vec![triangle.as_rows(&columns)] }
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.table.coordinate_bounds()
    }

    fn cost_floor(&self) -> f64 {
        // Residuals of rounding errors of what black pixels differ by.
        let black = self.shown.targets.iter().map(|target| target.compare([0.0; COLOURS]).0.norm_squared());
        1e-30 * black.sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::count;
    use approx::assert_relative_eq;
    use glam::DVec3;
    use std::f64::consts::PI;

    /// Radiance as it is.
    #[derive(Clone)]
    struct Radiance([f64; 3]);

    impl Target for Radiance {
        fn compare(&self, x: [f64; 3]) -> (Vector3<f64>, Matrix3<f64>) {
            (Vector3::from(x) - Vector3::from(self.0), Matrix3::identity())
        }
    }

    const PIXELS_SHOWN: usize = 150;

    /// An image in which pixel p sees 1 + p mod 5 pairs of directions; weights and brightness differ from colour to colour.
    fn shown(brightness: impl Fn(usize) -> [f64; 3]) -> Shown<Radiance> {
        let mut shown = Shown::new();
        for pixel in 0..PIXELS_SHOWN {
            shown.add_pixel(Radiance(brightness(pixel)));
            for k in 0..=pixel % 5 {
                let (p, k) = (count(pixel), count(k));
                let at = |theta: f64, phi: f64| {
                    let (sin, cos) = theta.sin_cos();
                    DVec3::new(sin * phi.cos(), sin * phi.sin(), cos)
                };
                let wi = at(0.1 + 0.25 * k, 0.3 * p);
                let wo = at(0.2 + 0.006 * p, 2.0 + 0.1 * k);
                let weight = 0.5 + 0.1 * k + 0.001 * p;
                shown.add_pair(Pair { wi, wo }, [weight, 0.8 * weight * weight, 0.3 + 0.2 * k]);
            }
        }
        shown
    }

    fn table(expression: &Expression, channels: &[&str]) -> ParameterTable {
        let channels: Vec<String> = channels.iter().map(|name| (*name).to_owned()).collect();
        ParameterTable::new(expression, &channels, false, &Vec::new()).unwrap()
    }

    #[test]
    fn derivatives_are_those_of_the_image() {
        let expression = Expression::parse("lambert + cook-torrance").unwrap();
        let shown = shown(|pixel| [0.1, 0.2, 0.3].map(|x| x + 0.01 * count(pixel % 7)));
        for channels in [&["r", "g", "b"][..], &["grey"]] {
            let problem = PixelProblem::new(&expression, &shown, table(&expression, channels));
            let x = DVector::from_vec(problem.table.coordinates());
            let slope = problem.linearise(&x).slope_at(&DVector::zeros(x.len()));
            for j in 0..x.len() {
                let step = 1e-6;
                let moved = |sign: f64| {
                    let mut x = x.clone();
                    x[j] += sign * step;
                    problem.linearise(&x).cost
                };
                // The slope of half the cost.
                let expected = (moved(1.0) - moved(-1.0)) / (4.0 * step);
                assert_relative_eq!(slope[j], expected, max_relative = 1e-5, epsilon = 1e-7);
            }
        }
    }

    /// Lambert's image is kd/pi times the sum of the weights: a straight line through the origin, whose slope any textbook has.
    #[test]
    fn the_minimum_of_a_matte_image_is_that_of_a_straight_line() {
        let expression = Expression::parse("lambert").unwrap();
        let brightness = |pixel: usize| [0.2, 0.4, 0.1].map(|x| x * (1.0 + count(pixel % 3)));
        let shown = shown(brightness);
        let start = table(&expression, &["r", "g", "b"]);
        let found = fit_image(&expression, &shown, &[&start], &Options::default()).unwrap().unwrap();
        for (colour, row) in found.rows().iter().enumerate() {
            let (mut products, mut squares) = (0.0, 0.0);
            for pixel in 0..PIXELS_SHOWN {
                let of_pixel =
                    shown.pixel_of.iter().zip(&shown.weights[colour]).filter(|(p, _)| **p == pixel);
                let light = of_pixel.map(|(_, weight)| weight).sum::<f64>() / PI;
                products += light * brightness(pixel)[colour];
                squares += light * light;
            }
            assert_relative_eq!(row.value, products / squares, max_relative = 1e-9);
        }
    }

    #[test]
    fn the_result_is_the_best_that_any_start_leads_to() {
        let expression = Expression::parse("lambert + cook-torrance").unwrap();
        let mut truth = table(&expression, &["grey"]);
        let index = (0..truth.rows().len()).find(|index| truth.name(*index) == "cook-torrance.m").unwrap();
        truth.set_value(index, 0.2);
        let dark = shown(|_| [0.0; 3]);
        let problem = PixelProblem::new(&expression, &dark, truth.clone());
        let formula = Formula::new(&expression, &truth, &problem.layouts, &problem.bases);
        let image = problem.render(&formula);
        let shown = shown(|pixel| {
            [0, 1, 2].map(|colour| image.sums[colour][(pixel + 1) * problem.width(colour) - 1])
        });
        let starts = [0.02, 0.5].map(|m| {
            let mut start = table(&expression, &["grey"]);
            start.set_value(index, m);
            start
        });
        let starts: Vec<&ParameterTable> = starts.iter().collect();
        let found = fit_image(&expression, &shown, &starts, &Options::default()).unwrap().unwrap();
        assert_relative_eq!(found.rows()[index].value, 0.2, max_relative = 1e-5);
    }
}
