//! The nonlinear regression problems of the NIST Statistical Reference Datasets (StRD): 27 problems, two
//! starts each, with parameters and standard deviations certified to 11 digits
//! (<https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml>).
//!
//! One solver with one set of options for all. The table of correct digits, beside those of two other
//! libraries, goes to `nist.md` in Cargo's folder for temporary files, and into `docs/trust/nist.md` with
//! `BRDFIT_UPDATE=1 cargo test --release --test integration nist`.
#![allow(clippy::print_stdout)]

use crate::common::shared;
use brdfit::math::count;
use brdfit::solver::{LeastSquares, Limits, Linearisation, Solution, Tolerances, minimise};
use nalgebra::{DMatrix, DVector};
use num_dual::{Dual64, DualNum};
use std::f64::consts::PI;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

/// What must be reached, and the mean that Ceres publishes for these problems.
const PARAMETER_DIGITS: f64 = 7.0;
const DEVIATION_DIGITS: f64 = 6.0;
const MEAN_OF_CERES: f64 = 9.4;
/// The residuals of this one are 1e-14 of the data: rounding alone changes their third digit.
const EXACT: &str = "Lanczos1";

/// One problem of the collection.
#[derive(Clone, Debug, PartialEq)]
struct Problem {
    name: String,
    rss: f64,
    /// sqrt(rss/degrees of freedom).
    residual_deviation: f64,
    starts: [Vec<f64>; 2],
    certified: Vec<f64>,
    standard_deviations: Vec<f64>,
    /// The response, then the predictors.
    observations: Vec<Vec<f64>>,
}

/// The carried table; `scripts/nist_table.py` says how it is made.
fn problems() -> Vec<Problem> {
    let mut problems: Vec<Problem> = Vec::new();
    for line in include_str!("nist/problems.csv").lines().filter(|line| !line.starts_with('#')) {
        let (kind, rest) = line.split_once(',').unwrap();
        if kind == "problem" {
            let (name, numbers) = rest.split_once(',').unwrap();
            let numbers = numbers_of(numbers.split(','));
            problems.push(Problem::named(name, numbers[0], numbers[1]));
            continue;
        }
        let problem = problems.last_mut().unwrap();
        let numbers = numbers_of(rest.split(','));
        match kind {
            "parameter" => problem.add_parameter(&numbers),
            "observation" => problem.observations.push(numbers),
            _ => panic!("{line}"),
        }
    }
    problems
}

/// A file as NIST provides it.
fn original(path: &Path) -> Problem {
    let text = fs::read_to_string(path).unwrap();
    let (head, observations): (Vec<_>, Vec<_>) = text.lines().enumerate().partition(|(index, _)| *index < 60);
    let after = |label: &str| {
        let line = head.iter().find_map(|(_, line)| line.strip_prefix(label)).unwrap();
        line.trim().parse().unwrap()
    };
    let name = path.file_stem().unwrap().to_str().unwrap();
    let mut problem =
        Problem::named(name, after("Residual Sum of Squares:"), after("Residual Standard Deviation:"));
    for (_, line) in head.iter().skip(40) {
        if let Some((_, numbers)) = line.split_once('=').filter(|(b, _)| b.trim().starts_with('b')) {
            problem.add_parameter(&numbers_of(numbers.split_whitespace()));
        }
    }
    let observations = observations.iter().map(|(_, line)| numbers_of(line.split_whitespace()));
    problem.observations = observations.filter(|numbers| !numbers.is_empty()).collect();
    problem
}

fn numbers_of<'a>(fields: impl Iterator<Item = &'a str>) -> Vec<f64> {
    fields.map(|field| field.parse().unwrap_or_else(|e| panic!("{field}: {e}"))).collect()
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
    fn named(name: &str, rss: f64, residual_deviation: f64) -> Self {
        Self {
            name: name.to_owned(),
            rss,
            residual_deviation,
            starts: [Vec::new(), Vec::new()],
            certified: Vec::new(),
            standard_deviations: Vec::new(),
            observations: Vec::new(),
        }
    }

    /// A line of two starts, certified value and standard deviation.
    fn add_parameter(&mut self, numbers: &[f64]) {
        self.starts[0].push(numbers[0]);
        self.starts[1].push(numbers[1]);
        self.certified.push(numbers[2]);
        self.standard_deviations.push(numbers[3]);
    }

    fn dof(&self) -> usize {
        self.observations.len() - self.certified.len()
    }

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
    let pairs = found.into_iter().zip(certified);
    let errors = pairs.map(|(found, certified)| ((found - certified) / certified).abs());
    // f64::max would pass over a NaN.
    let worst = errors.fold(0.0, |worst: f64, error| if error <= worst { worst } else { error });
    if worst.is_nan() { 0.0 } else { (-worst.log10()).clamp(0.0, 11.0) }
}

/// What came of one start.
struct Outcome {
    problem: Problem,
    start: usize,
    /// Of the parameters, of the standard deviations, of the sum of squares.
    digits: f64,
    deviation_digits: f64,
    cost_digits: f64,
    solution: Solution,
    /// Digits of the parameters that basin finds, one per solver.
    basin: [f64; 3],
    /// Digits of the parameters that scipy finds, one per method.
    scipy: Vec<f64>,
}

