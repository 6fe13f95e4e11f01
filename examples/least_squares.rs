//! Solves a least-squares problem of your own within bounds: a Gaussian peak on a constant background.
//!
//! The solver behind the fits knows nothing of reflectance. A problem gives the residuals and their derivatives.
//!
//! ```sh
//! cargo run --release --example least_squares
//! ```
#![allow(clippy::print_stdout)]

use brdfit::Error;
use brdfit::nalgebra::{DMatrix, DVector};
use brdfit::solver::{LeastSquares, Limits, Linearisation, Tolerances, minimise};

/// y = background + height exp(-((x - centre)/width)^2).
struct Peak {
    x: Vec<f64>,
    y: Vec<f64>,
}

const NAMES: [&str; 4] = ["background", "height", "centre", "width"];

impl LeastSquares for Peak {
    fn linearise(&self, parameters: &DVector<f64>) -> Linearisation {
        let &[background, height, centre, width] = parameters.as_slice() else {
            // The solver asks for as many parameters as there are bounds.
            return Linearisation::dense(DMatrix::zeros(0, parameters.len()), DVector::zeros(0));
        };
        let mut residuals = Vec::new();
        let mut rows = Vec::new();
        for (x, y) in self.x.iter().zip(&self.y) {
            let u = (x - centre) / width;
            let bell = (-u * u).exp();
            residuals.push(background + height * bell - y);
            let slope = 2.0 * height * bell * u / width;
            rows.extend([1.0, bell, slope, slope * u]);
        }
        Linearisation::dense(DMatrix::from_row_slice(residuals.len(), 4, &rows), residuals.into())
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        vec![(0.0, f64::INFINITY), (0.0, f64::INFINITY), (-10.0, 10.0), (0.01, 10.0)]
    }
}

fn main() -> Result<(), Error> {
    // The truth is 0.2, 1.5, 1.0 and 0.7, with an error of at most 0.01.
    let x: Vec<f64> = (0..61).map(|k| 0.1 * f64::from(k) - 2.0).collect();
    let truth = |x: f64| 0.2 + 1.5 * (-((x - 1.0) / 0.7_f64).powi(2)).exp();
    let y = x.iter().map(|x| truth(*x) + 0.01 * (37.0 * x).sin()).collect();
    let problem = Peak { x, y };

    let start = DVector::from_vec(vec![0.0, 1.0, 0.0, 1.0]);
    let solution = minimise(&problem, start, Tolerances::default(), Limits::default())?;
    let freedom = problem.x.len().saturating_sub(NAMES.len());
    println!("{} after {} iterations", solution.termination.name(), solution.iterations);
    match solution.linearisation.standard_deviations(NAMES.len(), freedom) {
        Some(errors) => {
            for ((name, value), error) in NAMES.iter().zip(solution.x.iter()).zip(errors.iter()) {
                println!("{name:10} {value:.4} +/- {error:.4}");
            }
        }
        None => println!("{} (not determined by the data)", solution.x),
    }
    Ok(())
}
