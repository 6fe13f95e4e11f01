//! The least-squares problem of fitting an image: pixels that are weighted sums of f.
//!
//! ```text
//! x(p, k) = sum_s w_s,k f_c(k)(s)          s: pairs of directions that pixel p sees; k: red, green, blue
//! minimised: sum_p |r_p(x(p, .))|^2        r_p: residuals of the pixel against its target
//! ```
//!
//! c(k) is the channel of colour k if the measurement has red, green and blue, and its only channel otherwise. Errors
//! in single directions that cancel within a pixel do not count, because they cannot be seen.

use super::formula::{Formula, Layout};
use super::kernels::Evaluation;
use super::reflectance::block_ranges;
use crate::geometry::{BLOCK, Block, Pair, Row};
use crate::model::{BasisBlock, Expression};
use crate::parameters::ParameterTable;
use crate::solver::triangle::{Triangle, dot};
use crate::solver::{LeastSquares, Linearisation};
use nalgebra::{DVector, Matrix3, Vector3};
use pulp::Arch;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Mutex;

/// Number of colours of a pixel.
const COLOURS: usize = 3;
/// Number of pixels whose rows are compressed together.
const PIXELS: usize = 64;

/// The target of a pixel.
pub(crate) trait Target: Clone + Sync {
    /// The residuals of a pixel whose red, green and blue are `x`, and their derivatives: one row per residual, one
    /// column per colour.
    fn compare(&self, x: [f64; COLOURS]) -> (Vector3<f64>, Matrix3<f64>);
}

/// The pairs of directions that each pixel of an image sees, and the target of each pixel.
#[derive(Clone, Debug)]
pub(crate) struct Shown<T> {
    pairs: Vec<Pair>,
    /// The pixel of each pair, in ascending order.
    pixel_of: Vec<usize>,
    /// The factor of each pair's reflectance, by colour.
    weights: [Vec<f64>; COLOURS],
    /// The target of each pixel.
    targets: Vec<T>,
}

impl<T: Target> Shown<T> {
    pub(crate) fn new() -> Self {
        Self { pairs: Vec::new(), pixel_of: Vec::new(), weights: Default::default(), targets: Vec::new() }
    }

    /// Adds a pixel. Pairs added after it belong to it.
    pub(crate) fn add_pixel(&mut self, target: T) {
        self.targets.push(target);
    }

    /// Adds a pair of directions that the last pixel sees, with the factor of its reflectance by colour.
    pub(crate) fn add_pair(&mut self, pair: Pair, weights: [f64; COLOURS]) {
        assert!(!self.targets.is_empty(), "a pixel to add the pair to");
        self.pairs.push(pair);
        self.pixel_of.push(self.targets.len() - 1);
        self.weights.iter_mut().zip(weights).for_each(|(row, weight)| row.push(weight));
    }

    /// About `wanted` of the pixels, spread evenly over their order.
    pub(in crate::fit) fn some(&self, wanted: usize) -> Self {
        let step = self.targets.len().div_ceil(wanted.max(1)).max(1);
        let mut some = Self::new();
        let mut last = None;
        for (index, (pair, pixel)) in self.pairs.iter().zip(&self.pixel_of).enumerate() {
            if !pixel.is_multiple_of(step) {
                continue;
            }
            if last != Some(pixel) {
                some.add_pixel(self.targets[*pixel].clone());
                last = Some(pixel);
            }
            some.add_pair(*pair, self.weights.each_ref().map(|weights| weights[index]));
        }
        some
    }
}

/// The least-squares problem of an image.
pub(in crate::fit) struct PixelProblem<'a, T> {
    expression: &'a Expression,
    shown: &'a Shown<T>,
    table: ParameterTable,
    /// The free parameters that each channel depends on.
    layouts: Vec<Layout>,
    /// The channel that gives each colour.
    channels: [usize; COLOURS],
    /// The basis of each lobe, as prepared for the previous pass.
    bases: Mutex<Vec<BasisBlock>>,
}

