//! What a measurement covers, for `brdfit info`.

use super::Measurement;
use crate::geometry::{Directions, Geometry, Pair, spherical_degrees};
use crate::math::count;
use glam::DVec3;
use std::collections::HashMap;

/// A summary of the directions and values of a measurement.
#[derive(Clone, Debug)]
pub struct Coverage {
    /// Smallest and largest angle of incidence, in degrees.
    pub theta_i_deg: (f64, f64),
    /// Smallest and largest viewing angle, in degrees.
    pub theta_o_deg: (f64, f64),
    /// Smallest and largest polar angle of the half vector, in degrees.
    pub theta_h_deg: (f64, f64),
    /// Number of different angles of incidence, to 0.01 degrees; `None` for grids.
    pub incidence_angles: Option<usize>,
    /// Whether wi, n and wo lie in one plane, to 0.1 degrees, for every sample.
    pub in_plane: bool,
    /// Smallest and largest value of each channel, in 1/sr; the first is larger if the channel has none.
    pub range: Vec<(f64, f64)>,
    /// Number of values of each channel that were not measured. They have no part in anything else.
    pub missing: Vec<usize>,
    /// Number of values below zero in each channel.
    pub negative: Vec<usize>,
    /// Root mean square of f(wi, wo) - f(wo, wi), relative to that of f, over the pairs that were measured both ways,
    /// and the number of those pairs. A MERL-style table stores each such pair once.
    pub reciprocity: Option<(f64, usize)>,
    /// Directional albedo of each channel: int f cos(theta_o) dwo, averaged over theta_i up to `ALBEDO_LIMIT_DEG`;
    /// `None` unless the data are a grid, NaN for a channel without values there. Cells that were not measured are filled with the mean
    /// of the others.
    pub albedo: Option<Vec<f64>>,
}

/// Angle of incidence up to which the albedo is averaged, in degrees.
pub const ALBEDO_LIMIT_DEG: f64 = 60.0;

/// Summarises a measurement.
#[must_use]
pub fn coverage(measurement: &Measurement) -> Coverage {
    let mut theta_i = (f64::INFINITY, f64::NEG_INFINITY);
    let mut theta_o = theta_i;
    let mut theta_h = theta_i;
    let mut in_plane = true;
    let mut incidences: Vec<i64> = Vec::new();
    // Neither minimum nor maximum takes NaN.
    let include = |range: &mut (f64, f64), value: f64| {
        *range = (range.0.min(value), range.1.max(value));
    };
    for g in measurement.directions.iter() {
        let (wi, wo) = (DVec3::from_array(g.wi), DVec3::from_array(g.wo));
        include(&mut theta_i, spherical_degrees(wi).0);
        include(&mut theta_o, spherical_degrees(wo).0);
        include(&mut theta_h, spherical_degrees(DVec3::from_array(g.h)).0);
        // n.(wi x wo) = sin(theta_i) sin(theta_o) sin(phi_o - phi_i)
        in_plane &= wi.cross(wo).z.abs() < 0.1_f64.to_radians();
        if !measurement.directions.is_grid() {
            incidences.push(rounded(spherical_degrees(wi).0, 0.01));
        }
    }
    incidences.sort_unstable();
    incidences.dedup();
    let range = measurement
        .values
        .iter()
        .map(|row| {
            let mut range = (f64::INFINITY, f64::NEG_INFINITY);
            row.iter().for_each(|v| include(&mut range, *v));
            range
        })
        .collect();
    Coverage {
        theta_i_deg: theta_i,
        theta_o_deg: theta_o,
        theta_h_deg: theta_h,
        incidence_angles: (!measurement.directions.is_grid()).then_some(incidences.len()),
        in_plane,
        range,
        missing: measurement.missing(),
        negative: measurement.values.iter().map(|row| row.iter().filter(|v| **v < 0.0).count()).collect(),
        reciprocity: reciprocity(measurement),
        albedo: albedo(measurement),
    }
}

