//! How the library tells what it is doing.

/// Hears how a fit goes on.
pub trait Progress: Send + Sync {
    /// A new stage begins.
    fn stage(&self, name: &str);
    /// An iteration of the final fit is over.
    fn iteration(&self, iteration: u64, cost: f64);
}

/// Hears nothing.
#[derive(Clone, Copy, Debug)]
pub struct Quiet;

impl Progress for Quiet {
    fn stage(&self, _: &str) {}
    fn iteration(&self, _: u64, _: f64) {}
}