/// Sums over the pairs that each pixel sees: for each pixel those of the Jacobian's columns, then that of the
/// reflectance.
struct PixelSums {
    /// Index of the first pixel.
    first: usize,
    /// The sums, by colour.
    sums: [Vec<f64>; COLOURS],
}

impl<'a, T: Target> PixelProblem<'a, T> {
    pub(in crate::fit) fn new(
        expression: &'a Expression,
        shown: &'a Shown<T>,
        table: ParameterTable,
    ) -> Self {
        let last = table.channels().len().saturating_sub(1);
        let layouts = (0..=last).map(|channel| Layout::new(&table, channel)).collect();
        let channels = std::array::from_fn(|colour: usize| colour.min(last));
        Self { expression, shown, table, layouts, channels, bases: Mutex::default() }
    }

    /// The parameters at which the problem starts.
    pub(in crate::fit) fn table(&self) -> &ParameterTable {
        &self.table
    }

    /// The cost at those parameters.
    pub(in crate::fit) fn cost(&self) -> f64 {
        self.linearise(&DVector::from_vec(self.table.coordinates())).cost
    }

    /// The free parameters that a colour depends on.
    fn columns(&self, colour: usize) -> &[usize] {
        self.layouts[self.channels[colour]].columns()
    }

    /// Number of sums per pixel of a colour: one for each column and one for the image itself.
    fn width(&self, colour: usize) -> usize {
        self.columns(colour).len() + 1
    }

