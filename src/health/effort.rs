//! How thoroughly a model is checked.

use super::quadrature::Quadrature;

/// Angles of incidence at which albedos are integrated, degrees.
pub const INCIDENCES_DEG: [f64; 12] = [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 85.0, 89.0, 89.9];

/// How thoroughly a model is checked.
#[derive(Clone, Debug)]
pub struct Effort {
    /// Number of pairs of directions at which reciprocity and sign are checked.
    pub pairs: usize,
    /// Number of pairs of directions at which digits are counted.
    pub wide_pairs: usize,
    /// Angles of incidence at which albedos are integrated, degrees.
    pub incidences_deg: Vec<f64>,
    /// Accuracy of the integrals.
    pub quadrature: Quadrature,
}

impl Default for Effort {
    fn default() -> Self {
        Self {
            pairs: 4000,
            wide_pairs: 500,
            incidences_deg: INCIDENCES_DEG.to_vec(),
            quadrature: Quadrature::default(),
        }
    }
}
