//! What a model says about the light that it gives back.

/// Whether more light may leave a surface than arrives.
///
/// Amplitudes that are albedos or reflectances are at most 1 here; larger ones, which fits may want for a measurement whose scale
/// is not known, gain energy in any model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Energy {
    /// The directional albedo is at most 1 for all shapes.
    Conserved,
    /// The directional albedo exceeds 1 for some shapes and angles of incidence.
    MayGain {
        /// The largest one that a white furnace finds (tests/health.rs). The head of the model's file has the same figure, and
        /// says where it comes from.
        largest_albedo: f64,
    },
}
