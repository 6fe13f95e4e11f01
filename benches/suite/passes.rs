//! One pass over a full table: values, derivatives and triangular factors, by metric and threads.

use super::inputs::{self, ONE_LOBE, load, parameters};
use super::timing::{as_f64, thread_counts, with_threads};
use super::{Setup, markdown};
use brdfit::fit::{Metric, ReflectanceProblem, score};
use brdfit::measurement::{Filters, Samples};
use brdfit::model::Expression;
use brdfit::solver::LeastSquares;
use nalgebra::DVector;

pub fn table(setup: &Setup) -> String {
    let expression = Expression::parse(ONE_LOBE).unwrap();
    let measurement = load(setup.inputs.table());
    let samples = Samples::select(&measurement, &Filters::default()).unwrap();
    let table = parameters(&expression, samples.values.len(), samples.directions.azimuths());
    let x = DVector::from_vec(table.coordinates());

    let mut rows = Vec::new();
    for metric in Metric::ALL {
        let problem = ReflectanceProblem::new(&expression, &samples, table.clone(), metric);
        rows.extend(by_threads(setup, &samples, &format!("a pass, {}", metric.name()), || {
            problem.linearise(&x)
        }));
    }
    rows.extend(by_threads(setup, &samples, "every error at the end", || {
        score(&expression, &samples, &table)
    }));
    let head =
        ["of the whole table", "threads", "ms", "ns per sample", "ns per value", "faster than one thread"];
    let name = inputs::name(setup.inputs.table());
    format!("`{ONE_LOBE}` on {} samples of {name}.\n\n{}", samples.len(), markdown(&head, &rows))
}

fn by_threads<T>(
    setup: &Setup,
    samples: &Samples,
    what: &str,
    work: impl Fn() -> T + Send + Sync,
) -> Vec<Vec<String>> {
    let times: Vec<(usize, f64)> = thread_counts()
        .into_iter()
        .map(|threads| (threads, with_threads(threads, || setup.effort.nanoseconds(&work))))
        .collect();
    let one = times[0].1;
    let row = |&(threads, nanoseconds): &(usize, f64)| {
        let per_sample = nanoseconds / as_f64(samples.len());
        vec![
            what.to_owned(),
            threads.to_string(),
            format!("{:.1}", nanoseconds * 1e-6),
            format!("{per_sample:.1}"),
            format!("{:.1}", per_sample / as_f64(samples.values.len())),
            format!("{:.2}", one / nanoseconds),
        ]
    };
    times.iter().map(row).collect()
}
