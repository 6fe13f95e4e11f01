//! Bounds of the albedo from samples that are scattered over the hemisphere.
//!
//! For each angle of incidence, f is integrated over directions that are spread evenly by their cosine. At each of them f lies between the
//! smallest and the largest of the samples about it, one to each side, unless a lobe hides between samples; where it is not surrounded by
//! samples, it is at least 0. Where no angle of incidence has samples all over the hemisphere, but a range of angles has, the smallest f in that
//! range bounds the albedo from below: lobes lie elsewhere for each angle, and do not add up.

use super::neighbours::point;
use crate::geometry::{Directions, Pair};
use crate::health::channel::MeasuredAlbedo;
use crate::math::{GOLDEN, count};
use crate::measurement::Measurement;
use std::f64::consts::PI;

/// The number of directions over which f is summed.
const SUMMED: usize = 300;
/// The fewest samples of an angle of incidence.
const FEWEST: usize = 20;
/// The most samples of an angle of incidence, and the most angles, that are looked at.
const MOST: usize = 1500;
const MOST_ANGLES: usize = 12;
/// The sides on which samples surround a direction.
const SIDES: usize = 4;
/// Samples farther away than this do not surround a direction: 30 degrees.
const FAR: f64 = 0.52;
/// Angles of incidence that differ by less than this, degrees, are one.
const ONE_DEG: f64 = 0.5;
/// Widths of the ranges into which they are gathered where they have too few samples each, degrees.
const RANGES_DEG: [f64; 2] = [10.0, 90.0];

/// A sample: the direction of the viewer, turned such that the light's azimuth is 0, on one side of the plane of incidence.
struct Sample {
    index: usize,
    theta_i: f64,
    wo: [f64; 3],
}

/// Albedos by channel and angle of incidence; empty where no angle has samples all over the hemisphere.
#[must_use]
pub(crate) fn albedos(measurement: &Measurement) -> Vec<Vec<MeasuredAlbedo>> {
    let Directions::Scattered(pairs) = &measurement.directions else { return Vec::new() };
    let complete = |index: &usize| {
        measurement.values.iter().all(|row| row.get(*index).is_some_and(|value| !value.is_nan()))
    };
    let samples: Vec<Sample> = (0..pairs.len())
        .filter(complete)
        .filter_map(|index| Some(sample(index, pairs.get(index)?)))
        .collect();
    let enough = |width: f64| {
        let groups = gathered(&samples, width.to_radians());
        groups.into_iter().filter(|group| group.len() >= FEWEST && spans(group)).collect::<Vec<_>>()
    };
    let by_channel = |each: Vec<Vec<MeasuredAlbedo>>| {
        let of_channel =
            |channel: usize| each.iter().filter_map(|group| group.get(channel).cloned()).collect();
        (0..measurement.values.len()).map(of_channel).collect()
    };
    let single = enough(ONE_DEG);
    if !single.is_empty() {
        let step = single.len().div_ceil(MOST_ANGLES);
        return by_channel(
            single.iter().step_by(step).map(|group| of_angle(group, &measurement.values)).collect(),
        );
    }
    let ranges = RANGES_DEG.into_iter().map(enough).find(|groups| !groups.is_empty()).unwrap_or_default();
    by_channel(ranges.iter().map(|group| of_range(group, &measurement.values)).collect())
}

fn sample(index: usize, pair: &Pair) -> Sample {
    let [slant, _, z, wo @ ..] = point(pair, true);
    Sample { index, theta_i: slant.atan2(z), wo }
}

/// The samples by their angle of incidence: those of one range together.
fn gathered(samples: &[Sample], width: f64) -> Vec<Vec<&Sample>> {
    let mut sorted: Vec<&Sample> = samples.iter().collect();
    sorted.sort_by(|a, b| a.theta_i.total_cmp(&b.theta_i));
    let mut groups: Vec<Vec<&Sample>> = Vec::new();
    for sample in sorted {
        match groups
            .last_mut()
            .filter(|group| group.first().is_some_and(|first| sample.theta_i - first.theta_i < width))
        {
            Some(group) => group.push(sample),
            None => groups.push(vec![sample]),
        }
    }
    groups
}

/// Whether samples leave the plane of incidence.
fn spans(group: &[&Sample]) -> bool {
    let beside = group
        .iter()
        .filter(|sample| {
            let [_, y, _] = sample.wo;
            y > 0.2
        })
        .count();
    5 * beside > group.len()
}

