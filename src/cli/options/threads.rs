//! The option `--threads`.

use brdfit::Error;
use rayon::ThreadPool;

/// Starts a pool of `number` threads, or of one per core if `number` is 0.
pub fn threads(number: usize) -> Result<ThreadPool, Error> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(number).build();
    pool.map_err(|e| Error::invalid("--threads", "a number of threads that can be started", e.to_string()))
}

/// Parses a whole number of at least 1.
pub fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| "expected a whole number of at least 1".to_owned())
}
