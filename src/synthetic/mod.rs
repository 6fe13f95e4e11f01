//! Synthetic measurements: the values of a model at given directions with noise of known size, and the reflection of rough
//! surfaces of small mirrors, traced ray by ray.

#![allow(
    clippy::indexing_slicing,
    reason = "lengths are checked where they come in; an index beyond the end is a mistake in the program"
)]

pub mod heightfield;

use crate::geometry::{Directions, Pair, direction};
use crate::measurement::{Channel, Measurement};
use crate::model::Expression;
use crate::parameters::ParameterTable;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;

/// Noise of a synthetic measurement: f (1 + relative N(0,1)) + absolute N(0,1); negative values are kept.
#[derive(Clone, Copy, Debug, Default)]
pub struct Noise {
    /// Standard deviation relative to f.
    pub relative: f64,
    /// Standard deviation in 1/sr.
    pub absolute: f64,
}

impl Noise {
    /// Whether there is any noise.
    #[must_use]
    pub fn any(self) -> bool {
        self.relative > 0.0 || self.absolute > 0.0
    }

    /// Standard deviation of the measured value of `f`, 1/sr.
    #[must_use]
    pub fn sigma(self, f: f64) -> f64 {
        (self.relative * f).hypot(self.absolute)
    }
}

/// Draws `n` pairs of directions up to `max_theta_deg`: half of them uniform over the solid angle of both hemispheres, half
/// concentrated around the mirror direction, where shiny materials have their lobes.
///
/// In the second half the angle between half vector and normal is evenly distributed in its logarithm, from 0.2 degrees
/// up, so that lobes of every width are covered.
#[must_use]
pub fn scattered_directions(n: usize, max_theta_deg: f64, seed: u64) -> Vec<Pair> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let limit = max_theta_deg.to_radians();
    let turn = std::f64::consts::TAU;
    let smallest = 0.2_f64.to_radians();
    let mut pairs = Vec::with_capacity(n);
    while pairs.len() < n {
        let mut uniform = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        let wi = direction(uniform(limit.cos(), 1.0).acos(), uniform(0.0, turn));
        let wo = if pairs.len() % 2 == 0 {
            direction(uniform(limit.cos(), 1.0).acos(), uniform(0.0, turn))
        } else {
            let theta_h = (uniform(smallest.ln(), limit.ln())).exp();
            let h = direction(theta_h, uniform(0.0, turn));
            h * (2.0 * wi.dot(h)) - wi
        };
        // A mirrored direction can be below the horizon or beyond the limit.
        if wo.z >= limit.cos() {
            pairs.push(Pair { wi, wo });
        }
    }
    pairs
}

/// The values of a model and their standard deviations, by channel and sample.
#[derive(Clone, Debug)]
pub struct Values {
    /// f with noise, 1/sr.
    pub values: Vec<Vec<f64>>,
    /// Standard deviation of the noise, 1/sr.
    pub sigma: Vec<Vec<f64>>,
}

/// Number that separates the random stream of the noise from that of directions with the same seed.
const NOISE_STREAM: u64 = 0x6e6f_6973_6500;

/// Evaluates a model and adds noise. The same seed gives the same noise.
#[must_use]
pub fn values(
    expression: &Expression,
    table: &ParameterTable,
    directions: &Directions,
    noise: Noise,
    seed: u64,
) -> Values {
    let mut rng = Pcg64Mcg::seed_from_u64(seed ^ NOISE_STREAM);
    let parameters: Vec<_> = (0..table.channels().len()).map(|c| table.formula_values(c)).collect();
    let mut values = expression.values(directions, &parameters);
    let sigma = values.iter().map(|row| row.iter().map(|f| noise.sigma(*f)).collect()).collect();
    if noise.any() {
        // The noise is drawn sample by sample, for all channels of each.
        for sample in 0..directions.len() {
            for row in &mut values {
                let mut normal = || rng.sample::<f64, _>(StandardNormal);
                row[sample] = row[sample] * (1.0 + noise.relative * normal()) + noise.absolute * normal();
            }
        }
    }
    Values { values, sigma }
}

/// Makes a synthetic measurement in memory.
#[must_use]
pub fn measurement(
    expression: &Expression,
    table: &ParameterTable,
    directions: Directions,
    noise: Noise,
    seed: u64,
) -> Measurement {
    let Values { values, sigma } = values(expression, table, &directions, noise, seed);
    Measurement {
        source: crate::measurement::Source { format: "synthetic", ..Default::default() },
        sigma: noise.any().then_some(sigma),
        ..Measurement::of(
            table.channels().iter().map(|name| Channel::named(name)).collect(),
            directions,
            values,
        )
    }
}
