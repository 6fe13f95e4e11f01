//! Measurements that their file defines at any pair of directions.

use crate::geometry::Pair;
use std::fmt::Debug;

/// A measured BRDF whose file says how it is interpolated, as an adaptive parameterisation does.
///
/// The samples of its measurement are drawn from it for a fit. Whoever needs values between them asks it instead of interpolating
/// the samples.
pub trait Continuous: Debug + Send + Sync {
    /// Writes f in 1/sr at a pair of directions to `values`, which holds one number per channel of the measurement.
    ///
    /// Both directions are above the horizon. Values that a file makes slightly negative stay so.
    fn at(&self, pair: &Pair, values: &mut [f64]);
}
