//! How long each stage of one fit takes, as the library itself announces them.

use super::inputs::{self, ONE_LOBE, load};
use super::timing::{as_f64, median, thread_counts, with_threads};
use super::{Setup, markdown};
use brdfit::fit::{Options, fit};
use brdfit::measurement::Measurement;
use brdfit::model::Expression;
use brdfit::progress::Progress;
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// One fit.
pub struct Course {
    /// The stages in their order, in seconds.
    pub stages: Vec<(String, f64)>,
    /// Samples used.
    pub samples: usize,
    /// Passes over all samples in the final fit.
    pub passes: u64,
}

impl Course {
    /// Seconds of the stages of that name.
    pub fn seconds(&self, name: &str) -> f64 {
        self.stages.iter().filter(|(stage, _)| stage == name).map(|(_, seconds)| seconds).sum()
    }

    /// Seconds of the whole fit.
    pub fn whole(&self) -> f64 {
        self.stages.iter().map(|(_, seconds)| seconds).sum()
    }
}

/// Remembers when each stage began.
#[derive(Default)]
struct Stages(Mutex<Vec<(String, Instant)>>);

impl Progress for Stages {
    fn stage(&self, name: &str) {
        self.0.lock().unwrap().push((name.to_owned(), Instant::now()));
    }
    fn iteration(&self, _: u64, _: f64) {}
}

/// Fits with default options.
pub fn run(measurement: &Measurement, expression: &Expression) -> Course {
    let stages = Arc::new(Stages::default());
    let heard: Arc<dyn Progress> = Arc::clone(&stages) as Arc<dyn Progress>;
    heard.stage("selecting");
    let fitted = fit(measurement, expression, &Options::default(), &heard);
    heard.stage("end");
    let fitted = fitted.unwrap_or_else(|error| panic!("{error}"));
    let stages = stages.0.lock().unwrap();
    let stages = stages.windows(2).map(|pair| {
        let [(name, begun), (_, ended)] = pair else { unreachable!("windows of two") };
        (name.clone(), (*ended - *begun).as_secs_f64())
    });
    Course { stages: stages.collect(), samples: fitted.used, passes: fitted.evaluations }
}

/// The median run of three, or a single one that takes long.
pub fn typical(measurement: &Measurement, expression: &Expression) -> Course {
    let first = run(measurement, expression);
    if first.whole() > 1.0 {
        return first;
    }
    let mut courses = [first, run(measurement, expression), run(measurement, expression)];
    courses.sort_by(|a, b| a.whole().total_cmp(&b.whole()));
    let [_, middle, _] = courses;
    middle
}

pub fn table(setup: &Setup) -> String {
    let measurement = load(setup.inputs.table());
    let expression = Expression::parse(ONE_LOBE).unwrap();
    let by_threads: Vec<(usize, Vec<Course>)> = thread_counts()
        .into_iter()
        .map(|threads| {
            let runs = 0..setup.effort.runs;
            (threads, with_threads(threads, || runs.map(|_| run(&measurement, &expression)).collect()))
        })
        .collect();
    let first = &by_threads[0].1[0];
    let row = |(name, _): &(String, f64)| {
        let times = by_threads.iter().flat_map(|(_, courses)| {
            let time = median(courses.iter().map(|course| course.seconds(name)));
            [format!("{:.1}", time * 1e3), format!("{:.0}", time * 1e9 / as_f64(first.samples))]
        });
        [name.clone()].into_iter().chain(times).collect()
    };
    let rows: Vec<Vec<String>> = first.stages.iter().map(row).collect();
    let head = by_threads.iter().flat_map(|(threads, _)| {
        [format!("ms, threads: {threads}"), format!("ns per sample, threads: {threads}")]
    });
    let head: Vec<String> = ["stage".to_owned()].into_iter().chain(head).collect();
    let text = markdown(&head.iter().map(String::as_str).collect::<Vec<_>>(), &rows);
    format!(
        "`{ONE_LOBE}`, `cbrt`, {} samples of {}; {} passes in the final fit.\n\n{text}",
        first.samples,
        inputs::name(setup.inputs.table()),
        first.passes
    )
}