/// `value` as a whole number of steps.
#[expect(clippy::cast_possible_truncation, reason = "angles and unit vectors in small steps fit easily")]
fn rounded(value: f64, step: f64) -> i64 {
    (value / step).round() as i64
}

/// The angles of two directions that do not change under rotation about the normal, radians: both polar angles, and that between the
/// azimuths.
pub(crate) fn invariant_angles(a: DVec3, b: DVec3) -> [f64; 3] {
    let turn = (a.x * b.y - a.y * b.x).abs().atan2(a.x * b.x + a.y * b.y);
    let turn = if a.z.min(b.z) > 0.999_96 { 0.0 } else { turn };
    // Rounding may make a cosine larger than 1.
    [a.z.min(1.0).acos(), b.z.min(1.0).acos(), turn]
}

/// The samples whose exchanged directions were measured as well, to half a degree: both indices, each pair once.
pub(crate) fn measured_both_ways(pairs: &[Pair]) -> Vec<(usize, usize)> {
    // Isotropic data are compared by the angles that do not change under rotation about the normal.
    let key = |a: DVec3, b: DVec3| invariant_angles(a, b).map(|angle| rounded(angle, 0.5_f64.to_radians()));
    let mut first = HashMap::new();
    for (index, pair) in pairs.iter().enumerate() {
        first.entry(key(pair.wi, pair.wo)).or_insert(index);
    }
    // No sample is compared with itself.
    let exchanged = |(index, pair): (usize, &Pair)| {
        let other = *first.get(&key(pair.wo, pair.wi))?;
        (other > index).then_some((index, other))
    };
    pairs.iter().enumerate().filter_map(exchanged).collect()
}

/// Compares the samples whose exchanged directions were measured as well.
fn reciprocity(measurement: &Measurement) -> Option<(f64, usize)> {
    let Directions::Scattered(pairs) = &measurement.directions else { return None };
    let (mut difference, mut scale, mut matches) = (0.0, 0.0, 0);
    for (index, other) in measured_both_ways(pairs) {
        let both = |row: &Vec<f64>| Some((*row.get(index)?, *row.get(other)?));
        let measured =
            measurement.values.iter().filter_map(both).filter(|(a, b)| !(a.is_nan() || b.is_nan()));
        let mut any = false;
        for (a, b) in measured {
            difference += (a - b).powi(2);
            scale += (a * a + b * b) / 2.0;
            any = true;
        }
        matches += usize::from(any);
    }
    (matches > 0 && scale > 0.0).then(|| ((difference / scale).sqrt(), matches))
}

/// int f co dwo by the solid angles of the grid's cells, averaged over the incident directions weighted by solid
/// angle. This is the cosine-weighted mean of f over both hemispheres within the limit, times pi.
fn albedo(measurement: &Measurement) -> Option<Vec<f64>> {
    let Directions::Grid { grid, cells } = &measurement.directions else { return None };
    let limit = ALBEDO_LIMIT_DEG.to_radians().cos();
    let within = |g: &Geometry<f64>| g.cos_i() >= limit && g.cos_o() > 0.0;
    // The sum of weights and of weighted values, by channel.
    let mut sums = vec![(0.0, 0.0); measurement.values.len()];
    for (index, (&cell, g)) in cells.iter().zip(measurement.directions.iter()).enumerate() {
        if !within(&g) {
            continue;
        }
        let weight = grid.weight(cell) * g.cos_o();
        for ((weights, sum), row) in sums.iter_mut().zip(&measurement.values) {
            let value = row.get(index).copied().filter(|value| !value.is_nan());
            if let Some(value) = value {
                *weights += weight;
                *sum += weight * value;
            }
        }
    }
    let known = sums.iter().any(|(weights, _)| *weights > 0.0);
    let albedo = |(weights, sum): (f64, f64)| std::f64::consts::PI * sum / weights;
    known.then(|| sums.into_iter().map(albedo).collect())
}

impl Coverage {
    /// The fraction of values below zero, all channels together.
    #[must_use]
    pub fn negative_share(&self, samples: usize) -> f64 {
        count(self.negative.iter().sum::<usize>()) / count((samples * self.negative.len()).max(1))
    }
}
