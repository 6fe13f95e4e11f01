//! A model's statement about energy conservation.

/// Whether more light can leave a surface than arrives.
///
/// This assumes that amplitudes that are albedos or reflectances are at most 1. Larger ones, which a measurement of
/// unknown scale may need, gain energy in any model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Energy {
    /// The directional albedo is at most 1 for all shapes.
    Conserved,
    /// The directional albedo exceeds 1 for some shapes and angles of incidence.
    MayGain {
        /// The largest albedo found by a white furnace test (tests/health.rs). The head of the model's file gives the same
        /// figure, and says where it occurs.
        largest_albedo: f64,
    },
}