/// Everything, once for all tests.
fn outcomes() -> &'static [Outcome] {
    static OUTCOMES: OnceLock<Vec<Outcome>> = OnceLock::new();
    OUTCOMES.get_or_init(|| {
        let scipy = include_str!("nist/scipy.csv");
        let problems = problems().into_iter().flat_map(|problem| [(problem.clone(), 0), (problem, 1)]);
        problems.map(|(problem, start)| outcome(problem, start, scipy)).collect()
    })
}

fn outcome(problem: Problem, start: usize, scipy: &str) -> Outcome {
    let from = problem.starts[start].clone();
    let solution =
        minimise(&problem, DVector::from_vec(from), Tolerances::default(), Limits::default()).unwrap();
    let deviations = solution.linearisation.standard_deviations(solution.x.len(), problem.dof());
    let label = format!("{},{},", problem.name, start + 1);
    let scipy = scipy.lines().find_map(|line| line.strip_prefix(&label)).unwrap();
    Outcome {
        start,
        digits: digits(&solution.x, &problem.certified),
        deviation_digits: deviations.map_or(0.0, |d| digits(&d, &problem.standard_deviations)),
        cost_digits: digits([&solution.cost], &[problem.rss]),
        basin: second_solver::all(&problem, start),
        scipy: numbers_of(scipy.split(',')),
        solution,
        problem,
    }
}

/// The same problems for the crate basin.
mod second_solver {
    use super::{Problem, digits};
    use basin::{
        BoundedLevenbergMarquardt, BoxBounds, ConstraintDescription, ConstraintSet, Constraints, DenseMatrix,
        Executor, Jacobian, LevenbergMarquardt, PointState, Residual, TrustRegionReflective,
    };
    use std::convert::Infallible;

    struct Adapter {
        problem: Problem,
        lower: Vec<f64>,
        upper: Vec<f64>,
    }

    impl Constraints for Adapter {
        type Set = ConstraintSet<BoxBounds<Vec<f64>>>;
        fn constraints(&self) -> <Self::Set as ConstraintDescription>::Borrowed<'_> {
            ConstraintSet::new().with_bounds(BoxBounds::new(Some(&self.lower), Some(&self.upper)))
        }
    }

    impl Residual for Adapter {
        type Param = Vec<f64>;
        type Output = Vec<f64>;
        type Error = Infallible;
        fn residual(&self, x: &Vec<f64>) -> Result<Vec<f64>, Infallible> {
            Ok(self.problem.residuals(x).as_slice().to_vec())
        }
    }

    impl Jacobian for Adapter {
        type Jacobian = DenseMatrix;
        fn jacobian(&self, x: &Vec<f64>) -> Result<DenseMatrix, Infallible> {
            let jacobian = self.problem.jacobian(x);
            Ok(DenseMatrix::from_fn(jacobian.nrows(), jacobian.ncols(), |i, j| jacobian[(i, j)]))
        }
    }

    /// Digits that a solver reaches with its default options and basin's default limit of iterations.
    macro_rules! reached {
        ($problem:expr, $start:expr, $solver:expr) => {{
            let n = $problem.certified.len();
            let (lower, upper) = (vec![f64::NEG_INFINITY; n], vec![f64::INFINITY; n]);
            let adapter = Adapter { problem: $problem.clone(), lower, upper };
            let state = PointState::new($problem.starts[$start].clone());
            let found = Executor::new(adapter, $solver, state).run();
            found.map_or(0.0, |found| digits(found.param(), &$problem.certified))
        }};
    }

    /// Levenberg-Marquardt by QR, the bounded one, the reflective trust region.
    pub fn all(problem: &Problem, start: usize) -> [f64; 3] {
        [
            reached!(problem, start, LevenbergMarquardt::new().with_pivoted_qr()),
            reached!(problem, start, BoundedLevenbergMarquardt::new()),
            reached!(problem, start, TrustRegionReflective::new()),
        ]
    }
}

#[test]
fn every_problem_is_solved_to_its_certified_digits() {
    let table = table();
    println!("{table}");
    fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join("nist.md"), &table).unwrap();
    let mut short = String::new();
    for o in outcomes() {
        let deviations_too = o.deviation_digits >= DEVIATION_DIGITS && o.cost_digits >= DEVIATION_DIGITS;
        let good = o.solution.termination.converged()
            && o.digits >= PARAMETER_DIGITS
            && (deviations_too || o.problem.name == EXACT);
        if !good {
            let (name, start, end) = (&o.problem.name, o.start + 1, o.solution.termination);
            writeln!(short, "{name} from start {start}: {:.1}, {:.1}, {end:?}", o.digits, o.deviation_digits)
                .unwrap();
        }
    }
    assert!(short.is_empty(), "too few digits:\n{short}");
    let mean = outcomes().iter().map(|o| o.digits).sum::<f64>() / count(outcomes().len());
    assert!(mean > MEAN_OF_CERES, "{mean}");
}

