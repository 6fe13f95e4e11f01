//! Values that are cut off, as where a detector saturates.

use super::warning::{Saturated, Warning};
use crate::fit::problem::loss::LossKind;
use crate::geometry::Geometry;
use crate::math::count;
use crate::measurement::Samples;
use std::collections::{BTreeMap, BTreeSet};

/// Least number of directions that share the largest value of a channel if it is cut off.
const LEAST: usize = 3;
/// Values rounded to few digits are shared, too. One that is cut off is shared by more than this many times as many directions as any
/// of those just below it.
const RATIO: usize = 2;
/// Number of samples below the largest value in which shared values are sought.
const BELOW: usize = 1000;
/// If the largest value is less than this many times the mean, the material is almost evenly bright and nothing was
/// cut off.
const STANDS_OUT: f64 = 1.01;
/// The largest share of the samples that a robust loss takes for outliers.
const MOST_OUTLIERS: f64 = 0.1;
/// Cosines that differ by less than this are the same.
const SAME: f64 = 1e-6;

/// Warns of channels in which several directions share the largest value, as if the detector had been saturated. `loss` is that of the
/// fit.
pub(super) fn saturated(channels: &[String], samples: &Samples, loss: LossKind) -> Option<Warning> {
    let of_channel = |(channel, row): (&String, &Vec<f64>)| {
        // What was not measured is neither the largest nor equal to it.
        let value = row.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let cut_off: Vec<usize> =
            (0..).zip(row).filter(|(_, f)| **f >= value).map(|(index, _)| index).collect();
        let measured = row.iter().filter(|f| !f.is_nan());
        let (sum, n) = measured.fold((0.0, 0_usize), |(sum, n), f| (sum + f, n + 1));
        let mean = sum / count(n.max(1));
        if cut_off.len() < LEAST || value <= STANDS_OUT * mean {
            return None;
        }
        let shared_by = different(samples, &cut_off);
        let is_cut = shared_by >= LEAST && shared_by > RATIO * most_shared_below(samples, row, value);
        is_cut.then(|| Saturated { channel: channel.clone(), samples: cut_off.len(), value })
    };
    let found: Vec<Saturated> = channels.iter().zip(&samples.values).filter_map(of_channel).collect();
    let few = found.iter().all(|cut| count(cut.samples) <= MOST_OUTLIERS * count(samples.len()));
    let loss_helps = loss == LossKind::None && few;
    (!found.is_empty()).then_some(Warning::Saturated { channels: found, loss_helps })
}

/// The number of directions among some samples that differ by more than turning the sample, mirroring it, or exchanging light and
/// viewer: where those change nothing, equal values are no sign of anything.
fn different(samples: &Samples, indices: &[usize]) -> usize {
    let rounded = |cosine: f64| ((cosine / SAME).round() + 0.0).to_bits();
    let key = |g: &Geometry<f64>| {
        let (low, high) = (g.cos_i().min(g.cos_o()), g.cos_i().max(g.cos_o()));
        [low, high, g.cos_d].map(rounded)
    };
    samples.directions.select(indices).each(key).into_iter().collect::<BTreeSet<_>>().len()
}

/// The largest number of different directions that share one of the values just below `value`.
fn most_shared_below(samples: &Samples, row: &[f64], value: f64) -> usize {
    let mut below: Vec<(f64, usize)> = row.iter().copied().zip(0..).filter(|(f, _)| *f < value).collect();
    if below.len() > BELOW {
        below.select_nth_unstable_by(BELOW, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        below.truncate(BELOW);
    }
    let mut by_value: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    for (f, index) in below {
        by_value.entry(f.to_bits()).or_default().push(index);
    }
    by_value.values().map(|indices| different(samples, indices)).max().unwrap_or(0)
}
