//! How the time of a fit grows with samples, channels, lobes and threads. Measurements are made in memory, in scattered
//! directions; the library fits them.

use super::course::typical;
use super::inputs::{ONE_LOBE, scattered};
use super::timing::{as_f64, exponent, thread_counts, with_threads};
use super::{Setup, markdown};
use brdfit::measurement::Measurement;
use brdfit::model::Expression;

/// How many of the largest sizes the growth is fitted to.
const LARGE_END: usize = 3;

/// One sort of size, and what is fitted at each.
struct Series {
    name: &'static str,
    sizes: Vec<usize>,
    make: fn(usize) -> (Expression, Measurement),
}

pub fn table(setup: &Setup) -> String {
    let most = |sizes: &[usize], quick: usize| {
        sizes.iter().copied().filter(|size| !setup.quick() || *size <= quick).collect::<Vec<_>>()
    };
    let series = [
        Series {
            name: "samples (3 channels)",
            sizes: most(&[1_000, 10_000, 100_000, 1_000_000, 10_000_000], 100_000),
            make: |samples| one_lobe(samples, 3),
        },
        Series {
            name: "channels (400 samples)",
            sizes: most(&[1, 3, 10, 31, 100, 300], 31),
            make: |channels| one_lobe(400, channels),
        },
        Series {
            name: "lobes (100 000 samples, 3 channels)",
            sizes: most(&[1, 2, 3], 2),
            make: |lobes| {
                let text = ["lambert"].into_iter().chain((0..lobes).map(|_| "cook-torrance(d=ggx)"));
                let expression = Expression::parse(&text.collect::<Vec<_>>().join(" + ")).unwrap();
                let measurement = scattered(&expression, 100_000, 3);
                (expression, measurement)
            },
        },
    ];
    let mut rows = Vec::new();
    for Series { name, sizes, make } in series {
        let mut times = Vec::new();
        for size in sizes {
            let (expression, measurement) = make(size);
            let course = typical(&measurement, &expression);
            let time = course.whole();
            times.push((as_f64(size), time));
            let end = &times[times.len().saturating_sub(LARGE_END)..];
            rows.push(vec![
                name.to_owned(),
                size.to_string(),
                format!("{time:.4}"),
                significant(time * 1e6 / as_f64(size)),
                format!("{:.4}", course.seconds("searching")),
                format!("{:.4}", course.seconds("fitting")),
                format!("{:.4}", course.seconds("judging")),
                course.passes.to_string(),
                if end.len() < LARGE_END { String::new() } else { format!("{:.2}", exponent(end)) },
            ]);
        }
    }
    let head = [
        "number of",
        "size",
        "fit s",
        "us per one",
        "of that: search s",
        "final s",
        "judging s",
        "passes",
        "exponent",
    ];
    markdown(&head, &rows)
}

/// One fit with more and more threads.
pub fn threads(setup: &Setup) -> String {
    let (expression, measurement) = one_lobe(if setup.quick() { 100_000 } else { 1_000_000 }, 3);
    let mut one = None;
    let row = |threads: usize| {
        let time = with_threads(threads, || typical(&measurement, &expression)).whole();
        let one = *one.get_or_insert(time);
        vec![threads.to_string(), format!("{time:.3}"), format!("{:.2}", one / time)]
    };
    let rows: Vec<Vec<String>> = thread_counts().into_iter().map(row).collect();
    let text = markdown(&["threads", "fit s", "faster than one"], &rows);
    format!("{} scattered samples, 3 channels.\n\n{text}", measurement.directions.len())
}

fn one_lobe(samples: usize, channels: usize) -> (Expression, Measurement) {
    let expression = Expression::parse(ONE_LOBE).unwrap();
    let measurement = scattered(&expression, samples, channels);
    (expression, measurement)
}

/// Three digits, more or less.
fn significant(value: f64) -> String {
    match value {
        100.0.. => format!("{value:.0}"),
        10.0.. => format!("{value:.1}"),
        1.0.. => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    }
}
