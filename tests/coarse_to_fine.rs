//! A fit of many samples goes most of its way on part of them. It must end where a fit ends that looks at every
//! sample in every iteration.

use approx::assert_relative_eq;
use brdfit::fit::{Fit, LossKind, Metric, Objective, Options, ReflectanceProblem, fit};
use brdfit::geometry::{Directions, HalfDifferenceGrid};
use brdfit::measurement::{Measurement, Samples};
use brdfit::model::Expression;
use brdfit::parameters::ParameterTable;
use brdfit::progress::{Progress, Quiet};
use brdfit::solver::{Limits, Solution, Tolerances, minimise};
use brdfit::synthetic::{Noise, measurement, scattered_directions};
use nalgebra::DVector;
use std::sync::Arc;

/// Data of `truth` with noise that no model explains.
fn data(truth: &str, directions: Directions) -> Measurement {
    let expression = Expression::parse(truth).unwrap();
    let channels = ["r", "g"].map(str::to_owned);
    let table = ParameterTable::new(&expression, &channels, directions.azimuths(), &Vec::new()).unwrap();
    measurement(&expression, &table, directions, Noise { relative: 0.1, absolute: 1e-3 }, 7)
}

fn scattered() -> Directions {
    Directions::Scattered(scattered_directions(250_000, 80.0, 3))
}

fn grid() -> Directions {
    let grid = HalfDifferenceGrid::merl_centers();
    let above = grid.above_horizon().iter().zip(0..).filter(|(above, _)| **above);
    Directions::Grid { cells: above.map(|(_, cell)| cell).collect(), grid: Arc::clone(&grid) }
}

fn fitted(data: &Measurement, expression: &Expression, options: &Options) -> Fit {
    let quiet: Arc<dyn Progress> = Arc::new(Quiet);
    fit(data, expression, options, &quiet).unwrap()
}

/// Levenberg-Marquardt on all samples, to the last digits, from a point beside the end of `found`.
fn on_all_samples(data: &Measurement, expression: &Expression, options: &Options, found: &Fit) -> Solution {
    let samples = Samples::select(data, &options.filters).unwrap();
    let objective =
        Objective { metric: options.metric, loss: options.loss, scale: found.loss_scale.unwrap_or(1.0) };
    let problem = ReflectanceProblem::new(expression, &samples, found.table.clone(), objective);
    let start = DVector::from_vec(found.table.coordinates()).map(|x| 1.07 * x + 0.01);
    minimise(&problem, start, Tolerances::default(), Limits::default()).unwrap()
}

fn ends_at_the_same_minimum(data: &Measurement, model: &str, options: &Options) {
    let expression = Expression::parse(model).unwrap();
    let found = fitted(data, &expression, options);
    assert!(found.used > 160_000 && found.unusable.is_none());
    let whole = on_all_samples(data, &expression, options, &found);
    assert!(whole.termination.converged());
    assert_relative_eq!(found.cost, whole.cost, max_relative = 1e-12);
    for (x, y) in found.table.coordinates().iter().zip(whole.x.iter()) {
        assert_relative_eq!(x, y, max_relative = 1e-7, epsilon = 1e-9);
    }
    // The detour saves looks at all samples; it must not need more of them than it saves.
    assert!(found.evaluations <= 8, "{} looks at all samples", found.evaluations);
}

#[test]
fn scattered_samples_in_every_metric() {
    let data = data("lambert + cook-torrance(d=beckmann)", scattered());
    for metric in Metric::ALL {
        // Not the model that made the data: residuals stay, and are curved.
        let options = Options::default().with_metric(metric);
        ends_at_the_same_minimum(&data, "lambert + cook-torrance(d=ggx)", &options);
    }
}

#[test]
fn a_full_grid() {
    let data = data("lambert + cook-torrance(d=beckmann)", grid());
    ends_at_the_same_minimum(&data, "lambert + cook-torrance(d=ggx)", &Options::default());
}

#[test]
fn a_robust_loss() {
    let data = data("lambert + cook-torrance(d=beckmann)", scattered());
    let options = Options::default().with_loss(LossKind::Huber);
    ends_at_the_same_minimum(&data, "lambert + cook-torrance(d=ggx)", &options);
}

#[test]
fn a_shape_per_channel() {
    let data = data("lambert + cook-torrance(d=ggx)", scattered());
    ends_at_the_same_minimum(&data, "lambert + cook-torrance(d=ggx, f=dielectric)", &Options::default());
}
