//! What a file says about the instrument and the sample, beside the values.

use serde::Serialize;

/// The total share of light that is scattered from one direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TotalScatter {
    /// The angle of incidence, degrees.
    pub theta_i_deg: f64,
    /// The azimuth of incidence, degrees.
    pub phi_i_deg: f64,
    /// The share: the integral of f cos(theta_o) as the file gives it.
    pub share: f64,
}

impl TotalScatter {
    /// The share of light scattered from a direction.
    #[must_use]
    pub const fn new(theta_i_deg: f64, phi_i_deg: f64, share: f64) -> Self {
        Self { theta_i_deg, phi_i_deg, share }
    }
}

/// The instrument of a measurement, as far as its file describes it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Instrument {
    /// What the file says in words, in one line: sample, instrument, date.
    pub description: Option<String>,
    /// The solid angle of the receiver, sr.
    pub receiver_sr: Option<f64>,
    /// The factor by which the file's numbers were multiplied to give f.
    pub scale: Option<f64>,
    /// The total integrated scatter (TIS) that the file gives.
    pub total_scatter: Vec<TotalScatter>,
}
