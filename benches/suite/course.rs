//! How long each stage of one fit to a full table takes, as the library itself announces them.

use super::inputs::{self, ONE_LOBE, load};
use super::timing::{as_f64, median, thread_counts, with_threads};
use super::{Setup, markdown};
use brdfit::fit::{Options, Progress, fit};
use brdfit::model::Expression;
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// Remembers when each stage began.
#[derive(Default)]
struct Stages(Mutex<Vec<(String, Instant)>>);

impl Progress for Stages {
    fn stage(&self, name: &str) {
        self.0.lock().unwrap().push((name.to_owned(), Instant::now()));
    }
    fn iteration(&self, _: u64, _: f64) {}
}

pub fn table(setup: &Setup) -> String {
    let measurement = load(setup.inputs.table());
    let expression = Expression::parse(ONE_LOBE).unwrap();
    let mut rows = Vec::new();
    let mut passes = 0;
    let mut samples = 0;
    for threads in thread_counts() {
        let mut of_stages: Vec<(String, Vec<f64>)> = Vec::new();
        for _ in 0..setup.effort.runs {
            let stages = Arc::new(Stages::default());
            let heard: Arc<dyn Progress> = Arc::clone(&stages) as Arc<dyn Progress>;
            heard.stage("selecting");
            let fitted =
                with_threads(threads, || fit(&measurement, &expression, &Options::default(), &heard));
            heard.stage("end");
            let fitted = fitted.unwrap_or_else(|error| panic!("{error}"));
            (passes, samples) = (fitted.evaluations, fitted.used);
            let stages = stages.0.lock().unwrap();
            for (place, pair) in stages.windows(2).enumerate() {
                if of_stages.len() == place {
                    of_stages.push((pair[0].0.clone(), Vec::new()));
                }
                of_stages[place].1.push((pair[1].1 - pair[0].1).as_secs_f64());
            }
        }
        for (stage, times) in of_stages {
            let time = median(times);
            let per_sample = time * 1e9 / as_f64(samples);
            rows.push(vec![
                stage,
                threads.to_string(),
                format!("{:.1}", time * 1e3),
                format!("{per_sample:.0}"),
            ]);
        }
    }
    let text = markdown(&["stage", "threads", "ms", "ns per sample"], &rows);
    let name = inputs::name(setup.inputs.table());
    format!("`{ONE_LOBE}`, `cbrt`, {samples} samples of {name}; {passes} passes in the final fit.\n\n{text}")
}
