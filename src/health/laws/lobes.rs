//! Lobes: the brightest samples lie where light and viewer mirror each other, or, on a retro-reflector, where both coincide.

use super::sketch::Sketch;
use crate::geometry::Pair;
use crate::math::{count, median};
use glam::DVec3;

/// The share of samples that count as the brightest.
const BRIGHTEST: f64 = 0.015;
/// The fewest of them.
const FEWEST: usize = 5;
/// The brightest are a lobe if they are so many times as bright as the median.
const CONTRAST: f64 = 3.0;

/// The brightest samples.
#[derive(Clone, Debug)]
pub(crate) struct Bright {
    samples: Vec<usize>,
}

/// How far the brightest samples lie from where a lobe would be: medians, degrees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Apart {
    /// From the mirror direction.
    pub mirror_deg: f64,
    /// From the light.
    pub light_deg: f64,
}

impl Apart {
    /// From either, whichever is nearer.
    pub fn least(self) -> f64 {
        self.mirror_deg.min(self.light_deg)
    }
}

impl Bright {
    /// The brightest samples of a sketch; `None` if they are not much brighter than the rest.
    pub fn of(sketch: &Sketch) -> Option<Self> {
        let values = &sketch.values;
        let mut samples: Vec<usize> = (0..values.len()).collect();
        let value = |index: &usize| values.get(*index).copied().unwrap_or(f64::NEG_INFINITY);
        samples.sort_by(|a, b| value(b).total_cmp(&value(a)));
        let most = (BRIGHTEST * count(values.len())).max(count(FEWEST));
        let wanted = samples.into_iter().enumerate().take_while(|(place, _)| count(place + 1) <= most);
        let middle = median(values.clone())?;
        let brightest: Vec<usize> = wanted.map(|(_, index)| index).collect();
        let mean = brightest.iter().map(value).sum::<f64>() / count(brightest.len().max(1));
        let least = CONTRAST * middle.max(0.0);
        let samples = brightest.iter().copied().filter(|index| value(index) > least).collect();
        (mean > least).then_some(Self { samples })
    }

    /// How far they lie from where a lobe would be, if these are the directions of all samples.
    pub fn apart(&self, pairs: &[Pair]) -> Option<Apart> {
        let of = |to: fn(DVec3) -> DVec3| {
            let each = self.samples.iter().filter_map(|index| pairs.get(*index));
            median(each.map(|pair| to(pair.wi).dot(pair.wo).clamp(-1.0, 1.0).acos().to_degrees()).collect())
        };
        Some(Apart { mirror_deg: of(|wi| DVec3::new(-wi.x, -wi.y, wi.z))?, light_deg: of(|wi| wi)? })
    }
}

/// Whether a lobe about the light becomes weaker as the light sinks, as that of a retro-reflector does: the peak at the most slanting light is
/// less than at the steepest. Fresnel's equations and the cosines make a mirror lobe stronger.
pub(crate) fn weakens(sketch: &Sketch) -> bool {
    /// Directions closer to the light than this, as a cosine, belong to its lobe: 15 degrees.
    const NEAR: f64 = 0.966;
    let mut peaks: Vec<(f64, f64)> = Vec::new();
    for (pair, value) in
        sketch.pairs.iter().zip(&sketch.values).filter(|(pair, _)| pair.wi.dot(pair.wo) > NEAR)
    {
        match peaks.iter_mut().find(|(cosine, _)| (cosine - pair.wi.z).abs() < 0.02) {
            Some((_, peak)) => *peak = peak.max(*value),
            None => peaks.push((pair.wi.z, *value)),
        }
    }
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
    match peaks.as_slice() {
        [(steepest, first), .., (lowest, last)] => steepest - lowest > 0.1 && last < first,
        _ => false,
    }
}
