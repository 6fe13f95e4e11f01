//! The residuals of a pixel against the measured one, in the metric of a fit.

use crate::fit::{self, Metric};
use crate::image::ColourTarget;
use nalgebra::{Matrix3, Vector3};

/// A measured pixel, linear RGB, exposed.
#[derive(Clone, Debug)]
pub(super) enum Target {
    /// l2: the radiances.
    Radiance(Vector3<f64>),
    /// log: ln(1 + x) of the radiances.
    Logarithm(Vector3<f64>),
    /// cbrt: the colour difference that an eye sees. L*, a* and b* are differences of cube roots.
    Colour(ColourTarget),
}

impl Target {
    pub(super) fn new(metric: Metric, measured: [f64; 3]) -> Self {
        match metric {
            Metric::L2 => Self::Radiance(measured.into()),
            Metric::Log => Self::Logarithm(Vector3::from(measured).map(|x| metric.measured(x).ln_1p())),
            Metric::Cbrt | Metric::UnbiasedCbrt => Self::Colour(ColourTarget::new(measured)),
        }
    }
}

impl fit::Target for Target {
    fn compare(&self, x: [f64; 3]) -> (Vector3<f64>, Matrix3<f64>) {
        let x = Vector3::from(x);
        match self {
            Self::Radiance(measured) => (x - measured, Matrix3::identity()),
            Self::Logarithm(measured) => {
                // Only interpolation can make radiances negative.
                let x = x.map(|x| Metric::Log.measured(x));
                (x.map(f64::ln_1p) - measured, Matrix3::from_diagonal(&x.map(|x| 1.0 / (1.0 + x))))
            }
            Self::Colour(target) => target.compare(x.into()),
        }
    }
}
