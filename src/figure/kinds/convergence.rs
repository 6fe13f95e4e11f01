//! The cost along the iterations. A report keeps only their number, so that they are made again from its starts.

use crate::error::Error;
use crate::figure::data::{
    Axes, Axis, Body, Colour, Curves, Dash, FigureData, Look, Marker, Panel, Scale, Series,
};
use crate::figure::kind::{Kind, Needs, Several, Subject, Wanted, only};
use crate::figure::refit::{problem_table, refit_options, reported};
use crate::figure::text::Text;
use crate::fit::{LossKind, Objective, ReflectanceProblem};
use crate::measurement::Samples;
use crate::parameters::{ParameterTable, Status};
use crate::report::{Recorded, StartRecord};
use crate::solver::in_parts::minimise_in_parts;
use crate::solver::{LeastSquares as _, Limits, Observer, Tolerances};
use nalgebra::DVector;
use std::sync::{Arc, Mutex, PoisonError};

/// The entry of the registry.
pub const KIND: Kind = Kind {
    name: "convergence",
    summary: "cost along the iterations, from every start of the report",
    needs: Needs::Both,
    several: Several::Refused,
    raster: false,
    compute,
};

/// The largest number of starts that are followed.
const MOST_STARTS: usize = 5;
/// The largest number of iterations.
const MOST_ITERATIONS: u64 = 300;

fn compute(subjects: &[Subject], wanted: &Wanted) -> Result<FigureData, Error> {
    let subject = only(subjects, KIND.name)?;
    let (recorded, measurement) = (subject.fitted()?, subject.measured()?);
    let options = refit_options(&subject.options, recorded);
    let samples = Samples::select(measurement, &options.filters)?;
    let objective = match (options.loss, options.loss_scale) {
        (LossKind::None, _) | (_, None) => Objective::from(options.metric),
        (loss, Some(scale)) => Objective { metric: options.metric, loss, scale },
    };
    let table = at_start(recorded, problem_table(recorded, measurement, &samples)?);
    let starts = starts(&recorded.report.starts, &table);
    let mut series = Vec::new();
    for (k, (name, table)) in starts.into_iter().enumerate() {
        wanted.progress.stage(&name);
        let problem = ReflectanceProblem::new(&recorded.expression, &samples, table, objective);
        let look = Look { colour: Colour::Of(k), line: Some(Dash::Of(k)), marker: Some(Marker::Of(k)) };
        let points = costs(&problem)?;
        series.push(Series { name: name.into(), look, points, band: None, in_legend: true });
    }
    let x = Axis::new("iteration", "");
    let y = Axis::new("cost", "").scaled(Scale::Log);
    let caption = format!(
        "{}: cost of {} in the metric {} along the iterations of Levenberg-Marquardt, made again on {} samples from the values at \
         which the starts of the report began.",
        subject.stem(),
        recorded.expression.canonical(),
        options.metric.name(),
        samples.len()
    );
    let curves = Curves { axes: Axes::Cartesian, x, y, series, marks: Vec::new() };
    let panels = vec![Panel { title: Text::default(), body: Body::Curves(curves) }];
    Ok(FigureData { kind: KIND.name, panels, caption: caption.into(), side_by_side: [1, 1] })
}

/// The table with every free parameter at the value at which the chosen start began.
fn at_start(recorded: &Recorded, mut table: ParameterTable) -> ParameterTable {
    for row in 0..table.rows().len() {
        let free = table.rows().get(row).is_some_and(|row| row.status == Status::Free);
        if let (true, Some(parameter)) = (free, reported(&recorded.report, &recorded.table, row)) {
            table.set_value(row, parameter.initial);
        }
    }
    table
}

/// The tables of the starts, the chosen one first. The others differ from it in their shapes.
fn starts(others: &[StartRecord], chosen: &ParameterTable) -> Vec<(String, ParameterTable)> {
    let place = |name: &String| (0..chosen.rows().len()).find(|row| chosen.name(*row) == *name);
    let mut all: Vec<(String, ParameterTable)> = vec![("chosen start".to_owned(), chosen.clone())];
    for start in others {
        let mut table = chosen.clone();
        for (name, value) in &start.shapes.0 {
            if let Some(row) = place(name) {
                table.set_value(row, *value);
            }
        }
        let same = |other: &ParameterTable| other.coordinates() == table.coordinates();
        if all.len() < MOST_STARTS && !all.iter().any(|(_, other)| same(other)) {
            all.push((format!("start {}", all.len() + 1), table));
        }
    }
    all
}

/// The cost at the start and after every iteration.
fn costs(problem: &ReflectanceProblem<'_>) -> Result<Vec<[f64; 2]>, Error> {
    let start = DVector::from_vec(problem.table().coordinates());
    let seen: Arc<Mutex<Vec<(u64, f64)>>> = Arc::default();
    let told = Arc::clone(&seen);
    let observer: Observer = Arc::new(move |iteration, cost| {
        told.lock().unwrap_or_else(PoisonError::into_inner).push((iteration, cost));
    });
    let limits = Limits { iterations: MOST_ITERATIONS, stop: None, deadline: None, observer: Some(observer) };
    let first = problem.linearise(&start).cost;
    minimise_in_parts(problem, &problem.table().free_products(), &start, Tolerances::default(), limits)?;
    let seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
    // The solver counts from 0, where the cost is that after its first step.
    let after = seen.iter().zip(1_u32..).map(|((_, cost), number)| [f64::from(number), *cost]);
    Ok(std::iter::once([0.0, first]).chain(after).collect())
}
