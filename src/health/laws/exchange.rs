//! Exchange: f stays the same when light and viewer change places (Helmholtz), f cos(theta) does not.

use super::neighbours::{between, nearest, point};
use super::sketch::Sketch;
use crate::geometry::Pair;
use crate::math::median;
use crate::measurement::interpolant::spread;
use crate::measurement::reading::Angle;
use rayon::prelude::*;

/// The most pairs that are compared.
const COMPARED: usize = 500;
/// The fewest from which anything is concluded.
const FEWEST: usize = 12;
/// Cosines of light and viewer must differ by this factor, as a logarithm, for an exchange to say anything about them.
const DIFFERENT: f64 = 0.15;
/// Samples that are farther than this from the exchanged directions, squared, say nothing about them: 6 degrees.
const FAR: f64 = 0.011;
/// Samples that are nearer than this, squared, were measured there: half a degree.
const SAME: f64 = 8e-5;
/// The number of neighbours that must agree elsewhere.
const ABOUT: usize = 4;
/// Logarithms of the values between which is interpolated differ by less than this, or a peak may lie between.
const STEADY: f64 = 0.5;
/// Smallest cosine that is looked at.
const LEAST_COSINE: f64 = 0.05;

/// The cosine by which values seem to be multiplied.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cosine {
    /// The angle whose cosine it is.
    pub of: Angle,
    /// Number of pairs that were compared.
    pub pairs: usize,
    /// By how much values differ when light and viewer change places, the median ratio less 1, as read and with the cosine divided out.
    pub differ: [f64; 2],
}

impl Cosine {
    /// The quantity that values are, as options name it.
    pub fn quantity(&self) -> &'static str {
        if self.of == Angle::ThetaI { "f-cos-i" } else { "f-cos-o" }
    }
}

/// The cosine that exchanging light and viewer brings to light; `None` if there is none.
pub(crate) fn cosine(sketch: &Sketch) -> Option<Cosine> {
    let usable =
        |pair: &Pair, value: f64| value > 0.0 && pair.wi.z > LEAST_COSINE && pair.wo.z > LEAST_COSINE;
    let kept = sketch.pairs.iter().zip(&sketch.values).filter(|(pair, value)| usable(pair, **value));
    let (pairs, logarithms): (Vec<Pair>, Vec<f64>) = kept.map(|(pair, value)| (*pair, value.ln())).unzip();
    let points: Vec<[f64; 6]> = pairs.iter().map(|pair| point(pair, sketch.isotropic)).collect();
    // The logarithm of the ratio of the cosines of viewer and light.
    let cosines = |pair: &Pair| (pair.wo.z / pair.wi.z).ln();
    let differs = |index: &usize| pairs.get(*index).is_some_and(|pair| cosines(pair).abs() > DIFFERENT);
    let slanting: Vec<usize> = (0..pairs.len()).filter(differs).collect();
    // ln f(wi, wo)/f(wo, wi), and that of the cosines.
    let compare = |place: usize| {
        let index = *slanting.get(place)?;
        let (pair, own) = (pairs.get(index)?, logarithms.get(index)?);
        let there = point(&Pair { wi: pair.wo, wo: pair.wi }, sketch.isotropic);
        let near = nearest(&points, &there, |other| other == index);
        let [(first, _), ..] = near;
        // What was measured in the very place needs no neighbours.
        let about = if first < SAME { 1 } else { ABOUT };
        let values = near.iter().take(about).filter_map(|(_, other)| logarithms.get(*other));
        let (low, high) = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (value.min(low), value.max(high)));
        let other = between(&points, &logarithms, &there, &near)?;
        (first < FAR && high - low < STEADY).then(|| (own - other, cosines(pair)))
    };
    let compared: Vec<(f64, f64)> = spread(slanting.len(), COMPARED).filter_map(compare).collect();
    if compared.len() < FEWEST {
        return None;
    }
    let slope = median(compared.iter().map(|(difference, cosines)| difference / cosines).collect())?;
    let of = match slope {
        0.75..1.25 => Angle::ThetaO,
        -1.25..-0.75 => Angle::ThetaI,
        _ => return None,
    };
    let sign = slope.signum();
    let differ = |share: f64| {
        let each =
            compared.iter().map(|(difference, cosines)| (difference - share * cosines).abs()).collect();
        median(each).map(|difference| difference.exp() - 1.0)
    };
    let differ = [differ(0.0)?, differ(sign)?];
    let [read, otherwise] = differ;
    (otherwise < 0.5 * read).then_some(Cosine { of, pairs: compared.len(), differ })
}