#[test]
fn the_exact_problem_is_limited_by_the_rounding_of_its_residuals() {
    for o in outcomes().iter().filter(|o| o.problem.name == EXACT) {
        let (problem, linearisation) = (&o.problem, &o.solution.linearisation);
        // The part of the standard deviations that comes from the Jacobian is as good as elsewhere.
        let certified = Linearisation { cost: problem.rss, ..linearisation.clone() };
        let deviations = certified.standard_deviations(o.solution.x.len(), problem.dof()).unwrap();
        let reached = digits(&deviations, &problem.standard_deviations);
        assert!(reached >= DEVIATION_DIGITS, "{reached}");
        // A residual is the difference of a response and a sum of three exponentials, good to some four
        // roundings of the response: |r + d|^2 - |r|^2 <= 2 |r| |d| + |d|^2.
        let size: f64 = problem.observations.iter().map(|o| o[0] * o[0]).sum();
        let rounding = 4.0 * f64::EPSILON * size.sqrt();
        let allowed = 2.0 * problem.rss.sqrt() * rounding + rounding * rounding;
        assert!(allowed < 0.05 * problem.rss, "the bound should bind");
        let error = (o.solution.cost - problem.rss).abs();
        assert!(error <= allowed, "{error} > {allowed}");
    }
}

#[test]
fn the_carried_table_is_that_of_nist() {
    let carried = problems();
    assert_eq!(carried.len(), 27);
    for problem in &carried {
        // The degrees of freedom are not carried: this is what tells them.
        let deviation = (problem.rss / count(problem.dof())).sqrt();
        let error = (deviation / problem.residual_deviation - 1.0).abs();
        assert!(error < 1e-9, "{}: {error}", problem.name);
    }
    let Some(folder) = shared("nist-strd") else { return };
    for problem in carried {
        assert_eq!(original(&folder.join(format!("{}.dat", problem.name))), problem);
    }
}

#[test]
fn the_documented_table_is_current() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/trust/nist.md");
    let text = fs::read_to_string(&path).unwrap();
    let (before, rest) = text.split_once(BEGIN).unwrap();
    let (documented, after) = rest.split_once(END).unwrap();
    if std::env::var_os("BRDFIT_UPDATE").is_some() {
        fs::write(&path, format!("{before}{BEGIN}\n\n{}\n{END}{after}", table())).unwrap();
        return;
    }
    let stale = "docs/trust/nist.md is stale: BRDFIT_UPDATE=1 cargo test --release --test integration nist";
    let mut rows = documented.lines().filter(|line| line.starts_with("| ")).skip(1);
    for o in outcomes() {
        let cells: Vec<&str> = rows.next().expect(stale).split('|').map(str::trim).collect();
        assert_eq!(cells[1..3], [o.problem.name.as_str(), &(o.start + 1).to_string()], "{stale}");
        // The last digits are rounding and differ from machine to machine.
        let documented = numbers_of(cells[3..5].iter().copied());
        for (documented, found) in documented.iter().zip([o.digits, o.deviation_digits]) {
            let solid = |digits: f64| digits.min(PARAMETER_DIGITS);
            assert!(o.problem.name == EXACT || (solid(*documented) - solid(found)).abs() < 0.5, "{stale}");
        }
    }
}

const BEGIN: &str = "<!-- written by tests/nist.rs -->";
const END: &str = "<!-- end of what tests/nist.rs writes -->";

/// The table of digits, in Markdown.
fn table() -> String {
    let mut text = String::from(
        "| problem | start | brdfit | its std. dev. | evaluations | ended | basin LM (QR) | basin bounded LM | \
         basin TRF | scipy lm | scipy trf | scipy dogbox |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); 8];
    for o in outcomes() {
        let own = [o.digits, o.deviation_digits];
        let others: Vec<f64> = o.basin.iter().chain(&o.scipy).copied().collect();
        columns.iter_mut().zip(own.iter().chain(&others)).for_each(|(column, value)| column.push(*value));
        let (evaluations, end) = (o.solution.evaluations, o.solution.termination.name());
        let start = o.start + 1;
        write!(
            text,
            "| {} | {start} | {:.1} | {:.1} | {evaluations} | {end} |",
            o.problem.name, own[0], own[1]
        )
        .unwrap();
        others.iter().for_each(|value| write!(text, " {value:.1} |").unwrap());
        text.push('\n');
    }
    let mut summary = |label: &str, of: &dyn Fn(&[f64]) -> String| {
        let cells: Vec<String> = columns.iter().map(|column| of(column)).collect();
        writeln!(text, "| {label} | | {} | | | {} |", cells[..2].join(" | "), cells[2..].join(" | "))
            .unwrap();
    };
    let at_least = |digits: f64| {
        move |column: &[f64]| column.iter().filter(|value| **value >= digits).count().to_string()
    };
    summary("**4 digits or more, of 54**", &at_least(4.0));
    summary("**7 digits or more, of 54**", &at_least(7.0));
    summary("**mean digits**", &|column| format!("{:.2}", column.iter().sum::<f64>() / count(column.len())));
    text
}
