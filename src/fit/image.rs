//! Fits a model to an image.

use super::options::Options;
use super::problem::pixels::{PixelProblem, Shown, Target};
use super::search::absent_lobes::minimise_escaping_absent_lobes;
use crate::error::Error;
use crate::model::{Expression, Role, Scale};
use crate::parameters::{ParameterRow, ParameterTable, Status};
use crate::solver::{Tolerances, minimise};
use nalgebra::DVector;

/// Final tolerances: an image does not show more digits than these.
const TOLERANCES: Tolerances = Tolerances { step: 1e-7, cost: 1e-9, gradient: 1e-7, refinements: 0 };
/// Largest number of iterations on all pixels; few fits take more than thirty.
const ITERATIONS: u64 = 100;
/// The effort with which each start is tried.
const TRIAL: Effort = Effort { pixels: 150, iterations: 8 };
/// The effort with which the best starts are improved.
const SEARCH: Effort = Effort { pixels: 400, iterations: 30 };
/// Number of starts that are improved.
const BEST_TRIALS: usize = 2;
/// Factors by which the widths of a start are multiplied to make further starts.
const WIDTH_FACTORS: [f64; 3] = [1.0, 1.0 / 3.0, 3.0];

/// How much a minimisation may cost.
struct Effort {
    /// Approximate number of pixels to minimise on.
    pixels: usize,
    /// Largest number of iterations.
    iterations: u64,
}

/// Searches from `starts` for the parameters whose image is closest to what is `shown`; `None` without starts.
///
/// Images have many minima if lobes are sharp. Every start is tried with its widths unchanged, a third as large and
/// three times as large, for a few iterations on a few of the pixels. The best two are improved on more pixels, and
/// the better of those on all pixels. The result is at least as close to what is shown as every start.
///
/// # Errors
/// The errors of [`minimise`].
pub(crate) fn fit_image<T: Target>(
    expression: &Expression,
    shown: &Shown<T>,
    starts: &[&ParameterTable],
    options: &Options,
) -> Result<Option<ParameterTable>, Error> {
    let improved = |shown: &Shown<T>, tables: Vec<ParameterTable>, iterations: u64| {
        let improved = |table| improved(&PixelProblem::new(expression, shown, table), options, iterations);
        let mut found = tables.into_iter().map(improved).collect::<Result<Vec<_>, Error>>()?;
        found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        Ok::<_, Error>(found)
    };
    let best = |found: Vec<(f64, ParameterTable)>, n: usize| -> Vec<ParameterTable> {
        found.into_iter().take(n).map(|(_, table)| table).collect()
    };

    // All starts are tried on few pixels, the best are improved on more, and the very best on all.
    let starts_tried: Vec<ParameterTable> =
        starts.iter().flat_map(|start| with_other_widths(start)).collect();
    let tried = improved(&shown.some(TRIAL.pixels), starts_tried, TRIAL.iterations)?;
    let searched = improved(&shown.some(SEARCH.pixels), best(tried, BEST_TRIALS), SEARCH.iterations)?;
    let mut found = improved(shown, best(searched, 1), ITERATIONS)?;

    // If a start was better than this result, the few pixels were not typical: minimise from the starts on all pixels.
    let cost = |table: &&ParameterTable| PixelProblem::new(expression, shown, (*table).clone()).cost();
    let least = starts.iter().map(cost).fold(f64::INFINITY, f64::min);
    if found.first().is_some_and(|(cost, _)| *cost > least) {
        found.extend(improved(shown, starts.iter().map(|table| (*table).clone()).collect(), ITERATIONS)?);
        found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    }
    Ok(best(found, 1).into_iter().next())
}

/// A start with its widths unchanged, narrower and wider; only the start itself if it has no free widths.
fn with_other_widths(start: &ParameterTable) -> Vec<ParameterTable> {
    let is_width = |row: &ParameterRow| {
        row.status == Status::Free && row.spec.role == Role::Shape && row.spec.scale == Scale::Log
    };
    let widths: Vec<(usize, f64)> = (0..)
        .zip(start.rows())
        .filter(|(_, row)| is_width(row))
        .map(|(index, row)| (index, row.value))
        .collect();
    let factors: &[f64] = if widths.is_empty() { &[1.0] } else { &WIDTH_FACTORS };
    let with = |factor: &f64| {
        let mut table = start.clone();
        widths.iter().for_each(|(index, value)| table.set_value(*index, factor * value));
        table
    };
    factors.iter().map(with).collect()
}

/// Minimises from the problem's parameters and returns the parameters reached, with their cost.
fn improved<T: Target>(
    problem: &PixelProblem<'_, T>,
    options: &Options,
    iterations: u64,
) -> Result<(f64, ParameterTable), Error> {
    let start = DVector::from_vec(problem.table().coordinates());
    let limits = options.limits(iterations, None);
    let solution = minimise_escaping_absent_lobes(problem, problem.table(), start, |start| {
        minimise(problem, start, TOLERANCES, limits.clone())
    })?;
    let mut table = problem.table().clone();
    table.set_coordinates(solution.x.as_slice());
    table.sort_lobes();
    Ok((solution.cost, table))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::problem::pixels::tests::{PIXELS_SHOWN, light, rendered, shown, table};
    use crate::math::count;
    use approx::assert_relative_eq;
    use std::f64::consts::PI;

    /// Lambert's image is kd/pi times the sum of the weights: a straight line through the origin, whose least-squares
    /// slope has a textbook formula.
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
                let light = light(&shown, colour, pixel) / PI;
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
        let image = rendered(&expression, &dark, &truth);
        let shown = shown(|pixel| image[pixel]);
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
