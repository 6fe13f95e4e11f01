//! What is known of a channel of a measurement.

use serde::Serialize;

/// The result of checking one channel.
#[derive(Clone, Debug, Serialize)]
pub struct MeasuredChannel {
    /// Its name.
    pub name: String,
    /// Values below 0.
    pub negative: Negative,
    /// Albedo per angle or range of incidence; null if no angle has samples all over the hemisphere.
    pub albedo: Option<Vec<MeasuredAlbedo>>,
}

/// Values below 0.
#[derive(Clone, Debug, Serialize)]
pub struct Negative {
    /// Number of values below 0.
    pub values: usize,
    /// Number of those that are too far below 0 to be noise.
    pub beyond_noise: usize,
    /// The smallest of all values, 1/sr.
    pub least: f64,
}

/// The albedo in a range of incidence.
#[derive(Clone, Debug, Serialize)]
pub struct MeasuredAlbedo {
    /// Smallest and largest angle of incidence, degrees.
    pub theta_i_deg: [f64; 2],
    /// The mean albedo over this range.
    pub value: f64,
    /// Error of integrating over the cells of a table, which may be too coarse for a narrow peak: the largest difference that taking every
    /// other row along the three axes makes, and by how much the cells of the range miss or exceed its solid angle. Of scattered samples, by how
    /// much the smallest and the largest values about each direction change it.
    pub error: f64,
    /// The smallest albedo that the values allow, if light in directions without values is missing.
    pub at_least: f64,
    /// The largest that they allow, if directions without values are like the others.
    pub at_most: f64,
    /// Share of the directions, by solid angle and cosine, that have no value. The albedo takes them to be like the others.
    pub unmeasured: f64,
}

impl MeasuredAlbedo {
    /// The angle or the range of incidence, in words.
    #[must_use]
    pub fn incidence(&self) -> String {
        let [low, high] = self.theta_i_deg.map(|theta| (theta * 100.0).round() / 100.0);
        if low < high { format!("from {low} to {high} deg") } else { format!("= {low} deg") }
    }
}
