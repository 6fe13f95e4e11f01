//! How the library reports its progress.

/// A listener that is told about the progress of a fit.
pub trait Progress: Send + Sync {
    /// Called when a new stage begins.
    fn stage(&self, name: &str);
    /// Called after each iteration of the final fit.
    fn iteration(&self, iteration: u64, cost: f64);
}

/// A listener that ignores everything.
#[derive(Clone, Copy, Debug)]
pub struct Quiet;

impl Progress for Quiet {
    fn stage(&self, _: &str) {}
    fn iteration(&self, _: u64, _: f64) {}
}