    /// Computes the image and its derivatives.
    fn render(&self, formula: &Formula<'_>) -> PixelSums {
        let arch = Arch::new();
        let workspace = || (Block::new(), formula.bases(), Vec::new());
        let all_samples = self.shown.pixel_of.len();
        let parts: Vec<PixelSums> = block_ranges(all_samples)
            .into_par_iter()
            .map_init(workspace, |(block, bases, rows), blocks| {
                let first = self.shown.pixel_of[blocks.start * BLOCK];
                let last = self.shown.pixel_of[all_samples.min(blocks.end * BLOCK) - 1];
                let mut part = self.no_sums(first, last + 1 - first);
                for index in blocks {
                    let samples = index * BLOCK..all_samples.min((index + 1) * BLOCK);
                    block.fill_pairs(&self.shown.pairs[samples.clone()]);
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
                let places = &mut sums[part.first * self.width(colour)..];
                places.iter_mut().zip(part_sums).for_each(|(place, sum)| *place += sum);
            }
        }
        all
    }

    /// Sums equal to 0 for `pixels` pixels from `first` on.
    fn no_sums(&self, first: usize, pixels: usize) -> PixelSums {
        PixelSums { first, sums: std::array::from_fn(|colour| vec![0.0; pixels * self.width(colour)]) }
    }

    /// Adds the rows of a channel, over a block of samples, to the sums of the pixels that they belong to.
    fn add(&self, channel: usize, rows: &[Row], samples: Range<usize>, part: &mut PixelSums) {
        let mut start = 0;
        for run in self.shown.pixel_of[samples.clone()].chunk_by(|a, b| a == b) {
            let within = start..start + run.len();
            start = within.end;
            let pixel = run[0] - part.first;
            let of_colours = self.channels.iter().zip(&self.shown.weights).zip(&mut part.sums);
            for ((_, weights), sums) in of_colours.filter(|((made_by, _), _)| **made_by == channel) {
                let weights = &weights[samples.start + within.start..samples.start + within.end];
                let places = &mut sums[pixel * rows.len()..];
                for (place, row) in places.iter_mut().zip(rows) {
                    *place += dot(weights, &row[within.clone()]);
                }
            }
        }
    }

    /// Compresses the residuals of all pixels and their derivatives into a triangular factor, and returns it with the
    /// cost.
    fn compress(&self, image: &PixelSums) -> (Triangle, f64) {
        let free = self.table.free().len();
        let mut triangle = Triangle::new(free + 1);
        let mut cost = 0.0;
        for (first, targets) in self.shown.targets.chunks(PIXELS).enumerate() {
            let mut rows = vec![vec![0.0; 3 * targets.len()]; free + 1];
            for (within, target) in targets.iter().enumerate() {
                let pixel = first * PIXELS + within;
                let of_colour = |colour: usize| -> &[f64] {
                    let width = self.width(colour);
                    &image.sums[colour][pixel * width..(pixel + 1) * width]
                };
                let colours = [of_colour(0), of_colour(1), of_colour(2)];
                let (residual, slopes) = target.compare(colours.map(|sums| sums[sums.len() - 1]));
                cost += residual.norm_squared();
                let mut add = |column: usize, entries: Vector3<f64>| {
                    let places = &mut rows[column][3 * within..3 * within + 3];
                    places.iter_mut().zip(&entries).for_each(|(place, entry)| *place += entry);
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
        Linearisation { cost, blocks: vec![triangle.as_rows(&columns)], costs: vec![cost] }
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.table.coordinate_bounds()
    }

    fn cost_floor(&self) -> f64 {
        // Residuals below the rounding error of the residuals of a black image.
        let black = self.shown.targets.iter().map(|target| target.compare([0.0; COLOURS]).0.norm_squared());
        1e-30 * black.sum::<f64>()
    }
}

#[cfg(test)]
pub(in crate::fit) mod tests {
    use super::*;
    use crate::geometry::Azimuths;
    use crate::math::count;
    use approx::assert_relative_eq;
    use glam::DVec3;

    /// Residuals that are differences of radiance.
    #[derive(Clone)]
    pub(in crate::fit) struct Radiance([f64; 3]);

    impl Target for Radiance {
        fn compare(&self, x: [f64; 3]) -> (Vector3<f64>, Matrix3<f64>) {
            (Vector3::from(x) - Vector3::from(self.0), Matrix3::identity())
        }
    }

    pub(in crate::fit) const PIXELS_SHOWN: usize = 150;

    /// An image in which pixel p sees 1 + p mod 5 pairs of directions; weights and brightness differ between colours.
    pub(in crate::fit) fn shown(brightness: impl Fn(usize) -> [f64; 3]) -> Shown<Radiance> {
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

    pub(in crate::fit) fn table(expression: &Expression, channels: &[&str]) -> ParameterTable {
        let channels: Vec<String> = channels.iter().map(|name| (*name).to_owned()).collect();
        ParameterTable::new(expression, &channels, Azimuths::Several, &Vec::new()).unwrap()
    }

    /// The red, green and blue that the model gives each pixel at the values in `table`.
    pub(in crate::fit) fn rendered(
        expression: &Expression,
        shown: &Shown<Radiance>,
        table: &ParameterTable,
    ) -> Vec<[f64; 3]> {
        let problem = PixelProblem::new(expression, shown, table.clone());
        let formula = Formula::new(expression, table, &problem.layouts, &problem.bases);
        let image = problem.render(&formula);
        let of_pixel = |pixel: usize| {
            [0, 1, 2].map(|colour| image.sums[colour][(pixel + 1) * problem.width(colour) - 1])
        };
        (0..PIXELS_SHOWN).map(of_pixel).collect()
    }

    /// The sum of a pixel's weights in one colour.
    pub(in crate::fit) fn light(shown: &Shown<Radiance>, colour: usize, pixel: usize) -> f64 {
        let seen = shown.pixel_of.iter().zip(&shown.weights[colour]).filter(|(p, _)| **p == pixel);
        seen.map(|(_, weight)| weight).sum()
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
                // The derivative of half the cost.
                let expected = (moved(1.0) - moved(-1.0)) / (4.0 * step);
                assert_relative_eq!(slope[j], expected, max_relative = 1e-5, epsilon = 1e-7);
            }
        }
    }
}
