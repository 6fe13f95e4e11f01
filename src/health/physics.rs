//! Checks the reciprocity, sign and albedo of a model.

use super::angles::{Angles, angles};
use super::effort::Effort;
use super::quadrature::{Integral, directional_albedo};
use crate::geometry::{Directions, Pair, direction};
use crate::model::{Expression, LobeValues};
use crate::synthetic::scattered_directions;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

/// Azimuths of the light for anisotropic models, degrees.
const AZIMUTHS_DEG: [f64; 3] = [0.0, 45.0, 90.0];
/// Largest polar angle of the directions, degrees.
const GRAZING_DEG: f64 = 89.9;
/// Seed of the pairs of directions.
const SEED: u64 = 71;

/// How much f changes when light and viewer are exchanged.
#[derive(Clone, Debug, Serialize)]
pub struct Reciprocity {
    /// The largest abs(f(wi, wo) - f(wo, wi)), divided by the larger of the two.
    pub largest: f64,
    /// Directions, degrees: theta_i, phi_i, theta_o, phi_o.
    pub at_deg: Angles,
    /// Number of pairs of directions compared.
    pub pairs: usize,
    /// Number of pairs at which either value is infinite or NaN.
    pub not_finite: usize,
}

/// A value and its directions.
#[derive(Clone, Debug, Serialize)]
pub struct Extreme {
    /// f, 1/sr.
    pub value: f64,
    /// Directions, degrees: theta_i, phi_i, theta_o, phi_o.
    pub at_deg: Angles,
}

/// The share of light from one direction that is reflected.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Albedo {
    /// Angle of incidence, degrees.
    pub theta_i_deg: f64,
    /// Azimuth of the light, degrees.
    pub phi_i_deg: f64,
    /// The albedo; null if it is infinite or NaN.
    pub value: Option<f64>,
    /// Estimated error of the quadrature; null if it is infinite or NaN.
    pub error: Option<f64>,
}

/// Pairs at which f is evaluated: over both hemispheres and near the mirror direction. A quarter of them have the light
/// turned by 180 degrees about the normal, so that those near the mirror direction become retroreflecting.
pub(super) fn pairs(n: usize) -> Vec<Pair> {
    let mut pairs = scattered_directions(n, GRAZING_DEG, SEED);
    for pair in pairs.iter_mut().skip(1).step_by(4) {
        pair.wi = DVec3::new(-pair.wi.x, -pair.wi.y, pair.wi.z);
    }
    pairs
}

/// Reciprocity and smallest value, per channel.
pub(super) fn compare(
    expression: &Expression,
    parameters: &[Vec<LobeValues>],
    pairs: &[Pair],
) -> Vec<(Reciprocity, Extreme)> {
    let swapped = pairs.iter().map(|pair| Pair { wi: pair.wo, wo: pair.wi }).collect();
    let there = expression.values(&Directions::Scattered(pairs.to_vec()), parameters);
    let back = expression.values(&Directions::Scattered(swapped), parameters);
    let channel = |(there, back): (&Vec<f64>, &Vec<f64>)| {
        let nowhere = [0.0; 4];
        let mut reciprocity =
            Reciprocity { largest: 0.0, at_deg: nowhere, pairs: pairs.len(), not_finite: 0 };
        let mut least = Extreme { value: f64::INFINITY, at_deg: nowhere };
        for ((a, b), pair) in there.iter().zip(back).zip(pairs) {
            if !(a.is_finite() && b.is_finite()) {
                reciprocity.not_finite += 1;
                continue;
            }
            let scale = a.abs().max(b.abs());
            // Subnormal numbers have fewer digits, or none.
            let difference = if scale < f64::MIN_POSITIVE { 0.0 } else { (a - b).abs() / scale };
            if difference > reciprocity.largest {
                (reciprocity.largest, reciprocity.at_deg) = (difference, angles(pair));
            }
            for (f, pair) in [(*a, *pair), (*b, Pair { wi: pair.wo, wo: pair.wi })] {
                if f < least.value {
                    least = Extreme { value: f, at_deg: angles(&pair) };
                }
            }
        }
        if !least.value.is_finite() {
            least.value = 0.0;
        }
        (reciprocity, least)
    };
    there.iter().zip(&back).map(channel).collect()
}

/// Whether f changes when both directions are turned together about the normal.
pub(super) fn is_anisotropic(expression: &Expression, parameters: &[Vec<LobeValues>]) -> bool {
    let pairs = scattered_directions(60, 80.0, SEED);
    let turn = |v: DVec3| DVec3::new(v.x * 0.8 - v.y * 0.6, v.x * 0.6 + v.y * 0.8, v.z);
    let turned = pairs.iter().map(|pair| Pair { wi: turn(pair.wi), wo: turn(pair.wo) }).collect();
    let before = expression.values(&Directions::Scattered(pairs), parameters);
    let after = expression.values(&Directions::Scattered(turned), parameters);
    // A sharp lobe magnifies the rounding of the rotation.
    let differ = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-6 * a.abs().max(b.abs());
    before.iter().flatten().zip(after.iter().flatten()).any(differ)
}

/// Albedos by channel and direction of incidence.
pub(super) fn albedos(
    expression: &Expression,
    parameters: &[Vec<LobeValues>],
    anisotropic: bool,
    effort: &Effort,
) -> Vec<Vec<Albedo>> {
    let azimuths = if anisotropic { AZIMUTHS_DEG.as_slice() } else { &[0.0] };
    let lights: Vec<(f64, f64)> =
        effort.incidences_deg.iter().flat_map(|theta| azimuths.iter().map(|phi| (*theta, *phi))).collect();
    let found: Vec<_> = lights
        .par_iter()
        .map(|(theta, phi)| {
            let wi = direction(theta.to_radians(), phi.to_radians());
            directional_albedo(expression, parameters, wi, anisotropic, &effort.quadrature)
        })
        .collect();
    let finite = |x: f64| x.is_finite().then_some(x);
    let of_channel = |channel: usize| {
        let each = lights.iter().zip(&found).map(|(&(theta_i_deg, phi_i_deg), integrals)| {
            let Integral { value, error } = integrals[channel];
            Albedo { theta_i_deg, phi_i_deg, value: finite(value), error: finite(error) }
        });
        each.collect()
    };
    (0..parameters.len()).map(of_channel).collect()
}

/// The largest of `albedos`; one without a value counts as infinite.
pub(super) fn largest(albedos: &[Albedo]) -> Albedo {
    let key = |albedo: &Albedo| albedo.value.unwrap_or(f64::INFINITY);
    let nothing = Albedo { theta_i_deg: 0.0, phi_i_deg: 0.0, value: None, error: None };
    albedos.iter().max_by(|a, b| key(a).total_cmp(&key(b))).copied().unwrap_or(nothing)
}
