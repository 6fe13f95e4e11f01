#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::print_stdout
)]

use brdfit::fit::{LeastSquares, Limits, Linearisation, Solution, Tolerances, minimise};
use nalgebra::{DMatrix, DVector};
use num_dual::{Dual64, DualNum};
use std::f64::consts::PI;

/// One problem of the collection.
#[derive(Clone, Debug, PartialEq)]
struct Problem {
    name: String,
    starts: [Vec<f64>; 2],
    certified: Vec<f64>,
    standard_deviations: Vec<f64>,
    rss: f64,
    dof: usize,
    /// The response, then the predictors.
    observations: Vec<Vec<f64>>,
}

/// The carried table; `scripts/nist_table.py` says how it is written.
fn problems() -> Vec<Problem> {
    let mut problems: Vec<Problem> = Vec::new();
    let lines = include_str!("nist/problems.csv").lines().filter(|line| !line.starts_with('#'));
    for line in lines {
        let (kind, rest) = line.split_once(',').unwrap();
        if kind == "problem" {
            let fields: Vec<&str> = rest.split(',').collect();
            problems.push(Problem {
                name: fields[0].to_owned(),
                rss: fields[1].parse().unwrap(),
                dof: fields[2].parse().unwrap(),
                starts: [Vec::new(), Vec::new()],
                certified: Vec::new(),
                standard_deviations: Vec::new(),
                observations: Vec::new(),
            });
            continue;
        }
        let numbers: Vec<f64> = rest.split(',').map(|field| field.parse().unwrap()).collect();
        let problem = problems.last_mut().unwrap();
        match kind {
            "parameter" => {
                problem.starts[0].push(numbers[0]);
                problem.starts[1].push(numbers[1]);
                problem.certified.push(numbers[2]);
                problem.standard_deviations.push(numbers[3]);
            }
            "observation" => problem.observations.push(numbers),
            _ => panic!("{line}"),
        }
    }
    problems
}

/// The model of a problem, as NIST writes it.
fn model(name: &str, b: &[Dual64], x: &[f64]) -> Dual64 {
    let constant = Dual64::from_re;
    let one = constant(1.0);
    let gauss = |i: usize| (-((-b[i + 1] + x[0]) / b[i + 2]).powi(2)).exp() * b[i];
    let cubic = |c0: Dual64, c: &[Dual64]| ((c[2] * x[0] + c[1]) * x[0] + c[0]) * x[0] + c0;
    match name {
        "Bennett5" => b[0] * (b[1] + x[0]).powd(-one / b[2]),
        "BoxBOD" | "Misra1a" => -b[0] * (-b[1] * x[0]).exp_m1(),
        "Chwirut1" | "Chwirut2" => (-b[0] * x[0]).exp() / (b[1] + b[2] * x[0]),
        "DanWood" => b[0] * constant(x[0]).powd(b[1]),
        "ENSO" => {
            let wave = |c: Dual64, s: Dual64, period: Dual64| {
                let phase = constant(2.0 * PI * x[0]) / period;
                c * phase.cos() + s * phase.sin()
            };
            b[0] + wave(b[1], b[2], constant(12.0)) + wave(b[4], b[5], b[3]) + wave(b[7], b[8], b[6])
        }
        "Eckerle4" => (((-b[2] + x[0]) / b[1]).powi(2) * -0.5).exp() * b[0] / b[1],
        "Gauss1" | "Gauss2" | "Gauss3" => b[0] * (-b[1] * x[0]).exp() + gauss(2) + gauss(5),
        "Hahn1" | "Thurber" => cubic(b[0], &b[1..4]) / cubic(one, &b[4..7]),
        "Kirby2" => ((b[2] * x[0] + b[1]) * x[0] + b[0]) / ((b[4] * x[0] + b[3]) * x[0] + one),
        "Lanczos1" | "Lanczos2" | "Lanczos3" => {
            b[0] * (-b[1] * x[0]).exp() + b[2] * (-b[3] * x[0]).exp() + b[4] * (-b[5] * x[0]).exp()
        }
        "MGH09" => b[0] * (b[1] * x[0] + x[0] * x[0]) / (b[2] * x[0] + x[0] * x[0] + b[3]),
        "MGH10" => b[0] * (b[1] / (b[2] + x[0])).exp(),
        "MGH17" => b[0] + b[1] * (-b[3] * x[0]).exp() + b[2] * (-b[4] * x[0]).exp(),
        "Misra1b" => b[0] * (one - (b[1] * (x[0] / 2.0) + one).powi(-2)),
        "Misra1c" => b[0] * (one - (b[1] * (2.0 * x[0]) + one).powf(-0.5)),
        "Misra1d" => b[0] * b[1] * x[0] / (b[1] * x[0] + one),
        "Nelson" => b[0] - b[1] * x[0] * (-b[2] * x[1]).exp(),
        "Rat42" => b[0] / ((b[1] - b[2] * x[0]).exp() + one),
        "Rat43" => b[0] / ((b[1] - b[2] * x[0]).exp() + one).powd(one / b[3]),
        "Roszman1" => b[0] - b[1] * x[0] - (b[2] / (-b[3] + x[0])).atan() / PI,
        _ => panic!("{name}"),
    }
}

