//! Timing, and what is made of times.

use std::hint::black_box;
use std::time::{Duration, Instant};

/// How long is measured.
#[derive(Clone, Copy)]
pub struct Effort {
    /// A batch is repeated work that takes at least this long, far longer than the clock's grain.
    batch: Duration,
    /// How many batches the median is of.
    batches: usize,
    /// How many runs of a whole process the median is of.
    pub runs: usize,
}

impl Effort {
    pub const FULL: Self = Self { batch: Duration::from_millis(5), batches: 11, runs: 5 };
    pub const QUICK: Self = Self { batch: Duration::from_millis(1), batches: 3, runs: 1 };

    /// Nanoseconds that one call of `work` takes, the median over batches.
    pub fn nanoseconds<T>(self, mut work: impl FnMut() -> T) -> f64 {
        let mut batch = |repeats: u32| {
            let started = Instant::now();
            for _ in 0..repeats {
                black_box(work());
            }
            started.elapsed()
        };
        // The first call warms the caches.
        batch(1);
        let mut repeats = 1;
        while batch(repeats) < self.batch {
            repeats *= 2;
        }
        median((0..self.batches).map(|_| batch(repeats).as_secs_f64() * 1e9 / f64::from(repeats)))
    }
}

/// The middle value; the upper one of two.
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The exponent p of y = c x^p, by least squares of the logarithms.
pub fn exponent(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = as_f64(logs.len());
    let (x, y) = logs.iter().fold((0.0, 0.0), |(sx, sy), (x, y)| (sx + x / n, sy + y / n));
    let (xy, xx) =
        logs.iter().fold((0.0, 0.0), |(xy, xx), (a, b)| (xy + (a - x) * (b - y), xx + (a - x) * (a - x)));
    xy / xx
}

/// A count as a number to divide by.
#[expect(clippy::cast_precision_loss, reason = "counts here are far below 2^53")]
pub fn as_f64(count: usize) -> f64 {
    count as f64
}

/// What runs in a pool of so many threads.
pub fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

/// One thread, two, and as many as the machine runs at a time.
pub fn thread_counts() -> Vec<usize> {
    let most = std::thread::available_parallelism().map_or(1, usize::from);
    let mut counts: Vec<usize> = [1, 2, most].into_iter().filter(|count| *count <= most).collect();
    counts.dedup();
    counts
}