/// The directions over which is summed, spread evenly by their cosine over half the hemisphere.
fn directions() -> impl Iterator<Item = [f64; 3]> {
    (0..SUMMED).map(|k| {
        let sine2 = (count(k) + 0.5) / count(SUMMED);
        let phi = PI * (count(k) * GOLDEN).fract();
        [sine2.sqrt() * phi.cos(), sine2.sqrt() * phi.sin(), (1.0 - sine2).sqrt()]
    })
}

/// The angles of incidence of a group, degrees.
fn theta_i_deg(group: &[&Sample]) -> [f64; 2] {
    [group.first(), group.last()].map(|sample| sample.map_or(0.0, |sample| sample.theta_i.to_degrees()))
}

/// The share of light from any angle of a range that is reflected at least: all directions have no less than the smallest f.
fn of_range(group: &[&Sample], values: &[Vec<f64>]) -> Vec<MeasuredAlbedo> {
    let albedo = |row: &Vec<f64>| {
        let each = || group.iter().filter_map(|sample| row.get(sample.index).copied());
        let (low, high) =
            each().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), f| (f.min(low), f.max(high)));
        let value = PI * each().sum::<f64>() / count(group.len());
        let (at_least, at_most) = (PI * low, PI * high);
        let error = (value - at_least).max(at_most - value);
        MeasuredAlbedo { theta_i_deg: theta_i_deg(group), value, error, at_least, at_most, unmeasured: 0.0 }
    };
    values.iter().map(albedo).collect()
}

/// The nearest samples about a direction, one to each side: the squares of their distances, and their indices.
fn about(group: &[&&Sample], [x, y, z]: [f64; 3]) -> [(f64, usize); SIDES] {
    let mut about = [(f64::INFINITY, usize::MAX); SIDES];
    let slant = x.hypot(y).max(1e-9);
    for sample in group {
        let [sx, sy, sz] = sample.wo;
        // Both sides of the plane of incidence are alike.
        for sy in [sy, -sy] {
            let from = [sx - x, sy - y, sz - z];
            let [dx, dy, dz] = from;
            let outwards = (dx * x + dy * y) * z / slant - dz * slant;
            let around = dy * x - dx * y;
            let side = 2 * usize::from(outwards > 0.0) + usize::from(around > 0.0);
            let distance2 = dx * dx + dy * dy + dz * dz;
            if let Some(nearest) = about.get_mut(side).filter(|nearest| distance2 < nearest.0) {
                *nearest = (distance2, sample.index);
            }
        }
    }
    about
}

/// The albedo of each channel at one angle of incidence.
fn of_angle(group: &[&Sample], values: &[Vec<f64>]) -> Vec<MeasuredAlbedo> {
    let theta_i_deg = theta_i_deg(group);
    let group: Vec<&&Sample> = group.iter().step_by(group.len().div_ceil(MOST)).collect();
    // Sums over all directions of the least and of the largest f about each, of the mean, and of the mean where samples surround it.
    let mut sums = vec![[0.0; 4]; values.len()];
    let mut measured = 0.0;
    for direction in directions() {
        let about = about(&group, direction);
        let surrounded = about.iter().all(|(distance2, _)| *distance2 < FAR * FAR);
        measured += if surrounded { 1.0 } else { 0.0 };
        for (sums, row) in sums.iter_mut().zip(values) {
            let known =
                || about.iter().filter_map(|(distance2, index)| Some((*distance2, *row.get(*index)?)));
            let (least, most) = known()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, f)| (f.min(low), f.max(high)));
            let (weights, sum) = known().fold((0.0, 0.0), |(weights, sum), (distance2, f)| {
                let weight = 1.0 / (distance2 + 1e-6);
                (weights + weight, sum + weight * f)
            });
            let mean = sum / weights;
            let [low, high, all, inside] = sums;
            *high += most;
            *all += mean;
            if surrounded {
                *low += least;
                *inside += mean;
            }
        }
    }
    let share = measured / count(SUMMED);
    let scale = PI / count(SUMMED);
    let albedo = |[low, high, all, inside]: [f64; 4]| {
        let value = if share > 0.0 { scale * inside / share } else { scale * all };
        // What cannot be negative is at least 0 where it was not measured.
        let [at_least, at_most] = [scale * low, scale * high];
        let error = (value * share - at_least).max(at_most - value).max(0.0);
        MeasuredAlbedo { theta_i_deg, value, error, at_least, at_most, unmeasured: 1.0 - share }
    };
    sums.into_iter().map(albedo).collect()
}