impl Problem {
    fn response(&self, observation: &[f64]) -> f64 {
        if self.name == "Nelson" { observation[0].ln() } else { observation[0] }
    }

    fn residuals(&self, b: &[f64]) -> DVector<f64> {
        let b: Vec<Dual64> = b.iter().map(|v| Dual64::from_re(*v)).collect();
        let entries = self.observations.iter().map(|o| model(&self.name, &b, &o[1..]).re - self.response(o));
        DVector::from_iterator(self.observations.len(), entries)
    }

    fn jacobian(&self, b: &[f64]) -> DMatrix<f64> {
        let mut parameters: Vec<Dual64> = b.iter().map(|v| Dual64::from_re(*v)).collect();
        let mut jacobian = DMatrix::zeros(self.observations.len(), b.len());
        for j in 0..b.len() {
            parameters[j].eps = 1.0;
            for (i, observation) in self.observations.iter().enumerate() {
                jacobian[(i, j)] = model(&self.name, &parameters, &observation[1..]).eps;
            }
            parameters[j].eps = 0.0;
        }
        jacobian
    }
}

impl LeastSquares for Problem {
    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        Linearisation::dense(self.jacobian(x.as_slice()), self.residuals(x.as_slice()))
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        vec![(f64::NEG_INFINITY, f64::INFINITY); self.certified.len()]
    }
}

/// Correct digits of the worst entry, at most 11, which is what NIST certifies.
fn digits<'a>(found: impl IntoIterator<Item = &'a f64>, certified: &[f64]) -> f64 {
    let errors =
        found.into_iter().zip(certified).map(|(found, certified)| ((found - certified) / certified).abs());
    let worst = errors.fold(0.0, |worst: f64, error| if error <= worst { worst } else { error });
    if worst.is_nan() { 0.0 } else { (-worst.log10()).clamp(0.0, 11.0) }
}

#[test]
fn proto() {
    let mut sum = 0.0;
    let (mut its, mut evs) = (0, 0);
    for problem in problems() {
        for start in &problem.starts {
            let s: Solution = minimise(
                &problem,
                DVector::from_vec(start.clone()),
                Tolerances::default(),
                Limits::default(),
            )
            .unwrap();
            let d = digits(s.x.iter(), &problem.certified);
            let sd = s
                .linearisation
                .standard_deviations(s.x.len(), problem.dof)
                .map_or(0.0, |sd| digits(sd.iter(), &problem.standard_deviations));
            sum += d;
            its += s.iterations;
            evs += s.evaluations;
            println!(
                "{:10} {d:5.1} {sd:5.1} {:5} {:5} {:16} {}",
                problem.name,
                s.iterations,
                s.evaluations,
                s.termination.name(),
                if d < 7.0 || (sd < 6.0) || !s.termination.converged() { "<<<<" } else { "" }
            );
        }
    }
    println!("mean {} iterations {its} evaluations {evs}", sum / 54.0);
}
